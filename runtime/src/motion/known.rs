//! What is known of the states of a model while a plan is followed before it runs.

use std::collections::BTreeSet;

use matterix_ir::model::{Action, Model};
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::{NodeId, Program};

use super::fixture::initial;
use crate::backend::unknown::{Known, eval};

/// Values of states by index, as far as they are known.
#[derive(Clone, Debug)]
pub(super) struct States<'p> {
    program: &'p Program,
    params: Vec<f64>,
    values: Vec<Option<f64>>,
    /// Never known: what moves by itself, by events, or by jobs that go on beside the plan.
    loose: BTreeSet<u32>,
}

impl<'p> States<'p> {
    /// As a run begins.
    pub fn new(program: &'p Program) -> Self {
        let model = &program.model;
        let assigned = |action: &Action| match action {
            Action::Assign { state, .. } => Some(*state),
            Action::Move { .. } => None,
        };
        let mut loose: BTreeSet<u32> = model.derivatives.iter().map(|d| d.state).collect();
        loose.extend(model.events.iter().flat_map(|e| &e.actions).filter_map(assigned));
        loose.extend(model.mixtures.iter().flat_map(|m| m.extensive.iter().map(|e| e.1)));
        for step in &program.plan.steps {
            if let Step::Start { body, .. } = &step.step {
                loose.extend(written(program, *body));
            }
        }
        let begin = |s: &matterix_ir::model::State| Some(initial(program, s.initial)).filter(|v| v.is_finite());
        let values = model.states.iter().map(begin).collect();
        let mut states =
            States { program, params: model.params.iter().map(|p| p.value).collect(), values, loose: BTreeSet::new() };
        states.forget(&loose);
        states.loose = loose;
        states
    }

    /// The value of a node, if it follows from what is known.
    pub fn value(&self, node: NodeId) -> Option<f64> {
        let (states, params) = (self.values.as_slice(), self.params.as_slice());
        let known = Known { time: f64::NAN, states, params, locals: &[], readings: &[] };
        eval(&self.model().graph, node, known).filter(|v| v.is_finite())
    }

    /// What an operation sets is known from now on as far as its values are.
    pub fn apply(&mut self, operation: &Operation) {
        for action in operation.at_start.iter().chain(&operation.at_end) {
            let Action::Assign { state, value, .. } = action else { continue };
            let value = self.value(*value).filter(|_| !self.loose.contains(state));
            if let Some(slot) = self.values.get_mut(*state as usize) {
                *slot = value;
            }
        }
    }

    /// What these states are is not known any more.
    pub fn forget(&mut self, states: &BTreeSet<u32>) {
        for state in states {
            if let Some(slot) = self.values.get_mut(*state as usize) {
                *slot = None;
            }
        }
    }

    /// What the steps of a part of the plan set is not known any more.
    pub fn forget_written(&mut self, id: StepId) {
        self.forget(&written(self.program, id));
    }

    /// Only what is the same on another way stays known.
    pub fn join(&mut self, other: &States<'p>) {
        for (mine, other) in self.values.iter_mut().zip(&other.values) {
            *mine = mine.filter(|_| *mine == *other);
        }
    }

    fn model(&self) -> &'p Model {
        &self.program.model
    }
}

/// The states that steps set.
fn written(program: &Program, id: StepId) -> BTreeSet<u32> {
    let mut out = BTreeSet::new();
    let mut open = vec![id];
    while let Some(id) = open.pop() {
        let step = &program.plan.get(id).step;
        if let Step::Operation(operation) = step {
            out.extend(operation.at_start.iter().chain(&operation.at_end).filter_map(|action| match action {
                Action::Assign { state, .. } => Some(*state),
                Action::Move { .. } => None,
            }));
        }
        open.extend(step.children());
    }
    out
}
