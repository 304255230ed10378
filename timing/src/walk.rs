//! A walk through the plan: when each step begins and ends, as points of a network.
//!
//! The network describes the run in which nothing fails: handlers are parts that may be done, the first alternative of a
//! `try` is the one that is done. A branch of an `if` is a scope of its own. A loop's body stands for its last turn.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::NodeId;
use matterix_ir::plan::{Operation, Plan, Step, StepId, Takes};
use matterix_ir::scene::InstanceId;

use crate::interval::Interval;
use crate::network::{BEGIN, Network, Point, Reason, Scope, WHOLE, Why};
use crate::value::{Known, Linear};

/// Which duration a step with a nominal one and bounds is taken to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durations {
    /// Anything within its bounds.
    Bounds,
    /// The nominal one.
    Nominal,
}

/// A line of steps that run one after the other: the plan itself, a branch of `parallel`, a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thread {
    /// The line it began in, and the place among the visits where it did; none for the plan itself.
    pub outer: Option<(u32, usize)>,
    /// The `parallel` or `start`.
    pub from: Option<StepId>,
    /// A job runs beside its outer line from the visit after its own steps until this one.
    pub job: Option<(usize, usize)>,
}

/// A step as met on the walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// The step around it.
    pub outer: Option<StepId>,
    /// When it begins.
    pub start: Point,
    /// When it ends.
    pub end: Point,
    /// How long it lasts, s.
    pub lasts: Interval,
    /// Where it holds.
    pub scope: Scope,
    /// Its line, by index in [`Timing::threads`].
    pub thread: u32,
    /// Its place in the order of the walk.
    pub order: usize,
    /// Whether it stands in a handler or a `finally`.
    pub aside: bool,
}

/// When the steps of a plan can happen.
#[derive(Clone, Debug)]
pub struct Timing {
    /// Points and what holds between them.
    pub network: Network,
    /// By step; none for what is never reached.
    pub visits: Vec<Option<Visit>>,
    /// Lines of steps.
    pub threads: Vec<Thread>,
    /// By scope: the outcome of a choice that it stands for, if it is one.
    outcomes: Vec<Option<Outcome>>,
    /// By loop: the place among the visits where a turn ends.
    turns: BTreeMap<StepId, usize>,
}

/// One outcome of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Outcome {
    choice: Choice,
    holds: bool,
}

/// What is chosen by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Choice {
    /// An `if`, each time anew.
    Step(StepId),
    /// A condition that comes out alike all through a run.
    Fixed(NodeId),
    /// What a constant decides: it is done, or never.
    Constant,
}

impl Known<'_> {
    /// How a condition comes out that nothing changes during a run.
    fn decided(&self, condition: NodeId, holds: bool) -> Option<Outcome> {
        if !self.is_fixed(condition) {
            return None;
        }
        if let Some(value) = self.number(condition).exact() {
            return Some(Outcome { choice: Choice::Constant, holds: (value != 0.0) == holds });
        }
        let (condition, holds) = self.without_not(condition, holds);
        Some(Outcome { choice: Choice::Fixed(condition), holds })
    }
}

impl Timing {
    /// Walks through a plan. A block with `claim` may have to wait wherever another one claims the same.
    pub fn of(plan: &Plan, known: &Known<'_>, durations: Durations) -> Timing {
        Timing::walk(plan, known, durations, None)
    }

    /// Walks through a plan in which only these blocks with `claim` may have to wait for what they claim.
    pub fn with_waits(plan: &Plan, known: &Known<'_>, durations: Durations, waits: &BTreeSet<StepId>) -> Timing {
        Timing::walk(plan, known, durations, Some(waits))
    }

