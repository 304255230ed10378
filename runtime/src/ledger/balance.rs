//! Sums over the whole lab that change only by what crosses its boundary.

use matterix_ir::NodeId;
use matterix_ir::model::Model;

/// Largest error of a balance, relative to the magnitude of its terms.
pub const CLOSURE: f64 = 1e-9;

/// How one balance stands; all numbers SI.
#[derive(Clone, Debug, PartialEq)]
pub struct BalanceReport {
    /// `energy`, `element C`.
    pub name: String,
    /// The sum when the run began.
    pub initial: f64,
    /// The sum now.
    pub now: f64,
    /// What came in through the boundary since.
    pub exchanged: f64,
    /// `now - initial - exchanged`.
    pub error: f64,
    /// The error's magnitude relative to that of the terms.
    pub relative: f64,
}

impl BalanceReport {
    /// Whether the sum is accounted for within [`CLOSURE`].
    pub fn closes(&self) -> bool {
        self.relative <= CLOSURE
    }
}

/// The sums and exchanges at the start, against which later ones are compared.
#[derive(Clone, Debug, Default)]
pub struct Balances {
    initial: Vec<f64>,
    exchanged: Vec<f64>,
    magnitude: Vec<f64>,
}

impl Balances {
    /// Notes where every balance of `model` starts.
    pub fn open(model: &Model, states: &[f64], eval: impl Fn(NodeId) -> f64) -> Self {
        Balances {
            initial: model.balances.iter().map(|b| eval(b.total)).collect(),
            exchanged: model.balances.iter().map(|b| exchanged(&b.exchanges, states)).collect(),
            magnitude: model.balances.iter().map(|b| eval(b.magnitude)).collect(),
        }
    }

    /// How every balance stands. The error is judged against the larger of the magnitudes at the start and now, so that a
    /// lab that was emptied is not judged by what little is left in it.
    pub fn report(&self, model: &Model, states: &[f64], eval: impl Fn(NodeId) -> f64) -> Vec<BalanceReport> {
        let mut reports = Vec::with_capacity(model.balances.len());
        for (i, balance) in model.balances.iter().enumerate() {
            let now = eval(balance.total);
            let exchanged = exchanged(&balance.exchanges, states) - self.exchanged[i];
            let error = now - self.initial[i] - exchanged;
            let magnitude = eval(balance.magnitude).abs().max(self.magnitude[i].abs()).max(exchanged.abs());
            let relative = if error == 0.0 { 0.0 } else { error.abs() / magnitude };
            let initial = self.initial[i];
            reports.push(BalanceReport { name: balance.name.clone(), initial, now, exchanged, error, relative });
        }
        reports
    }
}

fn exchanged(states_of: &[u32], states: &[f64]) -> f64 {
    states_of.iter().map(|&s| states[s as usize]).sum()
}
