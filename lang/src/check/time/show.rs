//! Durations and steps as a reader of the workflow knows them.

use matterix_ir::plan::{Plan, StepId};
use matterix_ir::quantity::show_number;
use matterix_timing::{ROUNDING, Timing};

/// A duration in days, hours, minutes and seconds: `1 h 30 min`.
pub(super) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 1.0 {
        return format!("{} s", show_number(seconds));
    }
    let mut left = seconds;
    let mut parts = Vec::new();
    for (unit, size) in [("d", 86_400.0), ("h", 3600.0), ("min", 60.0)] {
        let whole = ((left + ROUNDING) / size).floor();
        if whole >= 1.0 {
            parts.push(format!("{} {unit}", show_number(whole)));
            left -= whole * size;
        }
    }
    if left > ROUNDING {
        parts.push(format!("{} s", show_number(left)));
    }
    parts.join(" ")
}

/// The innermost step around one, or itself, that stands in the file of the workflow.
pub(super) fn own(plan: &Plan, timing: &Timing, step: StepId) -> StepId {
    let file = plan.get(plan.root).span.file;
    let here = |s: &StepId| plan.get(*s).span.file == file;
    std::iter::once(step).chain(timing.around(step)).find(here).unwrap_or(step)
}
