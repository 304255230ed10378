//! What laws and effects may do that no lab does: make or lose matter, bring a mixture to a temperature that cannot be.
//!
//! Where the compiler has shown that nothing of the kind can happen there is nothing to look at.

use matterix_ir::model::{Domain, Drained, Model};
use matterix_ir::{Span, codes};

use super::Engine;
use super::dense::Dense;
use crate::fault::Fault;
use crate::ledger::CLOSURE;

/// A mixture may be so much warmer or colder than everything else was before its law is blamed, K.
const MARGIN: f64 = 1.0;

/// An amount below nothing by less than this share of its scale is nothing.
const ROUNDING: f64 = 1e-3;

/// Halvings that find when an amount is used up.
const BISECTIONS: usize = 60;

/// The same as a share of what there was, where no scale is declared.
const LEFT_OVER: f64 = 1e-6;

/// What is counted between two looks.
#[derive(Clone, Debug, Default)]
pub(super) struct Suspicion {
    /// The sums that each state is in, by balance, with its factor there; found when first needed.
    factors: Vec<Vec<(u32, f64)>>,
    /// What the assignments of the present instant add to each balance, and the sum of their magnitudes.
    added: Vec<(f64, f64)>,
    /// Whether processes or temperatures are to be looked at while time passes.
    watchful: bool,
    /// The least and greatest of all temperatures that are not suspected, K.
    span: Option<(f64, f64)>,
}

impl Suspicion {
    pub(super) fn new(model: &Model) -> Self {
        let doubts = model.balances.iter().any(|b| !b.doubts.is_empty());
        Suspicion {
            watchful: doubts || !model.temperatures.suspects.is_empty() || !model.temperatures.drained.is_empty(),
            ..Suspicion::default()
        }
    }

    /// Counts the assignment of a state that changes it by so much.
    pub(super) fn count(&mut self, model: &Model, state: u32, by: f64) {
        if self.factors.is_empty() {
            self.factors = vec![Vec::new(); model.states.len()];
            for (balance, of) in model.balances.iter().enumerate() {
                for (state, factor) in &of.terms {
                    self.factors[*state as usize].push((balance as u32, *factor));
                }
            }
        }
        let factors = &self.factors[state as usize];
        if factors.is_empty() {
            return;
        }
        self.added.resize(model.balances.len(), (0.0, 0.0));
        for (balance, factor) in factors {
            let sum = &mut self.added[*balance as usize];
            *sum = (sum.0 + factor * by, sum.1 + (factor * by).abs());
        }
    }
}

