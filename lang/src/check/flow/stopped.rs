//! Steps that something stops before the next one: those of a branch or job when a written failure ends what it is part of, and those of
//! a `keep` that breaks. What they have switched on by then stays on, unless a `finally` around them puts it right.
//!
//! Each branch and job keeps a course of what it does to the things that should be in order at the end. Where the times are known, the
//! course tells how such a thing stands when the failure comes; else it may stand as after any step that may have been the last.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Operation, Step, StepId};
use matterix_ir::{BinaryOp, Span};

use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, Raised};

/// So many changes of a `keep` are tried for a break after them.
const MOST_CHANGES: usize = 64;

/// A change of something that should be in order at the end.
#[derive(Clone, Debug)]
struct Change {
    /// What should be in order, by index into the plan's `ends`.
    end: usize,
    /// When the step that makes it begins, s.
    since: (f64, f64),
    /// The latest time at which the step begins that changes it next, s.
    until: f64,
    /// Whether it is known not to be in order after that.
    off: bool,
    /// The states that it depends on and those that the step sets, as they are then.
    states: Vec<(u32, AbstractValue)>,
    /// The step.
    span: Span,
    /// What is done however the blocks around it end, the outermost first.
    finally: Vec<StepId>,
}

/// What a line of steps changes, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    changes: Vec<Change>,
    /// How many blocks with a `finally` are around the whole.
    outside: usize,
}

impl Course {
    pub(super) fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// The changes of each thing.
    fn by_end(&self) -> BTreeMap<usize, Vec<&Change>> {
        let mut out: BTreeMap<usize, Vec<&Change>> = BTreeMap::new();
        self.changes.iter().for_each(|change| out.entry(change.end).or_default().push(change));
        out
    }
}

/// A line of steps beside a failure.
#[derive(Clone, Debug)]
pub(super) struct Beside {
    pub course: Rc<Course>,
    /// What was known before it.
    pub base: Rc<AbstractState>,
    /// Whether its steps come first where both do something at one time.
    pub first: bool,
}

/// The courses of the branches of a `parallel`, and the failures raised in each, by index.
#[derive(Default)]
pub(super) struct Lines(BTreeMap<usize, (Rc<Course>, BTreeSet<usize>)>);

impl Interpreter<'_, '_> {
    /// Whether a written failure may stop what goes on beside it while something is to be in order at the end.
    pub(super) fn is_stopped_by(&self, steps: &[StepId]) -> bool {
        let written = |step: &Step| {
            matches!(
                step,
                Step::Fail { .. }
                    | Step::WaitUntil { timeout: Some(_), .. }
                    | Step::Hold { timeout: Some(_), .. }
                    | Step::RepeatWhile { .. }
            )
        };
        !self.plan.ends.is_empty()
            && steps.iter().any(|id| self.below(*id).into_iter().any(|id| written(&self.plan.get(id).step)))
    }

    /// What should be in order at the end, by the states it depends on.
    pub(super) fn ends_of(&mut self) -> Rc<BTreeMap<u32, Vec<usize>>> {
        if let Some(known) = &self.ends_of {
            return known.clone();
        }
        let plan = self.plan;
        let mut out: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (index, end) in plan.ends.iter().enumerate() {
            for state in self.parts(end.condition.node).states.clone() {
                out.entry(state).or_default().push(index);
            }
        }
        let out = Rc::new(out);
        self.ends_of = Some(out.clone());
        out
    }

    /// Begins to keep a course.
    pub(super) fn begin_course(&mut self) {
        self.courses.push(Course { changes: Vec::new(), outside: self.finally.len() });
    }

    /// The course kept since it was begun.
    pub(super) fn end_course(&mut self) -> Rc<Course> {
        Rc::new(self.courses.pop().unwrap_or_default())
    }

