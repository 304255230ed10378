//! R2: steps that wait for each other: blocks that hold one instance and ask for another, and `await`s of jobs, in a circle.
//!
//! A `claim` waits for the block that holds what it asks for, an `await` for the steps of its job; whoever stands still keeps the blocks
//! and the job that it stands in from ending. Waits of one line of steps that hold and want the same are one class. A circle lies within
//! a strongly connected component of the graph of classes, which is small however long the plan is; the times of single waits are compared
//! there only.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{PlanStep, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Severity, Span, codes};
use matterix_timing::ROUNDING;

use super::components::components;
use super::{Times, show, spent};

/// Comparisons of two claims at most; a plan that needs more is told that it was not searched to the end.
const MOST: usize = 400_000;

/// What a step waits for, and what the steps around it keep from others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Thing {
    /// An instance that a block claims.
    Instance(InstanceId),
    /// The end of a job, by its steps.
    Job(StepId),
}

/// A step at which a line of steps may stand still.
struct Wait {
    /// The `claim` or `await`.
    step: StepId,
    /// What it waits for.
    wants: Vec<Thing>,
    /// What others may wait for and it stands in, innermost first: blocks that claim, and steps of jobs.
    around: Vec<StepId>,
}

/// Claims, and `await`s where one stands in a claim, with what is around them.
fn waits(times: &Times<'_>) -> Vec<Wait> {
    let jobs = jobs_awaited_in_claims(times);
    let bodies: BTreeSet<StepId> = jobs.values().flatten().copied().collect();
    let holds = |s: &StepId| matches!(times.plan.get(*s).step, Step::Claim { .. }) || bodies.contains(s);
    let steps = (0..times.plan.steps.len() as u32).map(StepId).filter(|s| times.timing.visit(*s).is_some());
    let wait = |step: StepId| {
        let wants = match &times.plan.get(step).step {
            Step::Claim { claims, .. } => claims.iter().copied().map(Thing::Instance).collect(),
            Step::Await { job } => jobs.get(job.as_str())?.iter().copied().map(Thing::Job).collect(),
            _ => return None,
        };
        Some(Wait { step, wants, around: times.timing.around(step).filter(holds).collect() })
    };
    steps.filter_map(wait).filter(|wait| !wait.around.is_empty()).collect()
}

/// The steps of jobs by name, where an `await` stands in a claim.
fn jobs_awaited_in_claims<'p>(times: &Times<'p>) -> BTreeMap<&'p str, Vec<StepId>> {
    let plan = times.plan;
    let steps = || (0..plan.steps.len() as u32).map(StepId).filter(|s| times.timing.visit(*s).is_some());
    let in_claim = |s: StepId| times.timing.around(s).any(|a| matches!(plan.get(a).step, Step::Claim { .. }));
    if !steps().any(|s| matches!(plan.get(s).step, Step::Await { .. }) && in_claim(s)) {
        return BTreeMap::new();
    }
    let mut out: BTreeMap<&str, Vec<StepId>> = BTreeMap::new();
    for step in steps() {
        if let Step::Start { job, body } = &plan.get(step).step {
            out.entry(job).or_default().push(*body);
        }
    }
    out
}

/// Circles of claims and `await`s.
pub(super) fn findings(times: &Times<'_>, name: &dyn Fn(InstanceId) -> String) -> Vec<Diagnostic> {
    let nested = waits(times);
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
            let text = "the search for deadlocks ends here";
            found.push(spent(times.plan.get(own).span, "`check` did not compare all claims with each other", text));
            break;
        }
    }
    found
}

/// What tells waits of one line of steps apart: their line, what they want, and what is held around them.
type Class = (u32, Vec<Thing>, BTreeSet<Thing>);

/// A search for circles among nested waits.
struct Search<'t, 'p> {
    times: &'t Times<'p>,
    nested: &'t [Wait],
    /// By wait: its class.
    class: Vec<usize>,
    /// By wait: the strongly connected component of its class; none where no circle leads through it.
    component: Vec<Option<usize>>,
    /// Waits by what is held around them.
    holders: BTreeMap<Thing, Vec<usize>>,
    /// Comparisons that are left.
    left: usize,
}

impl<'t, 'p> Search<'t, 'p> {
    fn new(times: &'t Times<'p>, nested: &'t [Wait]) -> Self {
        let mut numbers: BTreeMap<Class, usize> = BTreeMap::new();
        let mut class = Vec::with_capacity(nested.len());
        let mut holders: BTreeMap<Thing, Vec<usize>> = BTreeMap::new();
        for (i, wait) in nested.iter().enumerate() {
            let around: BTreeSet<Thing> = kept(times, &wait.around).collect();
            around.iter().for_each(|thing| holders.entry(*thing).or_default().push(i));
            let thread = times.timing.visit(wait.step).map_or(0, |v| v.thread);
            let next = numbers.len();
            class.push(*numbers.entry((thread, wait.wants.clone(), around)).or_insert(next));
        }
        let mut classes: Vec<(&Class, usize)> = numbers.iter().map(|(class, number)| (class, *number)).collect();
        classes.sort_by_key(|(_, number)| *number);
        let holds = |wants: &[Thing], held: &BTreeSet<Thing>| wants.iter().any(|i| held.contains(i));
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

    /// Goes on along waits for the next until the first is reached again.
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

/// What these blocks and jobs keep from others.
fn kept<'p>(times: &'p Times<'_>, steps: &'p [StepId]) -> impl Iterator<Item = Thing> + 'p {
    steps.iter().flat_map(|step| match &times.plan.get(*step).step {
        Step::Claim { claims, .. } => claims.iter().copied().map(Thing::Instance).collect::<Vec<Thing>>(),
        _ => vec![Thing::Job(*step)],
    })
}