    fn walk(plan: &Plan, known: &Known<'_>, durations: Durations, waits: Option<&BTreeSet<StepId>>) -> Timing {
        let mut walk = Walk {
            plan,
            known,
            durations,
            waits,
            network: Network::default(),
            visits: vec![None; plan.steps.len()],
            threads: vec![Thread { outer: None, from: None, job: None }],
            locals: vec![None; plan.locals.len()],
            jobs: vec![Vec::new()],
            awaited: Vec::new(),
            order: 0,
            claimed: claimed(plan),
            outcomes: Vec::new(),
            decided: BTreeMap::new(),
            turns: BTreeMap::new(),
        };
        let root = Place { at: BEGIN, scope: WHOLE, thread: 0, outer: None, aside: false };
        let end = walk.step(plan.root, root);
        walk.close(plan.root, end, root);
        walk.outcomes.resize(walk.network.scopes.len(), None);
        Timing {
            network: walk.network,
            visits: walk.visits,
            threads: walk.threads,
            outcomes: walk.outcomes,
            turns: walk.turns,
        }
    }

    /// One step's visit.
    pub fn visit(&self, step: StepId) -> Option<&Visit> {
        self.visits.get(step.0 as usize)?.as_ref()
    }

    /// The steps around one, innermost first, without itself.
    pub fn around(&self, step: StepId) -> impl Iterator<Item = StepId> {
        std::iter::successors(self.visit(step).and_then(|v| v.outer), |s| self.visit(*s).and_then(|v| v.outer))
    }

    /// Whether two steps may run at the same time, as far as the shape of the plan tells.
    pub fn beside(&self, a: &Visit, b: &Visit) -> bool {
        self.in_lines_beside(a, b) && !self.exclude_each_other(a, b)
    }

    /// Whether a loop around a step comes to its next turn while a job of this line may go on.
    pub fn outlasts_turn(&self, thread: u32, turns: StepId) -> bool {
        let until = self.threads.get(thread as usize).and_then(|t| t.job).map_or(0, |job| job.1);
        self.turns.get(&turns).is_some_and(|end| until > *end)
    }

    /// Whether two steps stand in different branches of one choice, of which a run takes one.
    fn exclude_each_other(&self, a: &Visit, b: &Visit) -> bool {
        self.parted(a, b).is_some_and(|jobs| jobs.iter().all(|(job, turns)| !self.outlasts_turn(*job, *turns)))
    }

    /// For steps in different branches of one choice: the jobs of either that go on when a loop makes that choice anew, each with the loop,
    /// unless they are over by then.
    pub fn parted(&self, a: &Visit, b: &Visit) -> Option<Vec<(u32, StepId)>> {
        if a.scope == b.scope {
            return None;
        }
        let outcome = |s: &Scope| self.outcomes.get(s.0 as usize).copied().flatten();
        let others: Vec<Outcome> = self.network.around(b.scope).iter().filter_map(outcome).collect();
        let own = self.network.around(a.scope).into_iter().filter_map(|s| outcome(&s));
        let choice = |own: Outcome| {
            others.iter().any(|other| own.choice == other.choice && own.holds != other.holds).then_some(own.choice)
        };
        match own.filter_map(choice).next_back()? {
            Choice::Step(step) => Some(self.beyond_turns(step, [a, b])),
            Choice::Fixed(_) | Choice::Constant => Some(Vec::new()),
        }
    }

    /// The jobs that a choice begins, on the way to these steps, each with the loops around the choice.
    fn beyond_turns(&self, choice: StepId, visits: [&Visit; 2]) -> Vec<(u32, StepId)> {
        let Some(thread) = self.visit(choice).map(|v| v.thread) else { return Vec::new() };
        let begun = |v: &Visit| {
            let line = self.line(v.thread).into_iter();
            line.skip_while(|t| *t != thread).skip(1).filter(|t| self.is_job(*t)).collect::<Vec<u32>>()
        };
        let inside = |s: &StepId| self.visit(*s).is_some_and(|v| v.thread == thread);
        let loops: Vec<StepId> =
            self.around(choice).take_while(inside).filter(|s| self.turns.contains_key(s)).collect();
        let jobs = visits.into_iter().flat_map(begun);
        jobs.flat_map(|job| loops.iter().map(move |turns| (job, *turns)).collect::<Vec<_>>()).collect()
    }

    fn is_job(&self, thread: u32) -> bool {
        self.threads.get(thread as usize).is_some_and(|t| t.job.is_some())
    }

