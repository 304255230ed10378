//! What is done: the tree of the workflow. Leaves are operations, every node keeps its span.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::codes::{self, Code};
use crate::model::{Action, Domain};
use crate::scene::InstanceId;
use crate::{NodeId, Said, Span, Text, Unit};

/// The longest time a run takes unless set otherwise, s of lab time: 30 days.
pub const LONGEST_RUN: f64 = 30.0 * 86_400.0;

/// A node of the plan, by its index in [`Plan::steps`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct StepId(pub u32);

/// A truth value with the text it was written as.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Not 0 if it holds.
    pub node: NodeId,
    /// As written.
    pub text: String,
    /// Where.
    pub span: Span,
    /// What it compares, for reports; empty where it compares no quantities.
    pub compared: Vec<Comparison>,
    /// The members of instances it reads, for the history of a finding.
    pub terms: Vec<Term>,
    /// The failure raised where it does not hold, if it names one.
    pub refusal: Option<Refusal>,
    /// Where it asks the same of each of several things: the thing (as text) and what is asked of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub each: Vec<Condition>,
}

impl Condition {
    /// The failure raised where it does not hold.
    pub fn failure(&self) -> &str {
        self.refusal.as_ref().map_or("need", |r| &r.failure)
    }

    /// The kind of finding where it does not hold.
    pub fn code(&self) -> Code {
        self.refusal.as_ref().map_or(codes::NEED_UNMET, Refusal::code)
    }

    /// How to mend it, where it says so.
    pub fn advice(&self) -> Option<String> {
        self.refusal.as_ref().and_then(|r| r.help.clone())
    }
}

/// A member that a condition reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// `plate.target`, `beaker.volume`.
    pub name: String,
    /// Its value.
    pub node: NodeId,
    /// What the value means and how it is shown.
    pub domain: Domain,
}

/// What a thing keeps at all times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// The thing.
    pub instance: InstanceId,
    /// What must hold.
    pub condition: Condition,
}

/// `else overflow "use a larger vessel"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// What handlers know it by.
    pub failure: String,
    /// How to mend it.
    pub help: Option<String>,
    /// What is so where it does not hold, in words: for all of it, or for each that it asks about.
    #[serde(default)]
    pub said: Vec<Said>,
}

impl Refusal {
    /// The registered code of this name, `volume-overflow` for `volume_overflow`; `need-unmet` without one.
    pub fn code(&self) -> Code {
        codes::find(&self.failure.replace('_', "-")).unwrap_or(codes::NEED_UNMET)
    }
}

/// `presumes ever active else never_started`, or `warns volume >= volumes.min else below_minimum`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Presumption {
    /// What is presumed.
    pub condition: Condition,
    /// Whether it is enough that it held at some moment before.
    pub ever: bool,
    /// Whether its finding is a warning whatever its code is.
    pub warns: bool,
}

/// One comparison inside a condition: `value` against limits, with the unit to show them in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// As written.
    pub text: String,
    /// The quantity compared.
    pub value: NodeId,
    /// Lower limit, if there is one.
    pub low: Option<NodeId>,
    /// Upper limit, if there is one.
    pub high: Option<NodeId>,
    /// Whether the limit itself is outside: `<`, not `<=`.
    pub strict: bool,
    /// Unit of the limits.
    pub unit: Unit,
}

/// How long something takes, s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Takes {
    /// Used at `process` fidelity.
    pub nominal: NodeId,
    /// Shortest and longest.
    pub bounds: Option<(NodeId, NodeId)>,
}

/// An argument of an operation, as a driver sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Argument {
    /// A quantity with the unit it was written in.
    Quantity(NodeId, Unit),
    /// An instance.
    Instance(InstanceId),
    /// Several instances.
    Instances(Vec<InstanceId>),
    /// A text.
    Text(String),
    /// One of these words, by its index.
    Word(NodeId, Vec<String>),
}

