//! A walk through the plan: when each step begins and ends, as points of a network.
//!
//! The network describes the run in which nothing fails: handlers are parts that may be done, the first alternative of a
//! `try` is the one that is done. A branch of an `if` is a scope of its own. A loop's body stands for its last turn.

use std::collections::BTreeMap;

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
}

impl Timing {
    /// Walks through a plan.
    pub fn of(plan: &Plan, known: &Known<'_>, durations: Durations) -> Timing {
        let mut walk = Walk {
            plan,
            known,
            durations,
            network: Network::default(),
            visits: vec![None; plan.steps.len()],
            threads: vec![Thread { outer: None, from: None, job: None }],
            locals: vec![None; plan.locals.len()],
            jobs: vec![Vec::new()],
            order: 0,
            claimed: claimed(plan),
        };
        let root = Place { at: BEGIN, scope: WHOLE, thread: 0, outer: None, aside: false };
        let end = walk.step(plan.root, root);
        walk.close(plan.root, end, root);
        Timing { network: walk.network, visits: walk.visits, threads: walk.threads }
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
        let (a_line, b_line) = (self.line(a.thread), self.line(b.thread));
        let common = a_line.iter().zip(&b_line).take_while(|(x, y)| x == y).count();
        let (first, second) = (a_line.get(common), b_line.get(common));
        let thread = |t: Option<&u32>| t.and_then(|t| self.threads.get(*t as usize));
        let live = |job: Option<&Thread>, order: usize| {
            job.and_then(|t| t.job).is_some_and(|(after, until)| (after..until).contains(&order))
        };
        match (thread(first), thread(second)) {
            (Some(x), Some(y)) if x.job.is_none() && y.job.is_none() => x.from == y.from,
            (Some(x), Some(y)) => live(Some(x), b.order) || live(Some(y), a.order),
            (Some(x), None) => live(Some(x), b.order),
            (None, Some(y)) => live(Some(y), a.order),
            (None, None) => false,
        }
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
    order: usize,
    /// How many blocks claim each instance.
    claimed: BTreeMap<InstanceId, usize>,
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
                let lasts = self.operation(operation);
                self.lasting(id, place, lasts)
            }
            Step::Guarded { body, handlers, finally } => {
                let handled = !handlers.is_empty();
                let mut end = self.scoped(id, *body, place);
                for (_, handler) in handlers {
                    let (scope, start) = (self.network.scope(place.scope), self.network.point());
                    self.network.least(at, start, 0.0, scope, Reason { step: id, why: Why::Order });
                    self.step(*handler, Place { at: start, scope, aside: true, ..place });
                }
                if handled {
                    end.lasts.max = f64::INFINITY;
                    end.dead = false;
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
                for (index, alternative) in list.iter().enumerate() {
                    if index == 0 {
                        end = self.scoped(id, *alternative, place);
                        continue;
                    }
                    let scope = self.network.scope(place.scope);
                    self.scoped(id, *alternative, Place { scope, ..place });
                }
                if list.len() > 1 {
                    end.lasts.max = f64::INFINITY;
                    end.dead = false;
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
            Step::Keep { body, .. } => self.scoped(id, *body, place),
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
            Step::If { then, otherwise, .. } => self.branches(id, *then, *otherwise, place),
            Step::Repeat { times, body } => {
                let times = self.linear(*times, place.scope).bounds().unwrap_or(Interval::ANY);
                self.turns(id, times.as_duration(), *body, place)
            }
            Step::RepeatWhile { max, body, .. } => {
                let max = self.linear(*max, place.scope).bounds().unwrap_or(Interval::ANY).max;
                self.turns(id, Interval { min: 0.0, max }, *body, place)
            }
            Step::Claim { claims, body } => {
                // Whether others have what it claims is not followed: it may wait where others claim the same.
                let alone = place.thread == 0 && self.jobs.iter().all(Vec::is_empty);
                if alone || claims.iter().all(|i| self.claimed.get(i) == Some(&1)) {
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
        for step in list {
            let thread = self.threads.len() as u32;
            self.threads.push(Thread { outer: Some((place.thread, began)), from: Some(id), job: None });
            ends.push(self.step(*step, Place { thread, ..place }));
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
            if !self.network.holds_in(job.scope, place.scope) {
                continue;
            }
            ends.push(job.end);
            // It began somewhere in the body.
            lasts.max += job.lasts.max;
        }
        ends.retain(|p| *p != end.at);
        let at = if ends.is_empty() {
            end.at
        } else {
            ends.push(end.at);
            self.join(id, place, &ends, lasts.max)
        };
        End { at, lasts, dead: end.dead }
    }

    /// Nothing runs beside a line from here on.
    fn joined(&mut self, thread: u32) {
        let order = self.order;
        if let Some((_, until)) = self.threads.get_mut(thread as usize).and_then(|t| t.job.as_mut()) {
            *until = (*until).min(order);
        }
    }

    fn wait_for_job(&mut self, id: StepId, name: &str, place: Place) -> End {
        let job = self.jobs.iter().rev().flatten().rev().find(|j| j.name == name);
        let Some((end, longest, thread, scope)) = job.map(|j| (j.end, j.lasts.max, j.thread, j.scope)) else {
            return End { at: place.at, lasts: Interval::SOME_TIME, dead: false };
        };
        if !self.network.holds_in(scope, place.scope) {
            return End { at: place.at, lasts: Interval::SOME_TIME, dead: false };
        }
        if scope == place.scope {
            self.joined(thread);
        }
        let at = self.join(id, place, &[place.at, end], longest);
        End { at, lasts: Interval { min: 0.0, max: longest }, dead: false }
    }

    fn branches(&mut self, id: StepId, then: StepId, otherwise: Option<StepId>, place: Place) -> End {
        let mut lasts: Option<Interval> = None;
        let mut ends = Vec::new();
        for branch in [Some(then), otherwise].into_iter().flatten() {
            let scope = self.network.scope(place.scope);
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

    fn operation(&self, operation: &Operation) -> Interval {
        match (&operation.takes, &operation.until) {
            (Some(takes), Some(_)) => self.bounds(*takes).unwrap_or(Interval::SOME_TIME),
            (None, Some(_)) => Interval::SOME_TIME,
            (Some(takes), None) => {
                let bounds = if self.durations == Durations::Bounds { self.bounds(*takes) } else { None };
                bounds.unwrap_or_else(|| self.known.number(takes.nominal).as_duration())
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