    fn in_lines_beside(&self, a: &Visit, b: &Visit) -> bool {
        let (a_line, b_line) = (self.line(a.thread), self.line(b.thread));
        let common = a_line.iter().zip(&b_line).take_while(|(x, y)| x == y).count();
        let (a_line, b_line) = (&a_line[common..], &b_line[common..]);
        let thread = |t: &u32| self.threads.get(*t as usize);
        let branch = |line: &[u32]| line.first().and_then(thread).filter(|t| t.job.is_none()).map(|t| t.from);
        let live = |line: &[u32], order: usize| {
            line.iter().filter_map(thread).filter_map(|t| t.job).any(|(after, until)| (after..until).contains(&order))
        };
        let branches = branch(a_line).is_some() && branch(a_line) == branch(b_line);
        branches || live(a_line, b.order) || live(b_line, a.order)
    }

    /// The lines around a line, outermost first, itself last.
    fn line(&self, thread: u32) -> Vec<u32> {
        let outer = |t: &u32| self.threads.get(*t as usize).and_then(|t| t.outer).map(|o| o.0);
        let mut all: Vec<u32> = std::iter::successors(Some(thread), outer).collect();
        all.reverse();
        all
    }
}

/// Where the walk stands.
#[derive(Clone, Copy)]
struct Place {
    at: Point,
    scope: Scope,
    thread: u32,
    outer: Option<StepId>,
    aside: bool,
}

/// How a step ends.
#[derive(Clone, Copy)]
struct End {
    at: Point,
    lasts: Interval,
    /// Nothing comes after it: it fails.
    dead: bool,
}

/// A job that may still run.
struct Job {
    name: String,
    end: Point,
    lasts: Interval,
    thread: u32,
    scope: Scope,
}

struct Walk<'w, 'g> {
    plan: &'w Plan,
    known: &'w Known<'g>,
    durations: Durations,
    network: Network,
    visits: Vec<Option<Visit>>,
    threads: Vec<Thread>,
    /// With the scope in which each has its value.
    locals: Vec<Option<(Scope, Linear)>>,
    /// Running jobs by the blocks that wait for them, innermost last.
    jobs: Vec<Vec<Job>>,
    /// Jobs that lines waited for which are not those that began them: the job's line, and the one that waited.
    awaited: Vec<(u32, u32)>,
    order: usize,
    /// How many blocks claim each instance.
    claimed: BTreeMap<InstanceId, usize>,
    /// Blocks that may have to wait for what they claim; none where that was not looked into.
    waits: Option<&'w BTreeSet<StepId>>,
    /// By scope: the outcome it stands for.
    outcomes: Vec<Option<Outcome>>,
    /// Scopes of conditions that come out alike all through a run, by the scope around.
    decided: BTreeMap<(Scope, Outcome), Scope>,
    /// By loop: the place among the visits where a turn ends.
    turns: BTreeMap<StepId, usize>,
}

impl Walk<'_, '_> {
    fn step(&mut self, id: StepId, place: Place) -> End {
        self.order += 1;
        let order = self.order;
        let inner = Place { outer: Some(id), ..place };
        let end = self.begin(id, inner);
        let Place { at, scope, thread, outer, aside } = place;
        let visit = Visit { outer, start: at, end: end.at, lasts: end.lasts, scope, thread, order, aside };
        if let Some(slot) = self.visits.get_mut(id.0 as usize) {
            *slot = Some(visit);
        }
        end
    }

