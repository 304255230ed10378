//! What happens at one instant: actions, events, processes that begin and cease.

use std::collections::BTreeMap;

use matterix_ir::model::Action;
use matterix_ir::{NodeId, Span, codes};

use super::{Engine, Observer};
use crate::fault::Fault;
use crate::ledger::{Refusal, transfer};

/// So many crossings within [`CHATTER_TIME`] are a fault.
const CHATTER: usize = 1000;

/// A lab device does not switch a thousand times in this time, s.
const CHATTER_TIME: f64 = 1e-3;

impl Engine<'_> {
    /// Fires the events that became true, each time the first in source order, until none is left; then reports the
    /// processes that began or ceased. The law is looked at anew afterwards. `cause` is shown where a balance breaks.
    pub(super) fn settle(&mut self, cause: Option<Span>, observer: &mut dyn Observer) -> Result<(), Fault> {
        let mut fired: BTreeMap<usize, usize> = BTreeMap::new();
        while let Some(event) = self.next_event() {
            let times = fired.entry(event).or_default();
            *times += 1;
            if *times > self.options.max_events_per_instant {
                return Err(self.cascade(event));
            }
            self.show(observer);
            observer.event(self.time, event);
            let model = self.model;
            for action in &model.events[event].actions {
                self.perform(action, Some(&model.events[event].name), observer)?;
            }
            self.judge_instant(&format!("`{}`", model.events[event].name), Some(model.events[event].span))?;
        }
        self.report_processes(observer);
        self.is_prepared = false;
        if !self.sampled {
            self.show(observer);
            self.check_temperatures()?;
            self.check_balances(cause)?;
        }
        Ok(())
    }

    /// The first event whose condition has become true since it was last looked at.
    fn next_event(&mut self) -> Option<usize> {
        let model = self.model;
        let mut next = None;
        for (i, event) in model.events.iter().enumerate() {
            let now = self.truth(event.when);
            if !now {
                self.armed[i] = false;
            } else if !self.armed[i] && next.is_none() {
                next = Some(i);
            }
        }
        if let Some(i) = next {
            self.armed[i] = true;
        }
        next
    }

    fn cascade(&self, event: usize) -> Fault {
        let event = &self.model.events[event];
        let count = self.options.max_events_per_instant;
        let message = format!("`{}` happens more than {count} times at one instant", event.name);
        Fault::new(codes::EVENT_CASCADE, self.time, message)
            .at(event.span)
            .help("events that make each other's condition true never come to rest")
    }

    fn report_processes(&mut self, observer: &mut dyn Observer) {
        let model = self.model;
        for (i, process) in model.processes.iter().enumerate() {
            let running = process.guard.is_none_or(|g| self.truth(g));
            if running != self.running[i] {
                self.running[i] = running;
                observer.process(self.time, i, running);
            }
        }
    }

    /// Performs one action; `who` does, where that is not the step under way.
    pub(super) fn perform(
        &mut self,
        action: &Action,
        who: Option<&str>,
        observer: &mut dyn Observer,
    ) -> Result<(), Fault> {
        match *action {
            Action::Assign { state, value: node, span } => {
                let value = self.eval(node);
                if !value.is_finite() {
                    return Err(self.no_effect(state, node, who, span));
                }
                self.suspicion.count(self.model, state, value - self.states[state as usize]);
                self.write(state, value);
                Ok(())
            }
            Action::Move { fraction: node, from, to, span } => {
                let fraction = self.eval(node);
                if !fraction.is_finite() {
                    return Err(self.no_share(node, who, span));
                }
                self.carry(fraction, from, to, span)?;
                observer.moved(self.time, from, to, fraction);
                Ok(())
            }
        }
    }

    fn carry(&mut self, fraction: f64, from: u32, to: u32, span: Span) -> Result<(), Fault> {
        let model = self.model;
        let (from, to) = (&model.mixtures[from as usize], &model.mixtures[to as usize]);
        let mut after = self.states.clone();
        transfer(&mut after, fraction, from, to).map_err(|refusal| self.refused(refusal).at(span))?;
        for (_, state) in from.extensive.iter().chain(&to.extensive) {
            self.write(*state, after[*state as usize]);
        }
        Ok(())
    }

    fn refused(&self, refusal: Refusal) -> Fault {
        match refusal {
            Refusal::Fraction(fraction) => {
                let shown = matterix_ir::quantity::show_number;
                let message = match fraction {
                    1.0..1.01 => format!("the transfer takes {} % more than there is", shown(100.0 * (fraction - 1.0))),
                    _ => format!("the transfer takes {} times what there is", shown(fraction)),
                };
                let help =
                    if fraction > 1.0 { "more is asked for than the source holds" } else { "is the source empty?" };
                Fault::new(codes::TRANSFER_FRACTION, self.time, message).help(help)
            }
            Refusal::NoPlace(key, state) => {
                let name = &self.model.states[state as usize].name;
                let message = format!("`{name}` would be lost: the destination has no place for `{key}`");
                Fault::new(codes::BALANCE_BREACH, self.time, message)
            }
        }
    }

    /// Sets a state from outside the integration.
    fn write(&mut self, state: u32, value: f64) {
        let place = &mut self.states[state as usize];
        if place.to_bits() == value.to_bits() {
            return;
        }
        *place = value;
        self.sampled = false;
        self.forget();
        self.limits.wrote(state);
        self.course.wrote(state, &mut self.sizes);
        self.sizes[state as usize] = 0.0;
    }

    /// Equalities that were true at one instant only are false again.
    pub(super) fn release(&mut self, observer: &mut dyn Observer) {
        if self.touches.is_empty() {
            return;
        }
        self.touches.clear();
        self.forget();
        let model = self.model;
        for (i, event) in model.events.iter().enumerate() {
            self.armed[i] = self.armed[i] && self.truth(event.when);
        }
        self.report_processes(observer);
    }

    /// Counts the crossing of `node`; too many in too short a time are a fault.
    pub(super) fn count_crossing(&mut self, node: NodeId) -> Result<(), Fault> {
        let crossings = self.crossings.entry(node).or_default();
        crossings.push_back(self.time);
        if crossings.len() <= CHATTER {
            return Ok(());
        }
        let first = crossings.pop_front().unwrap_or(self.time);
        if self.time - first > CHATTER_TIME { Ok(()) } else { Err(self.chatters(node)) }
    }

    /// The fault, named after the event or process whose condition it is.
    fn chatters(&self, node: NodeId) -> Fault {
        let place = self.user_of(node);
        let name = place.map_or("a condition", |(name, _)| name);
        let message = format!("`{name}` switches on and off more than {CHATTER} times within {CHATTER_TIME} s");
        let fault = Fault::new(codes::CHATTERING, self.time, message)
            .help("give it a hysteresis band: switch on below one value and off above a higher one");
        match place {
            Some((_, span)) => fault.at(span),
            None => fault,
        }
    }
}
