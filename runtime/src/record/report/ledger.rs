//! Closure of the sums that must close, from the first and the last sample.

use matterix_ir::model::Balance;
use matterix_ir::{Env, NodeId};

use super::{BalanceReport, ExchangeReport};
use crate::record::run::Run;
use crate::record::series::Series;

/// Every balance of the model; none if nothing was sampled.
pub(super) fn balances(run: &Run<'_>) -> Vec<BalanceReport> {
    let Some((first, last)) = run.recording.sampled else { return Vec::new() };
    let (first, last) = (Instant::new(run, first, Series::first), Instant::new(run, last, Series::last));
    run.program.model.balances.iter().map(|b| balance(run, b, &first, &last)).collect()
}

/// All states at the first or the last sample.
struct Instant<'a> {
    run: Run<'a>,
    time: f64,
    states: Vec<f64>,
    params: Vec<f64>,
    /// Neither locals nor readings occur in the model; there is room for them so that none can be missing.
    unset: Vec<f64>,
}

impl<'a> Instant<'a> {
    fn new(run: &Run<'a>, time: f64, point: fn(&Series) -> Option<(f64, f64)>) -> Self {
        let model = &run.program.model;
        let state = |i: usize| run.recording.states.get(i).and_then(point).map_or(f64::NAN, |p| p.1);
        Instant {
            run: *run,
            time,
            states: (0..model.states.len()).map(state).collect(),
            params: model.params.iter().map(|p| p.value).collect(),
            unset: vec![f64::NAN; run.program.plan.locals.len().max(model.readings.len())],
        }
    }

    fn eval(&self, node: NodeId) -> f64 {
        let env = Env {
            time: self.time,
            states: &self.states,
            params: &self.params,
            locals: &self.unset,
            readings: &self.unset,
        };
        self.run.program.model.graph.eval(node, env)
    }
}

fn balance(run: &Run<'_>, balance: &Balance, first: &Instant<'_>, last: &Instant<'_>) -> BalanceReport {
    let state = |at: &Instant<'_>, i: u32| at.states.get(i as usize).copied().unwrap_or(f64::NAN);
    let exchanged = |i: u32| state(last, i) - state(first, i);
    let (initial, end) = (first.eval(balance.total), last.eval(balance.total));
    let error = end - initial - balance.exchanges.iter().map(|&i| exchanged(i)).sum::<f64>();
    let magnitude = first.eval(balance.magnitude).abs().max(last.eval(balance.magnitude).abs());
    // A sum is a difference of two readings of its unit, so a unit's offset has no part in changes.
    let change = |si: f64| si / balance.unit.factor;
    let exchange = |&i: &u32| ExchangeReport {
        name: run.program.model.states.get(i as usize).map(|s| s.name.clone()).unwrap_or_default(),
        amount: change(exchanged(i)),
    };
    BalanceReport {
        name: balance.name.clone(),
        unit: balance.unit.symbol.clone(),
        initial: balance.unit.of_si(initial),
        end: balance.unit.of_si(end),
        exchanges: balance.exchanges.iter().map(exchange).collect(),
        error: change(error),
        relative_error: if magnitude > 0.0 { error.abs() / magnitude } else { error.abs() },
    }
}
