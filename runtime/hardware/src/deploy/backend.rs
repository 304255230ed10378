//! The backend that talks to devices. A twin goes along: it keeps what was commanded, checks what steps need, and supposes what
//! no device tells. Time is the clock's; in a dry run it is the twin's, and nothing is sent.

use std::sync::atomic::Ordering;
use std::time::Duration;

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, StepId};
use matterix_ir::{Leaves, NodeId, Op, Span, codes};
use matterix_runtime::backend::{Backend, Follow, Status, Ticket};
use matterix_runtime::exec::{Alarm, Listener};
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Advance, Watch};

use super::hardware::{Hardware, Running, address, wall};
use super::journal::Entry;
use super::preflight::carrier;
use crate::link::Trouble;

/// How often devices are asked whether they are ready, and quantities without a period of their own are asked for, s.
const POLL: f64 = 0.25;

/// Longest time in which nobody looks at the clock.
const NAP: Duration = Duration::from_millis(10);

impl Backend for Hardware<'_, '_> {
    fn now(&self) -> f64 {
        self.twin.now()
    }

    fn value(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.eval(node, out).map(Some)
    }

    fn observe(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        match self.observed.asks(&self.program.model, node) {
            (_, true) if !self.is_dry() => Ok(None),
            _ => self.eval(node, out).map(Some),
        }
    }

    fn limit(&mut self, limit: u32, condition: NodeId, out: &mut dyn Listener) -> Result<Option<bool>, Fault> {
        self.eval(condition, out)?;
        self.twin.limit(limit, condition, out)
    }

    fn broken(&self) -> Vec<u32> {
        self.twin.broken()
    }

    fn decide(&self, limit: u32) -> Vec<Vec<u32>> {
        self.twin.decide(limit)
    }

    fn may_change(&self, operation: &Operation, condition: NodeId) -> bool {
        self.twin.may_change(operation, condition)
    }

    fn follow(&mut self, condition: NodeId) -> Follow {
        let (told, _) = self.observed.asks(&self.program.model, condition);
        if told.is_empty() {
            return self.twin.follow(condition);
        }
        let periods = told.iter().filter_map(|n| match self.program.model.graph.op(*n) {
            Op::Reading(r) => self.program.model.readings.get(r as usize)?.period.filter(|p| *p > 0.0),
            _ => None,
        });
        let shortest = periods.fold(f64::INFINITY, f64::min);
        Follow::Every(vec![if shortest.is_finite() { shortest.max(POLL) } else { 1.0 }])
    }

    fn set_local(&mut self, local: u32, value: Option<f64>) {
        self.twin.set_local(local, value);
    }

    fn foresee(&mut self, step: StepId, operation: &Operation, out: &mut dyn Listener) -> Option<Alarm> {
        self.twin.foresee(step, operation, out)
    }