    /// Notes in the courses kept what an operation that began at `began` has changed.
    pub(super) fn note_change(&mut self, operation: &Operation, began: &AbstractValue, facts: &AbstractState) {
        if self.courses.is_empty() {
            return;
        }
        let ends_of = self.ends_of();
        let set = operation.at_start.iter().chain(&operation.at_end).filter_map(Action::assigned);
        let set: BTreeSet<u32> = set.collect();
        let ends: BTreeSet<usize> = set.iter().filter_map(|s| ends_of.get(s)).flatten().copied().collect();
        let (plan, span, since) = (self.plan, self.site(), began.bounds());
        for end in ends {
            let node = plan.ends[end].condition.node;
            let states: BTreeSet<u32> = self.parts(node).states.iter().chain(&set).copied().collect();
            let states: Vec<(u32, AbstractValue)> =
                states.into_iter().map(|s| (s, facts.states[s as usize].clone())).collect();
            let off = self.eval(node, facts).truth() == Some(false);
            for course in &mut self.courses {
                if let Some(last) = course.changes.iter_mut().rev().find(|c| c.end == end) {
                    last.until = since.1;
                }
                let finally = self.finally.get(course.outside..).unwrap_or_default().to_vec();
                let states = states.clone();
                course.changes.push(Change { end, since, until: f64::INFINITY, off, states, span, finally });
            }
        }
    }

    /// Keeps the course of a branch, with the failures raised in it.
    pub(super) fn follow_line(
        &mut self,
        branch: usize,
        facts: AbstractState,
        body: StepId,
        lines: &mut Lines,
    ) -> Option<AbstractState> {
        let begun = self.guards.last().map_or(0, Vec::len);
        self.begin_course();
        let after = self.walk(body, facts);
        let course = self.end_course();
        let ended = self.guards.last().map_or(0, Vec::len);
        let line = lines.0.entry(branch).or_insert_with(|| (course, BTreeSet::new()));
        line.1.extend(begun..ended);
        after
    }

    /// Each written failure in a branch finds the others as they are when it stops them.
    pub(super) fn stop_branches(&mut self, base: &AbstractState, lines: &Lines) {
        let base = Rc::new(base.clone());
        for (branch, (own, raised)) in &lines.0 {
            let others = lines.0.iter().filter(|(other, _)| *other != branch);
            let beside: Vec<Beside> = others
                .map(|(other, (course, _))| Beside {
                    course: course.clone(),
                    base: base.clone(),
                    first: other < branch,
                })
                .collect();
            for index in raised {
                let failure = self.guards.last().and_then(|guard| guard.get(*index)).cloned();
                let Some((name, facts)) = failure.filter(|(_, facts)| facts.written.is_some()) else { continue };
                let (sure, maybe) = self.stopped(facts, own, &beside);
                if let Some(guard) = self.guards.last_mut() {
                    guard[*index].1 = sure;
                    guard.extend(maybe.map(|facts| (name, facts)));
                }
            }
        }
    }

    /// The same for jobs that a failure stops: those begun at this depth of handlers.
    pub(super) fn stop_jobs(&mut self, raised: Vec<Raised>, depth: usize) -> Vec<Raised> {
        let beside: Vec<Beside> = self.jobs.values().filter_map(|job| job.beside(depth, self.in_jobs)).collect();
        if beside.is_empty() {
            return raised;
        }
        let own = self.courses.first().cloned().unwrap_or_default();
        let mut out = Vec::with_capacity(raised.len());
        for (name, facts) in raised {
            if facts.written.is_none() {
                out.push((name, facts));
                continue;
            }
            let (sure, maybe) = self.stopped(facts, &own, &beside);
            out.push((name.clone(), sure));
            out.extend(maybe.map(|facts| (name, facts)));
        }
        out
    }

    /// What is known when a failure has stopped what goes on beside it, and what may be so besides. What both lines change is left as
    /// it is.
    fn stopped(
        &mut self,
        failed: AbstractState,
        own: &Course,
        beside: &[Beside],
    ) -> (AbstractState, Option<AbstractState>) {
        let (low, high) = failed.time.bounds();
        let mut sure = failed;
        let mut open: Vec<Change> = Vec::new();
        for Beside { course, base, first } in beside {
            let begun = |c: &Change| c.since.0 < high || (*first && c.since.0 == high);
            for (end, changes) in course.by_end() {
                if own.changes.iter().any(|c| c.end == end) {
                    continue;
                }
                if low == high && changes.iter().all(|c| c.since.0 == c.since.1) {
                    match changes.iter().rev().find(|c| begun(c)) {
                        Some(last) => self.set(last, &mut sure),
                        None => self.as_before(changes.first().copied(), base, &mut sure),
                    }
                } else {
                    open.extend(changes.into_iter().find(|c| c.off && begun(c) && c.until > low).cloned());
                }
            }
        }
        let maybe = (!open.is_empty()).then(|| {
            let mut maybe = sure.clone();
            open.iter().for_each(|change| self.set(change, &mut maybe));
            maybe
        });
        (sure, maybe)
    }

