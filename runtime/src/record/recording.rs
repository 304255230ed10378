//! What happened, in memory and by column, as the engine and the executor report it.

use matterix_ir::plan::StepId;
use matterix_ir::{Program, Span, Unit};
use serde::Serialize;

use crate::motion::Moment;

/// Where a node of the plan stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StepState {
    /// Not begun.
    Pending,
    /// Begun, not ended.
    Running,
    /// Ended as intended.
    Done,
    /// Ended by a failure.
    Failed,
    /// Passed over, or stopped because a sibling failed.
    Skipped,
}

/// How much a line of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// For whoever looks for a cause.
    Debug,
    /// Notes and what is done.
    Info,
    /// The run goes on; something may be wrong.
    Warning,
    /// A failure.
    Error,
}

/// An event of the model fired.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventMark {
    /// s.
    pub time: f64,
    /// Index into `model.events`.
    pub event: usize,
}

/// A process of the model began or ceased to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessMark {
    /// s.
    pub time: f64,
    /// Index into `model.processes`.
    pub process: usize,
    /// Whether it runs from now on.
    pub running: bool,
}

/// A node of the plan changed its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepMark {
    /// s.
    pub time: f64,
    /// The node.
    pub step: StepId,
    /// Its state from now on.
    pub state: StepState,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// s.
    pub time: f64,
    /// How much it matters.
    pub level: Level,
    /// In words.
    pub text: String,
    /// The statement it belongs to.
    pub span: Option<Span>,
}

/// A value taken by a `record` statement.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedValue {
    /// s.
    pub time: f64,
    /// Name of the record.
    pub name: String,
    /// SI; several for a tuple.
    pub values: Vec<f64>,
}

/// What a device reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadingMark {
    /// s.
    pub time: f64,
    /// Index into `model.readings`.
    pub reading: usize,
    /// SI.
    pub value: f64,
}

/// A quantity an expectation compared, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The comparison as written.
    pub text: String,
    /// What was found.
    pub value: f64,
    /// Lower limit.
    pub low: Option<f64>,
    /// Upper limit.
    pub high: Option<f64>,
    /// As shown.
    pub unit: Unit,
}

/// An `expect`, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// s.
    pub time: f64,
    /// As written.
    pub text: String,
    /// Where.
    pub span: Span,
    /// Whether it held.
    pub passed: bool,
    /// What it compared.
    pub measured: Vec<Measured>,
}

/// All that happened in one run. Times are seconds of the virtual clock, numbers SI.
///
/// Several samples may share one time: the value before and after a jump.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Time of each sample.
    pub times: Vec<f64>,
    /// By state, then by sample.
    pub states: Vec<Vec<f64>>,
    /// By observable, then by component, then by sample.
    pub observables: Vec<Vec<Vec<f64>>>,
    /// Where robots were while they moved, in order of time.
    pub moments: Vec<Moment>,
    /// In order of occurrence.
    pub events: Vec<EventMark>,
    /// In order of occurrence.
    pub processes: Vec<ProcessMark>,
    /// In order of occurrence.
    pub steps: Vec<StepMark>,
    /// In order of occurrence.
    pub log: Vec<LogLine>,
    /// In order of occurrence.
    pub values: Vec<RecordedValue>,
    /// In order of occurrence.
    pub readings: Vec<ReadingMark>,
    /// In order of occurrence.
    pub expectations: Vec<Expectation>,
    /// The latest time anything was reported for.
    pub end: f64,
}

impl Recording {
    /// A robot moves.
    pub fn travels(&mut self, moments: &[Moment]) {
        self.moments.extend_from_slice(moments);
        // Several robots move at once.
        self.moments.sort_by(|a, b| a.time.total_cmp(&b.time));
    }

    /// Empty columns for every state and observable of the program.
    pub fn new(program: &Program) -> Self {
        let model = &program.model;
        Recording {
            states: vec![Vec::new(); model.states.len()],
            observables: model.observables.iter().map(|o| vec![Vec::new(); o.value.len()]).collect(),
            ..Recording::default()
        }
    }

    /// Adds one value of every state and of every component of every observable; a value not given is not a number.
    pub fn sample(&mut self, time: f64, states: &[f64], observables: &[Vec<f64>]) {
        self.reach(time);
        self.times.push(time);
        for (i, column) in self.states.iter_mut().enumerate() {
            column.push(states.get(i).copied().unwrap_or(f64::NAN));
        }
        for (i, components) in self.observables.iter_mut().enumerate() {
            for (j, column) in components.iter_mut().enumerate() {
                column.push(observables.get(i).and_then(|o| o.get(j)).copied().unwrap_or(f64::NAN));
            }
        }
    }

    /// An event of the model fired.
    pub fn event(&mut self, time: f64, event: usize) {
        self.reach(time);
        self.events.push(EventMark { time, event });
    }

    /// A process began or ceased to run.
    pub fn process(&mut self, time: f64, process: usize, running: bool) {
        self.reach(time);
        self.processes.push(ProcessMark { time, process, running });
    }

    /// A node of the plan changed its state.
    pub fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.reach(time);
        self.steps.push(StepMark { time, step, state });
    }

    /// A line for the log.
    pub fn log(&mut self, time: f64, level: Level, text: impl Into<String>, span: Option<Span>) {
        self.reach(time);
        self.log.push(LogLine { time, level, text: text.into(), span });
    }

    /// A `record` statement took a value.
    pub fn value(&mut self, time: f64, name: impl Into<String>, values: &[f64]) {
        self.reach(time);
        self.values.push(RecordedValue { time, name: name.into(), values: values.to_vec() });
    }

    /// A device reported.
    pub fn reading(&mut self, time: f64, reading: usize, value: f64) {
        self.reach(time);
        self.readings.push(ReadingMark { time, reading, value });
    }

    /// An expectation was judged.
    pub fn expectation(&mut self, expectation: Expectation) {
        self.reach(expectation.time);
        self.expectations.push(expectation);
    }

    /// The run lasted until here, even if nothing was reported for this time.
    pub fn reach(&mut self, time: f64) {
        if time > self.end {
            self.end = time;
        }
    }
}
