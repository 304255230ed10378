//! R1: one instance used by two steps at the same time.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Plan, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Severity, Span, codes};
use matterix_timing::usage::{self, Use};

use super::{Times, expected, held, show, spent};

/// Pairs of uses that are compared at most; a plan that needs more is told that it was not searched to the end.
const MOST: usize = 2_000_000;

/// So many calls around each of two uses are named.
const MOST_CALLS: usize = 2;

/// Uses that overlap, or may, where nothing makes them take turns. Between two lines of steps one clash over an instance is said,
/// a certain one before one that may be. Of steps whose places are in `met` it is known that they do; no run comes to those in `never`.
pub(super) fn findings(
    times: &Times<'_>,
    met: &[[Span; 2]],
    never: &BTreeSet<StepId>,
    name: &dyn Fn(InstanceId) -> String,
) -> Vec<Diagnostic> {
    let mut uses = usage::uses(times.plan, &times.timing, never);
    uses.extend(held::holds(times));
    uses.retain(|used| !never.contains(&used.step));
    uses.sort_unstable();
    let mut clashes: Vec<(&Use, &Use, bool)> = Vec::new();
    let mut unfinished: Option<&Use> = None;
    let mut left = MOST;
    for of_one in uses.chunk_by(|a, b| a.instance == b.instance) {
        let mut lines: BTreeMap<u32, Vec<&Use>> = BTreeMap::new();
        for used in of_one {
            lines.entry(thread(times, used.step)).or_default().push(used);
        }
        let lines: Vec<Vec<&Use>> = lines.into_values().collect();
        for (i, one) in lines.iter().enumerate() {
            for other in &lines[i + 1..] {
                match between(times, one, other, &mut left) {
                    Ok(clash) => clashes.extend(clash),
                    Err(at) => unfinished = unfinished.or(Some(at)),
                }
            }
        }
    }
    let place = |used: &Use| times.plan.get(show::own(times.plan, &times.timing, used.step)).span;
    for (a, b, sure) in clashes.iter_mut().filter(|_| !met.is_empty()) {
        let places = [place(a), place(b)];
        *sure |= met.iter().any(|both| places.iter().all(|place| both.contains(place)));
    }
    clashes.sort_by_key(|c| !c.2);
    let mut said: BTreeSet<(InstanceId, StepId, StepId)> = BTreeSet::new();
    clashes.retain(|(a, b, _)| said.insert((a.instance, line(times, a.step), line(times, b.step))));
    let mut found: Vec<Diagnostic> =
        clashes.into_iter().map(|(a, b, sure)| finding(times, a, b, sure, &name(a.instance))).collect();
    found.extend(unfinished.map(|at| {
        let own = times.plan.get(show::own(times.plan, &times.timing, at.step));
        let headline = format!("`check` did not compare all uses of `{}` with each other", name(at.instance));
        spent(own.span, &headline, "the search for simultaneous uses ends here")
    }));
    found
}

/// The clash of two lines of steps over one instance, if there is one; a use of it where the search was cut short.
fn between<'u>(
    times: &Times<'_>,
    one: &[&'u Use],
    other: &[&'u Use],
    left: &mut usize,
) -> Result<Option<(&'u Use, &'u Use, bool)>, &'u Use> {
    let mut maybe = None;
    let (of_one, of_other) = (classes(times, one, other), classes(times, other, one));
    for (mine, a) in &of_one {
        for (others, b) in &of_other {
            // What both claim makes them take turns.
            if !mine.is_disjoint(others) {
                continue;
            }
            let one_claims = |used: &Use| mine.contains(&used.instance) != others.contains(&used.instance);
            for first in a {
                for second in b {
                    // Where one of them claims it, the whole block counts in place of what it uses.
                    let blocks = [first, second].iter().filter(|used| held::is_hold(times, used)).count();
                    if one_claims(first) != (blocks == 1) {
                        continue;
                    }
                    if *left == 0 {
                        return maybe.map_or(Err(*first), |found| Ok(Some(found)));
                    }
                    *left -= 1;
                    match clash(times, first, second) {
                        Some(true) => return Ok(Some((*first, *second, true))),
                        Some(false) if maybe.is_none() => maybe = Some((*first, *second, false)),
                        _ => {}
                    }
                }
            }
        }
    }
    Ok(maybe)
}

/// The uses of one line of steps by what is claimed around them for certain, and not around those of the other line.
fn classes<'u>(times: &Times<'_>, one: &[&'u Use], other: &[&Use]) -> BTreeMap<BTreeSet<InstanceId>, Vec<&'u Use>> {
    let beyond: BTreeSet<StepId> = other.first().into_iter().flat_map(|u| outside(times, u)).collect();
    let other_line = other.first().map(|u| thread(times, u.step));
    let mut out: BTreeMap<BTreeSet<InstanceId>, Vec<&Use>> = BTreeMap::new();
    for used in one {
        let around = times.timing.around(used.step);
        // One line may have begun inside of a claim of the other, which is around some of the other's steps only.
        let block = Some(used.step).filter(|_| held::is_hold(times, used));
        let own = block.into_iter().chain(around);
        let own = own.filter(|s| !beyond.contains(s) && Some(thread(times, *s)) != other_line);
        let claims = own.filter_map(|s| match &times.plan.get(s).step {
            Step::Claim { claims, .. } => Some(claims.as_slice()),
            _ => None,
        });
        out.entry(claims.flatten().copied().collect()).or_default().push(used);
    }
    out
}

/// The steps around the line of steps in which a use stands.
fn outside(times: &Times<'_>, used: &Use) -> impl Iterator<Item = StepId> {
    let line = thread(times, used.step);
    times.timing.around(used.step).filter(move |s| thread(times, *s) != line)
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
    match [a, b].map(|used| held::is_hold(times, used)) {
        [true, _] => return held::clash(times, a, b),
        [_, true] => return held::clash(times, b, a),
        _ => {}
    }
    if !times.beside(a.step, b.step)
        || take_turns(times, a, b)
        || independent(times, a.step, b.step)
        || [a, b].iter().any(|used| expected(times.plan, &times.timing, used.step, "claimed"))
    {
        return None;
    }
    if times.together(a.step, b.step) {
        return Some([a, b].iter().all(|used| times.must_fail(used.step, "claimed")));
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
pub(super) fn independent(times: &Times<'_>, a: StepId, b: StepId) -> bool {
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
    actions.filter_map(Action::assigned).collect()
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
    match [a, b].map(|used| held::is_hold(times, used)) {
        [true, _] => return held::finding(times, a, b, sure, name),
        [_, true] => return held::finding(times, b, a, sure, name),
        _ => {}
    }
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
    for used in [a, b] {
        for call in show::calls(times.plan, &times.timing, used.step).take(MOST_CALLS) {
            if d.labels.iter().all(|l| l.span != call.span) {
                d = d.because(call.span, format!("in `{}`", call.label));
            }
        }
    }
    d.help(format!("put each into `claim {name} {{ }}`, so that they take turns, or put both into one `sequence`"))
}
