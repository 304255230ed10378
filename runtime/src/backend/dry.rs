//! The dry run: no physics. Operations take their nominal time, their effects on logical states are followed, and
//! what depends on continuous quantities is not known.

use std::collections::BTreeMap;

use matterix_ir::codes;
use matterix_ir::graph::Env;
use matterix_ir::model::{Action, Model, State};
use matterix_ir::plan::{Operation, Plan, StepId};
use matterix_ir::{NodeId, Op};

use super::unknown::{self, Known};
use super::{Backend, Follow, Moments, Status, Ticket};
use crate::exec::Listener;
use crate::fault::Fault;
use crate::process::{Advance, Watch};

/// Events that follow from one another within an instant, at most.
const CASCADE: usize = 1000;

/// Walks a plan without physics.
pub struct Dry<'m> {
    model: &'m Model,
    params: Vec<f64>,
    states: Vec<Option<f64>>,
    /// Whether each state changes continuously or with a transfer, so that it is never known.
    unknown: Vec<bool>,
    locals: Vec<Option<f64>>,
    readings: Vec<NodeId>,
    /// Whether each event's condition was known to hold when last looked at.
    held: Vec<bool>,
    time: f64,
    moments: Moments,
    running: BTreeMap<Ticket, Running>,
    started: u64,
}

/// An operation that goes on.
struct Running {
    ends: f64,
    at_end: Vec<Action>,
}

impl<'m> Dry<'m> {
    /// Starts from the initial states; those that change continuously are not known.
    pub fn new(model: &'m Model, plan: &Plan, params: Vec<f64>) -> Self {
        let env = Env { time: 0.0, states: &[], params: &params, locals: &[], readings: &[] };
        let closed = |n| !model.graph.depends(n, |op| matches!(op, Op::State(_) | Op::Local(_) | Op::Reading(_)));
        let unknown = unknown_states(model);
        let initial = |(state, unknown): (&State, &bool)| {
            (!unknown && closed(state.initial)).then(|| model.graph.eval(state.initial, env))
        };
        let states = model.states.iter().zip(&unknown).map(initial).collect();
        Dry {
            model,
            params,
            states,
            unknown,
            locals: vec![None; plan.locals.len()],
            readings: model.readings.iter().map(|r| r.value).collect(),
            held: vec![false; model.events.len()],
            time: 0.0,
            moments: Moments::default(),
            running: BTreeMap::new(),
            started: 0,
        }
    }

    /// The states; `None` is not known.
    pub fn states(&self) -> &[Option<f64>] {
        &self.states
    }

    fn at(&self, node: NodeId, time: f64) -> Option<f64> {
        let known =
            Known { time, states: &self.states, params: &self.params, locals: &self.locals, readings: &self.readings };
        unknown::eval(&self.model.graph, node, known)
    }

    fn holds(&self, watch: &Watch, time: f64) -> bool {
        self.at(watch.node, time).is_some_and(|v| (v != 0.0) == watch.value)
    }

    fn apply(&mut self, actions: &[Action]) -> Result<(), Fault> {
        self.assign(actions);
        for _ in 0..CASCADE {
            if !self.fire() {
                return Ok(());
            }
        }
        let message = format!("events trigger each other more than {CASCADE} times at one instant");
        Err(Fault::new(codes::RUN_FAILED, self.time, message))
    }

    fn assign(&mut self, actions: &[Action]) {
        for action in actions {
            if let Action::Assign { state, value, .. } = action {
                let value = self.at(*value, self.time);
                if let (Some(slot), Some(false)) =
                    (self.states.get_mut(*state as usize), self.unknown.get(*state as usize))
                {
                    *slot = value;
                }
            }
        }
    }

    /// Lets the events happen whose conditions are known to have become true; whether there was one.
    fn fire(&mut self) -> bool {
        let (model, mut any) = (self.model, false);
        for (index, event) in model.events.iter().enumerate() {
            let holds = self.at(event.when, self.time).is_some_and(|v| v != 0.0);
            if std::mem::replace(&mut self.held[index], holds) || !holds {
                continue;
            }
            self.assign(&event.actions);
            any = true;
        }
        any
    }

