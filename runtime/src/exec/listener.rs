//! What a run tells the outside while it goes on.

use matterix_ir::plan::{Condition, Operation, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, Span, Unit};
use serde::{Deserialize, Serialize};

use crate::contact::Sighting;
use crate::motion::{Burden, Moment};

use super::failure::{FailureTrace, Measured};
use crate::process::{Engine, Observer};

/// Where a node of the plan stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StepState {
    /// Not begun.
    #[default]
    Pending,
    /// Going on.
    Running,
    /// Ended well.
    Done,
    /// Ended with a failure.
    Failed,
    /// Not needed, or stopped before its end.
    Skipped,
}

/// Where an operation stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OperationState {
    /// Its effects at start have been applied.
    Started,
    /// Its effects at end have been applied.
    Ended,
    /// Abandoned.
    Halted,
    /// The device reported a failure.
    Failed,
}

/// How an expectation was judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It holds.
    Passed,
    /// It does not.
    Failed,
    /// It depends on what cannot be known here.
    #[serde(rename = "not observed")]
    NotObserved,
}

/// One judged expectation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectationResult {
    /// The node of the plan.
    pub step: StepId,
    /// As written.
    pub text: String,
    /// Where.
    pub span: Span,
    /// When, s.
    pub time: f64,
    /// How it was judged.
    pub verdict: Verdict,
    /// What was measured.
    pub compared: Vec<Measured>,
}

/// A condition that could not be known and was taken to hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumption {
    /// The node of the plan.
    pub step: StepId,
    /// As written.
    pub text: String,
    /// Where.
    pub span: Span,
    /// When, s.
    pub time: f64,
}

/// A step that is asked for from outside of the plan's course.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// A node of the plan that its root does not lead to.
    pub step: StepId,
    /// Values for locals of the plan, SI.
    pub locals: Vec<(u32, f64)>,
}

/// What must not be and has come about, or would by an operation: a failure that handlers take by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Alarm {
    /// What handlers know it by: `incompatible_mix`, or the name of a hazard.
    pub name: String,
    /// The finding: what came about, and how to mend it.
    pub found: Diagnostic,
    /// The operation that brought it about, and the steps around it, innermost first.
    pub around: Vec<StepId>,
}

/// Receives what happens, in order; times are seconds since the run began. Every method may be left out.
#[expect(unused_variables, reason = "the defaults ignore their arguments")]
pub trait Listener: Observer {
    /// A node of the plan changed its state.
    fn step(&mut self, time: f64, step: StepId, state: StepState) {}
    /// What it wants to know whenever a node of the plan begins.
    fn wanted(&self, step: StepId) -> Vec<NodeId> {
        Vec::new()
    }
    /// A node of the plan begins: the values of what was wanted, SI, those that can be known.
    fn begins(&mut self, time: f64, step: StepId, values: &[Option<f64>]) {}
    /// An operation changed its state.
    fn operation(&mut self, time: f64, step: StepId, operation: &Operation, state: OperationState) {}
    /// An expectation was judged.
    fn expectation(&mut self, result: &ExpectationResult) {}
    /// A failure was raised, or a fault occurred; a handler may still take a failure.
    fn failure(&mut self, failure: &FailureTrace) {}
    /// A condition could not be known and was taken to hold.
    fn assumed(&mut self, time: f64, step: StepId, condition: &Condition) {}
    /// A sample of a `record`, one value or the parts of a tuple, SI.
    fn record(&mut self, time: f64, step: StepId, name: &str, values: &[f64], unit: &Unit) {}
    /// What was asked for is looked at, for the time with this number: SI.
    fn looked(&mut self, number: usize, values: &[f64]) {}
    /// The run has ended, and this is how the model stands.
    fn ended(&mut self, engine: &Engine<'_>) {}
    /// What a device reported when it was looked at: the reading's index in the model, SI.
    fn reading(&mut self, time: f64, reading: usize, value: f64) {}
    /// A robot begins to move: where it is from moment to moment until it stands still again.
    fn travels(&mut self, moments: &[Moment]) {}
    /// Loose things move by what touches them: where they are from moment to moment.
    fn sightings(&mut self, sightings: &[Sighting]) {}
    /// How a thing that a robot carries may be moved from now on.
    fn burdened(&mut self, time: f64, item: InstanceId, burden: Burden) {}
    /// Steps that are asked for now: each is done beside the plan, and its failure is told but ends nothing else.
    fn asked(&mut self, time: f64) -> Vec<Asked> {
        Vec::new()
    }
    /// Steps that were asked for and are to be broken off: what runs is halted, each `finally` still gets its turn.
    fn given_up(&mut self) -> Vec<StepId> {
        Vec::new()
    }
    /// What an operation that is about to begin would bring about and must not.
    fn foreseen(&mut self, engine: &Engine<'_>, step: StepId, operation: &Operation) -> Option<Alarm> {
        None
    }
    /// What has come about that must not be, once each, in order.
    fn alarm(&mut self) -> Option<Alarm> {
        None
    }
    /// A remark.
    fn note(&mut self, time: f64, step: StepId, text: &str) {}
    /// A person is asked.
    fn ask(&mut self, time: f64, step: StepId, text: &str) {}
}

/// Ignores everything.
impl Listener for () {}
