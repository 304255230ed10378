//! What happened, in memory and by column, as the engine and the executor report it.

use matterix_ir::model::Domain;
use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Program, Span};
use serde::Serialize;

use super::series::{ERROR, Series};
use super::taken::Taken;
use crate::contact::Sighting;
use crate::exec::{Measured, StepState};
use crate::motion::{Burden, Moment};

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

/// How a thing that a robot carries may be moved from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurdenMark {
    /// s.
    pub time: f64,
    /// The thing.
    pub item: InstanceId,
    /// How.
    pub burden: Burden,
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
/// Each state and each component of an observable is a [`Series`] of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// What is left out of its curves: see [`Series::new`].
    pub error: f64,
    /// Times of the first and the last sample, s.
    pub sampled: Option<(f64, f64)>,
    /// By state.
    pub states: Vec<Series>,
    /// By observable, then by component.
    pub observables: Vec<Vec<Series>>,
    /// Where robots were while they moved, in order of time.
    pub moments: Vec<Moment>,
    /// Where loose things were while what touched them moved them, in order of time.
    pub sightings: Vec<Sighting>,
    /// How what robots carry may be moved, in order of occurrence.
    pub burdens: Vec<BurdenMark>,
    /// In order of occurrence.
    pub events: Vec<EventMark>,
    /// In order of occurrence.
    pub processes: Vec<ProcessMark>,
    /// In order of occurrence.
    pub steps: Vec<StepMark>,
    /// In order of occurrence.
    pub log: Vec<LogLine>,
    /// In order of occurrence.
    pub values: Taken,
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
        // Several robots move at once: what comes may be of before what is there, but not of long before.
        let Some(first) = moments.iter().map(|m| m.time).min_by(f64::total_cmp) else { return };
        let known = self.moments.partition_point(|m| m.time <= first);
        self.moments.extend_from_slice(moments);
        self.moments[known..].sort_by(|a, b| a.time.total_cmp(&b.time));
    }

    /// Loose things move.
    pub fn sightings(&mut self, sightings: &[Sighting]) {
        self.sightings.extend_from_slice(sightings);
    }

    /// How a thing that a robot carries may be moved changes.
    pub fn burdened(&mut self, time: f64, item: InstanceId, burden: Burden) {
        self.burdens.push(BurdenMark { time, item, burden });
    }

    /// Without anything yet, of curves to the error that files have: [`ERROR`].
    pub fn new(program: &Program) -> Self {
        Recording::within(program, ERROR)
    }

    /// Without anything yet, of curves to such an error: see [`Series::new`]. What goes from value to value is exact.
    pub fn within(program: &Program, error: f64) -> Self {
        let model = &program.model;
        let state = |domain: &Domain| match domain {
            Domain::Quantity(_) => Series::new(error),
            _ if error == f64::INFINITY => Series::new(error),
            Domain::Bool | Domain::Instance | Domain::Enum(_) => Series::new(0.0),
        };
        Recording {
            error,
            states: model.states.iter().map(|s| state(&s.domain)).collect(),
            observables: model.observables.iter().map(|o| vec![Series::new(error); o.value.len()]).collect(),
            ..Recording::default()
        }
    }

    /// Whether nothing is kept of its curves but both ends.
    pub fn keeps_ends(&self) -> bool {
        self.error == f64::INFINITY
    }

    /// Something is sampled at a time.
    pub fn sampled(&mut self, time: f64) {
        self.reach(time);
        let first = self.sampled.map_or(time, |(first, _)| first);
        self.sampled = Some((first, time));
    }

    /// What a state is at a time.
    pub fn state(&mut self, time: f64, index: u32, value: f64) {
        if let Some(series) = self.states.get_mut(index as usize) {
            series.push(time, value);
        }
    }

    /// What an observable is at a time, by component.
    pub fn observable(&mut self, time: f64, index: u32, values: impl IntoIterator<Item = f64>) {
        let components = self.observables.get_mut(index as usize).into_iter().flatten();
        components.zip(values).for_each(|(series, value)| series.push(time, value));
    }

    /// Adds one value of every state and of every component of every observable.
    pub fn sample(&mut self, time: f64, states: &[f64], observables: &[Vec<f64>]) {
        self.sampled(time);
        for (index, value) in (0..).zip(states) {
            self.state(time, index, *value);
        }
        for (index, values) in (0..).zip(observables) {
            self.observable(time, index, values.iter().copied());
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
    pub fn value(&mut self, time: f64, name: &str, values: &[f64]) {
        self.reach(time);
        self.values.push(time, name, values);
    }

    /// A device reported.
    pub fn reading(&mut self, time: f64, reading: usize, value: f64) {
        self.reach(time);
        self.readings.push(ReadingMark { time, reading, value });
    }

    /// What each reading of a program reported, in order of occurrence.
    pub(super) fn by_reading(&self, program: &Program) -> Vec<Vec<ReadingMark>> {
        let mut all = vec![Vec::new(); program.model.readings.len()];
        for mark in &self.readings {
            if let Some(of) = all.get_mut(mark.reading) {
                of.push(*mark);
            }
        }
        all
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