/// What a robot does with its body, for planners and pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// Brings what it holds, or else its tool, to a frame.
    To {
        /// The robot.
        mover: InstanceId,
        /// Whose frame.
        goal: InstanceId,
        /// Its name; empty for the thing itself.
        frame: String,
        /// An instance known only in a run, by its index, which goes before `goal`.
        choice: Option<NodeId>,
        /// How far from there, in the axes of the lab, m.
        shift: Option<[NodeId; 3]>,
        /// How far something hangs below the mover, m, where it says so; else as far as it stops above the frame.
        hanging: Option<NodeId>,
        /// Along a straight line.
        straight: bool,
        /// The share of the operation's time that the motion takes the place of, s; all of it without.
        within: Option<NodeId>,
    },
    /// Shifts its tool, in the axes of the lab.
    By {
        /// The robot.
        mover: InstanceId,
        /// x, y, z in metres.
        shift: [NodeId; 3],
        /// Along a straight line.
        straight: bool,
    },
    /// Brings what it holds to a frame without tilting it much on the way; without a load any way will do.
    Upright {
        /// The robot.
        mover: InstanceId,
        /// Whose frame.
        goal: InstanceId,
        /// Its name; empty for the thing itself.
        frame: String,
        /// By how much it may tilt, rad.
        within: NodeId,
    },
    /// Brings a point of what it holds to a frame, upright, and there tilts it so that the point's x axis sinks; what is
    /// tilted already is tilted further or back.
    Tilted {
        /// The robot.
        mover: InstanceId,
        /// What it holds and the point of it.
        about: (InstanceId, String),
        /// Whose frame.
        goal: InstanceId,
        /// Its name; empty for the thing itself.
        frame: String,
        /// From upright, rad.
        angle: NodeId,
        /// How far from the frame the point is held, m: the way it sinks, aside, up.
        shift: Option<[NodeId; 3]>,
        /// How long that takes at least, s: it goes as much slower.
        within: Option<NodeId>,
    },
    /// Drives itself to a frame: its origin comes above or below that, its x axis along the frame's.
    Drive {
        /// The robot.
        mover: InstanceId,
        /// Whose frame.
        goal: InstanceId,
        /// Its name; empty for the thing itself.
        frame: String,
    },
    /// Brings the joints that move its tip to positions, rad or m.
    Joints {
        /// The robot.
        mover: InstanceId,
        /// In the order of its description.
        positions: Vec<NodeId>,
    },
    /// Brings the joints that move its tip to where they stood when the run began.
    Home {
        /// The robot.
        mover: InstanceId,
    },
    /// Opens its empty gripper, or closes it, as far as it goes.
    Fingers {
        /// The robot.
        by: InstanceId,
        /// Opens.
        open: bool,
    },
    /// Closes its gripper on a thing, which may be in the hand of another robot.
    Grip {
        /// The thing.
        item: InstanceId,
        /// At which of its frames.
        frame: String,
        /// The robot.
        by: InstanceId,
    },
    /// Takes a part of a thing that moves, by a frame on it, to where the effects at the operation's end put it.
    Lead {
        /// The thing.
        item: InstanceId,
        /// The frame.
        frame: String,
        /// The robot.
        by: InstanceId,
    },
    /// Opens its gripper.
    Free {
        /// What it held.
        item: InstanceId,
        /// What carries it then, if it is known: a surface, or a robot that grips it as well.
        on: Option<InstanceId>,
        /// The robot.
        by: InstanceId,
    },
}

impl Motion {
    /// What a motion that cannot be carried out fails with.
    pub const FAILURES: [&str; 11] = [
        "collision",
        "dropped",
        "jammed",
        "missed",
        "no_way",
        "slip",
        "spilled",
        "too_wide",
        "toppled",
        "unmovable",
        "unreachable",
    ];
    /// What any step fails with during which a part that moves by itself runs into something, or a vessel in hand is filled over its rim.
    pub const FAILURES_BESIDE: [&str; 2] = ["collision", "spilled"];