    fn begin(&mut self, id: StepId, place: Place) -> End {
        let plan = self.plan;
        let at = place.at;
        let now = End { at, lasts: Interval::ZERO, dead: false };
        match &plan.get(id).step {
            Step::Sequence(list) => self.sequence(list, place),
            Step::Parallel(list) => self.parallel(id, list, place),
            Step::Operation(operation) => {
                let lasts = self.operation(id, operation);
                self.lasting(id, place, lasts)
            }
            Step::Guarded { body, handlers, finally } => {
                let mut end = self.scoped(id, *body, place);
                let mut longest: Option<f64> = None;
                for (_, handler) in handlers {
                    let (scope, start) = (self.network.scope(place.scope), self.network.point());
                    self.network.least(at, start, 0.0, scope, Reason { step: id, why: Why::Order });
                    let handled = self.step(*handler, Place { at: start, scope, aside: true, ..place });
                    let lasts = if self.begins_again(*handler) { f64::INFINITY } else { handled.lasts.max };
                    longest = Some(longest.map_or(lasts, |l| l.max(lasts)));
                }
                if let Some(longest) = longest {
                    end = self.or_later(id, place, end, longest);
                }
                match finally {
                    Some(finally) => {
                        let last = self.step(*finally, Place { at: end.at, aside: true, ..place });
                        End { at: last.at, lasts: end.lasts + last.lasts, dead: end.dead }
                    }
                    None => end,
                }
            }
            Step::Try(list) => {
                let mut end = now;
                let mut longest = 0.0;
                for (index, alternative) in list.iter().enumerate() {
                    if index == 0 {
                        end = self.scoped(id, *alternative, place);
                        continue;
                    }
                    let scope = self.network.scope(place.scope);
                    longest += self.scoped(id, *alternative, Place { scope, ..place }).lasts.max;
                }
                if list.len() > 1 {
                    end = self.or_later(id, place, end, longest);
                }
                end
            }
            Step::Skill { takes, body, .. } => {
                let end = self.scoped(id, *body, place);
                match takes.and_then(|t| self.bounds(t)) {
                    Some(bounds) => self.promised(id, place, end, bounds),
                    None => end,
                }
            }
            Step::Keep { body, .. } | Step::During { body, .. } => self.scoped(id, *body, place),
            Step::Named { start, end, body, .. } => {
                self.set(*start, place.scope, Linear::at(at));
                let last = self.step(*body, place);
                self.set(*end, place.scope, Linear::at(last.at));
                last
            }
            Step::Let { local, value } => {
                let value = self.linear(*value, place.scope).taken_at(at);
                self.set(*local, place.scope, value);
                now
            }
            Step::Wait { duration } => {
                let lasts = self.duration(*duration, place.scope);
                self.lasting(id, place, lasts)
            }
            Step::WaitUntil { condition, timeout } => self.wait_until(id, condition.node, *timeout, place),
            Step::Hold { duration, timeout, .. } => {
                let min = self.duration(*duration, place.scope).min;
                let end = self.lasting(id, place, Interval { min, max: f64::INFINITY });
                self.timeout(id, *timeout, place, end)
            }
            Step::Within { limit, since, body } => {
                let limit = self.duration(*limit, place.scope).max;
                let since = self.linear(*since, place.scope);
                if let Some((point, offset)) = after_point(&since) {
                    let reason = Reason { step: id, why: Why::Window(limit) };
                    self.network.most(point, at, offset.max + limit, place.scope, reason);
                }
                self.step(*body, place)
            }
            Step::If { condition, then, otherwise } => self.branches(id, condition.node, *then, *otherwise, place),
            Step::Repeat { times, body } => {
                let times = self.linear(*times, place.scope).bounds().unwrap_or(Interval::ANY);
                self.turns(id, times.as_duration(), *body, place)
            }
            Step::RepeatWhile { max, body, .. } => {
                let max = self.linear(*max, place.scope).bounds().unwrap_or(Interval::ANY).max;
                self.turns(id, Interval { min: 0.0, max }, *body, place)
            }
            Step::Claim { claims, body } => {
                let alone = place.thread == 0 && self.jobs.iter().all(Vec::is_empty);
                let contended = || !alone && claims.iter().any(|i| self.claimed.get(i) != Some(&1));
                if !self.waits.map_or_else(contended, |waits| waits.contains(&id)) {
                    return self.scoped(id, *body, place);
                }
                let granted = self.network.point();
                self.network.least(at, granted, 0.0, place.scope, Reason { step: id, why: Why::Order });
                let end = self.scoped(id, *body, Place { at: granted, ..place });
                End { lasts: Interval { max: f64::INFINITY, ..end.lasts }, ..end }
            }
            Step::Start { job, body } => {
                let thread = self.threads.len() as u32;
                let began = self.order;
                self.threads.push(Thread { outer: Some((place.thread, began)), from: Some(id), job: None });
                let end = self.step(*body, Place { thread, ..place });
                self.order += 1;
                if let Some(line) = self.threads.get_mut(thread as usize) {
                    line.job = Some((self.order, usize::MAX));
                }
                let job = Job { name: job.clone(), end: end.at, lasts: end.lasts, thread, scope: place.scope };
                if let Some(block) = self.jobs.last_mut() {
                    block.push(job);
                }
                now
            }
            Step::Await { job } => self.wait_for_job(id, job, place),
            Step::Fail { .. } | Step::Retry { .. } => End { dead: true, ..now },
            _ => now,
        }
    }

