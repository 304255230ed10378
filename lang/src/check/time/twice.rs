//! R1: one instance used by two steps at the same time.

use std::collections::BTreeSet;

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Plan, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Severity, codes};
use matterix_timing::usage::{self, Use};

use super::{Times, expected, show};

/// Pairs of uses at most.
const MOST: usize = 200_000;

/// Uses that overlap, or may, where nothing makes them take turns.
pub(super) fn findings(times: &Times<'_>, name: &dyn Fn(InstanceId) -> String) -> Vec<Diagnostic> {
    let uses = usage::uses(times.plan, &times.timing);
    let mut clashes: Vec<(&Use, &Use, bool)> = Vec::new();
    let mut pairs = 0;
    for of_one in uses.chunk_by(|a, b| a.instance == b.instance) {
        let threads: Vec<u32> = of_one.iter().map(|u| thread(times, u.step)).collect();
        // In one line of steps nothing meets: most instances are used in one only.
        if threads.windows(2).all(|two| two[0] == two[1]) {
            continue;
        }
        for (i, first) in of_one.iter().enumerate() {
            for (j, second) in of_one.iter().enumerate().skip(i + 1) {
                if threads[i] == threads[j] {
                    continue;
                }
                pairs += 1;
                if pairs <= MOST {
                    clashes.extend(clash(times, first, second).map(|sure| (first, second, sure)));
                }
            }
        }
    }
    // Between two lines of steps one clash over an instance is said, a certain one before one that may be.
    clashes.sort_by_key(|c| !c.2);
    let mut said: BTreeSet<(InstanceId, StepId, StepId)> = BTreeSet::new();
    clashes.retain(|(a, b, _)| said.insert((a.instance, line(times, a.step), line(times, b.step))));
    clashes.into_iter().map(|(a, b, sure)| finding(times, a, b, sure, &name(a.instance))).collect()
}

fn thread(times: &Times<'_>, step: StepId) -> u32 {
    times.timing.visit(step).map_or(0, |v| v.thread)
}

/// The line of steps a step stands in, as the step it began with.
fn line(times: &Times<'_>, step: StepId) -> StepId {
    let inside = |s: &StepId| thread(times, *s) == thread(times, step);
    times.timing.around(step).take_while(inside).last().unwrap_or(step)
}

/// Whether two uses overlap: certainly, perhaps, or (none) never.
fn clash(times: &Times<'_>, a: &Use, b: &Use) -> Option<bool> {
    if !times.beside(a.step, b.step)
        || take_turns(times, a, b)
        || independent(times, a.step, b.step)
        || expected(times.plan, &times.timing, a.step, "claimed")
    {
        return None;
    }
    if times.together(a.step, b.step) {
        return Some(true);
    }
    if times.apart(a.step, b.step) || harmless(times, a.step, b.step) {
        return None;
    }
    Some(false)
}

/// Whether each stands in a `claim` that is not around the other, and both claim something in common: what they use, or
/// what else they need for it.
fn take_turns(times: &Times<'_>, a: &Use, b: &Use) -> bool {
    let claimed = |own: &Use, other: &Use| -> BTreeSet<InstanceId> {
        let others: Vec<StepId> = times.timing.around(other.step).collect();
        let own = times.timing.around(own.step).filter(|s| !others.contains(s));
        let claims = own.filter_map(|s| match &times.plan.get(s).step {
            Step::Claim { claims, .. } => Some(claims),
            _ => None,
        });
        claims.flatten().copied().collect()
    };
    !claimed(a, b).is_disjoint(&claimed(b, a))
}

/// Whether all that is done in one step can be done at the moment of all that is done in the other.
fn independent(times: &Times<'_>, a: StepId, b: StepId) -> bool {
    let others = operations(times.plan, b);
    let own = operations(times.plan, a);
    at_once(times, a) && at_once(times, b) && own.iter().all(|a| others.iter().all(|b| a.is_independent_of(b)))
}

fn at_once(times: &Times<'_>, step: StepId) -> bool {
    times.timing.visit(step).is_some_and(|v| v.lasts.max <= 0.0)
}

/// Two commands that are over at once meet only by chance, and only those that set the same are then in doubt.
fn harmless(times: &Times<'_>, a: StepId, b: StepId) -> bool {
    at_once(times, a) && at_once(times, b) && written(times.plan, a).is_disjoint(&written(times.plan, b))
}

/// The states that a step and what is below it assign.
fn written(plan: &Plan, step: StepId) -> BTreeSet<u32> {
    let actions = operations(plan, step).into_iter().flat_map(|o| o.at_start.iter().chain(&o.at_end));
    actions
        .filter_map(|action| match action {
            Action::Assign { state, .. } => Some(*state),
            Action::Move { .. } => None,
        })
        .collect()
}

/// The operations of a step and of what is below it.
fn operations(plan: &Plan, step: StepId) -> Vec<&Operation> {
    let mut out = Vec::new();
    let mut open = vec![step];
    while let Some(step) = open.pop() {
        let node = &plan.get(step).step;
        if let Step::Operation(operation) = node {
            out.push(&**operation);
        }
        open.extend(node.children());
    }
    out
}

fn finding(times: &Times<'_>, a: &Use, b: &Use, sure: bool, name: &str) -> Diagnostic {
    let own = |u: &Use| times.plan.get(show::own(times.plan, &times.timing, u.step));
    let (mut first, mut second) = (own(a), own(b));
    if first.span > second.span {
        std::mem::swap(&mut first, &mut second);
    }
    let may = if sure { "" } else { "may " };
    let headline = format!("`{}` and `{}` {may}use `{name}` at the same time", first.label, second.label);
    let mut d = Diagnostic::error(codes::CLAIMED_TWICE, second.span, headline, format!("uses `{name}`"))
        .because(first.span, format!("`{name}` {} in use here", if sure { "is" } else { "may be" }));
    if !sure {
        d.severity = Severity::Warning;
    }
    d.help(format!("put each into `claim {name} {{ }}`, so that they take turns, or do one after the other"))
}
