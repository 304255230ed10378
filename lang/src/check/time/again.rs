//! F2: a job that is begun again while it still runs.

use std::collections::BTreeMap;

use matterix_ir::plan::{Step, StepId};
use matterix_ir::quantity::show_duration;
use matterix_ir::{Diagnostic, Severity, codes};
use matterix_timing::{Known, ROUNDING};

use super::{Times, expected, show};

/// A `start` with its job's steps.
#[derive(Clone, Copy)]
struct Begun {
    step: StepId,
    body: StepId,
    order: usize,
    /// The block that waits for the job; none for the plan itself.
    block: Option<StepId>,
}

/// Jobs that are begun again while they run.
pub(super) fn findings(times: &Times<'_>, known: &Known<'_>) -> Vec<Diagnostic> {
    let mut jobs: BTreeMap<&str, Vec<Begun>> = BTreeMap::new();
    for step in (0..times.plan.steps.len() as u32).map(StepId) {
        let (Step::Start { job, body }, Some(visit)) = (&times.plan.get(step).step, times.timing.visit(step)) else {
            continue;
        };
        if !visit.aside {
            let block = times.timing.around(step).find(|s| times.plan.get(*s).step.waits_for_jobs());
            jobs.entry(job).or_default().push(Begun { step, body: *body, order: visit.order, block });
        }
    }
    let mut found = Vec::new();
    for (name, mut begun) in jobs {
        begun.sort_by_key(|b| b.order);
        let clashes = begun.iter().filter_map(|again| {
            let (first, sure) = clash(times, known, &begun, again)?;
            Some(finding(times, name, first, *again, sure))
        });
        found.extend(clashes);
    }
    found
}

/// The job that still runs, certainly or perhaps, where one of its name begins.
fn clash(times: &Times<'_>, known: &Known<'_>, all: &[Begun], again: &Begun) -> Option<(Begun, bool)> {
    if expected(times.plan, &times.timing, again.step, "job") {
        return None;
    }
    let around: Vec<StepId> = times.timing.around(again.step).collect();
    let depth = |b: &Begun| b.block.map_or(Some(around.len()), |block| around.iter().position(|s| *s == block));
    let earlier = all.iter().filter(|b| b.order < again.order).filter_map(|b| Some((depth(b)?, *b)));
    // The innermost block that has a job of this name counts.
    let earlier: Vec<(usize, Begun)> = earlier.collect();
    let nearest = earlier.iter().map(|(depth, _)| *depth).min();
    let earlier = earlier.into_iter().filter(|(depth, _)| Some(*depth) == nearest).map(|(_, b)| b);
    let mut maybe = None;
    for first in earlier {
        match still_runs(times, &first, again) {
            Some(true) => return Some((first, true)),
            Some(false) => maybe = Some((first, false)),
            None => {}
        }
    }
    maybe.or_else(|| in_next_turn(times, known, all, again))
}

/// Whether an earlier job runs where another of its name begins: certainly, perhaps, or (none) never.
fn still_runs(times: &Times<'_>, first: &Begun, again: &Begun) -> Option<bool> {
    let (job, start) = (times.timing.visit(first.body)?, times.timing.visit(again.step)?);
    if job.lasts.max <= 0.0 || !times.timing.beside(job, start) {
        return None;
    }
    let scopes = [job.scope, start.scope];
    let least = |a, b| times.least(a, b, &scopes);
    let outer = times.timing.visit(times.all_turns(again.step, first.step))?;
    if least(job.end, outer.start).is_some_and(|t| t > -ROUNDING) {
        return None;
    }
    let begun = least(job.start, start.start).is_some_and(|t| t >= -ROUNDING);
    let goes_on = least(start.start, job.end).is_some_and(|t| t > ROUNDING);
    let sure = begun && goes_on && times.must_fail(again.step, "job") && times.must_fail(first.step, "job");
    Some(sure)
}

/// The same of the job that an earlier turn of a loop began last, where the next turn comes to the first `start` of this name.
fn in_next_turn(times: &Times<'_>, known: &Known<'_>, all: &[Begun], again: &Begun) -> Option<(Begun, bool)> {
    let inside = times.timing.around(again.step).take_while(|s| Some(*s) != again.block);
    let start = times.timing.visit(again.step)?;
    for turns in inside {
        let (body, least_turns, most_turns) = match &times.plan.get(turns).step {
            Step::Repeat { times: n, body } => (*body, known.number(*n).min, known.number(*n).max),
            Step::RepeatWhile { max, body, .. } => (*body, 0.0, known.number(*max).max),
            _ => continue,
        };
        let mut here = all.iter().filter(|b| b.block == again.block && within(times, b.step, turns));
        let (first, last) = (here.clone().next()?, here.next_back()?);
        let (job, turn) = (times.timing.visit(last.body)?, times.timing.visit(body)?);
        if first.step != again.step || most_turns < 2.0 || !times.timing.outlasts_turn(job.thread, turns) {
            continue;
        }
        let begun = times.timing.visit(last.step)?;
        let scopes = [begun.scope, start.scope];
        let least = |a, b| times.least(a, b, &scopes);
        let gap = least(begun.start, turn.end).unwrap_or(0.0) + least(turn.start, start.start).unwrap_or(0.0);
        if job.lasts.max <= gap + ROUNDING {
            continue;
        }
        let longest = least(turn.end, begun.start).zip(least(start.start, turn.start)).map(|(a, b)| -a - b);
        let goes_on = longest.is_some_and(|longest| job.lasts.min > longest + ROUNDING) && least_turns >= 2.0;
        let sure = goes_on && times.must_fail(again.step, "job") && times.must_fail(last.step, "job");
        return Some((*last, sure));
    }
    None
}

fn within(times: &Times<'_>, step: StepId, outer: StepId) -> bool {
    times.timing.around(step).any(|s| s == outer)
}

fn finding(times: &Times<'_>, name: &str, first: Begun, again: Begun, sure: bool) -> Diagnostic {
    let own = |step: StepId| times.plan.get(show::own(times.plan, &times.timing, step));
    let may = if sure { "is" } else { "may be" };
    let headline = format!("job `{name}` {may} started again while it still runs");
    let lasts = times.timing.visit(first.body).map_or(0.0, |v| v.lasts.min);
    let takes = if lasts > 0.0 { format!("; it takes at least {}", show_duration(lasts)) } else { String::new() };
    let (begun, place) = (own(first.step), own(again.step));
    let mut d = if first.step == again.step {
        let text = format!("started in each turn of the loop{takes}: fails with `job`");
        Diagnostic::error(codes::JOB_STILL_RUNNING, place.span, headline, text)
    } else {
        let d = Diagnostic::error(codes::JOB_STILL_RUNNING, place.span, headline, "fails with `job`");
        d.because(begun.span, format!("started here{takes}"))
    };
    if !sure {
        d.severity = Severity::Warning;
    }
    d.help(format!("`await {name}` before starting it again, or give one of the jobs another name"))
}