    /// The end of a body of which a failure leads to steps that last so long, s, at most: that of the body, or later.
    fn or_later(&mut self, id: StepId, place: Place, body: End, longest: f64) -> End {
        let lasts = Interval { max: body.lasts.max + longest, ..body.lasts };
        let order = Reason { step: id, why: Why::Order };
        let at = self.network.point();
        self.network.least(body.at, at, 0.0, place.scope, order);
        self.network.most(place.at, at, lasts.max, place.scope, order);
        End { at, lasts, dead: false }
    }

    /// Whether a handler may have its body begin again.
    fn begins_again(&self, handler: StepId) -> bool {
        let step = &self.plan.get(handler).step;
        matches!(step, Step::Retry { .. }) || step.children().into_iter().any(|child| self.begins_again(child))
    }

    fn sequence(&mut self, list: &[StepId], place: Place) -> End {
        let mut end = End { at: place.at, lasts: Interval::ZERO, dead: false };
        for step in list {
            let next = self.step(*step, Place { at: end.at, ..place });
            end = End { at: next.at, lasts: end.lasts + next.lasts, dead: end.dead || next.dead };
        }
        end
    }

    fn parallel(&mut self, id: StepId, list: &[StepId], place: Place) -> End {
        let began = self.order;
        let mut ends = Vec::new();
        let mut branches = Vec::new();
        for step in list {
            let thread = self.threads.len() as u32;
            self.threads.push(Thread { outer: Some((place.thread, began)), from: Some(id), job: None });
            branches.push(thread);
            ends.push(self.step(*step, Place { thread, ..place }));
        }
        if !self.awaited.is_empty() {
            self.meet(&branches, place.thread);
        }
        let lasts = ends.iter().fold(Interval::ZERO, |all, e| all.later(e.lasts));
        let dead = ends.iter().any(|e| e.dead);
        let late: Vec<Point> = ends.iter().map(|e| e.at).filter(|p| *p != place.at).collect();
        let end = self.join(id, place, &late, lasts.max);
        End { at: end, lasts, dead }
    }

    /// The point at which all of `ends` have come, at most `longest` s after the place.
    fn join(&mut self, id: StepId, place: Place, ends: &[Point], longest: f64) -> Point {
        match ends {
            [] => place.at,
            [one] => *one,
            many => {
                let end = self.network.point();
                let order = Reason { step: id, why: Why::Order };
                many.iter().for_each(|p| self.network.least(*p, end, 0.0, place.scope, order));
                self.network.most(place.at, end, longest, place.scope, order);
                end
            }
        }
    }

    /// A body that waits for the jobs started in it.
    fn scoped(&mut self, id: StepId, body: StepId, place: Place) -> End {
        self.jobs.push(Vec::new());
        let end = self.step(body, place);
        self.close(id, end, place)
    }

    fn close(&mut self, id: StepId, end: End, place: Place) -> End {
        self.order += 1;
        let mut ends = Vec::new();
        let mut lasts = end.lasts;
        for job in self.jobs.pop().unwrap_or_default() {
            self.joined(job.thread);
            ends.push((job.end, job.scope));
            // It began somewhere in the body.
            lasts.max += job.lasts.max;
        }
        ends.retain(|(p, _)| *p != end.at);
        if ends.is_empty() {
            return End { lasts, ..end };
        }
        ends.push((end.at, place.scope));
        let at = self.join_in(id, place, &ends, lasts.max);
        End { at, lasts, dead: end.dead }
    }

