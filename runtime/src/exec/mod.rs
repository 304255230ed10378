//! The executor: runs a plan on a backend.
//!
//! Every node that has begun has a frame with an explicit state; a stack of tasks begins and ends frames without
//! recursion, so that nesting is bounded by memory only. When no task is left, time advances to the earliest of timers,
//! ends of operations, watched conditions and reports of readings, and the frames concerned are looked at in the order
//! in which they began. Nothing depends on a wall clock or on hashing: a run is a function of plan, backend and seed.
//!
//! **Stopping.** A failing branch, a breach of an invariant, a cancellation and a fault all mark a subtree. Waits end at
//! once; running operations end first, or are halted on cancellation and fault; each `finally` on the way runs. A stop
//! never reaches into a `finally` that runs, except where the backend itself can no longer go on.
//!
//! **Jobs** belong to the innermost block that handles failures or holds something (guarded block, alternative, skill,
//! `keep`, `claim`, the run): they have ended before it goes on. The failure of a job that nobody awaits is the block's.

mod alarm;
mod behind;
mod claims;
mod end;
mod ends;
mod enter;
mod failure;
mod frame;
mod jobs;
mod judge;
mod kept;
mod listener;
mod monitored;
mod operate;
mod stop;
mod tee;
mod tree;
mod wake;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::codes::{self, Code};
use matterix_ir::plan::{LONGEST_RUN, Limit, Plan, StepId};
use matterix_ir::scene::Scene;
use matterix_ir::{NodeId, Unit};
use serde::{Deserialize, Serialize};

pub use failure::{FailureTrace, Measured, TraceStep, diagnostic, expectation_diagnostic};
pub use listener::{Alarm, Asked, Assumption, ExpectationResult, Listener, OperationState, StepState, Verdict};
pub use tee::Tee;

use crate::backend::Backend;
use crate::fault::Fault;
pub use claims::Turn;

use claims::Claims;
use frame::{End, Frame, FrameId, Kind, Stop, Task};

/// Longest horizon, s: time stays exact to better than a millisecond.
const MAX_HORIZON: f64 = 1e12;

/// Bounds of a run.
#[derive(Clone, Copy, Debug)]
pub struct Limits<'c> {
    /// Longest run, s of lab time; what waits beyond it waits for ever.
    pub horizon: f64,
    /// Steps taken within one instant, at most.
    pub steps_per_instant: usize,
    /// Set from outside to end the run early; every `finally` still runs.
    pub cancel: Option<&'c AtomicBool>,
    /// The turns that claiming blocks take, in order; without one, a block takes its turn as it asks.
    pub turns: &'c [Turn],
    /// What is looked at when.
    pub looks: Probes<'c>,
}

/// Quantities that are looked at, at some times.
#[derive(Clone, Copy, Debug, Default)]
pub struct Probes<'c> {
    /// s, ascending; those after the end of the run are left out.
    pub times: &'c [f64],
    /// The quantities.
    pub nodes: &'c [NodeId],
}

impl Default for Limits<'_> {
    /// 30 days, a million steps.
    fn default() -> Self {
        Limits { horizon: LONGEST_RUN, steps_per_instant: 100_000, cancel: None, turns: &[], looks: Probes::default() }
    }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// To its end, all expectations met.
    Passed,
    /// To its end, but not all expectations met, or with something left on or in hand.
    ExpectationFailed,
    /// With a failure that nothing handled.
    Failed,
    /// From outside.
    Cancelled,
    /// The model, the plan or the backend could not go on.
    Fault,
}

/// A node of the plan over the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Where it stands.
    pub state: StepState,
    /// When it last began, s.
    pub started: Option<f64>,
    /// When it last ended, s.
    pub ended: Option<f64>,
    /// How often it began.
    pub runs: u32,
}

/// What came of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Execution {
    /// How it ended.
    pub status: RunStatus,
    /// What ended it, if something did.
    pub failure: Option<FailureTrace>,
    /// Failures that did not decide the end: in a `finally`, or in branches that were being stopped.
    pub suppressed: Vec<FailureTrace>,
    /// What the run has left on or in hand, with the steps that used it last.
    pub unfinished: Vec<FailureTrace>,
    /// In the order of their judgement.
    pub expectations: Vec<ExpectationResult>,
    /// Conditions that were taken to hold.
    pub assumptions: Vec<Assumption>,
    /// By [`StepId`].
    pub steps: Vec<StepRecord>,
    /// s.
    pub end_time: f64,
}

/// What a plan is carried out with.
pub struct Around<'p, 'b> {
    /// The plan.
    pub plan: &'p Plan,
    /// Its things.
    pub scene: &'p Scene,
    /// Who carries it out.
    pub backend: &'b mut dyn Backend,
    /// Bounds.
    pub limits: Limits<'b>,
    /// Who is told.
    pub out: &'b mut dyn Listener,
}

/// Runs `plan` on `backend` to its end.
pub fn execute(
    plan: &Plan,
    scene: &Scene,
    backend: &mut dyn Backend,
    limits: Limits<'_>,
    out: &mut dyn Listener,
) -> Execution {
    let mut progress = Progress::new(plan, backend.now(), limits);
    progress.go_on(Around { plan, scene, backend, limits, out }, f64::INFINITY);
    progress.into_execution(out)
}