    /// The robot that moves.
    pub fn mover(&self) -> InstanceId {
        match self {
            Motion::To { mover, .. } | Motion::By { mover, .. } | Motion::Upright { mover, .. } => *mover,
            Motion::Tilted { mover, .. } | Motion::Joints { mover, .. } | Motion::Home { mover } => *mover,
            Motion::Drive { mover, .. } => *mover,
            Motion::Fingers { by, .. } | Motion::Grip { by, .. } => *by,
            Motion::Free { by, .. } | Motion::Lead { by, .. } => *by,
        }
    }

    /// Whose frame it goes to.
    pub fn goal(&self) -> Option<(InstanceId, &str)> {
        match self {
            Motion::To { goal, frame, .. } | Motion::Upright { goal, frame, .. } => Some((*goal, frame)),
            Motion::Tilted { goal, frame, .. } | Motion::Lead { item: goal, frame, .. } => Some((*goal, frame)),
            Motion::Drive { goal, frame, .. } => Some((*goal, frame)),
            _ => None,
        }
    }

    /// The same motion to what `value` says was chosen; nothing where that is not known.
    pub fn chosen(&self, value: impl Fn(NodeId) -> Option<f64>) -> Option<Motion> {
        let mut motion = self.clone();
        if let Motion::To { goal, choice, .. } = &mut motion
            && let Some(node) = choice.take()
        {
            *goal = value(node).filter(|id| *id >= 0.0).map(|id| InstanceId(id as u32))?;
        }
        Some(motion)
    }

    /// The node that tells which thing it goes to, where only that does.
    pub fn choice(&self) -> Option<NodeId> {
        match self {
            Motion::To { choice, .. } => *choice,
            _ => None,
        }
    }

    /// The quantities it depends on, in their order.
    pub fn values(&self) -> Vec<NodeId> {
        match self {
            Motion::By { shift, .. } => shift.to_vec(),
            Motion::To { shift, hanging, .. } => shift.iter().flatten().copied().chain(*hanging).collect(),
            Motion::Upright { within, .. } => vec![*within],
            Motion::Tilted { angle, shift, within, .. } => {
                let all = [*angle].into_iter().chain(shift.iter().flatten().copied()).chain(*within);
                all.collect()
            }
            Motion::Joints { positions, .. } => positions.clone(),
            _ => Vec::new(),
        }
    }
}

/// A leaf: a command of a device or a primitive skill.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Operation {
    /// The verb as declared: `heat`, `stop heating`, `move`.
    pub verb: String,
    /// The capability that declares the command; absent for an extern skill.
    pub capability: Option<String>,
    /// The device the command is for, or the first argument of a skill.
    pub device: Option<InstanceId>,
    /// By parameter name, in order of declaration.
    pub arguments: Vec<(String, Argument)>,
    /// Must hold when it starts.
    pub needs: Vec<Arc<Condition>>,
    /// Looked at before the run only: what holds on no way through the plan is a mistake in it.
    pub presumes: Vec<Presumption>,
    /// Applied when it starts (commands).
    pub at_start: Vec<Action>,
    /// Applied when it ends (extern skills).
    pub at_end: Vec<Action>,
    /// How long it takes; at once if absent.
    pub takes: Option<Takes>,
    /// It lasts until this holds, if present.
    pub until: Option<Condition>,
    /// Instances it writes, for its duration.
    pub claims: Vec<InstanceId>,
    /// States that its needs and effects look at, where it is over at once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reads: Vec<u32>,
    /// Failures it may report.
    pub fails: Vec<String>,
    /// Limits that its effects may pass, by index into [`Plan::limits`].
    pub limits: Vec<u32>,
    /// What its robot does; `None` where nothing moves.
    pub motion: Option<Motion>,
}

impl Operation {
    /// Whether it is over at the moment it begins.
    pub fn is_at_once(&self) -> bool {
        self.takes.is_none() && self.until.is_none()
    }

    /// The states it assigns; none where it moves matter, which changes more than these, or has no effects.
    pub fn assigned(&self) -> Option<Vec<u32>> {
        let actions = self.at_start.iter().chain(&self.at_end);
        let assigned: Option<Vec<u32>> = actions.map(Action::assigned).collect();
        // Of a command without effects nobody knows what it changes.
        assigned.filter(|states| !states.is_empty())
    }

