//! The plan as lines of steps that run beside each other, each a control-flow graph: the plan itself, branches of `parallel`, jobs.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::plan::{Caught, Motion, Operation, Plan, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{FileId, NodeId, Span};

/// Turns of a counted loop that are written out; further ones are a loop of any number of turns.
const TURNS: f64 = 6.0;

/// What leads from one point of a line to the next.
#[derive(Clone, Debug)]
pub(super) enum Edge {
    /// Nothing happens.
    Pass,
    /// An operation begins, with what it does then.
    Begin(StepId),
    /// It ends, with what it does then.
    End(StepId),
    /// A value is kept.
    Keep(u32, NodeId),
    /// A branch is taken where a condition comes out so.
    Assume(NodeId, bool),
    /// Other lines begin at these points; the line itself waits at the next one.
    Fork(Rc<[usize]>),
    /// The lines that have come to these points end.
    Join(Rc<[usize]>),
    /// A job ends; one that never began is not waited for.
    Await(usize),
    /// A failure ends the lines that run inside of what handles it.
    Escape(Rc<BTreeSet<usize>>),
}

/// A point of a line.
#[derive(Clone, Debug, Default)]
pub(super) struct Point {
    pub line: usize,
    pub next: Vec<(Edge, usize)>,
    /// What is held here, with the step that holds it.
    pub held: Rc<BTreeSet<(InstanceId, StepId)>>,
}

/// All lines of a plan.
#[derive(Debug, Default)]
pub(super) struct Lines {
    pub points: Vec<Point>,
    /// Where the plan begins and ends.
    pub begin: usize,
    pub end: usize,
    /// The user's statements around each step, innermost last.
    pub sites: BTreeMap<StepId, Vec<Span>>,
    /// How many lines there are.
    pub count: usize,
}

/// A failure that may be raised at a point.
type Raised = (String, usize);

/// Writes out the lines of a plan. `times` gives how often a loop turns, where that is known when the plan begins.
pub(super) fn lines(
    plan: &Plan,
    library: &BTreeSet<FileId>,
    dangers: &BTreeSet<String>,
    times: &dyn Fn(NodeId) -> f64,
    most: usize,
) -> Option<Lines> {
    let mut build = Build {
        plan,
        library,
        dangers,
        times,
        most,
        lines: Lines { count: 1, ..Lines::default() },
        line: 0,
        held: Rc::default(),
        raised: Vec::new(),
        retries: Vec::new(),
        jobs: vec![BTreeMap::new()],
        sites: Vec::new(),
    };
    build.lines.begin = build.point();
    let end = build.step(plan.root, build.lines.begin)?;
    build.lines.end = build.close(end);
    Some(build.lines)
}

struct Build<'b> {
    plan: &'b Plan,
    library: &'b BTreeSet<FileId>,
    /// Failures that may come at any step.
    dangers: &'b BTreeSet<String>,
    times: &'b dyn Fn(NodeId) -> f64,
    /// Points at most.
    most: usize,
    lines: Lines,
    line: usize,
    held: Rc<BTreeSet<(InstanceId, StepId)>>,
    /// What may be raised so far in the innermost body with handlers.
    raised: Vec<Raised>,
    /// Where the bodies around begin, for those that begin again.
    retries: Vec<(usize, usize)>,
    /// Ends of the jobs that the blocks around wait for.
    jobs: Vec<BTreeMap<String, usize>>,
    sites: Vec<Span>,
}

