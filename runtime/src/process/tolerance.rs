//! How small the error of each state has to be.
//!
//! A state with a declared scale is followed down to a share of it. Without one the sizes that occur decide: those at the start,
//! those that the rates lead to within the shortest time in which anything changes, and those that come about later. Below
//! what rounding makes of the rates no error can be told.

use super::tangent;
use super::tape::Tape;

/// Without a declared scale, errors count down to this share of the largest value that a state has had.
const DEPTH: f64 = 1e-3;

/// What a state was worth before the present law is kept as this share: what has all but gone is not followed for ever.
const KEPT: f64 = 1e-6;

/// A state below this has no size of its own, SI.
const LEAST: f64 = 1e-24;

/// The tolerance of a state is set anew when its value has grown by so much.
const GROWN: f64 = 16.0;

/// How far ahead rates are tried, as a part of the shortest time in which a state changes by as much as it is.
const AHEAD: f64 = 0.5;

/// Links of a chain of states that are found, each fed by the one before.
const LINKS: usize = 6;

/// Without a state that changes in proportion to itself, rates are tried for so long, s.
const UNTIMED: f64 = 1.0;

/// Absolute tolerances of the moving states.
#[derive(Clone, Debug)]
pub(super) struct Tolerance {
    /// Relative error of a step.
    pub(super) rtol: f64,
    /// Absolute error of a step, by moving state.
    pub(super) atol: Vec<f64>,
    /// Declared scales.
    scales: Vec<Option<f64>>,
    /// The largest magnitude of each state so far.
    sizes: Vec<f64>,
    /// The rounding error of each rate, per s.
    noise: Vec<f64>,
    /// The step beyond which rounding is weighed anew, s.
    weighed: f64,
}

impl Tolerance {
    /// For the states `values` at `time`, s, that move by `rates`; `sizes` are what they were worth so far, 0 where that is not known.
    pub(super) fn new(
        rtol: f64,
        scales: Vec<Option<f64>>,
        sizes: &[f64],
        rates: &Tape,
        time: f64,
        values: &[f64],
    ) -> Self {
        let atol = vec![0.0; values.len()];
        let sizes = values.iter().zip(sizes).map(|(v, s)| v.abs().max(KEPT * s)).collect();
        let mut tolerance = Tolerance { rtol, atol, scales, sizes, noise: Vec::new(), weighed: 0.0 };
        if tolerance.scales.iter().any(Option::is_none) {
            tolerance.look_ahead(rates, time, values);
        }
        tolerance.set();
        tolerance
    }

    /// Sizes of states that are nothing, by what their rates make of them.
    fn look_ahead(&mut self, rates: &Tape, time: f64, values: &[f64]) {
        let mut registers = rates.registers();
        self.weigh(rates, time, values, &mut registers);
        let mut slopes = vec![0.0; values.len()];
        rates.results(&registers, &mut slopes);
        let paces = values.iter().zip(&slopes).map(|(v, s)| (v / s).abs()).filter(|t| t.is_normal());
        let span = AHEAD * paces.fold(f64::INFINITY, f64::min);
        let span = if span.is_finite() { span } else { UNTIMED };
        let open =
            |sizes: &[f64], scales: &[Option<f64>]| sizes.iter().zip(scales).any(|(s, d)| *s < LEAST && d.is_none());
        for _ in 0..LINKS {
            if !open(&self.sizes, &self.scales) {
                return;
            }
            let there: Vec<f64> = values.iter().zip(&slopes).map(|(v, s)| v + s * span).collect();
            rates.run(time + span, &there, &mut registers);
            let before = std::mem::replace(&mut slopes, vec![0.0; values.len()]);
            rates.results(&registers, &mut slopes);
            if slopes.iter().any(|s| !s.is_finite()) {
                return;
            }
            for ((size, value), slope) in self.sizes.iter_mut().zip(values).zip(&slopes) {
                if *value == 0.0 {
                    *size = size.max(slope.abs() * span);
                }
            }
            if before == slopes {
                return;
            }
        }
    }

    /// Weighs the rounding of the rates, whose values are in `registers` then.
    fn weigh(&mut self, rates: &Tape, time: f64, values: &[f64], registers: &mut [f64]) {
        rates.run(time, values, registers);
        self.noise.resize(values.len(), 0.0);
        rates.results(&tangent::noise(rates, registers), &mut self.noise);
    }