    /// Whether two commands of one thing can be given at the same moment: both are over at once, and neither changes what the
    /// other one changes or looks at, so that their order decides nothing.
    pub fn is_independent_of(&self, other: &Operation) -> bool {
        let (Some(own), Some(others)) = (self.assigned(), other.assigned()) else { return false };
        let apart = |states: &[u32], from: &Operation, writes: &[u32]| {
            states.iter().all(|s| !writes.contains(s) && !from.reads.contains(s))
        };
        self.is_at_once() && other.is_at_once() && apart(&own, other, &others) && apart(&others, self, &own)
    }
}

/// Which failures a handler takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Caught {
    /// `on slip { }`.
    Named(String),
    /// `on failure { }`: every one.
    Any,
}

/// What one node does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Step {
    /// One after the other.
    Sequence(Vec<StepId>),
    /// All at once, until all have ended; a failing branch stops its siblings at their next step boundary.
    Parallel(Vec<StepId>),
    /// A command or a primitive skill.
    Operation(Box<Operation>),
    /// Body with failure handlers and a `finally` that always runs.
    Guarded {
        /// What is tried.
        body: StepId,
        /// The first that catches the failure runs.
        handlers: Vec<(Caught, StepId)>,
        /// Runs afterwards in every case, cancellation included.
        finally: Option<StepId>,
    },
    /// The body of the innermost `Guarded` starts again, at most `times` times; stands only in a handler.
    Retry {
        /// How often.
        times: NodeId,
    },
    /// Ordered alternatives: the next is tried when one fails.
    Try(Vec<StepId>),
    /// Called skill: checks `needs` before and `effects` after its body.
    Skill {
        /// Its verb.
        verb: String,
        /// Must hold when it starts.
        needs: Vec<Arc<Condition>>,
        /// Must hold all the time.
        invariants: Vec<Condition>,
        /// Must hold when it ends: the promised effects.
        promises: Vec<Condition>,
        /// Bounds of its duration, checked when it ends.
        takes: Option<Takes>,
        /// What it does.
        body: StepId,
    },
    /// `step NAME { }`: notes when the body starts and ends.
    Named {
        /// Its name.
        name: String,
        /// Local that receives the start time, s.
        start: u32,
        /// Local that receives the end time, s.
        end: u32,
        /// What it does.
        body: StepId,
    },
    /// `let x = ...`: evaluates once, with readings taken now.
    Let {
        /// Local that receives the value.
        local: u32,
        /// The value.
        value: NodeId,
    },
    /// Waits for a time, s.
    Wait {
        /// How long.
        duration: NodeId,
    },
    /// Waits for a condition; `timeout` raises the failure `timeout`.
    WaitUntil {
        /// What is waited for.
        condition: Condition,
        /// At most this long, s.
        timeout: Option<NodeId>,
    },
    /// Waits for a condition, then needs it unbroken for a while; a break starts the clock again.
    Hold {
        /// What must hold.
        condition: Condition,
        /// For how long, s.
        duration: NodeId,
        /// At most this long in all, s.
        timeout: Option<NodeId>,
    },
    /// An invariant over a body; a breach raises the failure `broken`.
    Keep {
        /// What must hold all the time.
        condition: Condition,
        /// What it does.
        body: StepId,
    },
    /// What must hold while an operation lasts; it is halted where that breaks, with the failure `broken`.
    During {
        /// All of them, looked at from its start on.
        invariants: Vec<Condition>,
        /// The operation.
        body: StepId,
    },
    /// Its body must start at most `limit` after `since`; else the failure `late`.
    Within {
        /// s.
        limit: NodeId,
        /// A time, s.
        since: NodeId,
        /// What it does.
        body: StepId,
    },
    /// One branch or the other.
    If {
        /// Which.
        condition: Condition,
        /// If it holds.
        then: StepId,
        /// If it does not.
        otherwise: Option<StepId>,
    },
    /// A number of times.
    Repeat {
        /// How often; not a whole number is a fault.
        times: NodeId,
        /// What is repeated.
        body: StepId,
    },
    /// While a condition holds, at most `max` times; holding longer raises the failure `max`.
    RepeatWhile {
        /// Looked at before each turn.
        condition: Condition,
        /// At most this often.
        max: NodeId,
        /// What is repeated.
        body: StepId,
    },
    /// Waits for the instances to be free and holds them to its end.
    Claim {
        /// Which.
        claims: Vec<InstanceId>,
        /// What it does.
        body: StepId,
    },
    /// Starts a job that runs beside what follows.
    Start {
        /// Its name.
        job: String,
        /// What it does.
        body: StepId,
    },
    /// Waits for a job; its failure becomes this step's.
    Await {
        /// Its name.
        job: String,
    },
    /// Raises a failure.
    Fail {
        /// Its name.
        name: String,
        /// In words.
        text: Text,
    },
    /// Judges; a failed expectation does not stop the run but makes its result a failure.
    Expect(Vec<Condition>),
    /// Records a value at a fixed interval from here to the end of the run.
    Record {
        /// Name in the recording.
        name: String,
        /// One node, or several for a tuple.
        value: Vec<NodeId>,
        /// As shown.
        unit: Unit,
        /// Interval, s.
        every: NodeId,
    },
    /// A remark in the recording.
    Note(Text),
    /// A person confirms; in simulation at once.
    Ask(Text),
}

