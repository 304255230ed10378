//! Jobs that `start` begins: their steps are followed where they begin, and once more where they are waited for. What goes wrong in
//! one order only may be right in the order of the run.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::plan::{Step, StepId};
use matterix_ir::{BinaryOp, codes};

use super::Interpreter;
use super::interference::Rival;
use super::program_points::at_least;
use super::report::Finding;
use super::state::{AbstractState, changed_by};
use super::stopped::{Beside, Course};
use super::value::AbstractValue;
use super::{Raised, apart, left, trace_partitioning};

/// A job that was started and not waited for yet.
#[derive(Clone, Debug)]
pub(super) struct Job {
    body: StepId,
    /// When it began, s.
    start: AbstractValue,
    /// When it ended, s; not yet where its steps are followed when it is waited for.
    end: Option<AbstractValue>,
    /// The states that it changes.
    writes: BTreeSet<u32>,
    /// The states that hang on when it does something and when others do.
    raced: BTreeSet<u32>,
    /// What it changes that should be in order at the end, as far as that was asked for.
    course: Rc<Course>,
    /// What was known when it began.
    base: Option<Rc<AbstractState>>,
    /// How many bodies with handlers were around its `start`.
    depth: usize,
    /// How many blocks that wait for jobs were around it.
    blocks: usize,
    /// In how many jobs it was started.
    within: usize,
    /// It fails for certain, with one of these, where it is waited for.
    fails: Option<Vec<Raised>>,
}

impl Job {
    /// Its steps.
    pub(super) fn body(&self) -> StepId {
        self.body
    }

    /// What it does beside a failure that stops jobs begun at this depth of handlers.
    pub(super) fn beside(&self, depth: usize, within: usize) -> Option<Beside> {
        let stopped = self.is_stopped_at(depth, within) && !self.course.is_empty();
        let base = self.base.clone().filter(|_| stopped)?;
        Some(Beside { course: self.course.clone(), base, first: true })
    }

    /// Whether a failure at this depth of handlers stops it.
    pub(super) fn is_stopped_at(&self, depth: usize, within: usize) -> bool {
        self.depth >= depth && self.within == within
    }

    /// The states that it changes, or that hang on when it does something.
    pub(super) fn changes(&self) -> impl Iterator<Item = u32> {
        self.writes.iter().chain(&self.raced).copied()
    }

    /// When it began, s.
    pub(super) fn start(&self) -> &AbstractValue {
        &self.start
    }
}

/// Jobs that go on, by name.
pub(super) type Jobs = BTreeMap<String, Job>;

/// Follows a plan way by way, and in both orders where it starts jobs; `begin` gives one that was not followed yet.
pub(super) fn follow<'l, 'a>(begin: impl Fn() -> Interpreter<'l, 'a>) -> Interpreter<'l, 'a> {
    let mut flow = trace_partitioning::follow(&begin);
    apart::add_findings(&mut flow, &begin);
    left::on_some_way(&mut flow, &begin);
    if flow.plan.steps.iter().any(|s| matches!(s.step, Step::Start { .. })) {
        let mut late = begin();
        late.notes = None;
        late.late = true;
        late.swap_known(&mut flow);
        late.follow();
        late.swap_known(&mut flow);
        flow.reaches_also(&late);
        left::on_some_way(&mut late, &begin);
        let first = std::mem::take(&mut flow.findings);
        let unsearched = |f: &Finding| f.is(codes::NOT_ANALYSED) && !first.iter().any(|o| o.is_like(f));
        let (cut, other): (Vec<Finding>, Vec<Finding>) = late.findings.into_iter().partition(unsearched);
        late.findings = other;
        let open = (!late.needs_jobs).then_some(flow.open_at_start);
        flow.findings = in_both(first, &late.findings, open);
        flow.findings.extend(cut);
        // What was not looked at for a mistake that is none after all.
        if !flow.ended && late.ended {
            flow.findings.extend(late.findings.into_iter().filter(|f| f.is(codes::UNFINISHED)));
        }
    }
    flow
}

