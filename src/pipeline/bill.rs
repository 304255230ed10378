//! What a run of a program uses up: executed on the digital twin and followed.

use std::sync::atomic::AtomicBool;

use matterix_ir::{Diagnostic, Program, Sources};
use matterix_runtime::bill::{self, Bill, Follower};
use matterix_runtime::exec::{Limits, RunStatus};
use matterix_runtime::run::RunOptions;

pub use matterix_runtime::bill::Prices;

/// A bill with what went wrong in the run it was taken from.
pub struct Billed {
    bill: Bill,
    /// What ended the run early, and expectations that were not met.
    pub diagnostics: Vec<Diagnostic>,
    /// Whether the run came to its end.
    pub complete: bool,
}

/// Executes a program once and makes the bill of `runs` like it.
pub fn bill(program: &Program, sources: &Sources, seed: u64, runs: u64, cancel: &AtomicBool) -> Billed {
    let limits = Limits { cancel: Some(cancel), ..Limits::default() };
    let options = RunOptions { seed, limits, ..RunOptions::default() };
    let mut follower = Follower::new(program);
    let outcome = matterix_runtime::run::run(program, &options, &mut follower);
    Billed {
        bill: follower.bill(&outcome, runs),
        diagnostics: super::run::findings(&outcome, sources),
        complete: matches!(outcome.status, RunStatus::Passed | RunStatus::ExpectationFailed),
    }
}

impl Billed {
    /// Adds what it costs.
    pub fn price(&mut self, prices: &Prices) {
        self.bill.costs = Some(prices.costs(&self.bill));
    }

    /// The bill to read.
    pub fn page(&self) -> String {
        bill::human(&self.bill)
    }

    /// As JSON.
    pub fn json(&self) -> Result<String, String> {
        self.bill.json().map_err(|e| format!("cannot write the bill: {e}"))
    }

    /// As a table.
    pub fn csv(&self) -> Result<String, String> {
        bill::csv(&self.bill).map_err(|e| format!("cannot write the bill: {e}"))
    }
}
