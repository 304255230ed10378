//! What the runs of a study come to: figures of each report, and how often which failure ended a run.

use std::collections::BTreeMap;

use matterix_ir::Unit;
use matterix_ir::study::{Draw, Study};
use serde::Serialize;

use super::Row;
use super::table::outcome;

/// Figures of a number over runs, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit; empty for a plain number.
    pub unit: String,
    /// How many runs have it.
    pub count: usize,
    /// The mean.
    pub mean: Option<f64>,
    /// The standard deviation, with `count - 1`.
    pub std: Option<f64>,
    /// The smallest value.
    pub min: Option<f64>,
    /// The quantile of 5 %, between values by their order.
    pub q05: Option<f64>,
    /// The median.
    pub median: Option<f64>,
    /// The quantile of 95 %.
    pub q95: Option<f64>,
    /// The largest value.
    pub max: Option<f64>,
}

/// What varied.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The lower end, in the unit.
    pub low: f64,
    /// The upper end, in the unit.
    pub high: f64,
    /// How its values were taken: `sobol`, `grid(5)`.
    pub by: String,
}

/// The contents of `study.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The study.
    pub study: String,
    /// The workflow.
    pub workflow: String,
    /// The lab.
    pub lab: String,
    /// Where all randomness started.
    pub seed: u64,
    /// How many runs were asked for.
    pub runs: u64,
    /// How many have ended.
    pub done: u64,
    /// How many ended how: `passed`, `missed`, `failed`, `fault`.
    pub outcomes: BTreeMap<String, u64>,
    /// How many runs each failure ended.
    pub failures: BTreeMap<String, u64>,
    /// What varied.
    pub varied: Vec<Range>,
    /// What was reported.
    pub reports: Vec<Column>,
}

impl Summary {
    /// The summary of the rows there are.
    pub fn new(study: &Study, about: (&str, &str), rows: &[Row], seed: u64, runs: u64) -> Self {
        let mut outcomes = BTreeMap::new();
        let mut failures = BTreeMap::new();
        for row in rows {
            *outcomes.entry(outcome(row.status).to_string()).or_default() += 1;
            if let Some(fault) = &row.fault {
                *failures.entry(fault.clone()).or_default() += 1;
            }
        }
        let varied = study.varied.iter().map(|v| {
            let unit = &v.free.unit;
            let by = match v.draw {
                Draw::Uniform => "uniform".to_string(),
                Draw::Sobol => "sobol".to_string(),
                Draw::Grid(n) => format!("grid({n})"),
                Draw::Normal(mean, sd) => {
                    // A difference on a scale has another unit than its points.
                    let symbol = if unit.offset == 0.0 { unit.symbol.as_str() } else { "" };
                    format!("normal({}, {})", unit.show(mean), Unit::scaled(symbol, unit.factor).show(sd))
                }
            };
            let (low, high) = (unit.of_si(v.free.low), unit.of_si(v.free.high));
            Range { name: v.free.name.clone(), unit: unit.symbol.clone(), low, high, by }
        });
        let reports = study.reports.iter().enumerate().map(|(i, r)| {
            Column::new(&r.name, &r.unit, rows.iter().filter_map(|row| row.reports.get(i).copied().flatten()))
        });
        let (workflow, lab) = about;
        Summary {
            study: study.name.clone(),
            workflow: workflow.to_string(),
            lab: lab.to_string(),
            seed,
            runs,
            done: rows.len() as u64,
            outcomes,
            failures,
            varied: varied.collect(),
            reports: reports.collect(),
        }
    }

    /// As JSON.
    pub fn json(&self) -> Result<String, String> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|e| format!("cannot write the summary: {e}"))
    }
}

impl Column {
    /// Figures of values in SI.
    pub fn new(name: &str, unit: &Unit, values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.map(|si| unit.of_si(si)).collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len();
        let mean = (count > 0).then(|| sorted.iter().sum::<f64>() / count as f64);
        let squares = mean.map(|mean| sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>());
        let std = squares.filter(|_| count > 1).map(|squares| (squares / (count - 1) as f64).sqrt());
        Column {
            name: name.to_string(),
            unit: unit.symbol.clone(),
            count,
            mean,
            std,
            min: sorted.first().copied(),
            q05: quantile(&sorted, 0.05),
            median: quantile(&sorted, 0.5),
            q95: quantile(&sorted, 0.95),
            max: sorted.last().copied(),
        }
    }
}

/// The value below which this part of sorted values lies, between two neighbours in proportion.
fn quantile(sorted: &[f64], part: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let at = part * last as f64;
    let (below, above) = (sorted.get(at.floor() as usize)?, sorted.get(at.ceil() as usize)?);
    Some(below + (above - below) * (at - at.floor()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_few_numbers() {
        let c = Column::new("x", &Unit::one(), [4.0, 1.0, 3.0, 2.0, 5.0].into_iter());
        assert_eq!((c.count, c.mean, c.median, c.min, c.max), (5, Some(3.0), Some(3.0), Some(1.0), Some(5.0)));
        assert_eq!((c.q05, c.q95), (Some(1.2), Some(4.8)));
        assert!(c.std.is_some_and(|s| (s - 2.5f64.sqrt()).abs() < 1e-15));
        let none = Column::new("x", &Unit::one(), std::iter::empty());
        assert_eq!((none.count, none.mean, none.q95), (0, None, None));
    }
}
