//! The model made ready for watching: a copy in which conditions on readings can be followed without their imperfection, and
//! limits are broken only where they are clearly passed.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Model};
use matterix_ir::plan::{Condition, Operation, Plan, Step};
use matterix_ir::{Graph, NodeId, Op, Program};

use super::{Follow, noise};
use crate::process::Keeps;

/// The model of a program with, for each condition on readings, how to follow it.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The program's model; its graph has further nodes at the end.
    pub model: Model,
    follow: BTreeMap<NodeId, Follow>,
    /// What things keep at all times.
    pub keeps: Keeps,
}

impl Prepared {
    /// Prepares the model of `program`.
    pub fn new(program: &Program) -> Self {
        let mut model = program.model.clone();
        let mut follow = BTreeMap::new();
        for condition in followed(&program.plan) {
            let readings = readings(&model.graph, condition.node);
            if readings.is_empty() {
                continue;
            }
            let periods: Vec<f64> =
                readings.iter().filter_map(|&r| model.readings.get(r as usize).and_then(noise::period)).collect();
            let how = if periods.is_empty() {
                Follow::Watch(exact(&mut model, condition.node))
            } else {
                Follow::Every(periods)
            };
            follow.insert(condition.node, how);
        }
        let keeps = Keeps::new(&mut model, program.plan.limits.iter().map(|l| l.condition.node));
        Prepared { model, follow, keeps }
    }

    /// How to follow this condition.
    pub fn follow(&self, condition: NodeId) -> Follow {
        self.follow.get(&condition).cloned().unwrap_or(Follow::Watch(condition))
    }
}

impl Prepared {
    /// Whether an operation sets what a condition rests on, itself or by events that it sets off.
    pub fn may_change(&self, operation: &Operation, condition: NodeId) -> bool {
        let written = self.written(operation.at_start.iter().chain(&operation.at_end));
        let mut open: Vec<u32> = self.rests_on(condition).into_iter().collect();
        let mut seen: BTreeSet<u32> = open.iter().copied().collect();
        while let Some(state) = open.pop() {
            if written.contains(&state) {
                return true;
            }
            let setting = self.model.events.iter().filter(|event| self.written(event.actions.iter()).contains(&state));
            let causes: Vec<u32> = setting.flat_map(|event| self.rests_on(event.when)).collect();
            open.extend(causes.into_iter().filter(|cause| seen.insert(*cause)));
        }
        false
    }

    /// The states that actions set.
    fn written<'a>(&self, actions: impl Iterator<Item = &'a Action>) -> BTreeSet<u32> {
        let of_mixture = |m: &u32| self.model.mixtures.get(*m as usize).into_iter().flat_map(|m| &m.extensive);
        let states = |action: &Action| match action {
            Action::Assign { state, .. } => vec![*state],
            Action::Move { from, to, .. } => [from, to].into_iter().flat_map(of_mixture).map(|(_, s)| *s).collect(),
        };
        actions.flat_map(states).collect()
    }

    /// The states that a node depends on, by way of readings too.
    fn rests_on(&self, node: NodeId) -> BTreeSet<u32> {
        let (mut states, mut values) = (BTreeSet::new(), Vec::new());
        self.model.graph.visit(node, |op| match op {
            Op::State(state) => _ = states.insert(state),
            Op::Reading(reading) => values.extend(self.model.readings.get(reading as usize).map(|r| r.value)),
            _ => {}
        });
        values.into_iter().for_each(|value| states.extend(self.rests_on(value)));
        states
    }
}

/// The readings a node depends on, ascending.
pub(super) fn readings(graph: &Graph, node: NodeId) -> Vec<u32> {
    let mut found: Vec<u32> = graph
        .schedule([node])
        .into_iter()
        .filter_map(|n| match graph.op(n) {
            Op::Reading(r) => Some(r),
            _ => None,
        })
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// A copy of `node` in which every reading is the quantity it measures.
fn exact(model: &mut Model, node: NodeId) -> NodeId {
    let mut copies: BTreeMap<NodeId, NodeId> = BTreeMap::new();
    for old in model.graph.schedule([node]) {
        let at = |n: NodeId| copies.get(&n).copied().unwrap_or(n);
        let new = match model.graph.op(old) {
            Op::Reading(r) => model.readings.get(r as usize).map_or(old, |reading| reading.value),
            Op::Unary(o, a) => model.graph.add(Op::Unary(o, at(a))),
            Op::Binary(o, a, b) => model.graph.add(Op::Binary(o, at(a), at(b))),
            Op::Select(c, a, b) => model.graph.add(Op::Select(at(c), at(a), at(b))),
            Op::List(a, b) => model.graph.add(Op::List(at(a), at(b))),
            Op::Solved(call, _) => {
                let call = model.graph.call(call).clone();
                let args = call.args.iter().map(|arg| at(*arg)).collect();
                model.graph.solved(&call.system, call.part, &args)
            }
            _ => old,
        };
        copies.insert(old, new);
    }
    copies.get(&node).copied().unwrap_or(node)
}

/// The conditions of a plan that are followed over time.
fn followed(plan: &Plan) -> impl Iterator<Item = &Condition> {
    plan.steps.iter().flat_map(|s| match &s.step {
        Step::WaitUntil { condition, .. } | Step::Hold { condition, .. } | Step::Keep { condition, .. } => {
            std::slice::from_ref(condition)
        }
        Step::Skill { invariants, .. } | Step::During { invariants, .. } => invariants,
        Step::Operation(operation) => operation.until.as_slice(),
        _ => &[],
    })
}
