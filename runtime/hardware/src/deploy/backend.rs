//! The backend that talks to devices. A twin goes along: it keeps what was commanded, checks what steps need, and supposes what
//! no device tells. Time is the clock's; in a dry run it is the twin's, and nothing is sent.

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, StepId};
use matterix_ir::{Leaves, NodeId, Op, Span, codes};
use matterix_runtime::backend::{Backend, Follow, Status, Ticket};
use matterix_runtime::exec::{Alarm, Listener};
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Advance, Watch};

use super::control::Answer;
use super::hardware::{Hardware, Running};
use super::journal::{Entry, Gate, Turn};
use super::preflight::carrier;
use super::replay::Begun;
use crate::link::DeviceError;

/// How often devices are asked whether they are ready, and quantities without a period of their own are asked for, s.
const POLL: f64 = 0.25;

impl Backend for Hardware<'_, '_> {
    fn now(&self) -> f64 {
        self.twin.now()
    }

    fn moment_after(&mut self, duration: f64) -> f64 {
        let what = Turn::Waits(self.waits);
        self.waits += 1;
        let behind = self.late_for(what, duration).map_or(0.0, |to| to - self.twin.now());
        self.twin.moment_after(behind + duration)
    }

    fn value(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.eval(node, out).map(Some)
    }