    /// Nothing runs beside a line from here on.
    fn joined(&mut self, thread: u32) {
        let order = self.order;
        if let Some((_, until)) = self.threads.get_mut(thread as usize).and_then(|t| t.job.as_mut()) {
            *until = (*until).min(order);
        }
    }

    /// The same where another line waits for it: it goes on beside the lines next to that one, until their branches meet.
    fn joined_in(&mut self, job: u32, line: u32) {
        let outer = |thread: u32| self.threads.get(thread as usize).and_then(|t| t.outer).map(|outer| outer.0);
        if outer(job) == Some(line) {
            self.joined(job);
        } else {
            self.awaited.push((job, line));
        }
    }

    /// Branches meet: what one of them has waited for is over.
    fn meet(&mut self, branches: &[u32], line: u32) {
        let (met, other): (Vec<_>, Vec<_>) = self.awaited.drain(..).partition(|(_, at)| branches.contains(at));
        self.awaited = other;
        if !met.is_empty() {
            self.order += 1;
        }
        met.into_iter().for_each(|(job, _)| self.joined_in(job, line));
    }

    /// Waits for the job of this name in the innermost block that has one: after it, none of them goes on.
    fn wait_for_job(&mut self, id: StepId, name: &str, place: Place) -> End {
        let block = self.jobs.iter().rev().find(|block| block.iter().any(|j| j.name == name));
        let jobs: Vec<(Point, Interval, u32, Scope)> = block
            .into_iter()
            .flatten()
            .filter(|j| j.name == name)
            .map(|j| (j.end, j.lasts, j.thread, j.scope))
            .collect();
        let mut ends = vec![(place.at, place.scope)];
        let mut longest: f64 = 0.0;
        for (end, lasts, thread, scope) in &jobs {
            // Where the job has begun, it is waited for.
            if self.network.holds_in(place.scope, *scope) {
                self.joined_in(*thread, place.thread);
                ends.push((*end, *scope));
            } else if self.network.holds_in(*scope, place.scope) {
                ends.push((*end, place.scope));
            }
            longest = longest.max(lasts.max);
        }
        if ends.len() == 1 {
            return End { at: place.at, lasts: Interval::SOME_TIME, dead: false };
        }
        let at = self.join_in(id, place, &ends, longest);
        End { at, lasts: Interval { min: 0.0, max: longest }, dead: false }
    }

    /// The point at which all of `ends` have come that hold, each in its scope, at most `longest` s after the place.
    fn join_in(&mut self, id: StepId, place: Place, ends: &[(Point, Scope)], longest: f64) -> Point {
        let end = self.network.point();
        let order = Reason { step: id, why: Why::Order };
        ends.iter().for_each(|(p, scope)| self.network.least(*p, end, 0.0, *scope, order));
        self.network.most(place.at, end, longest, place.scope, order);
        end
    }

    fn branches(
        &mut self,
        id: StepId,
        condition: NodeId,
        then: StepId,
        otherwise: Option<StepId>,
        place: Place,
    ) -> End {
        let mut lasts: Option<Interval> = None;
        let mut ends = Vec::new();
        let branches = [(true, Some(then)), (false, otherwise)];
        for (holds, branch) in branches.into_iter().filter_map(|(holds, branch)| Some((holds, branch?))) {
            let scope = self.outcome(id, condition, holds, place.scope);
            let end = self.step(branch, Place { scope, ..place });
            if !end.dead {
                ends.push((scope, end.at));
                lasts = Some(lasts.map_or(end.lasts, |l| l.either(end.lasts)));
            }
        }
        if otherwise.is_none() {
            lasts = Some(lasts.map_or(Interval::ZERO, |l| l.either(Interval::ZERO)));
        }
        let Some(lasts) = lasts else { return End { at: place.at, lasts: Interval::ZERO, dead: true } };
        let end = self.lasting(id, place, lasts);
        self.reaches(id, &ends, end.at);
        end
    }