/// What `a` holds while it waits, of which `b` is not inside as well.
fn held(times: &Times<'_>, a: &Wait, b: &Wait) -> BTreeSet<Thing> {
    let own: Vec<StepId> = a.around.iter().filter(|s| !b.around.contains(s)).copied().collect();
    kept(times, &own).collect()
}

/// Whether both can wait at the same time: side by side, with nothing in common in hand.
fn meet(times: &Times<'_>, a: &Wait, b: &Wait) -> bool {
    (times.beside(a.step, b.step) || awaits(a, b) || awaits(b, a))
        && held(times, a, b).is_disjoint(&held(times, b, a))
        && !times.apart(outermost(times, a, b), outermost(times, b, a))
}

/// Whether `a` waits for a job that `b` stands in.
fn awaits(a: &Wait, b: &Wait) -> bool {
    a.wants.iter().any(|thing| matches!(thing, Thing::Job(body) if b.around.contains(body)))
}

/// The outermost block that claims around `a` and not around `b`, else `a` itself.
fn outermost(times: &Times<'_>, a: &Wait, b: &Wait) -> StepId {
    let claims = |s: &&StepId| matches!(times.plan.get(**s).step, Step::Claim { .. });
    a.around.iter().filter(claims).rfind(|s| !b.around.contains(s)).copied().unwrap_or(a.step)
}

/// What `a` waits for while `b` keeps it.
fn waits_for(times: &Times<'_>, a: &Wait, b: &Wait) -> Option<Thing> {
    if a.step == b.step || !meet(times, a, b) {
        return None;
    }
    let (mine, others) = (held(times, a, b), held(times, b, a));
    a.wants.iter().copied().find(|i| others.contains(i) && !mine.contains(i))
}

/// The block or job around `b` that keeps a thing.
fn keeper(times: &Times<'_>, thing: Thing, b: &Wait) -> Option<StepId> {
    b.around.iter().copied().find(|step| kept(times, &[*step]).any(|kept| kept == thing))
}

/// Whether every run comes to stand still in a circle: each block has what it keeps before the others ask for it, and nothing else
/// does.
fn certain(times: &Times<'_>, nested: &[Wait], circle: &[usize]) -> bool {
    let of_circle: Vec<&Wait> = circle.iter().map(|i| &nested[*i]).collect();
    of_circle.iter().enumerate().all(|(i, own)| {
        let next = of_circle[(i + 1) % of_circle.len()];
        times.must_fail(own.step, "deadlock")
            && match waits_for(times, own, next) {
                Some(Thing::Job(_)) => true,
                Some(thing) => {
                    keeper(times, thing, next).is_some_and(|block| is_first(times, &of_circle, block, own.step))
                }
                None => false,
            }
    })
}

/// Whether a block asks for what it claims before another one does, and nobody beyond the circle claims any of it.
fn is_first(times: &Times<'_>, circle: &[&Wait], block: StepId, other: StepId) -> bool {
    let (Some(first), Some(second)) = (times.timing.visit(block), times.timing.visit(other)) else { return false };
    let earlier = times.least(first.start, second.start, &[first.scope, second.scope]).is_some_and(|t| t > ROUNDING);
    let Step::Claim { claims, .. } = &times.plan.get(block).step else { return false };
    let steps = (0..times.plan.steps.len() as u32).map(StepId);
    let mut others = steps.filter(|step| match &times.plan.get(*step).step {
        Step::Claim { claims: theirs, .. } => {
            *step != block && theirs.iter().any(|i| claims.contains(i)) && times.beside(*step, block)
        }
        _ => false,
    });
    earlier && others.all(|step| circle.iter().any(|wait| wait.step == step))
}

/// So many calls around each wait of a circle are named.
const MOST_CALLS: usize = 2;

/// How one wait of a circle is told: what it waits for, and what it keeps from the one before it.
struct Told {
    /// The `claim` or `await`.
    step: StepId,
    /// What it waits for, in words.
    waits: String,
    /// The block that keeps what the one before it waits for, and its words; none for a job.
    holds: Option<(StepId, String)>,
}

