//! Limits that things keep at all times, where what flows breaks them: the failure, and the step that it ends.

use std::collections::BTreeMap;

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Step, StepId};

use super::Executor;
use super::frame::{FrameId, Kind};
use super::judge::Raised;

impl Executor<'_, '_> {
    /// Raises the failures of limits that have just been broken, each in the step in hand that it comes from.
    pub(super) fn limits_broken(&mut self, limits: &[u32]) {
        for &index in limits {
            let Some(id) = self.in_hand(index) else { continue };
            let node = self.plan.limits.get(index as usize).map(|limit| limit.condition.node);
            match node.map_or(Ok(()), |node| self.backend.defined(node)) {
                Ok(()) => self.limit_fails(id, index),
                Err(fault) => self.fault(id, fault),
            }
            self.drain();
        }
    }

    /// An operation that took its time has ended: it fails where it has gone on to pass a limit that was broken before, and taken
    /// by the handler of another step. Whether it did.
    pub(super) fn went_beyond(&mut self, id: FrameId, operation: &Operation) -> bool {
        if operation.is_at_once() {
            return false;
        }
        let broken = self.backend.broken();
        let passed = broken
            .into_iter()
            .find(|limit| self.backend.decide(*limit).first().is_some_and(|states| sets(operation, states)));
        passed.inspect(|limit| self.limit_fails(id, *limit)).is_some()
    }

    fn limit_fails(&mut self, id: FrameId, index: u32) {
        let Some(limit) = self.plan.limits.get(index as usize) else { return };
        let (condition, thing) = (&limit.condition, self.instance(limit.instance).to_owned());
        let label = self.label(id).to_owned();
        let text = format!("`{}` of `{thing}` becomes false during `{label}`", condition.text);
        let raised = self.unmet(condition, condition.failure(), condition.code(), text);
        self.fail(id, Raised { help: condition.advice(), ..raised });
    }

    /// The step in hand that a broken limit comes from: the operation that set going what broke it, or what is done now nearest
    /// to it in the plan.
    fn in_hand(&self, limit: u32) -> Option<FrameId> {
        let (cause, parents) = (self.cause(limit), self.parents());
        let path = |step: StepId| {
            let mut path: Vec<StepId> = std::iter::successors(Some(step), |s| parents.get(s).copied()).collect();
            path.reverse();
            path
        };
        let from = cause.map(path).unwrap_or_default();
        let near = |step: StepId| path(step).iter().zip(&from).take_while(|(a, b)| a == b).count();
        let beside = |id: FrameId| {
            std::iter::once(id).chain(self.ancestors(id)).any(|f| self.state.frames.get(&f).is_some_and(|f| f.job))
        };
        let leaves = self.state.frames.iter().filter(|(_, f)| f.children.is_empty());
        let ranked = leaves.filter_map(|(&id, f)| Some(((f.stop.is_none(), near(f.step?), !beside(id), id), id)));
        ranked.max_by_key(|(rank, _)| *rank).map(|(_, id)| id)
    }

    /// The operation that last set what decides how the states of a limit change; one that goes on before others.
    fn cause(&self, limit: u32) -> Option<StepId> {
        self.backend.decide(limit).iter().find_map(|states| {
            let begun = (0..self.plan.steps.len() as u32).map(StepId).filter_map(|id| match &self.plan.get(id).step {
                Step::Operation(o) if sets(o, states) => Some((id, self.state.steps[id.0 as usize].started?)),
                _ => None,
            });
            let runs = |id: StepId| {
                self.state.frames.values().any(|f| f.step == Some(id) && matches!(f.kind, Kind::Operation { .. }))
            };
            let ranked = begun.map(|(id, time)| (runs(id), time, self.plan.get(id).span, id));
            ranked.max_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))).map(|(.., id)| id)
        })
    }

    /// The step that each step stands in.
    fn parents(&self) -> BTreeMap<StepId, StepId> {
        let all = self.plan.steps.iter().enumerate();
        all.flat_map(|(i, s)| s.step.children().into_iter().map(move |child| (child, StepId(i as u32)))).collect()
    }
}

/// Whether an operation sets one of these states.
fn sets(operation: &Operation, states: &[u32]) -> bool {
    let mut actions = operation.at_start.iter().chain(&operation.at_end);
    actions.any(|a| matches!(a, Action::Assign { state, .. } if states.contains(state)))
}
