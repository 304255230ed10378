//! How long a command lasts that an event ends: a pump until it has counted its dose.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Event};
use matterix_ir::plan::Operation;
use matterix_ir::{BinaryOp, NodeId, Op};

use crate::value::Known;

/// What a command sets when it begins, by state.
type Set = BTreeMap<u32, f64>;

impl Known<'_> {
    /// The longest that a command lasts whose condition a steady count makes true, s, while nothing else changes what it sets; none
    /// where that is not known.
    pub fn counted(&self, operation: &Operation) -> Option<f64> {
        let until = operation.until.as_ref()?.node;
        let set: Set = operation.at_start.iter().filter_map(|action| self.assigned(action)).collect();
        let begun = self.with(&set);
        let mut least = begun.time_until(until, &set);
        for event in self.events {
            let written: BTreeSet<u32> = event.actions.iter().filter_map(Action::assigned).collect();
            let counts = self.graph.depends(until, |op| matches!(op, Op::State(s) if written.contains(s)));
            if !counts && !written.iter().any(|s| set.contains_key(s)) {
                continue;
            }
            let ends = begun.with(&self.effects(event)).number(until).exact().is_some_and(|holds| holds != 0.0);
            if !ends {
                return None;
            }
            let time = begun.time_until(event.when, &set);
            least = least.into_iter().chain(time).min_by(f64::total_cmp);
        }
        least
    }

    /// How long a condition takes at most to come true where what it compares changes steadily, s.
    fn time_until(&self, condition: NodeId, set: &Set) -> Option<f64> {
        if let Some(holds) = self.number(condition).exact() {
            return (holds != 0.0).then_some(0.0);
        }
        match self.graph.op(condition) {
            Op::Binary(BinaryOp::And, a, b) => Some(self.time_until(a, set)?.max(self.time_until(b, set)?)),
            Op::Binary(BinaryOp::Le | BinaryOp::Lt, a, b) => {
                let ((low, lowers), (high, rises)) = (self.course(a, set)?, self.course(b, set)?);
                let (ahead, gains) = (low - high, rises - lowers);
                (gains > 0.0).then(|| (ahead / gains).max(0.0))
            }
            _ => None,
        }
    }

    /// A value at the start of a command, and its rate of change while that lasts, 1/s.
    fn course(&self, node: NodeId, set: &Set) -> Option<(f64, f64)> {
        let Op::State(state) = self.graph.op(node) else {
            return Some((self.number(node).exact()?, 0.0));
        };
        let rates = self.derivatives.iter().filter(|d| d.state == state);
        let rate = rates.map(|d| self.number(d.rate).exact()).sum::<Option<f64>>()?;
        Some((set.get(&state).copied().or(self.number(node).exact())?, rate))
    }

    /// The same where these states have these values; what changes by itself keeps none.
    fn with(&self, set: &Set) -> Self {
        let mut out = self.clone();
        for (state, value) in set {
            if let Some(known) = out.states.get_mut(*state as usize) {
                *known = Some(*value).filter(|_| !self.derivatives.iter().any(|d| d.state == *state));
            }
        }
        out
    }

    fn effects(&self, event: &Event) -> Set {
        event.actions.iter().filter_map(|action| self.assigned(action)).collect()
    }

    /// What an action sets, where that is known.
    fn assigned(&self, action: &Action) -> Option<(u32, f64)> {
        match action {
            Action::Assign { state, value, .. } => Some((*state, self.number(*value).exact()?)),
            Action::Move { .. } => None,
        }
    }
}