impl Interpreter<'_, '_> {
    /// Starts a job.
    pub(super) fn start_job(&mut self, name: &str, body: StepId, mut facts: AbstractState) -> Option<AbstractState> {
        let (start, writes) = (facts.time.clone(), self.sets_going(self.writes(body)));
        let (depth, blocks) = (self.guards.len(), self.blocks);
        let raced = self.raced_by_job(body);
        let base = self.stops_jobs.then(|| Rc::new(facts.clone()));
        let mut course = Rc::default();
        let mut fails = None;
        let end = match self.late {
            true => {
                if let Some(base) = &base {
                    course = self.course_aside(body, AbstractState::clone(base));
                }
                None
            }
            false => {
                let courses = std::mem::take(&mut self.courses);
                self.begin_course();
                let meantime = self.meantime(&writes, &facts);
                let before = facts.clone();
                let raised = self.guards.last().map_or(0, Vec::len);
                let after = self.job(body, &raced, facts);
                course = self.end_course();
                self.courses = courses;
                self.begun_job(name, body, &raced);
                match after {
                    Some(after) => {
                        facts = after;
                        let end = std::mem::replace(&mut facts.time, start.clone());
                        if end != start {
                            self.begin_again(meantime.as_ref(), &mut facts);
                        }
                        Some(end)
                    }
                    // Its failure comes where it is waited for.
                    None => {
                        facts = before;
                        self.widen(body, &mut facts);
                        fails = Some(self.guards.last().into_iter().flatten().skip(raised).cloned().collect());
                        Some(at_least(&start))
                    }
                }
            }
        };
        self.open_at_start = self.open_at_start.max(self.open);
        facts.begun.insert(name.to_owned(), true);
        self.jobs.insert(
            name.to_owned(),
            Job { body, start, end, writes, raced, course, base, depth, blocks, within: self.in_jobs, fails },
        );
        Some(facts)
    }

    /// Waits for a job.
    pub(super) fn await_job(&mut self, name: &str, facts: AbstractState) -> Option<AbstractState> {
        match facts.begun.get(name) {
            Some(true) => {}
            begun => {
                let some = begun.is_some();
                if some {
                    if !self.is_taken("job") {
                        self.never_began(name, true);
                    }
                } else {
                    self.unless_taken("job", |flow| flow.never_began(name, false));
                }
                self.raise("job", facts.clone());
                if !some {
                    return None;
                }
            }
        }
        self.end_of_job(name, facts)
    }

    fn end_of_job(&mut self, name: &str, mut facts: AbstractState) -> Option<AbstractState> {
        self.end_job(name);
        let Some(Job { body, start, end, writes, raced, fails, .. }) = self.jobs.remove(name) else {
            return Some(facts);
        };
        if let Some(raised) = fails {
            for (name, failed) in raised {
                let mut failed_by_now = facts.clone();
                self.left_by_job(body, &raced, &failed, &mut failed_by_now);
                self.raise(&name, failed_by_now);
            }
            return None;
        }
        let now = facts.time.clone();
        let end = match end {
            Some(end) => end,
            None => {
                let meantime = self.look_back(&writes, &mut facts);
                facts.time = start;
                facts = self.job(body, &raced, facts)?;
                let end = std::mem::replace(&mut facts.time, now.clone());
                self.begin_again(meantime.as_ref(), &mut facts);
                end
            }
        };
        self.catch_up(&end, &writes, &mut facts);
        self.moves_until(&end, &mut facts);
        let raced: Vec<u32> = raced.into_iter().collect();
        self.forget(&raced, &mut facts);
        facts.time = AbstractValue::binary(BinaryOp::Max, &now, &end);
        Some(facts)
    }

    /// What a job that has failed alone sets stays as it was then until the failure is taken.
    fn left_by_job(&mut self, body: StepId, raced: &BTreeSet<u32>, failed: &AbstractState, facts: &mut AbstractState) {
        let beside: BTreeSet<u32> = self.concurrent(body).into_iter().flat_map(|id| self.writes(id)).collect();
        let beside = self.sets_going(beside);
        let set_by_events =
            self.events.iter().flat_map(|event| self.changed_by(&event.actions)).collect::<BTreeSet<u32>>();
        let lasts = |s: &u32| {
            !raced.contains(s) && !beside.contains(s) && !set_by_events.contains(s) && self.derivative_of(*s).is_none()
        };
        for state in self.writes(body).into_iter().filter(lasts).collect::<Vec<u32>>() {
            let place = changed_by(&failed.history, &None, state).unwrap_or_else(|| self.site());
            self.overwrite(place, vec![(state, failed.states[state as usize].clone())], facts);
        }
    }

