//! S1, D3, R1, R2: what no order and no patience mends. All of it is about the run in which nothing fails.

mod again;
mod components;
mod deadlock;
mod handled;
mod held;
mod show;
mod takes;
mod twice;
mod windows;

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Caught, Plan, Step, StepId};
use matterix_ir::{Diagnostic, Span, codes};
use matterix_timing::network::WHOLE;
use matterix_timing::walk::Durations;
use matterix_timing::{Interval, Known, Point, ROUNDING, Scope, Timing, Visit};

use super::Subject;

/// Least times that are kept at most (eight bytes each); when they are full, what is asked for again is searched again.
const MOST_KEPT: usize = 8_000_000;

/// Differences that all searches look at, at most; a plan that needs more is told that its times were not all compared.
const MOST_WORK: usize = 2_000_000_000;

/// Rounds in which single blocks are found to wait; after them, all wait that others contend with.
const MOST_ROUNDS: usize = 6;

/// What following the plan tells about its times.
#[derive(Clone, Copy)]
pub struct Told<'t> {
    /// How long steps last, s, where that follows from states.
    pub lasting: &'t BTreeMap<StepId, (f64, f64)>,
    /// Statements that are known to use one thing at the same time, by their places in the text.
    pub met: &'t [[Span; 2]],
    /// Steps that no run comes to.
    pub never: &'t BTreeSet<StepId>,
}

impl Default for Told<'_> {
    fn default() -> Self {
        Told { lasting: const { &BTreeMap::new() }, met: &[], never: const { &BTreeSet::new() } }
    }
}

/// Reports contradictions in the times of a plan and in the use of instances.
pub fn plan(subject: Subject<'_, '_>, told: Told<'_>) -> Vec<Diagnostic> {
    let Subject { lab, plan, derivatives, events, .. } = subject;
    let Told { lasting, met, never } = told;
    let params: Vec<f64> = lab.params.iter().map(|p| p.value).collect();
    let mut known = Known::new(&lab.graph, params, &lab.states, derivatives, events, plan);
    known.lasting = lasting.iter().map(|(id, (min, max))| (*id, Interval { min: *min, max: *max })).collect();
    let (late, times) = timed(plan, &known);
    let mut found = takes::findings(plan, &known, &times.timing);
    let told = |d: &Diagnostic| found.iter().any(|f: &Diagnostic| f.code == d.code && f.span() == d.span());
    let late: Vec<Diagnostic> = late.into_iter().filter(|d| !told(d)).collect();
    found.extend(late);
    let name = |i: matterix_ir::scene::InstanceId| {
        lab.instances.get(i.0 as usize).map_or_else(String::new, |i| i.name.clone())
    };
    found.extend(twice::findings(&times, met, never, &name));
    found.extend(again::findings(&times, &known));
    found.extend(deadlock::findings(&times, &name));
    if times.work.get() > MOST_WORK {
        let text = "the workflow has too many steps";
        found.push(spent(plan.get(plan.root).span, "`check` did not compare all times of this workflow", text));
    }
    found
}

/// The times of a plan, and what contradicts itself in them. A `claim` waits for what others use or claim: where that may be, it has no
/// time of its own.
///
/// At first no block waits. Then those wait that may meet another use, and so on until no further one does: up to the moment at which
/// a block would be the first to wait, a run keeps to times without that wait, in which the two never meet.
fn timed<'p>(plan: &'p Plan, known: &Known<'_>) -> (Vec<Diagnostic>, Times<'p>) {
    let mut waits: BTreeSet<StepId> = BTreeSet::new();
    let mut round = 0;
    loop {
        round += 1;
        let mut timing = Timing::with_waits(plan, known, Durations::Bounds, &waits);
        // What is contradicted says nothing about who meets whom.
        let (late, network) = windows::findings(plan, &timing);
        timing.network = network;
        let times = Times::new(plan, timing);
        let before = waits.len();
        waits.extend(held::waiting(&times));
        if round >= MOST_ROUNDS {
            waits.extend(held::contended(&times));
        }
        if waits.len() == before {
            return (late, times);
        }
    }
}

