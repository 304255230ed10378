//! What nothing asks for while steps are followed in the order of time: the temperatures of a plan without any that counts. It need
//! not be followed there; nothing is known of it.

use std::collections::BTreeSet;

use matterix_ir::NodeId;
use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Step};

use super::super::Interpreter;
use super::super::state::AbstractState;
use super::super::value::AbstractValue;
use crate::elaborate::hazards::Hazard;

impl Interpreter<'_, '_> {
    /// States of whose motion bounds alone are known, and what hangs on them; none where a step, a limit or one of these hazards asks
    /// for any.
    pub(super) fn unheeded(&mut self, dangers: &[&Hazard]) -> BTreeSet<u32> {
        let mut states: BTreeSet<u32> = self.tracks().wild.iter().copied().collect();
        let plan = self.plan;
        let operations = plan.steps.iter().filter_map(|step| match &step.step {
            Step::Operation(operation) => Some(&**operation),
            _ => None,
        });
        let operations: Vec<&Operation> = operations.collect();
        let mut size = 0;
        while states.len() > size {
            size = states.len();
            states = self.behind(&states);
            for action in operations.iter().flat_map(|o| o.at_start.iter().chain(&o.at_end)) {
                let carried = self.carried(action, &states);
                states.extend(carried);
            }
        }
        let asked_for = |flow: &mut Self, node: NodeId| flow.parts(node).states.iter().any(|s| states.contains(s));
        let limits = plan.limits.iter().map(|limit| limit.condition.node);
        let hazards = dangers.iter().map(|hazard| hazard.when);
        let nodes: Vec<NodeId> =
            plan.steps.iter().flat_map(|step| asked(&step.step)).chain(limits).chain(hazards).collect();
        if nodes.into_iter().any(|node| asked_for(self, node)) { BTreeSet::new() } else { states }
    }

    /// What an action changes by some states.
    fn carried(&mut self, action: &Action, by: &BTreeSet<u32>) -> Vec<u32> {
        let rests = action.sources().any(|node| self.parts(node).states.iter().any(|s| by.contains(s)));
        match action {
            Action::Assign { state, .. } if rests => vec![*state],
            Action::Assign { .. } => Vec::new(),
            Action::Move { from, to, .. } => {
                let [from, to] = [from, to].map(|m| &self.mixtures[*m as usize]);
                let comes = |key| rests || from.iter().any(|(k, s)| k == key && by.contains(s));
                let goes = from.iter().filter(|_| rests);
                to.iter().filter(|(key, _)| comes(key)).chain(goes).map(|(_, state)| *state).collect()
            }
        }
    }

    /// Whether nothing moves that anything asks for: nothing is known of it from then on.
    pub(in crate::check::flow) fn pass_unheeded(&mut self, facts: &mut AbstractState) -> bool {
        let moves = |i: &u32| self.unheeded.contains(&self.derivatives[*i as usize].state);
        if self.unheeded.is_empty() || !facts.moving.iter().chain(&facts.unsettled).all(moves) {
            return false;
        }
        let unsettled = std::mem::take(&mut facts.unsettled);
        facts.moving.extend(unsettled);
        for state in &self.unheeded {
            facts.states[*state as usize] = AbstractValue::top();
        }
        true
    }
}

/// What a step asks for, besides what actions take their values from.
fn asked(step: &Step) -> Vec<NodeId> {
    let node = |c: &matterix_ir::plan::Condition| c.node;
    match step {
        Step::Operation(o) => {
            let conditions = o.needs.iter().map(|need| need.node).chain(o.presumes.iter().map(|p| p.condition.node));
            let bounds = o.takes.and_then(|takes| takes.bounds).into_iter().flat_map(|(low, high)| [low, high]);
            let lasts = o.takes.map(|takes| takes.nominal).into_iter().chain(o.until.as_ref().map(node));
            conditions.chain(bounds).chain(lasts).collect()
        }
        Step::Skill { needs, invariants, promises, takes, .. } => {
            let bounds = takes.and_then(|takes| takes.bounds).into_iter().flat_map(|(low, high)| [low, high]);
            let all = invariants.iter().chain(promises).map(node);
            needs.iter().map(|need| need.node).chain(all).chain(bounds).collect()
        }
        Step::Let { value, .. } => vec![*value],
        Step::Wait { duration } => vec![*duration],
        Step::WaitUntil { condition, timeout } => std::iter::once(condition.node).chain(*timeout).collect(),
        Step::Hold { condition, duration, timeout } => {
            [condition.node, *duration].into_iter().chain(*timeout).collect()
        }
        Step::Keep { condition, .. } | Step::If { condition, .. } => vec![condition.node],
        Step::During { invariants, .. } => invariants.iter().map(node).collect(),
        Step::Within { limit, since, .. } => vec![*limit, *since],
        Step::Repeat { times, .. } | Step::Retry { times } => vec![*times],
        Step::RepeatWhile { condition, max, .. } => vec![condition.node, *max],
        Step::Expect(conditions) => conditions.iter().map(node).collect(),
        Step::Sequence(_)
        | Step::Parallel(_)
        | Step::Guarded { .. }
        | Step::Try(_)
        | Step::Named { .. }
        | Step::Claim { .. }
        | Step::Start { .. }
        | Step::Await { .. }
        | Step::Fail { .. }
        | Step::Record { .. }
        | Step::Note(_)
        | Step::Ask(_) => Vec::new(),
    }
}