    fn start(&mut self, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault> {
        if self.refused.get() {
            let message = format!("`{}` is not said: it was refused to go on", operation.verb);
            return Err(self.fault(codes::JOURNAL_MISMATCH, Span::default(), message));
        }
        let step = self.steps.get(&address(operation)).copied();
        let step =
            step.ok_or_else(|| self.fault(codes::UNDRIVEN, Span::default(), "an unknown operation".to_owned()))?;
        let program = self.program;
        let label = &program.plan.get(step).label;
        let found = carrier(step, operation, &self.devices);
        let number = self.tickets;
        self.tickets += 1;
        let ticket = Ticket(number);
        let Some(device) = found.or_else(|| self.is_dry().then_some(usize::MAX)) else {
            let message = format!("nothing carries out `{label}`");
            return Err(self.fault(codes::UNDRIVEN, program.plan.get(step).span, message));
        };
        let driver = self.devices.get(device).and_then(|d| d.driver);
        let exchange = driver.and_then(|d| d.call(step));
        let replayed = match exchange {
            Some(_) => self.replayed_start(number, step, label)?,
            None => None,
        };
        let by_hand = exchange.is_none() && device != usize::MAX && !self.is_dry();
        if by_hand && self.next_entry().is_none() {
            let agreed = (self.settings.person)(&format!("please do this, then confirm: {label}"));
            if !agreed {
                let message = format!("nobody did `{label}`");
                return Err(self.fault(codes::RUN_FAILED, program.plan.get(step).span, message));
            }
        }
        let graph = &self.program.model.graph;
        let heard = |n: &NodeId| graph.leaves(*n).meets(Leaves::READING);
        let nodes: Vec<NodeId> = operation.at_start.iter().map(Action::source).filter(heard).collect();
        for node in nodes {
            self.eval(node, out)?;
        }
        // What is said goes by what was before: which tip is next, how much is in a syringe.
        let texts = exchange.map(|e| self.texts(&e.sends)).transpose()?.unwrap_or_default();
        let twin = self.twin.start(operation, out)?;
        let mut failed = None;
        if let Some(exchange) = exchange {
            match replayed {
                Some(outcome) => failed = outcome,
                None => {
                    self.go_live(out)?;
                    self.beat(false, out)?;
                    failed = self.begin(device, exchange, texts, operation, step, number)?;
                    self.beat(true, out)?;
                }
            }
        }
        let until = exchange.and_then(|e| e.until.as_ref());
        let deadline = self.twin.now() + until.map_or(0.0, |u| self.twin.engine().eval(u.timeout));
        let ready = until.is_none() || self.is_dry();
        let changed = exchange.is_some();
        let set: Vec<u32> = operation
            .at_start
            .iter()
            .filter_map(|a| match a {
                Action::Assign { state, .. } => Some(*state),
                Action::Move { .. } => None,
            })
            .collect();
        if changed && failed.is_none() && ready && self.is_live() {
            self.read_back(device, &set, false)?;
        }
        if changed {
            self.commanded.extend(set);
        }
        let running = Running { device, twin, exchange, deadline, ready, failed, changed };
        self.running.insert(ticket, running);
        Ok(ticket)
    }

    fn poll(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault> {
        let now = self.twin.now();
        let Some(running) = self.running.get_mut(&ticket) else { return Ok(Status::Done) };
        let (device, twin, exchange) = (running.device, running.twin, running.exchange);
        if let Some((name, text)) = running.failed.take() {
            self.running.remove(&ticket);
            self.twin.halt(twin);
            return Ok(Status::Failed { name, text });
        }
        if let (false, Some(exchange), Some(until)) = (running.ready, exchange, exchange.and_then(|e| e.until.as_ref()))
        {
            let deadline = running.deadline;
            match self.next_entry() {
                Some(Entry::Ended { ticket: before, failed, .. }) if before == ticket.0 => {
                    self.replay.pop_front();
                    if let Some((name, text)) = failed {
                        self.running.remove(&ticket);
                        self.twin.halt(twin);
                        return Ok(Status::Failed { name, text });
                    }
                }
                Some(_) => return Ok(Status::Running { until: Some(now + POLL), watch: None }),
                None => {
                    self.go_live(out)?;
                    let text = self.texts(std::slice::from_ref(&until.asks))?.concat();
                    let asked = self.over(device, |link, driver, ear| link.is_ready(&text, until, driver, ear));
                    match asked {
                        Ok(true) => self.keep(&Entry::Ended { t: now, ticket: ticket.0, failed: None })?,
                        Ok(false) if now >= deadline => {
                            let message = format!("`{}` was not ready in time", self.devices[device].name);
                            return Err(self.fault(codes::DEVICE_LOST, exchange.span, message));
                        }
                        Ok(false) => return Ok(Status::Running { until: Some(now + POLL), watch: None }),
                        Err(Trouble::Refused { failure, text }) => {
                            let text = format!("`{}` has stopped: {text}", self.devices[device].name);
                            let failed = Some((failure.clone(), text.clone()));
                            self.keep(&Entry::Ended { t: now, ticket: ticket.0, failed })?;
                            self.running.remove(&ticket);
                            self.twin.halt(twin);
                            return Ok(Status::Failed { name: failure, text });
                        }
                        Err(trouble) => return Err(self.trouble(device, &trouble, exchange.span)),
                    }
                }
            }
            if let Some(running) = self.running.get_mut(&ticket) {
                running.ready = true;
            }
        }
        match self.twin.poll(twin, out)? {
            Status::Running { until, watch } => Ok(Status::Running { until, watch }),
            ended => {
                let running = self.running.remove(&ticket);
                if running.is_some_and(|r| r.changed && r.exchange.is_some_and(|e| e.until.is_some())) && self.is_live()
                {
                    self.read_back(device, &[], true)?;
                }
                Ok(ended)
            }
        }
    }

    fn halt(&mut self, ticket: Ticket) {
        let Some(running) = self.running.remove(&ticket) else { return };
        self.twin.halt(running.twin);
        let Some(driver) = self.devices.get(running.device).and_then(|d| d.driver) else { return };
        if running.ready || !self.is_live() || self.unreached.is_some() {
            return;
        }
        for exchange in &driver.halt {
            let Ok(texts) = self.texts(&exchange.sends) else { continue };
            // What goes wrong here ends what is ending already.
            if let Err(trouble) = self.try_say(running.device, &texts, exchange.expects.as_ref()) {
                self.trouble(running.device, &trouble, exchange.span);
            }
        }
    }

    fn advance(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        match self.next_entry() {
            Some(Entry::Time { t, fired, .. }) => {
                self.replay.pop_front();
                let mut broken = Vec::new();
                loop {
                    if let Advance::Broken(limits) = self.twin.advance(t, &[], out)? {
                        broken.extend(limits);
                    } else if self.twin.now() >= t {
                        break;
                    }
                }
                if !broken.is_empty() {
                    return Ok(Advance::Broken(broken));
                }
                return Ok(if fired.is_empty() && t >= until { Advance::Reached } else { Advance::Watch(fired) });
            }
            Some(other) => return Err(self.mismatch("time passes", &other)),
            None => {}
        }
        self.go_live(out)?;
        let outcome = loop {
            let now = self.twin.now();
            let clock = if self.is_dry() { f64::INFINITY } else { self.clock() };
            let target = until.min(clock).min(self.next_beat()).max(now);
            match self.twin.advance(target, watches, out)? {
                Advance::Reached => {}
                stopped => break stopped,
            }
            self.beat(true, out)?;
            if self.twin.now() >= until {
                break Advance::Reached;
            }
            if self.settings.cancel.load(Ordering::Relaxed) && !self.cancelled {
                self.cancelled = true;
                break Advance::Watch(Vec::new());
            }
            if !self.is_dry() && self.twin.now() >= self.clock() {
                let left = Duration::try_from_secs_f64((until - self.twin.now()) / self.settings.speed);
                std::thread::sleep(left.unwrap_or(NAP).min(NAP));
            }
        };
        let fired = match &outcome {
            Advance::Watch(fired) => fired.clone(),
            Advance::Reached | Advance::Broken(_) => Vec::new(),
        };
        self.journal.note(&Entry::Time { t: self.twin.now(), fired, wall: wall() });
        Ok(outcome)
    }
}
