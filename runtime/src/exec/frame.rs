//! Activations of plan nodes: one frame for each node that has begun and not ended.

use matterix_ir::NodeId;
use matterix_ir::plan::StepId;

use super::failure::FailureTrace;
use crate::backend::{Follow, Ticket, next_report};

/// A frame, by order of creation; never used twice in a run.
pub(super) type FrameId = u64;

/// How a frame ended.
#[derive(Clone, Debug)]
pub(super) enum End {
    Done,
    Failed(Box<FailureTrace>),
    /// On its way to the innermost handler, whose body begins again at most so often.
    Retry(u64),
    /// Abandoned because the run, a sibling's failure or a breach asked for it.
    Stopped,
}

/// Why a frame is to end early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stop {
    /// At its next step boundary: running operations end first.
    Boundary,
    /// At once: running operations are halted.
    Now,
}

/// What is to be done next, without recursion.
#[derive(Clone, Debug)]
pub(super) enum Task {
    Enter(FrameId),
    Finish(FrameId, End),
}

/// A condition on the watch.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    /// As in the plan; judged with measured values.
    pub condition: NodeId,
    pub follow: Follow,
    /// When it is looked at next, where readings report at intervals.
    pub next: f64,
}

impl Follower {
    pub fn new(condition: NodeId, follow: Follow, now: f64) -> Self {
        let mut follower = Follower { condition, follow, next: f64::INFINITY };
        follower.looked(now);
        follower
    }

    /// It has been looked at.
    pub fn looked(&mut self, now: f64) {
        if let Follow::Every(periods) = &self.follow {
            self.next = next_report(periods, now);
        }
    }

    /// The node to evaluate: what is watched, or the measured condition.
    pub fn node(&self) -> NodeId {
        match self.follow {
            Follow::Watch(node) => node,
            _ => self.condition,
        }
    }
}

/// A condition that must hold while a frame lives.
#[derive(Clone, Debug)]
pub(super) struct Monitor {
    pub follower: Follower,
    /// Its index among the conditions of the step.
    pub index: usize,
}

/// The part of a `Guarded` that runs.
#[derive(Clone, Debug)]
pub(super) enum Phase {
    Body,
    /// With the failure that is handled.
    Handler(Box<FailureTrace>),
    /// With what is to be passed on afterwards.
    Finally(End),
}

/// State of an activation.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    /// Not begun yet.
    New,
    /// Ends as its only child ends.
    Pass,
    Sequence {
        next: usize,
    },
    Parallel {
        /// What the first branch that did not end well ended with.
        end: Option<End>,
    },
    /// Waits until it may begin: a person lets nothing new begin.
    Held,
    /// A question is open.
    Asked {
        ticket: Ticket,
    },
    /// Waits for the instances it uses (inside a `finally`).
    Acquire,
    Operation {
        ticket: Ticket,
        until: Option<f64>,
        watch: Option<NodeId>,
    },
    Guarded {
        phase: Phase,
        retries: u64,
    },
    Try {
        index: usize,
    },
    /// A skill or a `keep`.
    Monitored {
        monitors: Vec<Monitor>,
        breach: Option<Box<FailureTrace>>,
    },
    Named,
    Wait {
        at: f64,
    },
    WaitUntil {
        follower: Follower,
        deadline: f64,
    },
    Hold {
        follower: Follower,
        duration: f64,
        /// When it will have held long enough, while it holds.
        end: Option<f64>,
        deadline: f64,
    },
    Repeat {
        left: u64,
    },
    RepeatWhile {
        left: u64,
        /// Whether no turn has been taken yet.
        first: bool,
    },
    Claim {
        granted: bool,
    },
    Await {
        job: FrameId,
    },
}

/// A job that was started beside what follows.
#[derive(Clone, Debug)]
pub(super) struct Job {
    pub name: String,
    pub frame: FrameId,
    /// Absent while it runs.
    pub end: Option<End>,
    /// Whether someone has taken its result.
    pub awaited: bool,
}

/// An activation of a plan node.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// Absent for the frame around the whole plan.
    pub step: Option<StepId>,
    pub parent: Option<FrameId>,
    pub children: Vec<FrameId>,
    pub started: f64,
    pub stop: Option<Stop>,
    /// Whether it runs beside its parent's body.
    pub job: bool,
    /// Whether somebody outside has asked for it: what becomes of it is nobody else's business.
    pub asked: bool,
    /// Whether it stands in a `finally`.
    pub finally: bool,
    pub kind: Kind,
    pub jobs: Vec<Job>,
    /// What the body ended with, while jobs are waited for.
    pub joining: Option<End>,
}

impl Frame {
    /// Whether a stop passes it by: a `finally` runs to its end.
    pub fn shields(&self) -> bool {
        matches!(self.kind, Kind::Guarded { phase: Phase::Finally(_), .. })
    }

    /// Whether it waits for something outside of it and may simply be given up.
    pub fn waits(&self) -> bool {
        matches!(
            self.kind,
            Kind::Held
                | Kind::Asked { .. }
                | Kind::Wait { .. }
                | Kind::WaitUntil { .. }
                | Kind::Hold { .. }
                | Kind::Claim { granted: false }
                | Kind::Acquire
                | Kind::Await { .. }
        )
    }
}