    /// The first time up to `until` at which a watch is seen to have its value, to 1 ms.
    fn crossing(&self, until: f64, watches: &[Watch]) -> Option<f64> {
        let any = |time| watches.iter().any(|w| self.holds(w, time));
        let probes = (0..64).map(|k| self.time + 1e-3 * 2f64.powi(k)).take_while(|t| *t < until).chain([until]);
        let mut before = self.time;
        for probe in probes {
            if any(probe) {
                return Some(self.bisect(before, probe, &any));
            }
            before = probe;
        }
        None
    }

    fn bisect(&self, mut before: f64, mut after: f64, any: &dyn Fn(f64) -> bool) -> f64 {
        while after - before > 1e-3 {
            let middle = before + (after - before) / 2.0;
            if middle <= before || middle >= after {
                break;
            }
            if any(middle) { after = middle } else { before = middle }
        }
        after
    }

    fn fired(&self, watches: &[Watch]) -> Vec<usize> {
        (0..watches.len()).filter(|&i| self.holds(&watches[i], self.time)).collect()
    }
}

/// By state, whether it changes continuously or with a transfer.
fn unknown_states(model: &Model) -> Vec<bool> {
    let moving = model.derivatives.iter().filter(|d| model.graph.constant(d.rate) != Some(0.0)).map(|d| d.state);
    let extensive = model.mixtures.iter().flat_map(|m| m.extensive.iter().map(|(_, state)| *state));
    let mut unknown = vec![false; model.states.len()];
    for state in moving.chain(extensive) {
        if let Some(slot) = unknown.get_mut(state as usize) {
            *slot = true;
        }
    }
    unknown
}

impl Backend for Dry<'_> {
    fn now(&self) -> f64 {
        self.time
    }

    fn moment_after(&mut self, duration: f64) -> f64 {
        self.moments.after(self.time, duration)
    }

    fn value(&mut self, node: NodeId, _: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        Ok(self.at(node, self.time))
    }

    fn follow(&mut self, condition: NodeId) -> Follow {
        if self.at(condition, self.time).is_some() { Follow::Watch(condition) } else { Follow::Assumed }
    }

    fn set_local(&mut self, local: u32, value: Option<f64>) {
        if let Some(slot) = self.locals.get_mut(local as usize) {
            *slot = value;
        }
    }

    fn start(&mut self, _: StepId, operation: &Operation, _: &mut dyn Listener) -> Result<Ticket, Fault> {
        let nominal = operation.takes.and_then(|t| self.at(t.nominal, self.time));
        self.apply(&operation.at_start)?;
        let duration = nominal.filter(|d| d.is_finite() && *d >= 0.0).unwrap_or(0.0);
        let ticket = Ticket(self.started);
        self.started += 1;
        self.running.insert(
            ticket,
            Running { ends: self.moments.after(self.time, duration), at_end: operation.at_end.clone() },
        );
        Ok(ticket)
    }

    fn poll(&mut self, ticket: Ticket, _: &mut dyn Listener) -> Result<Status, Fault> {
        match self.running.get(&ticket) {
            Some(running) if self.time < running.ends => {
                return Ok(Status::Running { until: Some(running.ends), watch: None });
            }
            _ => {}
        }
        if let Some(running) = self.running.remove(&ticket) {
            self.apply(&running.at_end)?;
        }
        Ok(Status::Done)
    }

    fn halt(&mut self, ticket: Ticket) {
        self.running.remove(&ticket);
    }

    fn advance(&mut self, until: f64, watches: &[Watch], _: &mut dyn Listener) -> Result<Advance, Fault> {
        let now = self.fired(watches);
        if !now.is_empty() {
            return Ok(Advance::Watch(now));
        }
        let crossing = self.crossing(until, watches);
        self.time = crossing.unwrap_or(until).max(self.time);
        let fired = self.fired(watches);
        self.apply(&[])?;
        Ok(if fired.is_empty() { Advance::Reached } else { Advance::Watch(fired) })
    }
}