    /// A thing stands as after a change, and what `finally` does about it.
    fn set(&mut self, change: &Change, facts: &mut AbstractState) {
        self.overwrite(change.span, change.states.clone(), facts);
        for finally in change.finally.iter().rev().filter(|_| change.off) {
            // What only waits puts nothing right.
            if self.writes(*finally).is_empty() {
                continue;
            }
            if let Some(end) = self.aside(*finally, facts.clone()) {
                *facts = end;
            }
        }
    }

    /// A thing stands as before its first change.
    fn as_before(&mut self, first: Option<&Change>, base: &AbstractState, facts: &mut AbstractState) {
        let Some(first) = first else { return };
        let states = first.states.iter().map(|(s, _)| (*s, base.states[*s as usize].clone())).collect();
        self.overwrite(first.span, states, facts);
    }

    /// Sets states by a statement that is not the one followed now.
    pub(super) fn overwrite(&mut self, span: Span, states: Vec<(u32, AbstractValue)>, facts: &mut AbstractState) {
        let changes: Vec<(u32, AbstractValue)> =
            states.into_iter().filter(|(s, known)| facts.states[*s as usize] != *known).collect();
        let changed: Vec<u32> = changes.iter().map(|(state, _)| *state).collect();
        changed.iter().for_each(|state| self.touch(*state, facts));
        facts.rebind(|bonds, _| bonds.release(&changed));
        facts.write(span, changes);
    }

    /// Follows steps beside the way that is followed: nothing is reported of them, and no failure of theirs leads anywhere.
    pub(super) fn aside(&mut self, body: StepId, facts: AbstractState) -> Option<AbstractState> {
        let (courses, jobs) = (std::mem::take(&mut self.courses), self.jobs.clone());
        let end = self.unheard(|flow| flow.unnoted(body, facts));
        (self.courses, self.jobs) = (courses, jobs);
        end
    }

    /// Does something of which nothing is reported, and no failure of which leads anywhere.
    pub(super) fn unheard<T>(&mut self, act: impl FnOnce(&mut Self) -> T) -> T {
        let (guards, reported) = (std::mem::take(&mut self.guards), std::mem::take(&mut self.reported));
        self.quiet += 1;
        let out = act(self);
        self.quiet -= 1;
        (self.guards, self.reported) = (guards, reported);
        out
    }

    /// The course of steps from here, followed aside.
    pub(super) fn course_aside(&mut self, body: StepId, facts: AbstractState) -> Rc<Course> {
        let (courses, jobs) = (std::mem::take(&mut self.courses), self.jobs.clone());
        self.begin_course();
        self.in_jobs += 1;
        self.unheard(|flow| flow.unnoted(body, facts));
        self.in_jobs -= 1;
        let course = self.end_course();
        (self.courses, self.jobs) = (courses, jobs);
        course
    }

    /// Follows the body of a `keep` whose break a handler takes.
    pub(super) fn may_break(
        &mut self,
        condition: &Condition,
        body: StepId,
        facts: AbstractState,
    ) -> Option<AbstractState> {
        let begun = facts.clone();
        self.begin_course();
        let after = self.walk(body, facts);
        let course = self.end_course();
        self.breaks_between(condition, begun, &course);
        after
    }

    /// A `keep` may break while something is not in order that its body has switched on.
    fn breaks_between(&mut self, condition: &Condition, begun: AbstractState, course: &Course) {
        let mut facts = begun;
        let mut seen: BTreeSet<usize> = BTreeSet::new();
        self.quiet += 1;
        let mut broken = Vec::new();
        for change in course.changes.iter().take(MOST_CHANGES) {
            self.overwrite(change.span, change.states.clone(), &mut facts);
            let rest = AbstractValue::Range(0.0, (change.until - change.since.0).max(0.0), Imprecision::Unknown);
            self.pass(&rest, &mut facts);
            if change.off && !seen.contains(&change.end) && self.eval(condition.node, &facts).truth() != Some(true) {
                seen.insert(change.end);
                let mut left = facts.clone();
                left.time = AbstractValue::binary(BinaryOp::Max, &left.time, &AbstractValue::Point(change.since.0));
                self.set(change, &mut left);
                broken.push(left);
            }
        }
        self.quiet -= 1;
        broken.into_iter().for_each(|facts| self.raise("broken", facts));
    }
}
