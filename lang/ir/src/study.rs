//! Many runs of one program: what varies between them, what is reported of each, and what is estimated from data.

use serde::{Deserialize, Serialize};

use crate::graph::NodeId;
use crate::quantity::Unit;
use crate::span::Span;

/// A parameter of the model and where it may lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Free {
    /// As written: `target`, `bench.beaker.initial[HI]`.
    pub name: String,
    /// Its index in the model.
    pub param: u32,
    /// SI.
    pub low: f64,
    /// SI.
    pub high: f64,
    /// As shown.
    pub unit: Unit,
    /// Where it is written.
    pub span: Span,
}

/// How a varied parameter takes its values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Draw {
    /// Drawn evenly, each run by itself.
    Uniform,
    /// From a Sobol sequence.
    Sobol,
    /// So many evenly spaced values, with both ends; each with each of the other grids.
    Grid(u32),
    /// From a normal distribution within the range: mean and standard deviation, SI.
    Normal(f64, f64),
}

/// A varied parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Varied {
    /// Which, and where.
    pub free: Free,
    /// How.
    pub draw: Draw,
}

/// A number that is reported of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reported {
    /// Its name.
    pub name: String,
    /// Looked at when the run has ended.
    pub value: NodeId,
    /// As shown.
    pub unit: Unit,
    /// Where it is written.
    pub span: Span,
}

/// What is kept of a quantity over a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Keep {
    /// The largest value.
    Largest,
    /// The smallest value.
    Smallest,
    /// The mean over time.
    Mean,
}

/// A quantity that is followed over a run; what is kept of it is a value of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverTime {
    /// The local that takes it when the run has ended.
    pub local: u32,
    /// What is followed.
    pub value: NodeId,
    /// What is kept.
    pub keep: Keep,
}

/// `study NAME of WORKFLOW { ... }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// Where its name stands.
    pub span: Span,
    /// What varies, in the order of the text.
    pub varied: Vec<Varied>,
    /// How many runs; may be left out where grids say it.
    pub runs: Option<u64>,
    /// What is reported, in the order of the text.
    pub reports: Vec<Reported>,
    /// What the reports follow over a run.
    pub over_time: Vec<OverTime>,
}

/// A parameter that is estimated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimated {
    /// Which, and where.
    pub free: Free,
    /// On a logarithmic scale.
    pub log: bool,
}

/// A value of the model that data speak of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Matched {
    /// As written.
    pub text: String,
    /// The model's value.
    pub value: NodeId,
    /// The column of the data.
    pub column: String,
    /// Where the column is named.
    pub column_span: Span,
    /// The unit of the column.
    pub unit: Unit,
    /// Standard deviation of the data, SI; none where it is to be learnt from the residuals.
    pub noise: Option<f64>,
}

/// A row of data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DataRow {
    /// s since the run began.
    pub time: f64,
    /// By match, SI; none where the cell is empty.
    pub values: Vec<Option<f64>>,
}

/// `fit NAME of WORKFLOW { ... }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Its name.
    pub name: String,
    /// Where its name stands.
    pub span: Span,
    /// The file of the data, as named.
    pub data: String,
    /// Where it is named.
    pub data_span: Span,
    /// What is estimated, in the order of the text.
    pub estimates: Vec<Estimated>,
    /// What the data speak of, in the order of the text.
    pub matches: Vec<Matched>,
    /// The data, by time; those of one time in the order of the file.
    pub rows: Vec<DataRow>,
}

/// A grid with more values than this cannot have been meant.
pub const MOST_RUNS: u64 = 10_000_000;
