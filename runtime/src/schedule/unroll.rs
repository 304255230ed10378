//! The plan written out: each step as often as it is done, with the time it takes.

use matterix_ir::NodeId;
use matterix_ir::plan::{Operation, Plan, Step, StepId};
use matterix_timing::walk::after_point;
use matterix_timing::{Interval, Known, Linear, Point};

use super::problem::{Moment, Problem, Task, Work};
use super::trial::{Occurrence, Trace};

/// Steps at most, so that a loop of loops ends.
const MOST_STEPS: usize = 200_000;

/// Why a plan cannot be written out.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Open {
    /// How long a step takes, or which way it goes, follows from the model only.
    Unknown(StepId),
    /// There are too many steps.
    TooLong,
}

/// Writes a plan out; what only a run can tell is taken from the trace of one.
pub(super) fn unroll(plan: &Plan, known: &Known<'_>, trace: Option<&Trace>) -> Result<Problem, Open> {
    let mut unroll = Unroll {
        plan,
        known,
        trace,
        used: vec![0; plan.steps.len()],
        claims: vec![0; plan.steps.len()],
        locals: vec![None; plan.locals.len()],
        jobs: vec![Vec::new()],
        open: Vec::new(),
        steps: 0,
        problem: Problem { lines: vec![plan.workflow.clone()], ..Problem::default() },
    };
    let whole = Place { line: 0, within: (0, u64::MAX) };
    let end = unroll.step(plan.root, Moment::BEGIN, whole)?;
    let end = unroll.close(plan.root, end);
    unroll.problem.end = Some(end);
    Ok(unroll.problem)
}

/// Where a step stands: its line, and the part of the trace it is in.
#[derive(Clone, Copy)]
struct Place {
    line: usize,
    within: (u64, u64),
}

struct Unroll<'u, 'g> {
    plan: &'u Plan,
    known: &'u Known<'g>,
    trace: Option<&'u Trace>,
    /// Occurrences taken from the trace, by step.
    used: Vec<usize>,
    /// How often each claim has been reached.
    claims: Vec<u32>,
    locals: Vec<Option<Linear>>,
    /// Running jobs by the blocks that wait for them, innermost last.
    jobs: Vec<Vec<(String, Moment)>>,
    /// Claims around.
    open: Vec<usize>,
    steps: usize,
    problem: Problem,
}

type End = Result<Moment, Open>;