    /// The scope of a branch; one for all branches that a condition which cannot change decides alike.
    fn outcome(&mut self, id: StepId, condition: NodeId, holds: bool, outer: Scope) -> Scope {
        let outcome = self.known.decided(condition, holds).unwrap_or(Outcome { choice: Choice::Step(id), holds });
        if let Some(scope) = self.decided.get(&(outer, outcome)) {
            return *scope;
        }
        let scope = self.network.scope(outer);
        self.outcomes.resize(scope.0 as usize, None);
        self.outcomes.push(Some(outcome));
        if !matches!(outcome.choice, Choice::Step(_)) {
            self.decided.insert((outer, outcome), scope);
        }
        scope
    }

    /// In its own scope, each branch ends when the whole does.
    fn reaches(&mut self, id: StepId, ends: &[(Scope, Point)], whole: Point) {
        let order = Reason { step: id, why: Why::Order };
        for (scope, end) in ends {
            self.network.least(*end, whole, 0.0, *scope, order);
            self.network.most(*end, whole, 0.0, *scope, order);
        }
    }

    /// A loop: its body stands for the last turn.
    fn turns(&mut self, id: StepId, times: Interval, body: StepId, place: Place) -> End {
        let sure = times.min >= 1.0;
        let scope = if sure { place.scope } else { self.network.scope(place.scope) };
        let only = times.exact() == Some(1.0);
        let start = if only { place.at } else { self.network.point() };
        let turn = self.step(body, Place { at: start, scope, ..place });
        self.turns.insert(id, self.order);
        let before = |n: f64, one: f64| if n <= 1.0 { 0.0 } else { (n - 1.0) * one };
        let reason =
            |t: f64, least: bool| Reason { step: id, why: if least { Why::AtLeast(t) } else { Why::AtMost(t) } };
        if !only {
            let (first, last) = (before(times.min, turn.lasts.min), before(times.max, turn.lasts.max));
            self.network.least(place.at, start, first, scope, reason(first, true));
            self.network.most(place.at, start, last, scope, reason(last, false));
        }
        let lasts = Interval { min: times.min * turn.lasts.min, max: before(times.max + 1.0, turn.lasts.max) };
        if sure {
            return End { at: turn.at, lasts, dead: turn.dead };
        }
        let end = self.lasting(id, place, lasts);
        self.reaches(id, &[(scope, turn.at)], end.at);
        end
    }

    fn wait_until(&mut self, id: StepId, condition: NodeId, timeout: Option<NodeId>, place: Place) -> End {
        let locals = self.visible(place.scope);
        let waits = self.known.not_before(condition, &locals);
        let end = self.network.point();
        let order = Reason { step: id, why: Why::Order };
        self.network.least(place.at, end, 0.0, place.scope, order);
        let mut min: f64 = 0.0;
        for wait in waits {
            // time + points + number >= 0
            let past = Linear { now: 0.0, ..wait };
            let Some((point, number)) = negated(&past) else { continue };
            let reason = Reason { step: id, why: Why::NotBefore(number.min) };
            self.network.least(point, end, number.min, place.scope, reason);
            if point == place.at {
                min = min.max(number.min);
            }
        }
        let end = End { at: end, lasts: Interval { min, max: f64::INFINITY }, dead: false };
        self.timeout(id, timeout, place, end)
    }

    fn timeout(&mut self, id: StepId, timeout: Option<NodeId>, place: Place, mut end: End) -> End {
        if let Some(timeout) = timeout {
            let longest = self.duration(timeout, place.scope).max;
            self.network.most(place.at, end.at, longest, place.scope, Reason { step: id, why: Why::Timeout(longest) });
            end.lasts.max = end.lasts.max.min(longest).max(end.lasts.min);
        }
        end
    }

