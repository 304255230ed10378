//! Steps as a reader of the workflow knows them.

use matterix_ir::plan::{Plan, PlanStep, Step, StepId};
use matterix_timing::Timing;

/// The innermost step around one, or itself, that stands in the file of the workflow.
pub(super) fn own(plan: &Plan, timing: &Timing, step: StepId) -> StepId {
    let file = plan.get(plan.root).span.file;
    let here = |s: &StepId| plan.get(*s).span.file == file;
    std::iter::once(step).chain(timing.around(step)).find(here).unwrap_or(step)
}

/// The calls of skills around the step that a reader knows, innermost first.
pub(super) fn calls<'p>(plan: &'p Plan, timing: &'p Timing, step: StepId) -> impl Iterator<Item = &'p PlanStep> {
    let own = plan.get(own(plan, timing, step)).span;
    let around = timing.around(step).map(move |s| plan.get(s));
    around.filter(move |s| matches!(s.step, Step::Skill { .. }) && s.span.file == own.file && s.span != own)
}
