//! What came of a fit.

use matterix_ir::Program;
use matterix_ir::study::Fit;
use serde::Serialize;

use super::scale::Scale;
use super::solve::Solution;
use super::spread::Spread;

/// As a part of its range, how near to an end an estimate counts as lying at it.
const EDGE: f64 = 1e-3;

/// From this correlation on two parameters are said to be hardly told apart.
const CLOSE: f64 = 0.99;

/// An estimated parameter, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// As written.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The best value.
    pub value: f64,
    /// The standard error; none where the data do not determine it.
    pub std_error: Option<f64>,
    /// The lower end of the interval of 95 %.
    pub low95: Option<f64>,
    /// The upper end of the interval of 95 %.
    pub high95: Option<f64>,
    /// The lower end of the range it was looked for in.
    pub low: f64,
    /// The upper end of that range.
    pub high: f64,
    /// Looked for on a logarithmic scale.
    pub log: bool,
    /// It lies at the end `low` or `high` of its range.
    pub at_bound: Option<&'static str>,
}

/// One value of the data and what the model says of it, in the unit of the column.
#[derive(Clone, Debug, PartialEq)]
pub struct Matching {
    /// s.
    pub time: f64,
    /// Its match, by number.
    pub column: usize,
    /// Measured.
    pub data: f64,
    /// Computed.
    pub model: f64,
    /// Computed less measured, in standard deviations.
    pub weighted: f64,
}

/// The contents of `fit.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The fit.
    pub fit: String,
    /// The workflow.
    pub workflow: String,
    /// The lab.
    pub lab: String,
    /// The file of the data.
    pub data: String,
    /// How many values it holds of what is matched.
    pub values: usize,
    /// The parameters.
    pub estimates: Vec<Estimate>,
    /// Correlations of the parameters, by their numbers; absent where one is not determined.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// The sum of the squares of the residuals in standard deviations; with learnt noise the degrees of freedom.
    pub chi2: f64,
    /// Values less parameters.
    pub degrees_of_freedom: i64,
    /// Their quotient; about one where model and noise are right.
    pub chi2_per_degree: Option<f64>,
    /// The noise that was learnt from what the fit leaves over, in the unit of the column; none where it was given.
    pub learnt_noise: Option<f64>,
    /// How many runs were made.
    pub evaluations: u64,
    /// From how many places the method went on.
    pub starts: usize,
    /// How many of them led to a place as good as the best.
    pub agreed: usize,
    /// Groups of parameters of which the data do not determine every combination.
    pub undetermined: Vec<Vec<String>>,
    /// What to know before the figures are used.
    pub notes: Vec<String>,
    /// Data and model.
    #[serde(skip)]
    pub matching: Vec<Matching>,
}

impl Outcome {
    /// The figures of a solution; `predicted` is what the model says by row and match, SI.
    pub fn new(program: &Program, fit: &Fit, scales: &[Scale], solution: &Solution, predicted: Vec<Vec<f64>>) -> Self {
        let values = solution.residuals.len();
        let freedom = values as i64 - scales.len() as i64;
        let squares: f64 = solution.residuals.iter().map(|r| r * r).sum();
        let learns = fit.matches.iter().any(|m| m.noise.is_none());
        let scatter = if learns && freedom > 0 { (squares / freedom as f64).sqrt() } else { 1.0 };
        let spread = Spread::new(&solution.jacobian, scatter, learns.then_some(freedom.max(1) as usize));
        let matching = matching(fit, solution, &predicted, scatter);
        let learnt_noise = learns.then(|| {
            let left = matching.iter().map(|m| (m.model - m.data).powi(2)).sum::<f64>();
            (left / freedom.max(1) as f64).sqrt()
        });
        let estimates: Vec<Estimate> = (0..scales.len()).map(|i| estimate(fit, scales, solution, &spread, i)).collect();
        let name = |i: &usize| fit.estimates.get(*i).map(|e| e.free.name.clone()).unwrap_or_default();
        let undetermined: Vec<Vec<String>> =
            spread.undetermined.iter().map(|group| group.iter().map(name).collect()).collect();
        let mut notes = notes(&estimates, &undetermined, &spread);
        let chi2 = squares / (scatter * scatter);
        let per_degree = (freedom > 0).then(|| chi2 / freedom as f64);
        if let (false, Some(v)) = (learns, per_degree)
            && v > 1.0 + 4.0 * (2.0 / freedom as f64).sqrt()
        {
            notes.push(
                "the residuals are larger than the noise: the model is incomplete, or the noise is underestimated"
                    .into(),
            );
        }
        if solution.agreed < solution.starts {
            let (agreed, starts) = (solution.agreed, solution.starts);
            notes.push(format!("only {agreed} of {starts} starts reached this minimum: there may be a better one"));
        }
        Outcome {
            fit: fit.name.clone(),
            workflow: program.plan.workflow.clone(),
            lab: program.scene.lab.clone(),
            data: fit.data.clone(),
            values,
            estimates,
            correlation: spread.correlation,
            chi2,
            degrees_of_freedom: freedom,
            chi2_per_degree: per_degree,
            learnt_noise,
            evaluations: solution.evaluations,
            starts: solution.starts,
            agreed: solution.agreed,
            undetermined,
            notes,
            matching,
        }
    }