    fn promised(&mut self, id: StepId, place: Place, end: End, bounds: Interval) -> End {
        let reason = |t| Reason { step: id, why: Why::Promised(t) };
        self.network.most(place.at, end.at, bounds.max, place.scope, reason(bounds.max));
        let lasts = Interval { min: end.lasts.min, max: end.lasts.max.min(bounds.max).max(end.lasts.min) };
        End { lasts, ..end }
    }

    /// A step that lasts, between two points; the same point where it takes no time.
    fn lasting(&mut self, id: StepId, place: Place, lasts: Interval) -> End {
        if lasts == Interval::ZERO {
            return End { at: place.at, lasts, dead: false };
        }
        let end = self.network.point();
        let reason = |why| Reason { step: id, why };
        self.network.least(place.at, end, lasts.min, place.scope, reason(Why::AtLeast(lasts.min)));
        self.network.most(place.at, end, lasts.max, place.scope, reason(Why::AtMost(lasts.max)));
        End { at: end, lasts, dead: false }
    }

    fn operation(&self, id: StepId, operation: &Operation) -> Interval {
        match (&operation.takes, &operation.until) {
            (takes, Some(_)) => takes.and_then(|takes| self.bounds(takes)).unwrap_or_else(|| {
                let max = self.known.counted(operation).unwrap_or(f64::INFINITY);
                Interval { max, ..Interval::SOME_TIME }
            }),
            (Some(takes), None) => {
                let bounds = if self.durations == Durations::Bounds { self.bounds(*takes) } else { None };
                let nominal = || {
                    let known = self.known.lasting.get(&id).copied();
                    known.unwrap_or_else(|| self.known.number(takes.nominal)).as_duration()
                };
                bounds.unwrap_or_else(nominal)
            }
            (None, None) => Interval::ZERO,
        }
    }

    /// Declared bounds of a duration, s; none where they contradict themselves, which is another finding.
    fn bounds(&self, takes: Takes) -> Option<Interval> {
        self.known.bounds(takes)
    }

    fn duration(&self, node: NodeId, scope: Scope) -> Interval {
        self.linear(node, scope).bounds().unwrap_or(Interval::ANY).as_duration()
    }

    fn linear(&self, node: NodeId, scope: Scope) -> Linear {
        let locals = if self.known.names_locals(node) { self.visible(scope) } else { Vec::new() };
        self.known.linear(node, &locals)
    }

    /// The locals that have a value wherever `scope` is done.
    fn visible(&self, scope: Scope) -> Vec<Option<Linear>> {
        let seen = |local: &Option<(Scope, Linear)>| {
            local.as_ref().filter(|(s, _)| self.network.holds_in(*s, scope)).map(|(_, value)| value.clone())
        };
        self.locals.iter().map(seen).collect()
    }

    fn set(&mut self, local: u32, scope: Scope, value: Linear) {
        if let Some(slot) = self.locals.get_mut(local as usize) {
            *slot = Some((scope, value));
        }
    }
}

fn claimed(plan: &Plan) -> BTreeMap<InstanceId, usize> {
    let mut counts = BTreeMap::new();
    for step in &plan.steps {
        if let Step::Claim { claims, .. } = &step.step {
            claims.iter().for_each(|i| *counts.entry(*i).or_default() += 1);
        }
    }
    counts
}

/// A sum that is one point and a number; a number alone counts from the beginning.
pub fn after_point(sum: &Linear) -> Option<(Point, Interval)> {
    if sum.now != 0.0 {
        return None;
    }
    let mut points = sum.points.iter();
    match (points.next(), points.next()) {
        (None, _) => Some((BEGIN, sum.number)),
        (Some((point, factor)), None) if *factor == 1.0 => Some((*point, sum.number)),
        _ => None,
    }
}

/// What `now` must be at least for `now + sum` to be 0: the sum with its sign turned, as a point and a number.
fn negated(sum: &Linear) -> Option<(Point, Interval)> {
    let turned = Linear {
        now: 0.0,
        points: sum.points.iter().map(|(p, f)| (*p, -f)).collect(),
        number: sum.number.scaled(-1.0),
    };
    after_point(&turned)
}