/// How the waits of a circle are told, with what they wait for: the names of things, and the labels of `await`s.
fn told(
    times: &Times<'_>,
    circle: &[&Wait],
    name: &dyn Fn(InstanceId) -> String,
) -> (Vec<Told>, Vec<String>, Vec<String>) {
    let own = |step: StepId| times.plan.get(show::own(times.plan, &times.timing, step));
    let (mut waited, mut jobs) = (Vec::new(), Vec::new());
    let mut told: Vec<Told> = Vec::new();
    let mut keeps: Vec<Option<(StepId, String)>> = vec![None; circle.len()];
    for (i, wait) in circle.iter().enumerate() {
        let after = (i + 1) % circle.len();
        let waits = match waits_for(times, wait, circle[after]) {
            Some(Thing::Instance(instance)) => {
                let wanted = name(instance);
                let block = keeper(times, Thing::Instance(instance), circle[after]);
                keeps[after] = block.map(|block| (block, format!("holds `{wanted}`")));
                waited.push(format!("`{wanted}`"));
                format!("for `{wanted}`")
            }
            Some(Thing::Job(_)) => {
                jobs.push(format!("`{}`", own(wait.step).label));
                "for the job".to_owned()
            }
            None => continue,
        };
        told.push(Told { step: wait.step, waits, holds: None });
    }
    for (told, keeps) in told.iter_mut().zip(keeps) {
        told.holds = keeps;
    }
    (told, waited, jobs)
}

/// The places of a circle with their words, that of the first wait first. Where several lines of steps stand still at one place of a
/// skill, each is told at the call that it comes from.
fn places(times: &Times<'_>, all: &[Told]) -> Vec<(Span, String)> {
    let own = |step: StepId| times.plan.get(show::own(times.plan, &times.timing, step)).span;
    let calls = |told: &Told| -> Vec<&PlanStep> { show::calls(times.plan, &times.timing, told.step).collect() };
    let of: Vec<Vec<&PlanStep>> = all.iter().map(calls).collect();
    let alone = |i: usize| {
        let others = |span: Span| (0..all.len()).any(|j| j != i && of[j].iter().any(|call| call.span == span));
        of[i].iter().map(|call| call.span).find(|span| !others(*span))
    };
    let shared = all.iter().enumerate().any(|(i, a)| all[..i].iter().any(|b| own(a.step) == own(b.step)));
    let apart: Option<Vec<Span>> = (0..all.len()).map(alone).collect();
    let mut out: Vec<(Span, String)> = Vec::new();
    if let Some(apart) = apart.filter(|_| shared) {
        for (told, span) in all.iter().zip(apart) {
            let holds = told.holds.as_ref().map_or_else(String::new, |(_, holds)| format!("{holds} and "));
            out.push((span, format!("{holds}waits {}", told.waits)));
        }
        for told in all {
            let blocks = told.holds.iter().map(|(block, _)| (own(*block), "claimed from here on".to_owned()));
            out.extend(blocks.chain([(own(told.step), "waits here".to_owned())]));
        }
    } else {
        out.extend(all.iter().map(|told| (own(told.step), format!("waits here {}", told.waits))));
        out.extend(all.iter().filter_map(|told| told.holds.clone()).map(|(block, holds)| (own(block), holds)));
        for call in of.iter().flat_map(|calls| calls.iter().take(MOST_CALLS)) {
            if out.iter().all(|(span, _)| *span != call.span) {
                out.push((call.span, format!("in `{}`", call.label)));
            }
        }
    }
    let mut said = BTreeSet::new();
    out.retain(|place| said.insert(place.clone()));
    if let Some(rest) = out.get_mut(1..) {
        rest.sort_by_key(|(span, _)| *span);
    }
    out
}

fn finding(times: &Times<'_>, nested: &[Wait], circle: &[usize], name: &dyn Fn(InstanceId) -> String) -> Diagnostic {
    let waits: Vec<&Wait> = circle.iter().map(|at| &nested[*at]).collect();
    let (all, waited, jobs) = told(times, &waits, name);
    let mut places = places(times, &all).into_iter();
    let (span, text) = places.next().unwrap_or((times.plan.get(times.plan.root).span, String::new()));
    let sure = jobs.is_empty() || certain(times, nested, circle);
    let can = if jobs.is_empty() || !sure { " can" } else { "" };
    let things = waited.join(" and ");
    let all = match (jobs.is_empty(), waited.is_empty()) {
        (true, _) => format!("claims of {things}"),
        (false, true) => jobs.join(" and "),
        (false, false) => format!("{} and a claim of {things}", jobs.join(" and ")),
    };
    let headline = format!("{all}{can} wait for each other forever");
    let mut d = Diagnostic::error(codes::DEADLOCK, span, headline, text);
    if !sure {
        d.severity = Severity::Warning;
    }
    for (span, text) in places {
        d = d.because(span, text);
    }
    d.help(match jobs.is_empty() {
        true => "claim all of them in one `claim`, or in the same order everywhere",
        false => {
            "wait for the job outside of the `claim`, or start it inside the block, where it may use the claimed things"
        }
    })
}