impl Step {
    /// Whether it waits for the jobs that begin in it.
    pub fn waits_for_jobs(&self) -> bool {
        matches!(
            self,
            Step::Guarded { .. }
                | Step::Try(_)
                | Step::Skill { .. }
                | Step::Keep { .. }
                | Step::During { .. }
                | Step::Claim { .. }
        )
    }

    /// The nodes directly below one, in order.
    pub fn children(&self) -> Vec<StepId> {
        match self {
            Step::Sequence(list) | Step::Parallel(list) | Step::Try(list) => list.clone(),
            Step::Guarded { body, handlers, finally } => {
                std::iter::once(*body).chain(handlers.iter().map(|(_, h)| *h)).chain(*finally).collect()
            }
            Step::If { then, otherwise, .. } => std::iter::once(*then).chain(*otherwise).collect(),
            Step::Skill { body, .. }
            | Step::Named { body, .. }
            | Step::Keep { body, .. }
            | Step::During { body, .. }
            | Step::Within { body, .. }
            | Step::Repeat { body, .. }
            | Step::RepeatWhile { body, .. }
            | Step::Claim { body, .. }
            | Step::Start { body, .. } => vec![*body],
            _ => Vec::new(),
        }
    }
}

/// A node of the tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanStep {
    /// As shown: `place beaker on hotplate by panda`, `parallel`, `step grow`.
    pub label: String,
    /// Its statement.
    pub span: Span,
    /// What it does.
    pub step: Step,
}

/// A value the plan keeps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Local {
    /// `first`, `grow.start`.
    pub name: String,
    /// As shown.
    pub unit: Unit,
}

/// The compiled workflow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the workflow.
    pub workflow: String,
    /// Its parameters as bound, as shown.
    pub arguments: Vec<(String, String)>,
    /// All nodes.
    pub steps: Vec<PlanStep>,
    /// The top of the tree.
    pub root: StepId,
    /// By the index used in `Op::Local`; not a number until set.
    pub locals: Vec<Local>,
    /// What must hold at the start and after every operation.
    pub limits: Vec<Limit>,
    /// What should hold when it has ended: nothing is left on or in hand.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<Limit>,
}

impl Plan {
    /// Where its workflow stands.
    pub fn span(&self) -> Span {
        self.steps.get(self.root.0 as usize).map(|step| step.span).unwrap_or_default()
    }

    /// One node.
    pub fn get(&self, id: StepId) -> &PlanStep {
        &self.steps[id.0 as usize]
    }
}
