//! What a run did, and whether two runs did the same.

use std::collections::BTreeMap;

use matterix_ir::Program;
use matterix_ir::plan::{Operation, StepId};
use matterix_runtime::exec::{ExpectationResult, Listener, OperationState, RunStatus, Verdict};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::run::{RunOptions, run};

/// Instants that differ by less are the same, s: they come of locating when a condition comes true.
const SAME_INSTANT: f64 = 1e-3;

/// Samples that are less apart are of one instant, s.
const SAME_SAMPLE: f64 = 1e-6;

/// Relative difference of a state that comes of the steps of the solver.
const SAME_VALUE: f64 = 1e-5;

/// What a run did.
pub struct Behaviour {
    /// Why it did not pass.
    pub failure: Option<String>,
    /// When it ended, s.
    end: f64,
    /// Names of states, and the magnitude below which they do not matter.
    states: Vec<(String, f64)>,
    /// States after each instant.
    samples: Vec<(f64, Vec<f64>)>,
    /// Operations that last: what, from when, until when.
    operations: Vec<(String, f64, f64)>,
}

impl Behaviour {
    /// Runs a program with the default seed.
    pub fn of(program: &Program) -> Self {
        let mut watch = Watch::new(program);
        let outcome = run(program, &RunOptions::default(), &mut watch);
        let missed = outcome.expectations.iter().find(|e| e.verdict == Verdict::Failed);
        let failure = match (outcome.status, &outcome.failure, missed) {
            (RunStatus::Passed, _, _) => None,
            (_, Some(f), _) => Some(f.name.clone()),
            (_, None, Some(ExpectationResult { text, .. })) => Some(format!("expect {text}")),
            (_, None, None) => Some("failed".to_string()),
        };
        watch.operations.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| a.0.cmp(&b.0)));
        let states = program.model.states.iter().map(|s| (s.name.clone(), s.scale.unwrap_or(1.0))).collect();
        Behaviour { failure, end: outcome.end_time, states, samples: watch.samples, operations: watch.operations }
    }

    /// Whether both end at the same time, do the same operations at the same times, and every state of the lab is the
    /// same at every instant that both know. Operations that take no time show in the states alone.
    pub fn same(&self, other: &Behaviour) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= SAME_INSTANT;
        if !close(self.end, other.end) || self.operations.len() != other.operations.len() {
            return false;
        }
        let mut pairs = self.operations.iter().zip(&other.operations);
        if !pairs.all(|(a, b)| a.0 == b.0 && close(a.1, b.1) && close(a.2, b.2)) {
            return false;
        }
        let Some(columns) = self.columns(other) else { return false };
        let mut j = 0;
        for (time, values) in &self.samples {
            while j + 1 < other.samples.len() && other.samples[j + 1].0 <= time + SAME_SAMPLE {
                j += 1;
            }
            let Some((then, others)) = other.samples.get(j) else { return false };
            if (then - time).abs() > SAME_SAMPLE {
                continue;
            }
            let same = |&(a, b, scale): &(usize, usize, f64)| {
                let (a, b) = (values[a], others[b]);
                (a - b).abs() <= SAME_VALUE * a.abs().max(b.abs()) + 1e-3 * scale
            };
            if !columns.iter().all(same) {
                return false;
            }
        }
        true
    }

    /// Pairs of columns with the same state; none where the states are not the same ones.
    fn columns(&self, other: &Behaviour) -> Option<Vec<(usize, usize, f64)>> {
        let index: BTreeMap<&str, usize> = other.states.iter().enumerate().map(|(i, s)| (s.0.as_str(), i)).collect();
        let pairs = self.states.iter().enumerate();
        let pairs: Option<Vec<_>> = pairs.map(|(i, s)| index.get(s.0.as_str()).map(|j| (i, *j, s.1))).collect();
        pairs.filter(|p| p.len() == other.states.len())
    }
}

/// Follows a run.
struct Watch<'p> {
    program: &'p Program,
    samples: Vec<(f64, Vec<f64>)>,
    running: BTreeMap<StepId, f64>,
    operations: Vec<(String, f64, f64)>,
}

impl<'p> Watch<'p> {
    fn new(program: &'p Program) -> Self {
        Watch { program, samples: Vec::new(), running: BTreeMap::new(), operations: Vec::new() }
    }
}

impl Observer for Watch<'_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, _: &[u32]) {
        // Of samples at one instant the last one counts.
        match self.samples.last_mut() {
            Some(last) if time - last.0 <= SAME_SAMPLE => last.1 = engine.states(),
            _ => self.samples.push((time, engine.states())),
        }
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Watch<'_> {
    fn operation(&mut self, time: f64, step: StepId, _: &Operation, state: OperationState) {
        match state {
            OperationState::Started => drop(self.running.insert(step, time)),
            _ => {
                let since = self.running.remove(&step).unwrap_or(time);
                if time > since {
                    self.operations.push((self.program.plan.get(step).label.clone(), since, time));
                }
            }
        }
    }
}