/// The finding that a limit of an analysis was reached.
fn spent(place: Span, headline: &str, text: &str) -> Diagnostic {
    Diagnostic::warning(codes::NOT_ANALYSED, place, headline, text)
        .help("split the workflow, or put steps that must not overlap into `claim`")
}

/// Least times from a point to all others, s, with what holds in some scopes.
type Searched = BTreeMap<(Point, Vec<Scope>), Vec<f64>>;

/// The plan with its times, and answers about pairs of steps.
pub struct Times<'p> {
    plan: &'p Plan,
    timing: Timing,
    searched: RefCell<Searched>,
    /// Differences looked at so far.
    work: Cell<usize>,
}

impl<'p> Times<'p> {
    /// Walks through a plan; what its times contradict is left out.
    pub fn of(subject: Subject<'p, '_>) -> Self {
        let Subject { lab, plan, derivatives, events, .. } = subject;
        let params: Vec<f64> = lab.params.iter().map(|p| p.value).collect();
        let known = Known::new(&lab.graph, params, &lab.states, derivatives, events, plan);
        timed(plan, &known).1
    }

    fn new(plan: &'p Plan, timing: Timing) -> Self {
        Times { plan, timing, searched: RefCell::default(), work: Cell::new(0) }
    }

    /// The least time between two points, s; none where it is not known.
    fn least(&self, from: Point, to: Point, scopes: &[Scope]) -> Option<f64> {
        if from == to {
            return Some(0.0);
        }
        let key = (from, scopes.to_vec());
        let mut searched = self.searched.borrow_mut();
        if !searched.contains_key(&key) {
            if self.work.get() > MOST_WORK {
                return None;
            }
            let network = &self.timing.network;
            self.work.set(self.work.get() + network.edges.len());
            if (searched.len() + 1) * network.points as usize > MOST_KEPT {
                searched.clear();
            }
            searched.insert(key.clone(), network.least_from(from, scopes).unwrap_or_default());
        }
        let least = searched.get(&key)?.get(to.0 as usize).copied()?;
        least.is_finite().then_some(least)
    }

    /// Whether the plan lets two steps run at the same time, as far as its shape tells.
    pub fn beside(&self, a: StepId, b: StepId) -> bool {
        match (self.timing.visit(a), self.timing.visit(b)) {
            (Some(a), Some(b)) => self.timing.beside(a, b) && !self.excluded(a, b),
            _ => false,
        }
    }

    /// Whether steps stand in different branches of a choice, and the jobs begun there are over before it is made anew.
    fn excluded(&self, a: &Visit, b: &Visit) -> bool {
        let over = |(job, turns): &(u32, StepId)| {
            let (Some(begun), Step::Repeat { body, .. } | Step::RepeatWhile { body, .. }) =
                (self.timing.threads.get(*job as usize).and_then(|t| t.from), &self.plan.get(*turns).step)
            else {
                return false;
            };
            let Step::Start { body: job, .. } = &self.plan.get(begun).step else { return false };
            let (Some(job), Some(turn)) = (self.timing.visit(*job), self.timing.visit(*body)) else { return false };
            self.least(job.end, turn.end, &[job.scope]).is_some_and(|t| t > -ROUNDING)
        };
        self.timing.parted(a, b).is_some_and(|jobs| jobs.iter().all(over))
    }

    /// Whether one step is over before the other begins in every run, whichever comes first. Where the search was cut short they
    /// count as apart: that is told of by itself.
    fn apart(&self, a: StepId, b: StepId) -> bool {
        self.work.get() > MOST_WORK || self.before(a, b) || self.before(b, a)
    }

