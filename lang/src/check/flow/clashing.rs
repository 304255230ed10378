//! Failures of two steps that use one thing at the same time, where something takes them: what was done by then is not known.

use std::collections::BTreeSet;

use matterix_ir::plan::{Step, StepId};
use matterix_ir::scene::InstanceId;

use super::Interpreter;
use super::program_points::at_least;
use super::state::AbstractState;

/// The failure of two steps that use one thing.
pub(super) const CLAIMED: &str = "claimed";

impl Interpreter<'_, '_> {
    /// What is known where a body that was followed may have failed because it uses what something beside it uses.
    pub(super) fn clashed(&mut self, body: StepId, facts: &AbstractState) -> Option<AbstractState> {
        if !self.may_clash(body) {
            return None;
        }
        let mut failed = facts.clone();
        self.widen(body, &mut failed);
        failed.time = at_least(&failed.time);
        failed.unsure = true;
        Some(failed)
    }

    /// Whether steps that go on beside each other in a body, or beside it, use one thing without taking turns.
    fn may_clash(&self, body: StepId) -> bool {
        let below = self.below(body);
        let within = |own: &StepId| below.contains(own);
        self.side_by_side().into_iter().any(|(own, others)| {
            let used = match within(&own) {
                true => self.used_by(own),
                false if self.below(own).contains(&body) => self.used_by(body),
                false => return false,
            };
            !used.is_empty() && others.iter().any(|other| !self.used_by(*other).is_disjoint(&used))
        })
    }

    /// What steps that were followed use without a `claim` around it among them.
    fn used_by(&self, step: StepId) -> BTreeSet<InstanceId> {
        let node = &self.plan.get(step).step;
        let mut out: BTreeSet<InstanceId> = match node {
            Step::Operation(operation) if self.is_come_to(step) => operation.claims.iter().copied().collect(),
            _ => BTreeSet::new(),
        };
        out.extend(node.children().into_iter().flat_map(|child| self.used_by(child)));
        if let Step::Claim { claims, .. } = node {
            claims.iter().for_each(|claimed| _ = out.remove(claimed));
        }
        out
    }
}