    /// Weighs the rounding of the rates anew where steps get short: a law may have come to a place at which rounding decides.
    pub(super) fn listen(&mut self, rates: &Tape, time: f64, values: &[f64]) {
        if self.scales.iter().any(Option::is_none) {
            self.weigh(rates, time, values, &mut rates.registers());
            self.weighed = 0.0;
        }
    }

    fn set(&mut self) {
        for ((atol, scale), size) in self.atol.iter_mut().zip(&self.scales).zip(&self.sizes) {
            *atol = self.rtol * scale.unwrap_or_else(|| (DEPTH * size.max(LEAST)).min(1.0));
        }
    }

    /// How far off the states may be at `values`.
    pub(super) fn allowed(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.atol).map(|(value, least)| least + self.rtol * value.abs()).collect()
    }

    /// What states are worth, in the order of the moving states.
    pub(super) fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Whether the states, after a step of `length` s, ask for other tolerances.
    pub(super) fn is_outgrown(&self, values: &[f64], length: f64) -> bool {
        let open = self.scales.iter().enumerate().filter(|(_, scale)| scale.is_none());
        let loud = length > self.weighed;
        open.into_iter().any(|(i, _)| {
            values[i].abs() > GROWN * self.sizes[i] && self.sizes[i] < 1.0 / DEPTH
                || loud && self.noise[i] * length > self.atol[i]
        })
    }

    /// Sets tolerances for `values`; `damping` is how fast an error of a state dies out by itself, per s.
    pub(super) fn renew(&mut self, values: &[f64], length: f64, damping: &mut dyn FnMut(usize) -> f64) {
        for (size, value) in self.sizes.iter_mut().zip(values) {
            *size = size.max(value.abs());
        }
        self.set();
        self.weighed = GROWN * length;
        for i in 0..values.len() {
            if self.scales[i].is_some() {
                continue;
            }
            let loud = self.noise[i] * self.weighed;
            if loud > self.atol[i] {
                self.atol[i] = self.atol[i].max(loud / (1.0 + self.weighed * damping(i)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use matterix_ir::BinaryOp;

    use super::super::tape::Step;
    use super::*;

    /// x' = -0.1 x, y' = 0.1 x - 0.2 y, z' = 0.2 y.
    fn chain() -> Tape {
        let steps = vec![
            Step::Binary(BinaryOp::Mul, 0, 4),
            Step::Binary(BinaryOp::Mul, 1, 5),
            Step::Binary(BinaryOp::Sub, 7, 8),
            Step::Binary(BinaryOp::Sub, 2, 7),
        ];
        Tape {
            constants: vec![0.1, 0.2, 0.0],
            inputs: 3,
            steps,
            terms: Vec::new(),
            calls: Vec::new(),
            outputs: vec![10, 9, 8],
        }
    }

    #[test]
    fn what_is_nothing_has_the_size_that_it_is_fed_to() {
        for unit in [1e-20, 1e-12, 1.0] {
            let tolerance = Tolerance::new(1e-8, vec![None; 3], &[0.0; 3], &chain(), 0.0, &[unit, 0.0, 0.0]);
            assert_eq!(tolerance.sizes[0], unit);
            assert!(tolerance.sizes[1] > 0.1 * unit && tolerance.sizes[1] < unit);
            assert!(tolerance.sizes[2] > 0.01 * unit && tolerance.sizes[2] < unit);
            assert!((tolerance.atol[0] / unit - 1e-11).abs() < 1e-20);
        }
    }

    #[test]
    fn a_declared_scale_is_kept() {
        let scales = vec![Some(1e-6), Some(1.0), None];
        let mut tolerance = Tolerance::new(1e-8, scales, &[0.0; 3], &chain(), 0.0, &[1e-9, 0.0, 1e-9]);
        tolerance.renew(&[1.0, 1.0, 1e-9], 1.0, &mut |_| 0.0);
        assert_eq!(tolerance.atol[..2], [1e-14, 1e-8]);
        assert!(tolerance.atol[2] < 1e-18);
    }
}
