//! A run of a program as residuals: what the model says at the times of the data, compared with them.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use matterix_ir::study::Fit;
use matterix_ir::{NodeId, Program};

use super::solve::Model;
use crate::backend::Prepared;
use crate::exec::{Limits, Listener, Probes, RunStatus};
use crate::process::{self, Engine, Observer};
use crate::run::{self, RunOptions};

/// The program of a fit, made ready once.
pub(super) struct Runs<'p> {
    program: &'p Program,
    fit: &'p Fit,
    prepared: Prepared,
    /// The times of the data, each once, s.
    times: Vec<f64>,
    nodes: Vec<NodeId>,
    /// By match: one standard deviation, SI; where it is to be learnt, the size of the data.
    weights: Vec<f64>,
    seed: u64,
    cancel: &'p AtomicBool,
}

impl<'p> Runs<'p> {
    /// The runs of a fit.
    pub(super) fn new(program: &'p Program, fit: &'p Fit, seed: u64, cancel: &'p AtomicBool) -> Self {
        let mut times: Vec<f64> = fit.rows.iter().map(|r| r.time).collect();
        times.dedup();
        let weights = fit.matches.iter().enumerate().map(|(i, m)| m.noise.unwrap_or_else(|| size(fit, i)));
        Runs {
            program,
            fit,
            prepared: Prepared::new(program),
            times,
            nodes: fit.matches.iter().map(|m| m.value).collect(),
            weights: weights.collect(),
            seed,
            cancel,
        }
    }

    /// The values as written, SI.
    pub(super) fn nominal(&self) -> Vec<f64> {
        let params = &self.program.model.params;
        self.fit.estimates.iter().filter_map(|e| params.get(e.free.param as usize).map(|p| p.value)).collect()
    }

    /// What the model says, by row of the data and match, SI.
    pub(super) fn predicted(&self, values: &[f64]) -> Result<Vec<Vec<f64>>, String> {
        let mut params: Vec<f64> = self.program.model.params.iter().map(|p| p.value).collect();
        for (e, value) in self.fit.estimates.iter().zip(values) {
            if let Some(slot) = params.get_mut(e.free.param as usize) {
                *slot = *value;
            }
        }
        let looks = Probes { times: &self.times, nodes: &self.nodes };
        let limits = Limits { cancel: Some(self.cancel), looks, ..Limits::default() };
        let process = process::Options::of_one_of_many();
        let options = RunOptions { seed: self.seed, limits, process, ..RunOptions::default() };
        let mut seen = Seen::default();
        let outcome = run::run_ready(self.program, &self.prepared, params, &options, &mut seen);
        if !matches!(outcome.status, RunStatus::Passed | RunStatus::ExpectationFailed) {
            let why = outcome.execution.failure.map_or("cancelled".to_string(), |f| format!("{}: {}", f.name, f.text));
            return Err(why);
        }
        let mut out = Vec::with_capacity(self.fit.rows.len());
        for row in &self.fit.rows {
            let number = self.times.partition_point(|t| *t < row.time);
            let Some(values) = seen.0.get(&number) else {
                let (end, at) = (outcome.end_time, row.time);
                return Err(format!("the run ends at {end} s, but the data continue to {at} s"));
            };
            out.push(values.clone());
        }
        Ok(out)
    }
}

/// The largest magnitude in a column, to bring its residuals near to one.
fn size(fit: &Fit, column: usize) -> f64 {
    let values = fit.rows.iter().filter_map(|r| r.values.get(column).copied().flatten());
    let largest = values.fold(0.0f64, |m, v| m.max(v.abs()));
    if largest > 0.0 { largest } else { 1.0 }
}

impl Model for Runs<'_> {
    fn residuals(&self, values: &[f64]) -> Result<Vec<f64>, String> {
        let predicted = self.predicted(values)?;
        let mut out = Vec::new();
        for (row, model) in self.fit.rows.iter().zip(&predicted) {
            for ((data, model), weight) in row.values.iter().zip(model).zip(&self.weights) {
                out.extend(data.map(|data| (model - data) / weight));
            }
        }
        Ok(out)
    }
}

/// What was looked at, by the number of the time.
#[derive(Default)]
struct Seen(BTreeMap<usize, Vec<f64>>);

impl Observer for Seen {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Seen {
    fn looked(&mut self, number: usize, values: &[f64]) {
        self.0.insert(number, values.to_vec());
    }
}
