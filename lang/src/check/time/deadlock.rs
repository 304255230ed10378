//! R2: claims that wait for each other: blocks that hold one instance and ask for another, in a circle.
//!
//! Claims of one line of steps that hold and want the same are one class. A circle of claims lies within a strongly connected
//! component of the graph of classes, which is small however long the plan is; the times of single claims are compared there only.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, codes};
use matterix_timing::usage::{self, Claim};

use super::components::components;
use super::{Times, show, spent};

/// Comparisons of two claims at most; a plan that needs more is told that it was not searched to the end.
const MOST: usize = 400_000;

/// Circles of claims.
pub(super) fn findings(times: &Times<'_>, name: &dyn Fn(InstanceId) -> String) -> Vec<Diagnostic> {
    let mut nested: Vec<Claim> = usage::claims(times.plan, &times.timing);
    nested.retain(|c| !c.around.is_empty());
    let mut search = Search::new(times, &nested);
    let mut found = Vec::new();
    let mut said: BTreeSet<BTreeSet<usize>> = BTreeSet::new();
    for start in 0..nested.len() {
        let alike = |classes: &BTreeSet<usize>| classes.contains(&search.class[start]);
        if search.component[start].is_none() || said.iter().any(alike) {
            continue;
        }
        let mut circle = vec![start];
        if search.close(&mut circle) {
            said.insert(circle.iter().map(|c| search.class[*c]).collect());
            found.push(finding(times, &nested, &circle, name));
        }
        if search.left == 0 {
            let own = show::own(times.plan, &times.timing, nested[start].step);
            let text = "the search for claims that wait for each other ends here";
            found.push(spent(times.plan.get(own).span, "not all claims are compared with each other", text));
            break;
        }
    }
    found
}

/// What tells claims of one line of steps apart: their line, what they want, and what is held around them.
type Class = (u32, Vec<InstanceId>, BTreeSet<InstanceId>);

/// A search for circles among nested claims.
struct Search<'t, 'p> {
    times: &'t Times<'p>,
    nested: &'t [Claim],
    /// By claim: its class.
    class: Vec<usize>,
    /// By claim: the strongly connected component of its class; none where no circle leads through it.
    component: Vec<Option<usize>>,
    /// Claims by the instances held around them.
    holders: BTreeMap<InstanceId, Vec<usize>>,
    /// Comparisons that are left.
    left: usize,
}

impl<'t, 'p> Search<'t, 'p> {
    fn new(times: &'t Times<'p>, nested: &'t [Claim]) -> Self {
        let mut numbers: BTreeMap<Class, usize> = BTreeMap::new();
        let mut class = Vec::with_capacity(nested.len());
        let mut holders: BTreeMap<InstanceId, Vec<usize>> = BTreeMap::new();
        for (i, claim) in nested.iter().enumerate() {
            let around: BTreeSet<InstanceId> = claimed(times, &claim.around).collect();
            around.iter().for_each(|instance| holders.entry(*instance).or_default().push(i));
            let thread = times.timing.visit(claim.step).map_or(0, |v| v.thread);
            let next = numbers.len();
            class.push(*numbers.entry((thread, claim.wants.clone(), around)).or_insert(next));
        }
        let mut classes: Vec<(&Class, usize)> = numbers.iter().map(|(class, number)| (class, *number)).collect();
        classes.sort_by_key(|(_, number)| *number);
        let holds = |wants: &[InstanceId], held: &BTreeSet<InstanceId>| wants.iter().any(|i| held.contains(i));
        let waits: Vec<Vec<usize>> = classes
            .iter()
            .map(|((_, wants, _), _)| {
                classes.iter().filter(|((_, _, held), _)| holds(wants, held)).map(|c| c.1).collect()
            })
            .collect();
        let of_class = components(&waits);
        let component = class.iter().map(|c| of_class[*c]).collect();
        Search { times, nested, class, component, holders, left: MOST }
    }

    /// Goes on along claims that wait for the next until the first is reached again.
    fn close(&mut self, circle: &mut Vec<usize>) -> bool {
        let (Some(&first), Some(&last)) = (circle.first(), circle.last()) else { return false };
        if circle.len() > 1 && waits_for(self.times, &self.nested[last], &self.nested[first]).is_some() {
            return true;
        }
        let wants = &self.nested[last].wants;
        let next: BTreeSet<usize> = wants.iter().filter_map(|i| self.holders.get(i)).flatten().copied().collect();
        // Each circle is found from its first claim, and leads through each class once.
        for next in next.range(first + 1..).copied() {
            let again = circle.iter().any(|c| self.class[*c] == self.class[next]);
            if again || self.component[next] != self.component[first] {
                continue;
            }
            if self.left == 0 {
                return false;
            }
            self.left -= 1;
            // All of it must be able to stand still at once.
            let (times, nested) = (self.times, self.nested);
            if waits_for(times, &nested[last], &nested[next]).is_none()
                || circle.iter().any(|c| !meet(times, &nested[*c], &nested[next]))
            {
                continue;
            }
            circle.push(next);
            if self.close(circle) {
                return true;
            }
            circle.pop();
        }
        false
    }
}

/// The instances that these blocks claim.
fn claimed<'p>(times: &'p Times<'_>, steps: &'p [StepId]) -> impl Iterator<Item = InstanceId> + 'p {
    steps
        .iter()
        .flat_map(|s| match &times.plan.get(*s).step {
            Step::Claim { claims, .. } => claims.as_slice(),
            _ => &[],
        })
        .copied()
}

/// The instances that `a` holds while it waits, of which `b` is not inside as well.
fn held(times: &Times<'_>, a: &Claim, b: &Claim) -> BTreeSet<InstanceId> {
    let own: Vec<StepId> = a.around.iter().filter(|s| !b.around.contains(s)).copied().collect();
    claimed(times, &own).collect()
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