    fn ended(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        if self.is_dry() {
            return self.eval(node, out).map(Some);
        }
        // A reading in place of the true value that it shows, as nothing else is known of a device.
        let shown = self.observed.shows(&self.program.model, node);
        self.eval_by(node, shown, out).map(Some)
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

    fn start(&mut self, step: StepId, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault> {
        self.noted = None;
        let begun = self.start_operation(step, operation, out);
        begun.map_err(|fault| self.outward(fault))
    }

    fn poll(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault> {
        self.noted = None;
        let status = self.poll_operation(ticket, out);
        status.map_err(|fault| self.outward(fault))
    }

    fn halt(&mut self, ticket: Ticket) {
        if self.questions.remove(&ticket).is_some() {
            self.settings.control.withdraw(ticket.0);
        }
        let Some(running) = self.running.remove(&ticket) else { return };
        self.halt_twin(&running);
        self.break_off(&running);
    }

    fn admits(&mut self) -> bool {
        match self.gate {
            Gate::Go => true,
            Gate::Pause => false,
            Gate::Step => {
                self.gate = Gate::Pause;
                true
            }
        }
    }

    fn ask(&mut self, step: StepId, text: &str, out: &mut dyn Listener) -> Result<Option<Ticket>, Fault> {
        if self.is_dry() {
            return Ok(None);
        }
        let ticket = Ticket(self.tickets);
        self.tickets += 1;
        self.noted = None;
        let put = self.put(ticket, step, text.to_owned(), out);
        put.map_err(|fault| self.outward(fault))?;
        Ok(Some(ticket))
    }

    fn answered(&mut self, ticket: Ticket, _: &mut dyn Listener) -> Result<Option<bool>, Fault> {
        self.noted = None;
        let answer = self.answer(ticket);
        match answer.map_err(|fault| self.outward(fault))? {
            Some(Answer { yes: false, who }) => {
                // Who does not agree wants it to end.
                self.settings.control.stop(&who);
                Ok(Some(false))
            }
            answer => Ok(answer.map(|answer| answer.yes)),
        }
    }

    fn advance(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        self.noted = None;
        let advance = self.pass(until, watches, out);
        advance.map_err(|fault| self.outward(fault))
    }
}

impl Hardware<'_, '_> {
    fn start_operation(
        &mut self,
        step: StepId,
        operation: &Operation,
        out: &mut dyn Listener,
    ) -> Result<Ticket, Fault> {
        if self.refused.get() {
            let message = format!("`{}` was not sent: the deployment cannot continue", operation.verb);
            return Err(self.fault(codes::JOURNAL_MISMATCH, None::<Span>, message));
        }
        // What begins now begins where the clock is by now, on the twin too.
        if self.next_entry().is_none() {
            self.go_live(out)?;
        }
        self.keep_abreast(Turn::Begins(self.tickets), out)?;
        let program = self.program;
        let label = &program.plan.get(step).label;
        let found = carrier(step, operation, &self.devices);
        let number = self.tickets;
        self.tickets += 1;
        let ticket = Ticket(number);
        let Some(device) = found.or_else(|| self.is_dry().then_some(usize::MAX)) else {
            let message = format!("no device carries out `{label}`");
            return Err(self.fault(codes::UNDRIVEN, program.plan.get(step).span, message));
        };
        let driver = self.devices.get(device).and_then(|d| d.driver);
        let exchange = driver.and_then(|d| d.call(step));
        let by_hand = exchange.is_none() && device != usize::MAX && !self.is_dry();
        if by_hand {
            self.put(ticket, step, format!("please do this, then confirm: {label}"), out)?;
        }
        let graph = &self.program.model.graph;
        let heard = |n: &NodeId| graph.leaves(*n).meets(Leaves::READING);
        let nodes: Vec<NodeId> = operation.at_start.iter().map(Action::source).filter(heard).collect();
        for node in nodes {
            self.eval(node, out)?;
        }
        // What is said goes by what was before: which tip is next, how much is in a syringe.
        let texts = exchange.map(|e| self.texts(&e.sends)).transpose()?.unwrap_or_default();
        let replayed = match exchange {
            Some(_) => self.replayed_start(number, step, label, &texts)?,
            None => None,
        };
        if exchange.is_some() && replayed.is_none() {
            // What an earlier process said in part begins now, on the twin too.
            self.go_live(out)?;
        }
        let twin = self.twin.start(step, operation, out)?;
        let mut failed = None;
        if let Some(exchange) = exchange {
            self.beat(false, out)?;
            failed = match replayed {
                Some(Begun::Told(outcome)) => outcome,
                Some(Begun::Not) => {
                    let fault = self.replayed_fault();
                    return Err(fault.unwrap_or_else(|| self.fault(codes::RUN_FAILED, None::<Span>, String::new())));
                }
                None => self.begin(device, exchange, texts, operation, step, number)?,
            };
            self.fresh.clear();
            self.beat(true, out)?;
            self.keep_abreast(Turn::Told(number), out)?;
        }
        let until = exchange.and_then(|e| e.until.as_ref());
        let deadline = self.twin.now() + until.map_or(0.0, |u| self.twin.engine().eval(u.timeout));
        let ready = until.is_none() || self.is_dry();
        let changed = exchange.is_some();
        let actions = if ready { &[][..] } else { &operation.at_end };
        let set: Vec<u32> = operation.at_start.iter().chain(actions).filter_map(Action::assigned).collect();
        if changed && failed.is_none() && ready && self.is_live() {
            self.read_back(device, &set, false)?;
        }
        if let Some(fault) = self.replayed_fault() {
            return Err(fault);
        }
        if changed {
            self.commanded.extend(&set);
        }
        let words = match self.begun_with.remove(&number) {
            Some(words) => words,
            None => self.words_of(device),
        };
        let running = Running { step, device, twin, exchange, deadline, ready, failed, changed, set, words, by_hand };
        self.running.insert(ticket, running);
        Ok(ticket)
    }

    /// It goes on: it is looked at again soon.
    fn polled_again(&self) -> Status {
        Status::Running { until: Some(self.twin.now() + POLL), watch: None }
    }

    fn poll_operation(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault> {
        let Some(running) = self.running.get_mut(&ticket) else { return Ok(Status::Done) };
        let (step, device, twin, exchange) = (running.step, running.device, running.twin, running.exchange);
        if let Some((name, text)) = running.failed.take() {
            self.running.remove(&ticket);
            self.twin.halt(twin);
            return Ok(Status::Failed { name, text });
        }
        if running.by_hand {
            match self.answer(ticket)? {
                None => return Ok(self.polled_again()),
                Some(Answer { yes: true, .. }) => {}
                Some(Answer { yes: false, who }) => {
                    let label = &self.program.plan.get(step).label;
                    self.running.remove(&ticket);
                    self.twin.halt(twin);
                    self.not_set_by_hand(device, label);
                    return Ok(Status::Declined { text: Answer::refusal(&who) });
                }
            }
            if let Some(running) = self.running.get_mut(&ticket) {
                running.by_hand = false;
            }
            return self.poll_operation(ticket, out);
        }
        if let (false, Some(exchange), Some(until)) = (running.ready, exchange, exchange.and_then(|e| e.until.as_ref()))
        {
            let deadline = running.deadline;
            let next = self.next_entry();
            if let Some(fault) = self.replayed_fault() {
                return Err(fault);
            }
            match next {
                Some(Entry::Ended { t, ticket: before, failed }) if before == ticket.0 && t <= self.twin.now() => {
                    self.replay.pop_front();
                    if let Some((name, text)) = failed {
                        self.running.remove(&ticket);
                        self.twin.halt(twin);
                        return Ok(Status::Failed { name, text });
                    }
                }
                Some(_) => return Ok(self.polled_again()),
                None => {
                    self.go_live(out)?;
                    let now = self.twin.now();
                    let text = self.texts(std::slice::from_ref(&until.asks))?.concat();
                    self.recall(ticket);
                    let asked = self.inquire(device, |link, driver, ear| link.is_ready(&text, until, driver, ear));
                    match asked {
                        Ok(true) => {
                            self.forget_heard();
                            self.keep(&Entry::Ended { t: now, ticket: ticket.0, failed: None })?;
                        }
                        Ok(false) if now >= deadline => {
                            let message = format!("`{}` was not ready in time", self.devices[device].name);
                            return Err(self.fault(codes::DEVICE_LOST, exchange.span, message));
                        }
                        Ok(false) => return Ok(self.polled_again()),
                        Err(DeviceError::Refused { failure, text }) => {
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
            self.fresh.clear();
            self.keep_abreast(Turn::Ready(ticket.0), out)?;
            if !self.is_dry() {
                self.twin.hasten(twin);
            }
        }
        match self.twin.poll(twin, out)? {
            Status::Running { until, watch } => Ok(Status::Running { until, watch }),
            ended => {
                self.fresh.clear();
                let running = self.running.remove(&ticket);
                if let Some(running) = running {
                    if running.changed && running.exchange.is_some_and(|e| e.until.is_some()) && self.is_live() {
                        self.read_back(device, &running.set, true)?;
                    }
                    self.set_by_hand(device);
                }
                if let Some(fault) = self.replayed_fault() {
                    return Err(fault);
                }
                Ok(ended)
            }
        }
    }
}
