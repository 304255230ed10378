//! What is known of a lab's states while a plan is followed without being run.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::graph::{BinaryOp, apply};
use matterix_ir::model::{Action, Domain, Model};
use matterix_ir::plan::{Motion, Operation, Step};
use matterix_ir::{NodeId, Op, Program};

use crate::motion::stage::Stage;

/// Values of states that are words, truths or instances, as far as they are known; quantities only where motions depend on
/// them and nothing but operations changes them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    by_state: BTreeMap<u32, f64>,
    /// The quantities among them.
    followed: Arc<BTreeSet<u32>>,
}

impl Values {
    /// When the run begins. What an event changes is not known, as nobody says when.
    pub fn at_start(program: &Program) -> Self {
        let model = &program.model;
        let changes = model.events.iter().flat_map(|e| &e.actions).filter_map(|a| match a {
            Action::Assign { state, .. } => Some(*state),
            Action::Move { .. } => None,
        });
        let changes: BTreeSet<u32> = changes.collect();
        let mut out = Values { followed: Arc::new(followed(program, &changes)), ..Values::default() };
        for (index, state) in model.states.iter().enumerate() {
            let index = index as u32;
            if !out.follows(model, index) || changes.contains(&index) {
                continue;
            }
            if let Some(value) = out.value(model, state.initial) {
                out.by_state.insert(index, value);
            }
        }
        out
    }

    /// Whether what becomes of a state is followed.
    fn follows(&self, model: &Model, state: u32) -> bool {
        let quantity = model.states.get(state as usize).is_none_or(|s| matches!(s.domain, Domain::Quantity(_)));
        !quantity || self.followed.contains(&state)
    }

    /// An assignment: the new value, if it is known.
    pub fn assign(&mut self, model: &Model, state: u32, value: NodeId) -> Option<f64> {
        let value = self.value(model, value);
        if self.follows(model, state) {
            match value {
                Some(value) => self.by_state.insert(state, value),
                None => self.by_state.remove(&state),
            };
        }
        value
    }

    /// What is known when actions have been carried out, the quantities that they set included.
    fn after<'a>(&self, model: &Model, actions: impl Iterator<Item = &'a Action>) -> Values {
        let mut out = self.clone();
        for action in actions {
            let Action::Assign { state, value, .. } = action else { continue };
            match out.value(model, *value) {
                Some(value) => out.by_state.insert(*state, value),
                None => out.by_state.remove(state),
            };
        }
        out
    }

    /// The values of the motion of an operation, as [`Stage::perform`] takes them; nothing where only a run can tell them.
    pub fn of_motion(
        &self,
        model: &Model,
        stage: &Stage<'_>,
        motion: &Motion,
        operation: &Operation,
    ) -> Option<Vec<f64>> {
        if let Some(led) = stage.led_by(motion) {
            let after = self.after(model, operation.at_start.iter().chain(&operation.at_end));
            return after.value(model, led).map(|to| vec![to]);
        }
        motion.values().into_iter().map(|node| self.value(model, node)).collect()
    }

    /// The value of an expression, if what is known settles it.
    pub fn value(&self, model: &Model, node: NodeId) -> Option<f64> {
        let graph = &model.graph;
        let mut values: BTreeMap<NodeId, f64> = BTreeMap::new();
        for node in graph.schedule([node]) {
            let op = graph.op(node);
            let leaf = |op: Op| match op {
                Op::Const(v) => Some(v),
                Op::State(s) => self.by_state.get(&s).copied(),
                Op::Param(p) => model.params.get(p as usize).map(|p| p.value),
                _ => None,
            };
            let at = |n: NodeId| values.get(&n).copied();
            let value = match op {
                _ if op.operands().next().is_none() => leaf(op),
                // One side may settle it.
                Op::Binary(BinaryOp::And, a, b) if at(a) == Some(0.0) || at(b) == Some(0.0) => Some(0.0),
                Op::Binary(BinaryOp::Or, a, b) if [a, b].into_iter().any(|n| at(n).is_some_and(|v| v != 0.0)) => {
                    Some(1.0)
                }
                Op::Select(c, a, b) => match at(c) {
                    Some(c) => at(if c != 0.0 { a } else { b }),
                    None => at(a).filter(|v| at(b) == Some(*v)),
                },
                _ if op.operands().all(|n| values.contains_key(&n)) => {
                    Some(apply(op, |_| f64::NAN, |n| values.get(&n).copied().unwrap_or(f64::NAN)))
                }
                _ => None,
            };
            if let Some(value) = value.filter(|v| !v.is_nan()) {
                values.insert(node, value);
            }
        }
        values.get(&node).copied()
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.by_state.iter().map(|(state, value)| (*state, *value))
    }
}

/// Quantities that motions depend on, such as how far a tip hangs below its nozzle, as far as no law and no event changes them.
/// To follow the others would be to tell courses apart that are the same in space.
fn followed(program: &Program, by_events: &BTreeSet<u32>) -> BTreeSet<u32> {
    let model = &program.model;
    let operations = || {
        program.plan.steps.iter().filter_map(|step| match &step.step {
            Step::Operation(operation) => Some(operation),
            _ => None,
        })
    };
    let mut assigned: BTreeMap<u32, Vec<NodeId>> = BTreeMap::new();
    let mut open: Vec<NodeId> = Vec::new();
    for operation in operations() {
        for action in operation.at_start.iter().chain(&operation.at_end) {
            if let Action::Assign { state, value, .. } = action {
                assigned.entry(*state).or_default().push(*value);
            }
        }
        if let Some(motion) = &operation.motion {
            open.extend(motion.values());
            open.extend(motion.choice());
        }
    }
    let by_laws = model.derivatives.iter().map(|d| d.state);
    let in_mixtures = model.mixtures.iter().flat_map(|m| m.extensive.iter().map(|(_, state)| *state));
    let moving: BTreeSet<u32> = by_laws.chain(in_mixtures).chain(by_events.iter().copied()).collect();
    let (mut seen, mut found) = (BTreeSet::new(), BTreeSet::new());
    while let Some(node) = open.pop() {
        if !seen.insert(node) {
            continue;
        }
        for node in model.graph.schedule([node]) {
            let Op::State(state) = model.graph.op(node) else { continue };
            if !moving.contains(&state) && found.insert(state) {
                open.extend(assigned.get(&state).into_iter().flatten());
            }
        }
    }
    found
}
