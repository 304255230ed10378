//! R2: claims that wait for each other: blocks that hold one instance and ask for another, in a circle.

use std::collections::BTreeSet;

use matterix_ir::plan::{Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, codes};
use matterix_timing::usage::{self, Claim};

use super::{Times, show};

/// Nested claims at most; circles longer than this are left to the run.
const MOST: usize = 200;
const LONGEST: usize = 5;

/// Circles of claims.
pub(super) fn findings(times: &Times<'_>, name: &dyn Fn(InstanceId) -> String) -> Vec<Diagnostic> {
    let mut nested: Vec<Claim> = usage::claims(times.plan, &times.timing);
    nested.retain(|c| !c.around.is_empty());
    nested.truncate(MOST);
    let waits: Vec<Vec<usize>> = nested
        .iter()
        .map(|a| (0..nested.len()).filter(|b| waits_for(times, a, &nested[*b]).is_some()).collect())
        .collect();
    let mut found = Vec::new();
    let mut said: BTreeSet<usize> = BTreeSet::new();
    for start in 0..nested.len() {
        if said.contains(&start) {
            continue;
        }
        let mut circle = vec![start];
        if close(times, &nested, &waits, &mut circle) {
            said.extend(&circle);
            found.push(finding(times, &nested, &circle, name));
        }
    }
    found
}

/// Goes on along claims that wait for the next until the first is reached again.
fn close(times: &Times<'_>, nested: &[Claim], waits: &[Vec<usize>], circle: &mut Vec<usize>) -> bool {
    let (Some(&first), Some(&last)) = (circle.first(), circle.last()) else { return false };
    if circle.len() > 1 && waits[last].contains(&first) {
        return true;
    }
    if circle.len() == LONGEST {
        return false;
    }
    for &next in &waits[last] {
        // Each circle is found from its first claim; all of it must be able to stand still at once.
        if next <= first || circle.contains(&next) || circle.iter().any(|c| !meet(times, &nested[*c], &nested[next])) {
            continue;
        }
        circle.push(next);
        if close(times, nested, waits, circle) {
            return true;
        }
        circle.pop();
    }
    false
}

/// The instances that `a` holds while it waits, of which `b` is not inside as well.
fn held(times: &Times<'_>, a: &Claim, b: &Claim) -> BTreeSet<InstanceId> {
    let own = a.around.iter().filter(|s| !b.around.contains(s));
    own.flat_map(|s| match &times.plan.get(*s).step {
        Step::Claim { claims, .. } => claims.clone(),
        _ => Vec::new(),
    })
    .collect()
}

/// Whether both can wait at the same time: side by side, with nothing in common in hand.
fn meet(times: &Times<'_>, a: &Claim, b: &Claim) -> bool {
    times.beside(a.step, b.step)
        && held(times, a, b).is_disjoint(&held(times, b, a))
        && !times.apart(outermost(a, b), outermost(b, a))
}

fn outermost(a: &Claim, b: &Claim) -> StepId {
    a.around.iter().rfind(|s| !b.around.contains(s)).copied().unwrap_or(a.step)
}

/// The instance that `a` waits for while `b` holds it.
fn waits_for(times: &Times<'_>, a: &Claim, b: &Claim) -> Option<InstanceId> {
    if a.step == b.step || !meet(times, a, b) {
        return None;
    }
    let (mine, others) = (held(times, a, b), held(times, b, a));
    a.wants.iter().copied().find(|i| others.contains(i) && !mine.contains(i))
}

fn finding(times: &Times<'_>, nested: &[Claim], circle: &[usize], name: &dyn Fn(InstanceId) -> String) -> Diagnostic {
    let next = |i: usize| circle[(i + 1) % circle.len()];
    let mut labels = Vec::new();
    let mut waited = Vec::new();
    for (i, &claim) in circle.iter().enumerate() {
        let (own, other) = (&nested[claim], &nested[next(i)]);
        let Some(wanted) = waits_for(times, own, other) else { continue };
        let wanted = name(wanted);
        labels.push((own.step, format!("waits here for `{wanted}`")));
        waited.push(format!("`{wanted}`"));
    }
    for (i, &claim) in circle.iter().enumerate() {
        let before = &nested[circle[(i + circle.len() - 1) % circle.len()]];
        let own = &nested[claim];
        let Some(instance) = waits_for(times, before, own) else { continue };
        let holder = own.around.iter().find(|s| match &times.plan.get(**s).step {
            Step::Claim { claims, .. } => claims.contains(&instance),
            _ => false,
        });
        labels.extend(holder.map(|h| (*h, format!("holds `{}`", name(instance)))));
    }
    let span = |step: StepId| times.plan.get(show::own(times.plan, &times.timing, step)).span;
    let headline = format!("claims of {} can wait for each other for ever", waited.join(" and "));
    let (first, rest) = (labels.first().cloned(), labels.get(1..).unwrap_or_default());
    let (step, text) = first.unwrap_or((times.plan.root, String::new()));
    let mut rest = rest.to_vec();
    rest.sort_by_key(|(s, _)| span(*s));
    let mut d = Diagnostic::error(codes::DEADLOCK, span(step), headline, text);
    for (step, text) in rest {
        d = d.because(span(step), text);
    }
    d.help("claim everything that is needed together in one `claim`, or everywhere in the same order")
}