    /// Whether a step is over before another one begins in every run.
    pub fn before(&self, first: StepId, second: StepId) -> bool {
        let (first, second) = (self.all_turns(first, second), self.all_turns(second, first));
        let (Some(a), Some(b)) = (self.timing.visit(first), self.timing.visit(second)) else { return false };
        // Two actions without duration meet where nothing keeps them apart; others may follow each other closely.
        let at_once = a.lasts.max <= 0.0 && b.lasts.max <= 0.0;
        let gap = if at_once { ROUNDING } else { -ROUNDING };
        self.least(a.end, b.start, &[a.scope, b.scope]).is_some_and(|t| t > gap)
    }

    /// Whether every run comes to a step, and ends if that fails with `failure`.
    fn must_fail(&self, step: StepId, failure: &str) -> bool {
        let whole = self.timing.visit(step).is_some_and(|v| v.scope == WHOLE);
        whole && !handled::handled(self.plan, &self.timing, step, failure)
    }

    /// Whether the steps run at the same time in every run that comes to both.
    fn together(&self, a: StepId, b: StepId) -> bool {
        let (Some(a), Some(b)) = (self.timing.visit(a), self.timing.visit(b)) else { return false };
        let scopes = [a.scope, b.scope];
        let at_least = |from: Point, to: Point, lasts: f64| {
            let least = self.least(from, to, &scopes);
            least.is_some_and(|t| if lasts > 0.0 { t > ROUNDING } else { t >= -ROUNDING })
        };
        at_least(a.start, b.end, b.lasts.min) && at_least(b.start, a.end, a.lasts.min)
    }

    /// The outermost loop around a step that is not around the other, else the step itself: what is known of times in
    /// a loop is known of its last turn.
    fn all_turns(&self, step: StepId, other: StepId) -> StepId {
        let outer: Vec<StepId> = self.timing.around(other).collect();
        let is_loop = |s: &StepId| matches!(self.plan.get(*s).step, Step::Repeat { .. } | Step::RepeatWhile { .. });
        self.timing.around(step).take_while(|s| !outer.contains(s)).filter(is_loop).last().unwrap_or(step)
    }
}

/// Whether a handler of a step, or around it, names a failure: whoever wrote it expects it.
fn expected(plan: &Plan, timing: &Timing, step: StepId, failure: &str) -> bool {
    std::iter::once(step).chain(timing.around(step)).any(|around| match &plan.get(around).step {
        Step::Guarded { handlers, .. } => {
            handlers.iter().any(|(caught, _)| matches!(caught, Caught::Named(name) if name == failure))
        }
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::Told;
    use crate::check::tests::found;

    const BENCH: &str = "
capability Worker {
    state done: Ratio = 0
    command work(t: Duration)
        takes t
        effect done = done + 1
}
asset W: Worker {}
lab bench {
    ambient: 25 degC
    a = W
    b = W
}
";

    fn timed(steps: &str) -> Vec<String> {
        let text = format!("{BENCH}workflow w in bench {{\n{steps}\n}}\n");
        found(&text, |bench| super::plan(bench.subject(), Told::default()))
    }

    #[test]
    fn one_after_the_other_is_no_clash() {
        assert_eq!(timed("work 5 s by a\nwork 5 s by a"), [""; 0]);
    }

    #[test]
    fn one_thing_used_twice_at_a_time_is_found() {
        let found = "claimed-twice: `work 5 s by a` and `work 5 s by a` use `a` at the same time";
        assert_eq!(timed("parallel { sequence { work 5 s by a } sequence { wait 1 s; work 5 s by a } }"), [found]);
    }

    #[test]
    fn claims_that_cross_are_found() {
        let cross = "parallel {
            claim a { wait 1 s; claim b { work 1 s by b } }
            claim b { wait 1 s; claim a { work 1 s by a } }
        }";
        assert_eq!(timed(cross), ["deadlock: claims of `b` and `a` can wait for each other forever"]);
    }
}
