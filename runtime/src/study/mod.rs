//! Studies: many runs of one program, on all processors, with the same table whatever their number.

mod design;
mod human;
mod pool;
mod stretch;
mod summary;
mod table;
mod watch;

use std::sync::atomic::AtomicBool;

use matterix_ir::Program;
use matterix_ir::study::Study;

use crate::backend::Prepared;
use crate::exec::{Limits, RunStatus};
use crate::process;
use crate::run::{self, RunOptions};

pub use design::Design;
pub(crate) use design::sobol;
pub use human::human;
pub(crate) use human::short;
pub(crate) use pool::shared;
pub use summary::{Column, Summary};
pub use table::csv;

use watch::Watcher;

/// How to make the runs.
#[derive(Clone, Copy, Debug)]
pub struct Options<'c> {
    /// How many runs.
    pub runs: u64,
    /// Where all randomness starts; run `i`, counted from 0, has the seed `seed + i`.
    pub seed: u64,
    /// On how many threads.
    pub jobs: usize,
    /// Set from outside to end early; runs that have ended are kept.
    pub cancel: &'c AtomicBool,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its number, from 0.
    pub run: u64,
    /// Where its randomness started.
    pub seed: u64,
    /// What varied, in the order of the study, SI.
    pub varied: Vec<f64>,
    /// How it ended.
    pub status: RunStatus,
    /// The failure that ended it: `timeout`, `not-a-number`.
    pub fault: Option<String>,
    /// The reports in the order of the study, SI; all absent where the run has failed, one where it is not finite.
    pub reports: Vec<Option<f64>>,
}

/// Makes the runs of a study; rows are in the order of their numbers. `done` is told how many have ended.
pub fn runs(program: &Program, study: &Study, options: &Options<'_>, done: &mut dyn FnMut(u64)) -> Vec<Row> {
    let prepared = Prepared::new(program);
    let design = Design::new(study, options.seed);
    let nominal: Vec<f64> = program.model.params.iter().map(|p| p.value).collect();
    let one = |number: u64| {
        let varied = design.point(number);
        let mut params = nominal.clone();
        for (v, value) in study.varied.iter().zip(&varied) {
            if let Some(slot) = params.get_mut(v.free.param as usize) {
                *slot = *value;
            }
        }
        let seed = options.seed.wrapping_add(number);
        let limits = Limits { cancel: Some(options.cancel), ..Limits::default() };
        let process = process::Options::of_one_of_many();
        let run_options = RunOptions { seed, limits, process, ..RunOptions::default() };
        let mut watcher = Watcher::new(study, program.plan.locals.len());
        let outcome = run::run_ready(program, &prepared, params, &run_options, &mut watcher);
        let ended = matches!(outcome.status, RunStatus::Passed | RunStatus::ExpectationFailed);
        let reports = if ended { watcher.reports } else { vec![None; study.reports.len()] };
        let fault = outcome.failure.as_ref().map(|f| f.name.clone());
        Row { run: number, seed, varied, status: outcome.status, fault, reports }
    };
    let rows = shared(options.runs, options.jobs, options.cancel, one, done);
    rows.into_iter().filter(|row| row.status != RunStatus::Cancelled).collect()
}