impl Engine<'_> {
    /// The amounts among `moving` that laws may take more of than there is.
    pub(super) fn scarce(&self, moving: &[u32]) -> Vec<Scarce> {
        let watched = self.model.temperatures.drained.iter().enumerate();
        let scarce = |(which, drained): (usize, &Drained)| {
            let place = moving.binary_search(&drained.state).ok()? as u32;
            Some(Scarce { which, place, residue: self.residue(drained) })
        };
        watched.filter_map(scarce).collect()
    }

    /// The fault of an amount that a law takes more of than there is.
    pub(super) fn overdrawn(&self, drained: &Drained, how: &str) -> Fault {
        let name = &self.model.states[drained.state as usize].name;
        let message = format!("`{}` removes more than `{name}` holds: it {how}", drained.law);
        Fault::new(codes::TRANSFER_FRACTION, self.time, message)
            .at(drained.span)
            .help("let the rate depend on the remaining amount, or give the law a `while` that ends it")
    }

    /// Fails where what was assigned since the last look makes or loses something; `who` did it.
    pub(super) fn judge_instant(&mut self, who: &str, span: Option<Span>) -> Result<(), Fault> {
        let added = std::mem::take(&mut self.suspicion.added);
        for (balance, (sum, size)) in self.model.balances.iter().zip(added) {
            if sum.abs() <= CLOSURE * size || sum.abs() <= CLOSURE * self.eval(balance.magnitude).abs() {
                continue;
            }
            let verb = if sum > 0.0 { "makes" } else { "loses" };
            let message = format!("{who} {verb} {} of {}", balance.unit.show(sum.abs()), balance.name);
            let fault = Fault::new(codes::BALANCE_BREACH, self.time, message)
                .help("add to one mixture the amount that another loses, as `move(...)` does");
            return Err(match span {
                Some(span) => fault.at(span),
                None => fault,
            });
        }
        Ok(())
    }

    /// Looks at what processes may break while time passes.
    pub(super) fn check_suspects(&mut self) -> Result<(), Fault> {
        if !self.suspicion.watchful {
            return Ok(());
        }
        self.check_temperatures()?;
        self.check_balances(None)
    }

    /// Fails where a law has taken more of an amount than there is.
    pub(super) fn check_drained(&self) -> Result<(), Fault> {
        let overdrawn = |d: &&Drained| self.state(d.state) < -self.residue(d);
        self.model.temperatures.drained.iter().find(overdrawn).map_or(Ok(()), |d| Err(self.takes_too_much(d)))
    }

    /// The amount that a law would take more of than there is, if one has run out.
    pub(super) fn run_dry(&self) -> Option<Fault> {
        let taken = |d: &Drained| {
            let rate = self.model.derivatives.iter().find(|of| of.state == d.state).map(|of| self.eval(of.rate));
            rate.is_some_and(|rate| rate < 0.0 || !rate.is_finite())
        };
        let dry = |d: &&Drained| self.state(d.state).abs() <= self.residue(d) && taken(d);
        self.model.temperatures.drained.iter().find(dry).map(|d| self.takes_too_much(d))
    }

    /// What counts as nothing of an amount.
    fn residue(&self, drained: &Drained) -> f64 {
        let state = drained.state as usize;
        self.model.states[state].scale.map_or(LEFT_OVER * self.sizes[state], |scale| ROUNDING * scale)
    }

    fn takes_too_much(&self, drained: &Drained) -> Fault {
        let (state, value) = (&self.model.states[drained.state as usize], self.states[drained.state as usize]);
        let shown = match &state.domain {
            Domain::Quantity(unit) => unit.show(value),
            _ => value.to_string(),
        };
        self.overdrawn(drained, &format!("is {shown}"))
    }

    /// Fails where a suspected temperature cannot be.
    pub(super) fn check_temperatures(&mut self) -> Result<(), Fault> {
        self.check_drained()?;
        let temperatures = &self.model.temperatures;
        if temperatures.suspects.is_empty() {
            return Ok(());
        }
        let (mut low, mut high) = self.suspicion.span.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
        let others = temperatures.others.iter().map(|n| self.eval(*n));
        let first = self.suspicion.span.is_none();
        let own = temperatures.suspects.iter().filter(|_| first).map(|s| self.eval(s.value));
        for t in others.chain(own).filter(|t| t.is_finite()) {
            (low, high) = (low.min(t), high.max(t));
        }
        self.suspicion.span = Some((low, high));
        for suspect in &temperatures.suspects {
            let t = self.eval(suspect.value);
            let beyond = suspect.heatless && (t < low - MARGIN || t > high + MARGIN);
            if t >= 0.0 && !beyond {
                continue;
            }
            let unit = matterix_ir::Unit { symbol: "degC".into(), factor: 1.0, offset: 273.15 };
            let shown = |t: f64| unit.show(t);
            let message = match t < 0.0 || t.is_nan() {
                true => format!("`{}` drives `{}` to {}, which is impossible", suspect.law, suspect.name, shown(t)),
                false => format!(
                    "`{}` drives `{}` to {}, but everything else in the lab was between {} and {}",
                    suspect.law,
                    suspect.name,
                    shown(t),
                    shown(low),
                    shown(high)
                ),
            };
            return Err(Fault::new(codes::NONPHYSICAL_TEMPERATURE, self.time, message)
                .at(suspect.span)
                .help("let amounts carry their heat, as `move(...)` does"));
        }
        Ok(())
    }
}

/// An amount that must not be used up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scarce {
    /// Its index in the model.
    which: usize,
    /// Its place among the moving states.
    place: u32,
    /// What counts as nothing.
    residue: f64,
}

/// The first amount that is used up, by its index, and when, s on the clock of `dense`: between `from` and the last of `times`
/// (ascending).
pub(super) fn first_drained(dense: &Dense, scarce: &[Scarce], from: f64, times: &[f64]) -> Option<(f64, usize)> {
    let value = |time: f64, scarce: &Scarce| {
        let mut value = [0.0];
        dense.some(time, &[scarce.place], &mut value);
        value[0]
    };
    let mut low = from;
    for &high in times.iter().filter(|_| !scarce.is_empty()) {
        let gone = scarce.iter().filter(|s| value(high, s) < -s.residue);
        let used_up = |s: &Scarce| {
            let (mut low, mut high) = (low, high);
            for _ in 0..BISECTIONS {
                let middle = low + 0.5 * (high - low);
                if value(middle, s) < 0.0 { high = middle } else { low = middle }
            }
            (low, s.which)
        };
        if let Some(first) = gone.map(used_up).min_by(|a, b| a.0.total_cmp(&b.0)) {
            return Some(first);
        }
        low = high;
    }
    None
}