/// Why the whole run ends early.
#[derive(Clone, Debug)]
enum Abort {
    Cancelled,
    Fault(Box<FailureTrace>),
}

/// A `record` that samples.
#[derive(Clone, Debug)]
struct Recording<'p> {
    name: &'p str,
    value: &'p [NodeId],
    unit: &'p Unit,
    since: f64,
    every: f64,
    turn: u64,
}

/// A sample that is due within this part of its interval counts as due: what is left is rounding.
const ROUNDING: f64 = 1e-9;

impl Recording<'_> {
    fn due(&self) -> f64 {
        self.since + self.turn as f64 * self.every
    }

    fn is_due(&self, now: f64) -> bool {
        self.due() <= now + (ROUNDING * self.every).max(4.0 * f64::EPSILON * now)
    }
}

/// Where a run stands. A clone goes on as it does, on a clone of its backend.
#[derive(Clone, Debug)]
pub struct Progress<'p> {
    frames: BTreeMap<FrameId, Frame>,
    created: FrameId,
    tasks: Vec<Task>,
    claims: Claims,
    behind: behind::Behind,
    recordings: BTreeMap<StepId, Recording<'p>>,
    /// How many of the times have come at which something is looked at.
    looked: usize,
    job_names: BTreeSet<&'p str>,
    steps: Vec<StepRecord>,
    now: f64,
    /// The end of lab time; moved on when it has been reached and the run unwinds.
    horizon: f64,
    /// Steps taken at this instant.
    taken: usize,
    abort: Option<Abort>,
    /// What should hold at the end and held at the start, once it has begun.
    begun: Option<Vec<&'p Limit>>,
    /// How the whole plan ended.
    end: Option<End>,
    suppressed: Vec<FailureTrace>,
    unfinished: Vec<FailureTrace>,
    /// The first no to a question or a request in a `finally`, which held nothing up.
    declined: Option<FailureTrace>,
    expectations: Vec<ExpectationResult>,
    assumptions: Vec<Assumption>,
    /// Nothing is left to do.
    is_over: bool,
}

/// A run while it goes on.
struct Executor<'p, 'b> {
    plan: &'p Plan,
    scene: &'p Scene,
    backend: &'b mut dyn Backend,
    out: &'b mut dyn Listener,
    limits: Limits<'b>,
    /// It pauses here, s.
    until: f64,
    state: &'b mut Progress<'p>,
}

impl<'p> Progress<'p> {
    /// Of a plan that has not begun, `now` s after the start of lab time.
    pub fn new(plan: &'p Plan, now: f64, limits: Limits<'_>) -> Self {
        Progress {
            frames: BTreeMap::new(),
            created: 0,
            tasks: Vec::new(),
            claims: Claims::with_turns(limits.turns),
            behind: behind::Behind::default(),
            recordings: BTreeMap::new(),
            looked: 0,
            job_names: BTreeSet::new(),
            steps: vec![StepRecord::default(); plan.steps.len()],
            now,
            horizon: now + limits.horizon.clamp(0.0, MAX_HORIZON),
            taken: 0,
            abort: None,
            begun: None,
            end: None,
            suppressed: Vec::new(),
            unfinished: Vec::new(),
            declined: None,
            expectations: Vec::new(),
            assumptions: Vec::new(),
            is_over: false,
        }
    }

    /// Goes on to `until`, s of lab time, or to the end of the plan; whether that has come. Nothing that happens depends on where
    /// it pauses.
    pub fn go_on(&mut self, around: Around<'p, '_>, until: f64) -> bool {
        let Around { plan, scene, backend, limits, out } = around;
        if !self.is_over {
            let mut run = Executor { plan, scene, backend, out, limits, until, state: self };
            run.drive();
        }
        self.is_over
    }
}

