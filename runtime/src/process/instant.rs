//! What happens at one instant: actions, events, processes that begin and cease.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Content, Kept, Mixture};
use matterix_ir::{NodeId, Span, codes};

use super::index::Root;
use super::{Engine, Observer};
use crate::fault::Fault;
use crate::ledger::{Held, Refusal, transfer};

/// So many crossings within [`CHATTER_TIME`] are a fault.
const CHATTER: usize = 1000;

/// A lab device does not switch a thousand times in this time, s.
const CHATTER_TIME: f64 = 1e-3;

impl Engine<'_> {
    /// Fires the events that became true, each time the first in source order, until none is left; then reports the
    /// processes that began or ceased. `cause` is shown where a balance breaks.
    pub(super) fn settle(&mut self, cause: Option<Span>, observer: &mut dyn Observer) -> Result<(), Fault> {
        let (mut fired, mut ready) = (BTreeMap::new(), BTreeSet::new());
        while let Some(event) = self.next_event(&mut ready)? {
            let times: &mut usize = fired.entry(event).or_default();
            *times += 1;
            if *times > self.options.max_events_per_instant {
                return Err(self.cascade(event));
            }
            let model = self.model;
            let Some(of) = model.events.get(event as usize) else { continue };
            self.show(observer);
            observer.event(self.time, event as usize);
            self.expose(&of.actions, observer);
            for action in &of.actions {
                self.perform(action, Some(&of.name), observer)?;
            }
            self.judge_instant(&format!("`{}`", of.name), Some(of.span))?;
        }
        self.report_processes(observer)?;
        if !self.unshown.is_empty() {
            self.show(observer);
            self.check_temperatures()?;
            if self.unbalanced >= self.states.len() {
                self.unbalanced = 0;
                self.check_balances(cause)?;
            }
        }
        Ok(())
    }

    /// The first event whose condition has become true since it was last looked at; `ready` are those that wait for their turn.
    fn next_event(&mut self, ready: &mut BTreeSet<u32>) -> Result<Option<u32>, Fault> {
        self.digest();
        for event in std::mem::take(&mut self.due.events) {
            let of = &self.model.events[event as usize];
            self.decided(of.when, &of.name, of.span)?;
            let now = self.truth(of.when);
            if !now {
                self.armed[event as usize] = false;
            }
            if now && !self.armed[event as usize] {
                ready.insert(event);
            } else {
                ready.remove(&event);
            }
        }
        let next = ready.pop_first();
        if let Some(next) = next {
            self.armed[next as usize] = true;
        }
        Ok(next)
    }

    fn cascade(&self, event: u32) -> Fault {
        let event = &self.model.events[event as usize];
        let count = self.options.max_events_per_instant;
        let message = format!("`{}` happens more than {count} times at one instant", event.name);
        Fault::new(codes::EVENT_CASCADE, self.time, message)
            .at(event.span)
            .help("these events make each other's condition true endlessly")
    }

    fn report_processes(&mut self, observer: &mut dyn Observer) -> Result<(), Fault> {
        self.digest();
        for process in std::mem::take(&mut self.due.processes) {
            let i = process as usize;
            let of = &self.model.processes[i];
            of.guard.map_or(Ok(()), |guard| self.decided(guard, &of.name, of.span))?;
            let running = of.guard.is_none_or(|g| self.truth(g));
            if running != self.running[i] {
                self.running[i] = running;
                observer.process(self.time, i, running);
            }
        }
        Ok(())
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
                self.suspicion.count(self.model, state, value - self.state(state));
                self.write(state, value);
                Ok(())
            }
            Action::Move { fraction: node, ref but, from, to, span } => {
                let fraction = self.eval(node);
                if !fraction.is_finite() {
                    return Err(self.no_share(node, false, who, span));
                }
                let stays = but.iter().map(|kept| kept.stays.source());
                if let Some(node) = stays.into_iter().find(|node| !self.eval(*node).is_finite()) {
                    return Err(self.no_share(node, true, who, span));
                }
                let mass = self.carry(fraction, but, from, to, span)?;
                observer.moved(self.time, from, to, mass);
                Ok(())
            }
        }
    }

    /// Shows what actions are about to change, as it is before.
    pub(super) fn expose(&mut self, actions: &[Action], observer: &mut dyn Observer) {
        for action in actions {
            match *action {
                Action::Assign { state, .. } => self.unshown.push(state),
                Action::Move { from, to, .. } => {
                    let ends = [from, to].map(|mixture| &self.model.mixtures[mixture as usize].extensive);
                    self.unshown.extend(ends.into_iter().flatten().map(|(_, state)| *state));
                }
            }
        }
        self.show(observer);
    }

    /// Makes a transfer; gives the share of the mass of the source that moves.
    fn carry(&mut self, fraction: f64, but: &[Kept], from: u32, to: u32, span: Span) -> Result<f64, Fault> {
        let model = self.model;
        let (from, to) = (&model.mixtures[from as usize], &model.mixtures[to as usize]);
        let held = Held::new(but, |state| self.state(state), |node| self.eval(node));
        let held = held.map_err(|refusal| self.refused(refusal).at(span))?;
        let after = transfer(|state| self.state(state), fraction, &held, from, to);
        let after = after.map_err(|refusal| self.refused(refusal).at(span))?;
        let mass = if held.is_empty() { fraction } else { fraction * self.free(from, &held) };
        after.into_iter().for_each(|(state, value)| self.write(state, value));
        Ok(mass)
    }

    /// The share of the mass of a mixture that is not held back; 0 of nothing.
    fn free(&self, mixture: &Mixture, held: &Held) -> f64 {
        let weighed = |amount: &dyn Fn(u32) -> f64| {
            let molar_mass = |c: &Content| self.model.species.get(c.species as usize).map_or(0.0, |s| s.molar_mass);
            let of = |c: &Content| amount(c.state) * molar_mass(c);
            mixture.contents.iter().map(of).sum::<f64>()
        };
        let all = weighed(&|state| self.state(state));
        if all > 0.0 { weighed(&|state| self.state(state) - held.of(state)) / all } else { 0.0 }
    }

    fn refused(&self, refusal: Refusal) -> Fault {
        match refusal {
            Refusal::Fraction(fraction) => {
                let shown = matterix_ir::quantity::show_number;
                let message = match fraction {
                    1.0..1.01 => {
                        format!("the transfer removes {} % more than the source holds", shown(100.0 * (fraction - 1.0)))
                    }
                    _ => format!("the transfer removes {} times the contents of the source", shown(fraction)),
                };
                let help =
                    if fraction > 1.0 { "transfer less, or fill the source first" } else { "is the source empty?" };
                Fault::new(codes::TRANSFER_FRACTION, self.time, message).help(help)
            }
            Refusal::Kept(state, share) => {
                let name = &self.model.states[state as usize].name;
                let shown = matterix_ir::quantity::show_number(share);
                let message = format!("the share of `{name}` that is to stay behind is {shown}: it must be 0 to 1");
                Fault::new(codes::TRANSFER_FRACTION, self.time, message)
            }
            Refusal::NoPlace(key, state) => {
                let name = &self.model.states[state as usize].name;
                let message = format!("`{name}` would be lost: the target has no `{key}`");
                Fault::new(codes::BALANCE_BREACH, self.time, message)
            }
        }
    }

    /// Sets a state from outside the integration.
    pub(super) fn write(&mut self, state: u32, value: f64) {
        if self.state(state).to_bits() == value.to_bits() {
            return;
        }
        let part = self.course.part_of[state as usize];
        self.reach_now(part);
        if let Some(of) = self.course.parts.get_mut(part).filter(|part| !part.is_broken) {
            of.leave(&mut self.sizes);
            of.is_broken = true;
            self.due.law.broken.insert(part);
        }
        self.states[state as usize] = value;
        self.sizes[state as usize] = 0.0;
        self.unshown.push(state);
        let leaves = self.index.leaves(state);
        self.memo.get_mut().change_all(&self.index.users, leaves);
        self.due.seeds.extend(leaves);
    }

    /// Equalities that were true at one instant only are false again.
    pub(super) fn release(&mut self, observer: &mut dyn Observer) -> Result<(), Fault> {
        let touches = std::mem::take(&mut self.touches);
        if touches.is_empty() {
            return Ok(());
        }
        self.memo.get_mut().unpin(&self.index.users);
        let (due, mut events) = (&mut self.due, Vec::new());
        self.index.above(&touches, &mut |_| {}, &mut |_, kind| match kind {
            Root::Event(i) => events.push(i as usize),
            Root::Guard(i) => due.processes.extend([i]),
            Root::Rate(_) | Root::Limit(_) | Root::Attended | Root::Watch => {}
        });
        for i in events {
            self.armed[i] = self.armed[i] && self.truth(self.model.events[i].when);
        }
        self.report_processes(observer)
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
