//! The run in one document: `report.json`. Every field is described in `docs/report.md`.

mod build;
mod human;
mod ledger;
pub(crate) mod text;

use std::collections::BTreeMap;

use matterix_ir::Severity;
use serde::Serialize;

use super::recording::Level;
use super::run::{Place, Run, Status};
use crate::exec::{Measured, StepState};
use crate::run::Fidelity;

pub use human::human;

/// Version of the document; it changes when a field is renamed, removed or changes its meaning.
pub const REPORT_SCHEMA: u32 = 1;

/// What a run was, did and found. Times in s; quantities in the unit beside them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// [`REPORT_SCHEMA`].
    pub schema: u32,
    /// Name and version of the program that wrote it.
    pub tool: String,
    /// Version of the language.
    pub language: u32,
    /// Source files.
    pub files: Vec<String>,
    /// Name of the workflow.
    pub workflow: String,
    /// Name of the lab.
    pub lab: String,
    /// Parameters of the workflow as bound.
    pub arguments: Vec<ArgumentReport>,
    /// Seed of all randomness.
    pub seed: u64,
    /// Fidelity of the simulation.
    pub fidelity: Fidelity,
    /// How it ended.
    pub status: Status,
    /// When it ended, s.
    pub end: f64,
    /// Why it failed, if it did.
    pub failure: Option<FailureReport>,
    /// What met that should not, and hazards that came about, in order.
    pub findings: Vec<FindingReport>,
    /// In the order in which they were judged.
    pub expectations: Vec<ExpectationReport>,
    /// Every mixture at the end.
    pub containers: Vec<ContainerReport>,
    /// Every execution of every node in order of start, then the nodes that never began.
    pub steps: Vec<StepReport>,
    /// Every process of the model.
    pub processes: Vec<ProcessReport>,
    /// Every event that fired.
    pub events: Vec<EventReport>,
    /// Last report of every device that reported.
    pub readings: Vec<ReadingReport>,
    /// Summary of every `record` statement that took a value.
    pub records: Vec<RecordSummary>,
    /// Every sum that must close.
    pub ledger: Vec<BalanceReport>,
    /// Notes, warnings and failures.
    pub log: Vec<LogReport>,
    /// The integrator's counters by name.
    pub integrator: BTreeMap<String, u64>,
}

/// A parameter of the workflow.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArgumentReport {
    /// Its name.
    pub name: String,
    /// As shown.
    pub value: String,
}

/// Why a run failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailureReport {
    /// `slip`, `timeout`, `fault`.
    pub name: String,
    /// In words.
    pub text: String,
    /// s.
    pub time: f64,
    /// The statement that raised it.
    #[serde(flatten)]
    pub place: Place,
    /// The nodes it passed through, from the leaf up, without those that only order others.
    pub trace: Vec<TraceReport>,
}

/// A finding of the run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingReport {
    /// s.
    pub time: f64,
    /// Its code.
    pub code: String,
    /// `error`, `warning`.
    pub severity: Severity,
    /// In words.
    pub text: String,
    /// The statement during which it was made.
    #[serde(flatten)]
    pub place: Place,
}

/// A node a failure passed through.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TraceReport {
    /// As shown.
    pub label: String,
    /// Its statement.
    #[serde(flatten)]
    pub place: Place,
}

/// An `expect`, judged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectationReport {
    /// As written.
    pub text: String,
    /// Whether it held.
    pub passed: bool,
    /// When it was judged, s.
    pub time: f64,
    /// Its statement.
    #[serde(flatten)]
    pub place: Place,
    /// What it compared.
    pub measured: Vec<MeasuredReport>,
}

/// A quantity an expectation compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredReport {
    /// The comparison as written.
    pub text: String,
    /// What was found.
    pub value: f64,
    /// Lower limit.
    pub low: Option<f64>,
    /// Upper limit.
    pub high: Option<f64>,
    /// Of all three.
    pub unit: String,
}

