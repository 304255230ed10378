//! Turns of a loop: when a further one changes nothing that is known, and what is known after those that are left.

use std::rc::Rc;

use matterix_ir::NodeId;
use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Operation, Step, StepId};

use super::Interpreter;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};

impl Interpreter<'_, '_> {
    /// Whether a further turn changes nothing that is known. Where only how states hang together still changes, that is given up:
    /// what a turn that began without it leads to holds for all further turns.
    pub(super) fn rests(&mut self, body: StepId, facts: &mut AbstractState, before: &AbstractState) -> bool {
        if facts.states != before.states {
            return false;
        }
        let related = match (&facts.bonds, &before.bonds) {
            (Some(now), Some(then)) => Rc::ptr_eq(now, then) || now == then,
            (_, then) => then.is_none(),
        };
        if !related {
            facts.bonds = None;
        }
        let told = before.cases.is_none() || facts.cases == before.cases;
        if !told {
            facts.cases = None;
        }
        related && told && (facts.time == before.time || !self.time_brings(body, before))
    }

    /// Whether a later turn may do something else for the time alone: a timer, a law that follows the clock, a condition.
    fn time_brings(&mut self, body: StepId, before: &AbstractState) -> bool {
        let (since, until) = before.time.bounds();
        // Where it may be any time, all that it may bring has been followed.
        if until == f64::INFINITY {
            return false;
        }
        let mut ever = before.clone();
        ever.time = AbstractValue::Range(since, f64::INFINITY, Imprecision::Unknown);
        let events = self.events;
        let timer = self.timed.clone().into_iter().any(|i| match self.eval(events[i as usize].when, &ever).truth() {
            Some(truth) => truth && before.fired[i as usize] != Some(true),
            None => true,
        });
        let derivatives = self.derivatives;
        timer
            || self
                .clocked
                .clone()
                .into_iter()
                .any(|i| self.eval(derivatives[i as usize].rate, &ever).exact().is_none())
            || self.below(body).into_iter().any(|id| self.asks_for_time(id, &ever))
    }

    /// Whether what a step asks for, or does, may come out otherwise later.
    fn asks_for_time(&mut self, id: StepId, ever: &AbstractState) -> bool {
        let plan = self.plan;
        let (conditions, values) = match &plan.get(id).step {
            Step::If { condition, .. } | Step::Keep { condition, .. } => (vec![condition], Vec::new()),
            Step::WaitUntil { condition, timeout } => (vec![condition], timeout.iter().copied().collect()),
            Step::Hold { condition, duration, timeout } => {
                (vec![condition], timeout.iter().copied().chain([*duration]).collect())
            }
            Step::RepeatWhile { condition, max, .. } => (vec![condition], vec![*max]),
            Step::Expect(conditions) => (conditions.iter().collect(), Vec::new()),
            Step::During { invariants, .. } => (invariants.iter().collect(), Vec::new()),
            Step::Skill { needs, invariants, promises, takes, .. } => {
                let conditions = needs.iter().map(AsRef::as_ref).chain(invariants).chain(promises);
                (conditions.collect(), takes.iter().map(|takes| takes.nominal).collect())
            }
            Step::Operation(operation) => asked_by(operation),
            Step::Let { value, .. } => (Vec::new(), vec![*value]),
            Step::Wait { duration } => (Vec::new(), vec![*duration]),
            Step::Repeat { times, .. } => (Vec::new(), vec![*times]),
            _ => (Vec::new(), Vec::new()),
        };
        values.into_iter().any(|node| self.parts(node).timed)
            || conditions.into_iter().any(|c| self.parts(c.node).timed && self.eval(c.node, ever).truth().is_none())
    }
}

/// The conditions and values that an operation evaluates.
fn asked_by(operation: &Operation) -> (Vec<&Condition>, Vec<NodeId>) {
    let presumed = operation.presumes.iter().map(|p| &p.condition);
    let conditions = operation.needs.iter().map(AsRef::as_ref).chain(presumed).chain(&operation.until);
    let values = operation.at_start.iter().chain(&operation.at_end).flat_map(Action::sources);
    (conditions.collect(), values.chain(operation.takes.iter().map(|takes| takes.nominal)).collect())
}

/// What tells turns of a loop apart that leave all states as they were.
pub(super) struct Moment {
    time: AbstractValue,
    locals: Vec<AbstractValue>,
}

impl Moment {
    pub(super) fn of(facts: &AbstractState) -> Self {
        Moment { time: facts.time.clone(), locals: facts.locals.clone() }
    }
}

/// The same after as many more turns as are `left`, where that is known: each takes as long as the last one.
pub(super) fn after_turns(left: Option<f64>, mut facts: AbstractState, before: &Moment) -> AbstractState {
    match (left, facts.time.exact(), before.time.exact()) {
        (Some(left), Some(now), Some(then)) if left.is_finite() && facts.locals == before.locals => {
            facts.time = AbstractValue::Point(now + left * (now - then));
            facts
        }
        _ => later(facts, before),
    }
}

/// The same after more turns, of which only the time is told apart.
pub(super) fn later(mut facts: AbstractState, before: &Moment) -> AbstractState {
    if facts.time != before.time || facts.locals != before.locals {
        let (since, _) = facts.time.bounds();
        facts.time = AbstractValue::Range(since, f64::INFINITY, Imprecision::Unknown);
        facts
            .locals
            .iter_mut()
            .zip(&before.locals)
            .filter(|(a, b)| a != b)
            .for_each(|(a, _)| *a = AbstractValue::top());
    }
    facts
}
