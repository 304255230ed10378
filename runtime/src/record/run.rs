//! One finished run as the writers see it.

use std::collections::BTreeMap;

use matterix_ir::model::Observable;
use matterix_ir::plan::StepId;
use matterix_ir::{Program, Sources, Span};
use serde::Serialize;

use super::recording::Recording;
use super::series::Series;
use crate::run::{Fidelity, Finding};

/// How a run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// To the end, every expectation held.
    #[default]
    Passed,
    /// To the end, an expectation did not hold.
    Missed,
    /// A failure that nothing handled, or a fault.
    Failed,
    /// Stopped from outside.
    Cancelled,
}

/// Why a run failed.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// `slip`, `timeout`, `fault`.
    pub name: String,
    /// In words.
    pub text: String,
    /// s.
    pub time: f64,
    /// The statement that raised it.
    pub span: Option<Span>,
    /// The nodes it passed through, from the leaf up.
    pub trace: Vec<StepId>,
}

/// What the recording itself does not know.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunInfo {
    /// Version of the language, as in `mtx 1`.
    pub language: u32,
    /// Seed of all randomness.
    pub seed: u64,
    /// How closely the world was simulated.
    pub fidelity: Fidelity,
    /// How it ended.
    pub status: Status,
    /// Why it failed, if it did.
    pub failure: Option<Failure>,
    /// What met that should not, and hazards that came about.
    pub findings: Vec<Finding>,
    /// The integrator's counters by name, if there was one.
    pub integrator: BTreeMap<String, u64>,
}

/// A finished run.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// What was executed.
    pub program: &'a Program,
    /// What happened.
    pub recording: &'a Recording,
    /// The text, for line numbers; files that are absent give none.
    pub sources: &'a Sources,
    /// The rest.
    pub info: &'a RunInfo,
}

/// A line of a source file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Place {
    /// Name of the file; empty if unknown.
    pub file: String,
    /// From 1; absent where the text is not known.
    pub line: Option<usize>,
}

impl<'a> Run<'a> {
    /// Whether the model of an observable holds, 1 where it does; none where it always does.
    pub(super) fn validity(&self, observable: &Observable) -> Option<&'a Series> {
        self.recording.observables.get(observable.valid? as usize)?.first()
    }

    /// Where a span begins.
    pub fn place(&self, span: Span) -> Place {
        let known = self.sources.get(span.file);
        let file = known.map(|s| &s.name).or_else(|| self.program.files.get(span.file.0 as usize));
        Place { file: file.cloned().unwrap_or_default(), line: known.map(|_| self.sources.line_column(span).0) }
    }

    /// Name of an instance as a state stores it: its index, or -1 for nothing.
    pub(super) fn instance_name(&self, value: f64) -> &'a str {
        match self.program.scene.instances.get(value as usize) {
            Some(instance) if value >= 0.0 => &instance.name,
            _ => "nothing",
        }
    }
}

/// Name and version of the program that writes.
pub(crate) const TOOL: &str = concat!("matterixc ", env!("CARGO_PKG_VERSION"));