impl MeasuredReport {
    /// In the unit shown; none where nothing was measured.
    pub(super) fn of(m: &Measured) -> Option<Self> {
        let shown = |si: f64| m.unit.of_si(si);
        Some(MeasuredReport {
            text: m.text.clone(),
            value: shown(m.value?),
            low: m.low.map(shown),
            high: m.high.map(shown),
            unit: m.unit.symbol.clone(),
        })
    }
}

/// A mixture at the end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContainerReport {
    /// Its instance.
    pub name: String,
    /// Species in it.
    pub species: Vec<SpeciesReport>,
    /// Its properties.
    pub properties: Vec<PropertyReport>,
}

/// A species in a mixture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpeciesReport {
    /// Its name.
    pub name: String,
    /// Hill formula; empty for an undefined structure.
    pub formula: String,
    /// mol; absent for a species counted by mass.
    pub amount: Option<f64>,
    /// g.
    pub mass: f64,
    /// mol put in, where an equilibrium says how much of it there is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub put: Option<f64>,
    /// Whether it is a solid beside the solution, where an equilibrium says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solid: Option<bool>,
    /// As the library defines it.
    pub concentration: Option<f64>,
    /// Of the concentration.
    pub concentration_unit: String,
}

/// A property of a mixture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PropertyReport {
    /// Its name in the mixture.
    pub name: String,
    /// One number, or several for a tuple.
    pub values: Vec<f64>,
    /// Of the values.
    pub unit: String,
    /// Whether the range of its model does not contain them.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub outside: bool,
}

/// One execution of a node of the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepReport {
    /// Index in the plan.
    pub id: u32,
    /// As shown.
    pub label: String,
    /// Labels from the workflow down, joined by ` > `.
    pub path: String,
    /// How many steps it stands inside, those that only order others left out.
    pub depth: usize,
    /// Whether it only orders others or takes no time by nature.
    pub structure: bool,
    /// s; absent if it never began.
    pub start: Option<f64>,
    /// s; absent if it did not end.
    pub end: Option<f64>,
    /// Its last state.
    pub state: StepState,
    /// Its statement.
    #[serde(flatten)]
    pub place: Place,
}

/// When a process ran.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProcessReport {
    /// The process and its instances.
    pub name: String,
    /// Start and end, s.
    pub intervals: Vec<[f64; 2]>,
    /// Its declaration.
    #[serde(flatten)]
    pub place: Place,
}

/// An event that fired.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventReport {
    /// s.
    pub time: f64,
    /// The event and its instances.
    pub name: String,
    /// Its declaration.
    #[serde(flatten)]
    pub place: Place,
}

/// Last report of a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReadingReport {
    /// `scale.mass`.
    pub name: String,
    /// s.
    pub time: f64,
    /// What it said.
    pub value: f64,
    /// Of the value.
    pub unit: String,
    /// How often it reported.
    pub count: usize,
}

/// What a `record` statement took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordSummary {
    /// Its name.
    pub name: String,
    /// Of the values.
    pub unit: String,
    /// How many samples.
    pub count: usize,
    /// First sample.
    pub first: Vec<f64>,
    /// Last sample.
    pub last: Vec<f64>,
}

/// A sum that must close.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BalanceReport {
    /// `energy`, `element C`, `charge`, `mass`.
    pub name: String,
    /// Of all its numbers but the relative error.
    pub unit: String,
    /// At the start.
    pub initial: f64,
    /// At the end.
    pub end: f64,
    /// What came in through the boundary (negative: went out).
    pub exchanges: Vec<ExchangeReport>,
    /// End less start less exchanges.
    pub error: f64,
    /// The error by the sum of the magnitudes of the terms.
    pub relative_error: f64,
}

/// What crossed the boundary by one process.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExchangeReport {
    /// The state that counts it.
    pub name: String,
    /// In the balance's unit.
    pub amount: f64,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogReport {
    /// s.
    pub time: f64,
    /// How much it matters.
    pub level: Level,
    /// In words.
    pub text: String,
    /// The statement it belongs to.
    #[serde(flatten)]
    pub place: Place,
}

impl Report {
    /// The report of a finished run.
    pub fn new(run: &Run<'_>) -> Self {
        build::report(run)
    }

    /// The document with a line end at its end.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}