    /// As JSON.
    pub fn json(&self) -> Result<String, String> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|e| format!("cannot write the fit: {e}"))
    }
}

fn estimate(fit: &Fit, scales: &[Scale], solution: &Solution, spread: &Spread, i: usize) -> Estimate {
    let (e, scale) = (&fit.estimates[i], scales[i]);
    let (value, place) = (solution.values[i], solution.places[i]);
    let unit = &e.free.unit;
    let error = spread.errors.get(i).copied().flatten();
    let end = |sign: f64| error.map(|error| unit.of_si(scale.moved(value, sign * spread.reach * error)));
    Estimate {
        name: e.free.name.clone(),
        unit: unit.symbol.clone(),
        value: unit.of_si(value),
        std_error: error.map(|error| error * scale.slope(place) / unit.factor),
        low95: end(-1.0),
        high95: end(1.0),
        low: unit.of_si(scale.low),
        high: unit.of_si(scale.high),
        log: scale.log,
        at_bound: if place < EDGE {
            Some("low")
        } else if place > 1.0 - EDGE {
            Some("high")
        } else {
            None
        },
    }
}

fn matching(fit: &Fit, solution: &Solution, predicted: &[Vec<f64>], scatter: f64) -> Vec<Matching> {
    let mut weighted = solution.residuals.iter();
    let mut out = Vec::new();
    for (row, model) in fit.rows.iter().zip(predicted) {
        for (column, (data, model)) in row.values.iter().zip(model).enumerate() {
            let (Some(data), Some(m)) = (data, fit.matches.get(column)) else { continue };
            out.push(Matching {
                time: row.time,
                column,
                data: m.unit.of_si(*data),
                model: m.unit.of_si(*model),
                weighted: weighted.next().copied().unwrap_or(f64::NAN) / scatter,
            });
        }
    }
    out
}

fn notes(estimates: &[Estimate], undetermined: &[Vec<String>], spread: &Spread) -> Vec<String> {
    let mut out = Vec::new();
    for group in undetermined {
        let names: Vec<String> = group.iter().map(|n| format!("`{n}`")).collect();
        out.push(match names.as_slice() {
            [one] => format!("the data do not determine {one}: the fit is about as good anywhere in its range"),
            many => format!(
                "the data do not determine {} separately: if they change together, the fit stays as good",
                many.join(" and ")
            ),
        });
    }
    for e in estimates {
        if let Some(end) = e.at_bound {
            let (which, value) = if end == "low" { ("lower", e.low) } else { ("upper", e.high) };
            let value = crate::study::short(value);
            out.push(format!(
                "`{}` is at the {which} end of its range, {value} {}: its error means little",
                e.name, e.unit
            ));
        }
    }
    for (i, row) in spread.correlation.iter().enumerate() {
        for (j, r) in row.iter().enumerate().skip(i + 1) {
            if let Some(r) = r.filter(|r| r.abs() > CLOSE)
                && let (Some(a), Some(b)) = (estimates.get(i), estimates.get(j))
            {
                out.push(format!(
                    "the data hardly separate `{}` and `{}`: their correlation is {r:.4}",
                    a.name, b.name
                ));
            }
        }
    }
    out
}