impl<'p> Executor<'p, '_> {
    /// Runs to the end, or to where it pauses: tasks first, then time.
    fn drive(&mut self) {
        if self.state.begun.is_none() && !self.begin_plan() {
            self.state.is_over = true;
            return;
        }
        while self.state.end.is_none() {
            if self.is_to_end() {
                self.state.abort = Some(Abort::Cancelled);
                self.stop_all(Stop::Now, false);
                self.drain();
                continue;
            }
            if self.state.now >= self.until {
                return;
            }
            self.begin_asked();
            self.pass_time();
        }
        let begun = self.state.begun.take().unwrap_or_default();
        if let Err(fault) = self.judge_ends(&begun) {
            self.abort(FailureTrace::of_fault(self.plan, fault));
        }
        self.state.is_over = true;
    }

    /// Begins the plan; false where it is none.
    fn begin_plan(&mut self) -> bool {
        if let Err(message) = tree::check(self.plan) {
            let fault = Fault::new(codes::RUN_FAILED, 0.0, message);
            self.state.abort = Some(Abort::Fault(Box::new(FailureTrace::of_fault(self.plan, fault))));
            return false;
        }
        match self.in_order() {
            Ok(begun) => self.state.begun = Some(begun),
            Err(fault) => {
                self.abort(FailureTrace::of_fault(self.plan, fault));
                return false;
            }
        }
        let root = self.insert(None, None);
        self.set_kind(root, Kind::Pass);
        self.spawn(root, self.plan.root);
        self.alarmed();
        self.drain();
        true
    }

    /// Whether somebody has ended it early, which has not been heeded yet.
    fn is_to_end(&self) -> bool {
        self.state.abort.is_none() && self.limits.cancel.is_some_and(|c| c.load(Ordering::Relaxed))
    }

    /// Works off all tasks.
    fn drain(&mut self) {
        while let Some(task) = self.state.tasks.pop() {
            self.state.taken += 1;
            if self.state.taken > self.limits.steps_per_instant {
                self.state.tasks.push(task);
                self.give_up_instant();
                continue;
            }
            match task {
                Task::Enter(id) => self.enter(id),
                Task::Finish(id, end) => self.finish(id, end),
            }
        }
    }

    fn give_up_instant(&mut self) {
        self.state.taken = 0;
        let message = format!("the run takes more than {} steps at one instant", self.limits.steps_per_instant);
        let fault = self.run_fault(codes::ENDLESS_INSTANT, message);
        self.fault_everywhere(fault);
    }

    fn run_fault(&self, code: Code, message: String) -> Fault {
        Fault::new(code, self.state.now, message)
    }

    /// A new frame under `parent`.
    fn insert(&mut self, parent: Option<FrameId>, step: Option<StepId>) -> FrameId {
        let id = self.state.created;
        self.state.created += 1;
        let finally = parent.and_then(|p| self.state.frames.get(&p)).is_some_and(|p| p.finally || p.shields());
        let frame = Frame {
            step,
            parent,
            children: Vec::new(),
            started: self.state.now,
            stop: None,
            job: false,
            asked: false,
            finally,
            kind: Kind::New,
            jobs: Vec::new(),
            joining: None,
        };
        self.state.frames.insert(id, frame);
        if let Some(parent) = parent.and_then(|p| self.state.frames.get_mut(&p)) {
            parent.children.push(id);
        }
        id
    }

    /// A child that begins when its task is reached.
    fn spawn(&mut self, parent: FrameId, step: StepId) -> FrameId {
        let id = self.insert(Some(parent), Some(step));
        self.state.tasks.push(Task::Enter(id));
        id
    }

    fn set_kind(&mut self, id: FrameId, kind: Kind) {
        if let Some(frame) = self.state.frames.get_mut(&id) {
            frame.kind = kind;
        }
    }

    fn push_end(&mut self, id: FrameId, end: End) {
        self.state.tasks.push(Task::Finish(id, end));
    }

    /// The frames around `id`, innermost first, without itself.
    fn ancestors(&self, id: FrameId) -> impl Iterator<Item = FrameId> {
        std::iter::successors(self.parent(id), |&p| self.parent(p))
    }

    fn parent(&self, id: FrameId) -> Option<FrameId> {
        self.state.frames.get(&id).and_then(|f| f.parent)
    }

    fn mark(&mut self, step: StepId, state: StepState) {
        let record = &mut self.state.steps[step.0 as usize];
        record.state = state;
        match state {
            StepState::Running => {
                record.started = Some(self.state.now);
                record.ended = None;
                record.runs += 1;
            }
            StepState::Done | StepState::Failed => record.ended = Some(self.state.now),
            StepState::Skipped if record.started.is_some() && record.ended.is_none() => {
                record.ended = Some(self.state.now)
            }
            StepState::Skipped | StepState::Pending => {}
        }
        self.out.step(self.state.now, step, state);
    }
}

impl Progress<'_> {
    /// What has come of it. What has not begun by then is skipped, and `out` is told so.
    pub fn into_execution(mut self, out: &mut dyn Listener) -> Execution {
        for (step, record) in (0..).map(StepId).zip(&mut self.steps) {
            if record.state == StepState::Pending {
                record.state = StepState::Skipped;
                out.step(self.now, step, StepState::Skipped);
            }
        }
        let unmet = self.expectations.iter().any(|e| e.verdict == Verdict::Failed);
        let (status, failure) = match (self.abort, self.end) {
            (Some(Abort::Fault(trace)), _) => (RunStatus::Fault, Some(*trace)),
            (Some(Abort::Cancelled), _) => (RunStatus::Cancelled, None),
            (None, Some(End::Failed(trace))) => (RunStatus::Failed, Some(*trace)),
            (None, _) if self.declined.is_some() => (RunStatus::Failed, self.declined),
            (None, _) if unmet || !self.unfinished.is_empty() => (RunStatus::ExpectationFailed, None),
            (None, _) => (RunStatus::Passed, None),
        };
        Execution {
            status,
            failure,
            suppressed: self.suppressed,
            unfinished: self.unfinished,
            expectations: self.expectations,
            assumptions: self.assumptions,
            steps: self.steps,
            end_time: self.now,
        }
    }
}
