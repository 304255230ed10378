//! D3: a command or skill whose time cannot lie within its own bounds.

use matterix_ir::plan::{Plan, Step, StepId, Takes};
use matterix_ir::quantity::show_duration;
use matterix_ir::{Diagnostic, codes};
use matterix_timing::{Interval, Known, ROUNDING, Timing};

use super::show;

/// Durations outside of their declared bounds.
pub(super) fn findings(plan: &Plan, known: &Known<'_>, timing: &Timing) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for step in (0..plan.steps.len() as u32).map(StepId).filter(|s| timing.visit(*s).is_some()) {
        let (takes, real) = match &plan.get(step).step {
            Step::Operation(operation) if operation.until.is_none() => (operation.takes, None),
            Step::Skill { takes, body, .. } => (*takes, timing.visit(*body).map(|v| v.lasts)),
            _ => continue,
        };
        found.extend(takes.and_then(|takes| finding(plan, known, timing, step, takes, real)));
    }
    found
}

fn finding(
    plan: &Plan,
    known: &Known<'_>,
    timing: &Timing,
    step: StepId,
    takes: Takes,
    real: Option<Interval>,
) -> Option<Diagnostic> {
    let bounds = known.bounds(takes)?;
    let nominal = known.number(takes.nominal);
    let what = &plan.get(step).label;
    let allowed = match bounds.max.is_finite() {
        true => format!("{} .. {}", show_duration(bounds.min), show_duration(bounds.max)),
        false => format!("at least {}", show_duration(bounds.min)),
    };
    let outside = |i: Interval| i.min > bounds.max + ROUNDING || i.max < bounds.min - ROUNDING;
    let (headline, help) = match real {
        Some(real) if outside(real) => {
            let (how, time) = if real.min > bounds.max { ("at least", real.min) } else { ("at most", real.max) };
            let time = show_duration(time);
            (
                format!("the steps of `{what}` take {how} {time}, but its bounds are {allowed}"),
                "widen the bounds in `takes`, or change the steps",
            )
        }
        _ if outside(nominal) => {
            let time = show_duration(if nominal.min > bounds.max { nominal.min } else { nominal.max });
            (
                format!("`{what}` takes {time}, but its bounds are {allowed}"),
                "change the parameter that sets its time, or the bounds in its `takes`",
            )
        }
        _ => return None,
    };
    let own = show::own(plan, timing, step);
    let label = if own == step { "outside its bounds" } else { "called here" };
    Some(Diagnostic::error(codes::TAKES_CONTRADICTED, plan.get(own).span, headline, label).help(help))
}