impl Unroll<'_, '_> {
    fn step(&mut self, id: StepId, at: Moment, place: Place) -> End {
        self.steps += 1;
        if self.steps > MOST_STEPS {
            return Err(Open::TooLong);
        }
        let seen = self.occurrence(id, place.within);
        let inner = Place { within: seen.map_or(place.within, |o| (o.began, o.ended)), ..place };
        let plan = self.plan;
        match &plan.get(id).step {
            Step::Sequence(list) => list.iter().try_fold(at, |at, step| self.step(*step, at, inner)),
            Step::Parallel(list) => {
                let mut ends = Vec::new();
                for (index, step) in list.iter().enumerate() {
                    let name = self.branch_name(*step, index);
                    self.problem.lines.push(name);
                    let line = self.problem.lines.len() - 1;
                    ends.push(self.step(*step, at, Place { line, ..inner })?);
                }
                Ok(if ends.is_empty() { at } else { self.problem.join(&ends, id) })
            }
            Step::Operation(operation) => self.operation(id, operation, at, seen, place),
            Step::Guarded { body, handlers, finally } => {
                if handlers.iter().any(|(_, h)| self.seen_in(*h, inner.within)) {
                    return measured(id, at, seen);
                }
                let end = self.scoped(id, *body, at, inner)?;
                finally.map_or(Ok(end), |f| self.step(f, end, inner))
            }
            Step::Try(list) => match list.as_slice() {
                [] => Ok(at),
                [_, second, ..] if self.seen_in(*second, inner.within) => measured(id, at, seen),
                [first, ..] => self.scoped(id, *first, at, inner),
            },
            Step::Skill { takes, body, .. } => {
                let end = self.scoped(id, *body, at, inner)?;
                if let Some(bounds) = takes.and_then(|t| self.known.bounds(t)).filter(|b| b.max.is_finite()) {
                    self.problem.window(at, end, bounds.max, id);
                }
                Ok(end)
            }
            Step::Keep { body, .. } => self.scoped(id, *body, at, inner),
            Step::Named { start, end, body, .. } => {
                self.set(*start, moment(at));
                let last = self.step(*body, at, inner)?;
                self.set(*end, moment(last));
                Ok(last)
            }
            Step::Let { local, value } => {
                let value = self.known.linear(*value, &self.locals);
                self.set(*local, at_moment(value, at));
                Ok(at)
            }
            Step::Wait { duration } => match self.exact(*duration) {
                Some(time) => Ok(at.later(time.max(0.0))),
                None => measured(id, at, seen),
            },
            Step::WaitUntil { condition, timeout } => self.wait_until(id, condition.node, *timeout, at, seen),
            Step::Hold { .. } => measured(id, at, seen),
            Step::Within { limit, since, body } => {
                let since = self.known.linear(*since, &self.locals);
                let limit = self.exact(*limit).ok_or(Open::Unknown(id))?;
                match after_point(&since).and_then(|(p, offset)| Some((p, offset.exact()?))) {
                    Some((point, offset)) => {
                        self.problem.window(Moment { point, offset }, at, limit, id);
                    }
                    None => return Err(Open::Unknown(id)),
                }
                self.step(*body, at, inner)
            }
            Step::If { condition, then, otherwise } => {
                let holds = match (self.exact(condition.node), seen) {
                    (Some(value), _) => value != 0.0,
                    (None, Some(_)) => self.seen_in(*then, inner.within),
                    (None, None) => return Err(Open::Unknown(id)),
                };
                let taken = if holds { Some(*then) } else { *otherwise };
                taken.map_or(Ok(at), |step| self.step(step, at, inner))
            }
            Step::Repeat { times, body } => {
                let times = match (self.exact(*times), seen) {
                    (Some(times), _) => times.max(0.0) as usize,
                    (None, Some(_)) => self.count_in(*body, inner.within),
                    (None, None) => return Err(Open::Unknown(id)),
                };
                (0..times).try_fold(at, |at, _| self.step(*body, at, inner))
            }
            Step::RepeatWhile { body, .. } => {
                let Some(_) = seen else { return Err(Open::Unknown(id)) };
                let times = self.count_in(*body, inner.within);
                (0..times).try_fold(at, |at, _| self.step(*body, at, inner))
            }
            Step::Claim { claims, body } => {
                let start = self.problem.network.point();
                self.problem.least(at, Moment::of(start), 0.0, id);
                let occurrence = self.claims[id.0 as usize];
                self.claims[id.0 as usize] += 1;
                let index = self.problem.tasks.len();
                self.problem.tasks.push(Task {
                    step: id,
                    occurrence,
                    instances: claims.clone(),
                    label: self.content(*body).unwrap_or_else(|| plan.get(id).label.clone()),
                    line: place.line,
                    asks: at,
                    start,
                    end: Moment::of(start),
                    around: self.open.clone(),
                });
                self.open.push(index);
                let end = self.scoped(id, *body, Moment::of(start), inner);
                self.open.pop();
                let end = end?;
                self.problem.tasks[index].end = end;
                Ok(end)
            }
            Step::Start { job, body } => {
                self.problem.lines.push(job.clone());
                let line = self.problem.lines.len() - 1;
                // A job's steps are not among those of its `start`.
                let end = self.step(*body, at, Place { line, within: (inner.within.0, u64::MAX) })?;
                if let Some(block) = self.jobs.last_mut() {
                    block.push((job.clone(), end));
                }
                Ok(at)
            }
            Step::Await { job } => {
                let end = self.jobs.iter().rev().flatten().rev().find(|j| j.0 == *job).map(|j| j.1);
                Ok(end.map_or(at, |end| self.problem.join(&[at, end], id)))
            }
            _ => Ok(at),
        }
    }

    fn operation(
        &mut self,
        id: StepId,
        operation: &Operation,
        at: Moment,
        seen: Option<Occurrence>,
        place: Place,
    ) -> End {
        let time = match (&operation.until, &operation.takes) {
            (Some(_), _) => None,
            (None, Some(takes)) => self.exact(takes.nominal),
            (None, None) => Some(0.0),
        };
        let end = time.map_or_else(|| measured(id, at, seen), |t| Ok(at.later(t.max(0.0))))?;
        let claimed = |i| self.open.iter().any(|t| self.problem.tasks[*t].instances.contains(i));
        let instances: Vec<_> = operation.claims.iter().filter(|i| !claimed(i)).copied().collect();
        if end != at && !instances.is_empty() {
            let label = self.plan.get(id).label.clone();
            self.problem.work.push(Work { step: id, instances, label, line: place.line, start: at, end });
        }
        Ok(end)
    }