    /// The jobs that nothing waits for: a run ends when they have.
    pub(super) fn await_all(&mut self, mut facts: AbstractState) -> Option<AbstractState> {
        while let Some(name) = self.jobs.keys().next().cloned() {
            facts = self.end_of_job(&name, facts)?;
        }
        Some(facts)
    }

    fn job(&mut self, body: StepId, raced: &BTreeSet<u32>, facts: AbstractState) -> Option<AbstractState> {
        let mut noted = self.sets_going(self.beside(body));
        noted.extend(raced);
        let beside = self.concurrent(body);
        let met: BTreeSet<u32> = beside.into_iter().flat_map(|id| self.writes(id)).collect();
        let others: BTreeSet<u32> = self.sets_going(met).union(raced).copied().collect();
        self.meets.push(others.clone());
        self.begin_job(&noted);
        self.contested.push(others.intersection(&self.writes(body)).copied().collect());
        self.shared.push(others);
        let rival = Rival { steps: self.after_start(body), start: facts.time.clone(), later: false };
        self.rivals.push(vec![rival]);
        self.in_jobs += 1;
        let raised = self.guards.last().map_or(0, Vec::len);
        let after = self.walk(body, facts);
        self.blur(raised);
        self.in_jobs -= 1;
        self.rivals.pop();
        self.shared.pop();
        self.meets.pop();
        self.contested.pop();
        after
    }

    /// Whether the plan starts jobs that a written failure may stop.
    pub(super) fn may_stop_jobs(&self) -> bool {
        self.plan.steps.iter().any(|s| matches!(s.step, Step::Start { .. })) && self.is_stopped_by(&[self.plan.root])
    }

    /// A block ends: it waits for the jobs begun in it, or a failure has stopped them.
    pub(super) fn end_block(&mut self, after: Option<AbstractState>) -> Option<AbstractState> {
        self.end_block_at(self.guards.len(), after)
    }

    /// The same of a body whose handlers still take what its jobs raise.
    pub(super) fn end_body(&mut self, after: Option<AbstractState>) -> Option<AbstractState> {
        self.end_block_at(self.guards.len().saturating_sub(1), after)
    }

    /// The same for jobs begun deeper than so many bodies with handlers.
    fn end_block_at(&mut self, depth: usize, mut after: Option<AbstractState>) -> Option<AbstractState> {
        let blocks = self.blocks;
        while let Some((name, _)) = self.jobs.iter().find(|(_, job)| job.depth > depth || job.blocks > blocks) {
            let name = name.clone();
            after = match after {
                Some(facts) => self.end_of_job(&name, facts),
                None => {
                    self.end_job(&name);
                    self.jobs.remove(&name);
                    None
                }
            };
        }
        after
    }

    /// The states that jobs which go on change.
    pub(super) fn of_jobs(&self) -> impl Iterator<Item = &BTreeSet<u32>> {
        self.jobs.values().flat_map(|job| [&job.writes, &job.raced])
    }
}

/// What goes wrong in both orders. Where it does in either, if nowhere in both, the first order tells it: two that put something
/// in one place. What goes wrong in turns of a loop may be right turn by turn, and what a run need not come to proves nothing:
/// `open` choices and handlers are around both; none where no run goes on in the second order.
pub(super) fn in_both(first: Vec<Finding>, second: &[Finding], open: Option<usize>) -> Vec<Finding> {
    let both = first.iter().any(|f| second.iter().any(|o| o.is_like(f)));
    let is_come_to = |f: &Finding| open.is_some_and(|open| f.is_come_to(open));
    let wrong = |found: &[Finding]| found.iter().any(|f| f.is_error() && is_come_to(f));
    let either = !both && wrong(&first) && wrong(second);
    let stays = |f: Finding| match f.is(codes::NOT_ANALYSED) || second.iter().any(|o| o.is_like(&f)) {
        true => Some(f),
        false => (either && is_come_to(&f)).then(|| f.of_one_order()),
    };
    first.into_iter().filter_map(stays).collect()
}
