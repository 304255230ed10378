//! Failures of a run with the steps that led to them, and their rendering as diagnostics.

use matterix_ir::codes::{self, Code};
use matterix_ir::plan::{Plan, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::{Diagnostic, Label, Span, Unit};
use serde::Serialize;

use super::listener::ExpectationResult;

/// One step of a trace.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TraceStep {
    /// The node of the plan.
    pub step: StepId,
    /// As shown.
    pub label: String,
    /// Its statement.
    pub span: Span,
    /// When it began, s.
    pub started: f64,
}

/// A comparison with what was measured, SI; a value is absent where it cannot be known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// As written.
    pub text: String,
    /// The quantity compared.
    pub value: Option<f64>,
    /// Lower limit.
    pub low: Option<f64>,
    /// Upper limit.
    pub high: Option<f64>,
    /// Unit of the limits.
    pub unit: Unit,
}

impl Measured {
    /// ``` `probe < 80 degC`: 93 degC, upper limit 80 degC ```; empty where nothing was measured.
    pub fn show(&self) -> String {
        let Some(value) = self.value else { return String::new() };
        let limits = match (self.low, self.high) {
            (Some(low), Some(high)) if low == high => self.equal_to(value, low),
            (Some(low), Some(high)) => format!(", limits {} .. {}", self.unit.show(low), self.unit.show(high)),
            (Some(low), None) => format!(", lower limit {}", self.unit.show(low)),
            (None, Some(high)) => format!(", upper limit {}", self.unit.show(high)),
            (None, None) => String::new(),
        };
        format!("`{}`: {}{limits}", self.text, self.unit.show(value))
    }

    /// What a value should be; by how much it is off where both are shown alike.
    fn equal_to(&self, value: f64, wanted: f64) -> String {
        let shown = self.unit.show(wanted);
        match value != wanted && self.unit.show(value) == shown {
            true => {
                let off = show_number(self.unit.of_si(value) - self.unit.of_si(wanted));
                format!(", off by {off}: allow a difference, as in `== {shown} +- ...`")
            }
            false => format!(", must be {shown}"),
        }
    }
}

/// A failure or fault with its history.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailureTrace {
    /// What handlers know it by: `slip`, `timeout`, `broken`; the code's name for a fault.
    pub name: String,
    /// In words, without the name.
    pub text: String,
    /// Its kind.
    pub code: Code,
    /// Whether no handler can take it.
    pub fault: bool,
    /// Its cause in the text.
    pub span: Span,
    /// When it happened, s.
    pub time: f64,
    /// The steps it happened in, innermost first.
    pub steps: Vec<TraceStep>,
    /// What was measured.
    pub measured: Vec<Measured>,
    /// How to mend it.
    pub help: Vec<String>,
    /// What else in the text it rests on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub because: Vec<Label>,
}

impl FailureTrace {
    /// A fault outside of any step: where it has no place of its own it is the workflow's.
    pub fn of_fault(plan: &Plan, fault: crate::fault::Fault) -> Self {
        FailureTrace {
            name: fault.code.name.to_owned(),
            text: fault.message,
            code: fault.code,
            fault: true,
            span: fault.span.unwrap_or_else(|| plan.span()),
            time: fault.time,
            steps: Vec::new(),
            measured: Vec::new(),
            help: fault.help,
            because: fault.because,
        }
    }

    /// The step as an entry of a trace.
    pub(super) fn entry(plan: &Plan, step: StepId, started: f64) -> TraceStep {
        let node = plan.get(step);
        TraceStep { step, label: node.label.clone(), span: node.span, started }
    }
}

/// The failure as a diagnostic: its cause, then the enclosing steps from the innermost outwards.
pub fn diagnostic(trace: &FailureTrace) -> Diagnostic {
    let at = format!("at {} s", show_number(trace.time));
    let measured: Vec<String> = trace.measured.iter().map(Measured::show).filter(|t| !t.is_empty()).collect();
    let label = if measured.is_empty() { at.clone() } else { format!("{at}, {}", measured.join(", ")) };
    let headline = if trace.fault || trace.code != codes::RUN_FAILED {
        trace.text.clone()
    } else {
        format!("the run failed with `{}`: {}", trace.name, trace.text)
    };
    let mut diagnostic = Diagnostic::error(trace.code, trace.span, headline, label);
    diagnostic.labels.extend(trace.because.iter().cloned());
    let mut last = trace.span;
    for step in &trace.steps {
        // A block has no name of its own: the step it belongs to says where.
        if step.span != last && !step.span.is_empty() && step.label != "sequence" {
            let since = show_number(step.started);
            diagnostic = diagnostic.because(step.span, format!("in `{}`, started at {since} s", step.label));
            last = step.span;
        }
    }
    diagnostic.help = trace.help.clone();
    diagnostic
}

/// A failed expectation as a diagnostic.
pub fn expectation_diagnostic(result: &ExpectationResult) -> Diagnostic {
    let headline = format!("`{}` is false at {} s", result.text, show_number(result.time));
    let measured: Vec<String> = result.compared.iter().map(Measured::show).filter(|t| !t.is_empty()).collect();
    let label = if measured.is_empty() { "expected here".to_owned() } else { measured.join(", ") };
    Diagnostic::error(codes::EXPECTATION_FAILED, result.span, headline, label)
}
