//! Steps as a reader of the workflow knows them.

use matterix_ir::plan::{Plan, StepId};
use matterix_timing::Timing;

/// The innermost step around one, or itself, that stands in the file of the workflow.
pub(super) fn own(plan: &Plan, timing: &Timing, step: StepId) -> StepId {
    let file = plan.get(plan.root).span.file;
    let here = |s: &StepId| plan.get(*s).span.file == file;
    std::iter::once(step).chain(timing.around(step)).find(here).unwrap_or(step)
}
