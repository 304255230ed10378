//! Windows that are over before a branch or job gets what it has claimed.

use std::collections::BTreeSet;

use matterix_ir::plan::{Step, StepId};
use matterix_ir::quantity::show_duration;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, codes};

use super::super::Interpreter;
use super::super::report::Finding;
use super::{Lines, same, takes};

impl<'l> Interpreter<'l, '_> {
    /// Whether some of these steps may wait for a claim while a window of theirs runs.
    pub(super) fn has_windows_behind_claims(&self, pairs: &[(StepId, Vec<StepId>)]) -> bool {
        if !self.plan.steps.iter().any(|s| matches!(s.step, Step::Within { .. })) {
            return false;
        }
        pairs.iter().any(|(own, others)| {
            let asked: BTreeSet<InstanceId> = self
                .below(*own)
                .into_iter()
                .filter(|id| self.holds_window(*id))
                .flat_map(|id| self.claimed_by(id))
                .collect();
            let beside = others.iter().flat_map(|other| self.below(*other));
            !asked.is_empty() && beside.into_iter().flat_map(|id| self.claimed_by(id)).any(|i| asked.contains(&i))
        })
    }

    fn holds_window(&self, id: StepId) -> bool {
        self.below(id).into_iter().any(|id| matches!(self.plan.get(id).step, Step::Within { .. }))
    }

    /// What a step itself claims for the steps in it.
    fn claimed_by(&self, id: StepId) -> Vec<InstanceId> {
        match &self.plan.get(id).step {
            Step::Claim { claims, .. } => claims.clone(),
            _ => Vec::new(),
        }
    }

    /// A line that has waited for what it claimed comes to a window.
    pub(super) fn judge_window(
        &mut self,
        lines: &mut Lines<'l>,
        at: usize,
        (id, limit, since): (StepId, NodeId, NodeId),
    ) {
        let (limit, since) = (self.eval(limit, &lines.facts).exact(), self.eval(since, &lines.facts).exact());
        let (Some(limit), Some(since)) = (limit, since) else { return };
        let (now, waited) = (lines.now(), lines.all[at].claim.1);
        // What comes too late without the claim, too, is another finding.
        if now <= since + limit || same(now, since + limit) || now - waited > since + limit {
            return;
        }
        lines.over = true;
        if takes(&self.caught, "late") {
            return;
        }
        let headline = format!(
            "this starts {} after the step that it follows, because it waits for a claim",
            show_duration(now - since)
        );
        let said = format!("must start within {}", show_duration(limit));
        let d = Diagnostic::error(codes::WINDOW_UNMEETABLE, self.plan.get(id).span, headline, said)
            .because(self.claim_of(id), format!("waits {} for this claim", show_duration(waited)))
            .help("use another device of this kind, or let the other branch or job claim it later");
        self.tell_in_time(d, self.plan.get(id).span, lines.left);
    }

    /// The claim around a step.
    fn claim_of(&self, id: StepId) -> matterix_ir::Span {
        let steps = (0..self.plan.steps.len() as u32).map(StepId);
        let around = steps.filter(|other| matches!(self.plan.get(*other).step, Step::Claim { .. }));
        let around = around.map(|other| (self.below(other), other)).filter(|(below, _)| below.contains(&id));
        around.min_by_key(|(below, _)| below.len()).map(|(_, other)| self.plan.get(other).span).unwrap_or_default()
    }
}

/// A window that comes too late in one order of claims, where another one does in the other.
pub(super) fn late_in_either(first: &[Finding], second: &[Finding]) -> Option<Finding> {
    let late = |found: &[Finding]| found.iter().position(|f| f.is(codes::WINDOW_UNMEETABLE));
    let (one, other) = (late(first)?, late(second)?);
    (!first[one].is_like(&second[other])).then(|| first[one].clone().softened())
}

/// A window that is too late in the order in which claims are asked for may come in time in another.
pub(super) fn softened(finding: Finding) -> Finding {
    if finding.is(codes::WINDOW_UNMEETABLE) { finding.softened() } else { finding }
}
