//! Fits: parameters of a program estimated from data by weighted least squares, and what the data say of them.
//!
//! - `scale`: parameters as places in their ranges, between 0 and 1.
//! - `solve`: starts from many places, then Levenberg and Marquardt's method.
//! - `spread`: standard errors, what is not determined.
//! - `runs`: a run of the program as a vector of residuals.

mod human;
mod outcome;
mod runs;
mod scale;
mod solve;
mod spread;
mod table;

use std::sync::atomic::AtomicBool;

use matterix_ir::Program;
use matterix_ir::study::Fit;

pub use human::human;
pub use outcome::{Estimate, Matching, Outcome};
pub use scale::Scale;
pub use solve::{Model, Options, Solution, Unsolved, solve};
pub use spread::Spread;
pub use table::csv;

/// Estimates the parameters of a fit; where nothing came of it, why. `done` is told how many runs have ended in the first
/// look around.
pub fn estimate(
    program: &Program,
    fit: &Fit,
    seed: u64,
    jobs: usize,
    cancel: &AtomicBool,
    done: &mut dyn FnMut(u64),
) -> Result<Outcome, Unsolved> {
    let model = runs::Runs::new(program, fit, seed, cancel);
    let scales: Vec<Scale> =
        fit.estimates.iter().map(|e| Scale { low: e.free.low, high: e.free.high, log: e.log }).collect();
    let options = Options { nominal: model.nominal(), seed, jobs, cancel };
    let solution = solve(&model, &scales, &options, done)?;
    let predicted = model.predicted(&solution.values).map_err(Unsolved::Failed)?;
    Ok(Outcome::new(program, fit, &scales, &solution, predicted))
}