    fn wait_until(
        &mut self,
        id: StepId,
        condition: NodeId,
        timeout: Option<NodeId>,
        at: Moment,
        seen: Option<Occurrence>,
    ) -> End {
        let waits = self.known.not_before(condition, &self.locals);
        let moments: Option<Vec<Moment>> = waits.iter().map(turned).collect();
        let end = match moments {
            Some(mut moments) if self.known.only_time(condition) && !moments.is_empty() => {
                moments.push(at);
                self.problem.join(&moments, id)
            }
            _ => return measured(id, at, seen),
        };
        if let Some(longest) = timeout.and_then(|t| self.exact(t)) {
            self.problem.window(at, end, longest, id);
        }
        Ok(end)
    }

    /// A body that waits for the jobs started in it.
    fn scoped(&mut self, id: StepId, body: StepId, at: Moment, place: Place) -> End {
        self.jobs.push(Vec::new());
        let end = self.step(body, at, place);
        let end = end?;
        Ok(self.close(id, end))
    }

    fn close(&mut self, id: StepId, end: Moment) -> Moment {
        let mut ends: Vec<Moment> = self.jobs.pop().unwrap_or_default().into_iter().map(|j| j.1).collect();
        ends.push(end);
        self.problem.join(&ends, id)
    }

    fn exact(&self, node: NodeId) -> Option<f64> {
        self.known.linear(node, &self.locals).bounds().and_then(Interval::exact)
    }

    fn set(&mut self, local: u32, value: Linear) {
        if let Some(slot) = self.locals.get_mut(local as usize) {
            *slot = Some(value);
        }
    }

    /// The next occurrence of a step in a part of the trace.
    fn occurrence(&mut self, id: StepId, within: (u64, u64)) -> Option<Occurrence> {
        let all = self.trace?.occurrences(id);
        let used = self.used.get_mut(id.0 as usize)?;
        while all.get(*used).is_some_and(|o| o.began < within.0) {
            *used += 1;
        }
        let found = all.get(*used).filter(|o| o.began <= within.1).copied();
        *used += usize::from(found.is_some());
        found
    }

    fn count_in(&self, id: StepId, within: (u64, u64)) -> usize {
        let all = self.trace.map_or(&[][..], |t| t.occurrences(id));
        all.iter().filter(|o| (within.0..=within.1).contains(&o.began)).count()
    }

    fn seen_in(&self, id: StepId, within: (u64, u64)) -> bool {
        self.count_in(id, within) > 0
    }

    /// What a branch is called.
    fn branch_name(&self, step: StepId, index: usize) -> String {
        match &self.plan.get(step).step {
            Step::Named { name, .. } => name.clone(),
            Step::Guarded { body, .. } => self.branch_name(*body, index),
            Step::Sequence(list) if list.len() == 1 => self.branch_name(list[0], index),
            _ => format!("branch {}", index + 1),
        }
    }

    /// The first thing done in a block, as its name.
    fn content(&self, step: StepId) -> Option<String> {
        match &self.plan.get(step).step {
            Step::Sequence(list) => list.iter().find_map(|s| self.content(*s)),
            Step::Let { .. } | Step::Note(_) | Step::Record { .. } => None,
            Step::Guarded { body, .. } | Step::Within { body, .. } | Step::Keep { body, .. } => self.content(*body),
            Step::Named { name, .. } => Some(name.clone()),
            // Options are for those who read the text.
            _ => self.plan.get(step).label.split(" {").next().map(str::to_owned),
        }
    }
}

/// The time a step took in the trace.
fn measured(id: StepId, at: Moment, seen: Option<Occurrence>) -> End {
    seen.map(|o| at.later(o.lasted)).ok_or(Open::Unknown(id))
}

fn moment(at: Moment) -> Linear {
    let mut sum = Linear::at(at.point);
    sum.number = Interval::exactly(at.offset);
    sum
}

/// A sum with the time now at a moment.
fn at_moment(mut sum: Linear, at: Moment) -> Linear {
    let factor = sum.now;
    sum.number = sum.number + Interval::exactly(at.offset * factor);
    sum.taken_at(at.point)
}

/// The moment from which `now + rest` is 0 or more.
fn turned(sum: &Linear) -> Option<Moment> {
    let offset = -sum.number.exact()?;
    let mut points = sum.points.iter();
    match (points.next(), points.next()) {
        (None, _) => Some(Moment { offset, ..Moment::BEGIN }),
        (Some((point, factor)), None) if *factor == -1.0 => Some(Moment { point: Point(point.0), offset }),
        _ => None,
    }
}