impl Build<'_> {
    fn point(&mut self) -> usize {
        self.lines.points.push(Point { line: self.line, next: Vec::new(), held: self.held.clone() });
        self.lines.points.len() - 1
    }

    fn edge(&mut self, from: usize, edge: Edge, to: usize) {
        self.lines.points[from].next.push((edge, to));
    }

    fn after(&mut self, from: usize, edge: Edge) -> usize {
        let to = self.point();
        self.edge(from, edge, to);
        to
    }

    fn raise(&mut self, name: &str, at: usize) {
        self.raised.push((name.to_owned(), at));
    }

    /// A step from a point on; where it ends. Nothing where the plan has too many points.
    fn step(&mut self, id: StepId, at: usize) -> Option<usize> {
        if self.lines.points.len() > self.most {
            return None;
        }
        let step = self.plan.get(id);
        let own = !self.library.contains(&step.span.file) && step.span != Span::default();
        self.sites.extend(own.then_some(step.span));
        self.lines.sites.entry(id).or_insert_with(|| self.sites.clone());
        let end = self.inside(id, &step.step, at);
        if own {
            self.sites.pop();
        }
        end
    }

    fn inside(&mut self, id: StepId, step: &Step, at: usize) -> Option<usize> {
        match step {
            Step::Sequence(list) => list.iter().try_fold(at, |at, s| self.step(*s, at)),
            Step::Operation(operation) => Some(self.operation(id, operation, at)),
            Step::Parallel(list) => self.parallel(list, at),
            Step::Start { job, body } => {
                let (begin, end) = self.other_line(*body)?;
                if let Some(jobs) = self.jobs.last_mut() {
                    jobs.insert(job.clone(), end);
                }
                Some(self.after(at, Edge::Fork([begin].into())))
            }
            Step::Await { job } => {
                let end = self.jobs.iter().rev().find_map(|jobs| jobs.get(job)).copied();
                Some(end.map_or(at, |end| self.after(at, Edge::Await(end))))
            }
            Step::Guarded { body, handlers, finally } => self.guarded(*body, handlers, *finally, at),
            Step::Retry { .. } => {
                if let Some((begin, _)) = self.retries.last().copied() {
                    self.edge(at, Edge::Pass, begin);
                }
                Some(self.point())
            }
            Step::Try(list) => self.alternatives(list, at),
            Step::If { condition, then, otherwise } => {
                let (yes, no) = (self.point(), self.point());
                self.edge(at, Edge::Assume(condition.node, true), yes);
                self.edge(at, Edge::Assume(condition.node, false), no);
                let then = self.step(*then, yes)?;
                let no = otherwise.map_or(Some(no), |o| self.step(o, no))?;
                let end = self.after(then, Edge::Pass);
                self.edge(no, Edge::Pass, end);
                Some(end)
            }
            Step::Repeat { times, body } => self.turns((self.times)(*times), *body, at),
            Step::RepeatWhile { max, body, .. } => {
                let head = self.after(at, Edge::Pass);
                self.raise("max", head);
                let turned = self.step(*body, head)?;
                if (self.times)(*max) <= 1.0 {
                    self.raise("max", turned);
                    let end = self.after(head, Edge::Pass);
                    self.edge(turned, Edge::Pass, end);
                    return Some(end);
                }
                self.edge(turned, Edge::Pass, head);
                Some(self.after(head, Edge::Pass))
            }
            Step::Let { local, value } => Some(self.after(at, Edge::Keep(*local, *value))),
            Step::WaitUntil { timeout, .. } | Step::Hold { timeout, .. } => {
                if timeout.is_some() {
                    self.raise("timeout", at);
                }
                Some(at)
            }
            Step::Fail { name, .. } => {
                self.raise(name, at);
                Some(self.point())
            }
            Step::Named { body, .. } => self.step(*body, at),
            Step::Within { body, .. } => {
                self.raise("late", at);
                self.step(*body, at)
            }
            Step::Claim { claims, body } => {
                let outer = self.held.clone();
                let mut held = (*outer).clone();
                held.extend(claims.iter().map(|i| (*i, id)));
                self.held = Rc::new(held);
                let begin = self.after(at, Edge::Pass);
                let end = self.scoped(*body, begin);
                self.held = outer;
                Some(self.after(end?, Edge::Pass))
            }
            Step::Skill { body, needs, invariants, .. } => {
                needs.iter().for_each(|need| self.raise(need.failure(), at));
                let end = if invariants.is_empty() { self.scoped(*body, at)? } else { self.broken(*body, at)? };
                self.raise("promise", end);
                Some(end)
            }
            Step::Keep { condition, body } => {
                self.raise("broken", at);
                let begin = self.point();
                self.edge(at, Edge::Assume(condition.node, true), begin);
                self.broken(*body, begin)
            }
            Step::During { body, .. } => self.broken(*body, at),
            _ => Some(at),
        }
    }

    fn operation(&mut self, id: StepId, operation: &Operation, at: usize) -> usize {
        operation.needs.iter().for_each(|need| self.raise(need.failure(), at));
        operation.fails.iter().chain([&"claimed".to_owned()]).for_each(|name| self.raise(name, at));
        let by_motion = Motion::FAILURES.into_iter().filter(|_| operation.motion.is_some());
        by_motion.for_each(|name| self.raise(name, at));
        let outer = self.held.clone();
        let mut held = (*outer).clone();
        held.extend(operation.claims.iter().map(|i| (*i, id)));
        self.held = Rc::new(held);
        let during = self.after(at, Edge::Begin(id));
        self.held = outer;
        self.after(during, Edge::End(id))
    }

    /// A body that a broken promise may end anywhere.
    fn broken(&mut self, body: StepId, at: usize) -> Option<usize> {
        let first = self.lines.points.len();
        let end = self.scoped(body, at)?;
        self.raise("broken", at);
        (first..self.lines.points.len()).for_each(|point| self.raise("broken", point));
        Some(end)
    }

    /// A body that waits for the jobs started in it.
    fn scoped(&mut self, body: StepId, at: usize) -> Option<usize> {
        self.jobs.push(BTreeMap::new());
        let end = self.step(body, at);
        let end = end.map(|end| self.close(end));
        self.jobs.pop();
        end
    }

    fn close(&mut self, end: usize) -> usize {
        let jobs = self.jobs.last().cloned().unwrap_or_default();
        jobs.into_values().fold(end, |at, job| self.after(at, Edge::Await(job)))
    }

    /// A line beside the present one: where it begins and ends.
    fn other_line(&mut self, body: StepId) -> Option<(usize, usize)> {
        let outer = std::mem::replace(&mut self.line, self.lines.count);
        self.lines.count += 1;
        let begin = self.point();
        let end = self.step(body, begin).map(|end| self.after(end, Edge::Pass));
        self.line = outer;
        Some((begin, end?))
    }

    fn parallel(&mut self, list: &[StepId], at: usize) -> Option<usize> {
        let branches: Option<Vec<(usize, usize)>> = list.iter().map(|s| self.other_line(*s)).collect();
        let (begins, ends): (Vec<usize>, Vec<usize>) = branches?.into_iter().unzip();
        let waiting = self.after(at, Edge::Fork(begins.into()));
        Some(self.after(waiting, Edge::Join(ends.into())))
    }

    fn turns(&mut self, times: f64, body: StepId, mut at: usize) -> Option<usize> {
        let written = if times.is_nan() { 0.0 } else { times.min(TURNS) };
        let mut done = 0.0;
        while done < written {
            at = self.step(body, at)?;
            done += 1.0;
        }
        if done >= times {
            return Some(at);
        }
        let head = self.after(at, Edge::Pass);
        let turned = self.step(body, head)?;
        self.edge(turned, Edge::Pass, head);
        Some(self.after(head, Edge::Pass))
    }

    fn guarded(
        &mut self,
        body: StepId,
        handlers: &[(Caught, StepId)],
        finally: Option<StepId>,
        at: usize,
    ) -> Option<usize> {
        let begin = self.after(at, Edge::Pass);
        let outer = std::mem::take(&mut self.raised);
        let first = self.lines.count;
        self.retries.push((begin, self.line));
        let done = self.scoped(body, begin)?;
        let inside: Rc<BTreeSet<usize>> = Rc::new((first..self.lines.count).collect());
        let mut raised = std::mem::take(&mut self.raised);
        let end = self.after(done, Edge::Pass);
        let named = handlers.iter().filter_map(|(caught, _)| match caught {
            Caught::Named(name) => self.dangers.get(name),
            Caught::Any => None,
        });
        for name in named {
            raised.extend((begin..end).map(|point| (name.clone(), point)));
        }
        for (caught, handler) in handlers {
            let takes = |name: &str| matches!(caught, Caught::Any) || *caught == Caught::Named(name.to_owned());
            let (taken, rest): (Vec<Raised>, Vec<Raised>) = raised.into_iter().partition(|(name, _)| takes(name));
            raised = rest;
            let entry = self.entry(&taken, &inside);
            let handled = self.step(*handler, entry)?;
            self.edge(handled, Edge::Pass, end);
        }
        self.retries.pop();
        // What handlers raise leaves as well.
        raised.append(&mut self.raised);
        self.raised = outer;
        let Some(finally) = finally else {
            self.raised.append(&mut raised);
            return Some(end);
        };
        if !raised.is_empty() {
            let entry = self.entry(&raised, &inside);
            let left = self.step(finally, entry)?;
            let names: BTreeSet<String> = raised.into_iter().map(|(name, _)| name).collect();
            names.iter().for_each(|name| self.raise(name, left));
        }
        self.step(finally, end)
    }

    /// Where the failures raised at these points lead.
    fn entry(&mut self, raised: &[Raised], inside: &Rc<BTreeSet<usize>>) -> usize {
        let entry = self.point();
        let points: BTreeSet<usize> = raised.iter().map(|(_, at)| *at).collect();
        points.into_iter().for_each(|at| self.edge(at, Edge::Escape(inside.clone()), entry));
        entry
    }

    fn alternatives(&mut self, list: &[StepId], at: usize) -> Option<usize> {
        let mut entry = self.after(at, Edge::Pass);
        let end = self.point();
        for (i, alternative) in list.iter().enumerate() {
            let outer = std::mem::take(&mut self.raised);
            let first = self.lines.count;
            let done = self.scoped(*alternative, entry)?;
            self.edge(done, Edge::Pass, end);
            let raised = std::mem::replace(&mut self.raised, outer);
            if i + 1 == list.len() {
                self.raised.extend(raised);
                break;
            }
            let inside: Rc<BTreeSet<usize>> = Rc::new((first..self.lines.count).collect());
            entry = self.entry(&raised, &inside);
        }
        Some(end)
    }
}
