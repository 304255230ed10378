//! Parts that need no integration: rates linear in the states, by coefficients that stay as they are until the next discontinuity.
//!
//! From `x` on, after `s`, the states are `x + P(s) f`: `f` are the rates at `x`, `P(s) = s + A s^2 / 2 + A^2 s^3 / 6 ...`. It holds for
//! matrices of every kind, defective and singular ones among them. Steps are powers of 2, so that the matrices of a length are made
//! from those of half of it, `P(2 s) = 2 P(s) + P(s) A P(s)`, and serve for all steps of that length. A step is as long as its polynomial is good; as what
//! moves dies out, steps grow. Only rounding accumulates: by as much as the fastest rate is faster than a step is long, so
//! that a part with rates that are too far apart is left to the integrator.

use std::collections::BTreeMap;

use super::dense::POINTS;
use super::slopes::Slopes;
use super::tape::Tape;
use super::timed::kinds;

/// More states than this are integrated: a product of matrices grows with the third power.
pub(super) const MOST: usize = 10;

/// Powers of 2, s: no step is longer or shorter.
const LENGTHS: std::ops::RangeInclusive<i32> = -100..=40;

/// Steps this much longer than the fastest rate lose six digits.
const STIFF: f64 = 1e5;

/// So many steps that only [`STIFF`] keeps short lead nowhere.
const HELD: usize = 24;

/// Terms of the series, enough where the norm is at most [`NEAR`].
const TERMS: usize = 13;

/// The norm up to which the series is used.
const NEAR: f64 = 0.5;

/// The error of a polynomial of degree 5 grows with this power of 2 when the step is twice as long; half as much again is left over.
const GROWTH: f64 = 96.0;

/// Who watches sees the ends of steps and draws straight lines between them: these may be off by this part of what has changed so far.
const BEND: f64 = 1.0 / 400.0;

/// In a step this much shorter than the fastest rate no curve departs from a straight line by more than [`BEND`] of what it changes by
/// in all: `h^2 / 8` of it.
const SHORT: f64 = 1.0 / 8.0;

/// Where the solution is computed, as parts of a step: where a polynomial is sampled, and where that is worst.
pub(super) const PLACES: [f64; 6] = [POINTS[1], POINTS[2], POINTS[3], POINTS[4], 1.0, 0.5];

/// A square matrix, row by row.
#[derive(Clone, Debug)]
struct Square {
    size: usize,
    entries: Vec<f64>,
}

impl Square {
    fn zeros(size: usize) -> Self {
        Square { size, entries: vec![0.0; size * size] }
    }

    fn times(&self, other: &Square) -> Square {
        let mut product = Square::zeros(self.size);
        for (row, out) in self.rows().zip(product.entries.chunks_mut(self.size)) {
            for (factor, other) in row.iter().zip(other.rows()).filter(|(factor, _)| **factor != 0.0) {
                out.iter_mut().zip(other).for_each(|(out, other)| *out += factor * other);
            }
        }
        product
    }

    fn add(&mut self, factor: f64, other: &Square) {
        self.entries.iter_mut().zip(&other.entries).for_each(|(a, b)| *a += factor * b);
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.entries.chunks(self.size)
    }

    /// The largest sum of a row.
    fn norm(&self) -> f64 {
        self.rows().map(|row| row.iter().map(|e| e.abs()).sum()).fold(0.0, f64::max)
    }
}

/// A part's law as a matrix, in units in which its rows and columns are alike.
#[derive(Clone)]
pub(super) struct Exact {
    /// The first powers of the matrix, the unit matrix before them.
    powers: Vec<Square>,
    norm: f64,
    /// The units of the states: powers of 2, which round nothing.
    units: Vec<f64>,
    /// By the exponent of the length, [`PLACES`] of a step.
    known: BTreeMap<i32, Vec<Square>>,
    /// The exponent of the next step.
    next: i32,
    /// Steps in a row that could have been longer.
    held: usize,
    rates: Vec<f64>,
    /// The least and the most of each state so far.
    seen: Vec<(f64, f64)>,
}

/// A step that is good enough: its length, s, and the states at [`PLACES`].
pub(super) struct Stride {
    pub(super) length: f64,
    pub(super) states: [Vec<f64>; 6],
}

impl Exact {
    /// For a law that is linear by constant coefficients; `slopes` has no hubs.
    pub(super) fn of(rates: &Tape, slopes: &Slopes) -> Option<Self> {
        if rates.inputs > MOST || !is_linear(rates) {
            return None;
        }
        let mut registers = rates.registers();
        rates.run(0.0, &vec![0.0; rates.inputs], &mut registers);
        let pattern = &slopes.pattern;
        let mut entries = vec![0.0; pattern.columns.len()];
        slopes.evaluate(rates, &registers, &mut slopes.memory(), &mut entries);
        let mut matrix = Square::zeros(rates.inputs);
        for row in 0..rates.inputs {
            for entry in pattern.row(row) {
                matrix.entries[row * rates.inputs + pattern.columns[entry] as usize] = entries[entry];
            }
        }
        Some(Exact::new(matrix))
    }

    fn new(mut matrix: Square) -> Self {
        let units = balance(&mut matrix);
        let (norm, size) = (matrix.norm(), matrix.size);
        let mut one = Square::zeros(size);
        (0..size).for_each(|i| one.entries[i * size + i] = 1.0);
        let next = if norm > 0.0 { exponent(NEAR / 2.0 / norm) } else { 0 };
        let (rates, seen) = (vec![0.0; size], vec![(f64::INFINITY, f64::NEG_INFINITY); size]);
        Exact { powers: vec![one, matrix], norm, units, known: BTreeMap::new(), next, held: 0, rates, seen }
    }

    /// A step from `values` on, at which the rates are `slopes`; the polynomial through it may be off by `allowed`. None where
    /// there is none, or where too many have been too short.
    pub(super) fn stride(&mut self, values: &[f64], slopes: &[f64], allowed: &[f64]) -> Option<Stride> {
        self.rates.iter_mut().zip(slopes).zip(&self.units).for_each(|((r, s), u)| *r = s / u);
        self.seen.iter_mut().zip(values).for_each(|(seen, value)| *seen = (seen.0.min(*value), seen.1.max(*value)));
        let most = if self.norm > 0.0 { exponent(STIFF / self.norm) } else { *LENGTHS.end() };
        self.next = self.next.min(most);
        loop {
            if !LENGTHS.contains(&self.next) || self.held > HELD {
                return None;
            }
            let states = self.states(values);
            let is_drawn = self.norm * 2f64.powi(self.next) <= SHORT;
            let bend = if is_drawn { 0.0 } else { bend(values, &states, allowed, &self.seen) };
            let error = worst(values, &states, allowed).max(bend);
            if error <= 1.0 {
                let length = 2f64.powi(self.next);
                let more = [1.0, GROWTH].iter().filter(|more| GROWTH * *more * error < 1.0).count() as i32;
                self.held = if self.next == most && most < *LENGTHS.end() && more > 0 { self.held + 1 } else { 0 };
                self.next = (self.next + more).min(most).min(*LENGTHS.end());
                return Some(Stride { length, states });
            }
            self.next -= 1;
        }
    }

    /// The least and the most of each state so far.
    pub(super) fn seen(&self) -> Vec<(f64, f64)> {
        self.seen.clone()
    }

    /// Takes over what states were under another law.
    pub(super) fn see(&mut self, before: &[(f64, f64)]) {
        let both = self.seen.iter_mut().zip(before);
        both.for_each(|(seen, before)| *seen = (seen.0.min(before.0), seen.1.max(before.1)));
    }

    fn states(&mut self, values: &[f64]) -> [Vec<f64>; 6] {
        self.prepare(self.next);
        let matrices = &self.known[&self.next];
        std::array::from_fn(|k| {
            let moved = matrices[k].rows().map(|row| row.iter().zip(&self.rates).map(|(a, b)| a * b).sum::<f64>());
            moved.zip(&self.units).zip(values).map(|((moved, unit), value)| value + unit * moved).collect()
        })
    }

    /// Makes the matrices of steps of one length.
    fn prepare(&mut self, length: i32) {
        let mut begin = length;
        while !self.known.contains_key(&begin) && self.norm * 2f64.powi(begin) > NEAR {
            begin -= 1;
        }
        if !self.known.contains_key(&begin) {
            let made = PLACES.iter().map(|place| self.series(place * 2f64.powi(begin))).collect();
            self.known.insert(begin, made);
        }
        for length in begin..length {
            let twice = |half: &Square| {
                let mut twice = half.times(&self.powers[1].times(half));
                twice.add(2.0, half);
                twice
            };
            let made = self.known[&length].iter().map(twice).collect();
            self.known.insert(length + 1, made);
        }
    }

    /// `P(span)` by its series.
    fn series(&mut self, span: f64) -> Square {
        while self.powers.len() <= TERMS {
            let next = self.powers[1].times(&self.powers[self.powers.len() - 1]);
            self.powers.push(next);
        }
        let mut sum = Square::zeros(self.rates.len());
        // The smallest first.
        for (k, power) in self.powers.iter().enumerate().rev() {
            let factor = (0..=k).map(|i| span / (i + 1) as f64).product();
            sum.add(factor, power);
        }
        sum
    }
}

/// The exponent of the power of 2 next below `length`.
fn exponent(length: f64) -> i32 {
    const BIAS: i32 = 1023;
    ((length.to_bits() >> 52) & 0x7ff) as i32 - BIAS
}

/// How far the polynomial through a step is off, as a part of what is allowed.
fn worst(values: &[f64], states: &[Vec<f64>; 6], allowed: &[f64]) -> f64 {
    // The Lagrange polynomials of the points at the middle.
    const SHARES: [f64; 6] =
        [0.1, -0.247_213_595_499_958, 0.647_213_595_499_958, 0.647_213_595_499_958, -0.247_213_595_499_958, 0.1];
    let mut most = 0.0_f64;
    for i in 0..values.len() {
        let sampled = [values[i], states[0][i], states[1][i], states[2][i], states[3][i], states[4][i]];
        let middle: f64 = SHARES.iter().zip(sampled).map(|(share, value)| share * (value - values[i])).sum();
        let error = (middle - (states[5][i] - values[i])).abs() / allowed[i];
        most = if error.is_finite() { most.max(error) } else { f64::INFINITY };
    }
    most
}

/// How far off a straight line is, as a part of what it may be; it grows with the length like [`worst`].
fn bend(values: &[f64], states: &[Vec<f64>; 6], allowed: &[f64], seen: &[(f64, f64)]) -> f64 {
    let part = |i: usize| {
        let (start, middle, end) = (values[i], states[5][i], states[4][i]);
        let (least, most) = (seen[i].0.min(end), seen[i].1.max(end));
        (middle - 0.5 * (start + end)).abs() / (BEND * (most - least) + allowed[i])
    };
    (0..values.len()).map(part).fold(0.0, f64::max).powi(3)
}

/// Gives states units in which rows and columns are alike (Parlett and Reinsch 1969, without permutations).
fn balance(matrix: &mut Square) -> Vec<f64> {
    let size = matrix.size;
    let mut units = vec![1.0; size];
    let mut is_done = false;
    for _ in 0..100 {
        if std::mem::replace(&mut is_done, true) {
            break;
        }
        for (i, own) in units.iter_mut().enumerate() {
            let others = || (0..size).filter(|j| *j != i);
            let row: f64 = others().map(|j| matrix.entries[i * size + j].abs()).sum();
            let column: f64 = others().map(|j| matrix.entries[j * size + i].abs()).sum();
            if !(row.is_normal() && column.is_normal()) {
                continue;
            }
            let unit = 2f64.powi((exponent(row) - exponent(column)) / 2);
            if (row / unit + column * unit) < 0.95 * (row + column) {
                others().for_each(|j| matrix.entries[i * size + j] /= unit);
                others().for_each(|j| matrix.entries[j * size + i] *= unit);
                *own *= unit;
                is_done = false;
            }
        }
    }
    units
}

/// Whether all results are sums of constant multiples of states, and of constants.
pub(super) fn is_linear(tape: &Tape) -> bool {
    let kinds = kinds(tape, 2, |_| 1);
    tape.outputs.iter().all(|output| kinds[*output as usize] < 2)
}

#[cfg(test)]
pub(super) mod tests {
    use matterix_ir::BinaryOp;
    use proptest::prelude::*;

    use super::super::integrator::{Integrator, Next};
    use super::super::tape::Step;
    use super::super::tape::Term;
    use super::super::tolerance::Tolerance;
    use super::*;

    /// x' = A x + b
    fn law(matrix: &[f64], constant: &[f64]) -> Tape {
        let size = constant.len();
        let mut tape = Tape { constants: constant.to_vec(), inputs: size, ..Tape::default() };
        for (row, factors) in matrix.chunks(size).enumerate() {
            let first = tape.terms.len() as u32;
            let states = factors.iter().zip(0..).map(|(factor, i)| (*factor, (size + 1 + i) as u32));
            let terms = states.chain([(1.0, row as u32)]).filter(|(factor, _)| *factor != 0.0);
            tape.terms.extend(terms.map(|(factor, register)| Term { factor, register }));
            tape.steps.push(Step::Sum(first, tape.terms.len() as u32 - first));
        }
        let first = tape.first_result() as u32;
        tape.outputs = (first..first + size as u32).collect();
        tape
    }

    pub(in crate::process) fn integrator(tape: &Tape, values: &[f64]) -> Integrator {
        let scales = vec![Some(1.0); values.len()];
        let tolerance = Tolerance::new(2e-10, scales, &vec![0.0; values.len()], tape, 0.0, values);
        Integrator::new(tape.clone(), (0..values.len() as u32).collect(), 0.0, values, tolerance)
    }

    /// The states at `time`, s, and the steps until then.
    fn at(mut integrator: Integrator, time: f64) -> (Vec<f64>, usize) {
        let mut states = vec![0.0; integrator.moving.len()];
        let (mut steps, mut is_there) = (0, false);
        while !is_there {
            let run = integrator.run(&mut |dense| {
                if is_there {
                    return Next::Stop;
                }
                steps += 1;
                is_there = dense.clock.lab(dense.end) >= time;
                if is_there {
                    dense.at(dense.clock.local(time), &mut states);
                }
                if is_there { Next::Stop } else { Next::Step }
            });
            run.expect("steps are found");
        }
        (states, steps)
    }

    fn exactly(matrix: &[f64], constant: &[f64], values: &[f64], time: f64) -> (Vec<f64>, usize) {
        let integrator = integrator(&law(matrix, constant), values);
        assert!(integrator.exact.is_some());
        at(integrator, time)
    }

    #[track_caller]
    fn close(found: &[f64], expected: &[f64], error: f64) {
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() <= error, "{found:?} is not {expected:?}");
        }
    }

    #[test]
    fn equal_rates_in_a_row() {
        let matrix = [-1.0, 1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, -1.0];
        for t in [0.01, 1.0, 7.0, 40.0] {
            let (states, _) = exactly(&matrix, &[0.0; 3], &[0.0, 0.0, 1.0], t);
            let e = f64::exp(-t);
            close(&states, &[t * t / 2.0 * e, t * e, e], 1e-9);
        }
    }

    #[test]
    fn what_is_shared_out_is_kept() {
        let matrix = [-3e-3, 1.0, 3e-3, -1.0];
        let (states, steps) = exactly(&matrix, &[0.0; 2], &[350e3, 298.15], 1e5);
        assert!((states[0] + states[1] - 350_298.15).abs() < 1e-8, "{states:?}");
        assert!(steps < 90, "{steps}");
        let share = 350_298.15 / 1.003;
        close(&states, &[share, 3e-3 * share], 1e-6);
    }

    #[test]
    fn a_state_that_grows_evenly_takes_long_steps() {
        let (states, steps) = exactly(&[0.0], &[3.0], &[1.0], 1e6);
        close(&states, &[3e6 + 1.0], 1e-6);
        assert!(steps <= 12, "{steps}");
    }

    #[test]
    fn what_swings_is_followed() {
        let (states, _) = exactly(&[0.0, 1.0, -1.0, 0.0], &[0.0; 2], &[0.0, 1.0], 100.0);
        close(&states, &[f64::sin(100.0), f64::cos(100.0)], 1e-7);
    }

    #[test]
    fn rates_far_apart_are_integrated_in_the_end() {
        let (states, steps) = exactly(&[-1.0, 0.0, 1e9, -1e9], &[0.0; 2], &[1.0, 0.0], 2.0);
        let slow = f64::exp(-2.0);
        close(&states, &[slow, slow * 1e9 / (1e9 - 1.0)], 1e-8);
        assert!(steps < 400, "{steps}");
    }

    #[test]
    fn heat_and_amounts_have_units_of_their_own() {
        // 1 J warms by 1e-3 K, which is lost at 0.01 per s; an amount in mol sets 5e4 J free at 0.1 per s.
        let matrix = [-0.1, 0.0, 5e3, -0.01];
        let (states, steps) = exactly(&matrix, &[0.0; 2], &[2e-3, 0.0], 30.0);
        let heat = 2e-3 * 5e3 / 0.09 * (f64::exp(-0.3) - f64::exp(-3.0));
        close(&states, &[2e-3 * f64::exp(-3.0), heat], 1e-7);
        assert!(steps < 80, "{steps}");
    }

    #[test]
    fn only_what_is_linear_is_taken() {
        let linear = law(&[-1.0], &[2.0]);
        assert!(is_linear(&linear));
        let time = linear.time() as u32;
        let product = linear.first_result() as u32;
        for step in [Step::Binary(BinaryOp::Mul, product, product), Step::Binary(BinaryOp::Add, product, time)] {
            let mut other = linear.clone();
            other.steps.push(step);
            assert!(is_linear(&other), "nothing rests on it");
            other.outputs = vec![product + 1];
            assert!(!is_linear(&other));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn a_propagated_part_is_an_integrated_one(
            entries in prop::collection::vec(-1.0..1.0_f64, 25),
            paces in prop::collection::vec(-3.0..3.0_f64, 5),
            values in prop::collection::vec(-2.0..2.0_f64, 5),
            time in 0.1..50.0_f64,
        ) {
            // Each row is outweighed by its diagonal: stable, at paces that are decades apart.
            let mut matrix = entries.clone();
            for (row, pace) in paces.iter().enumerate() {
                matrix[row * 5 + row] = -5.0;
                matrix[row * 5..row * 5 + 5].iter_mut().for_each(|entry| *entry *= 10f64.powf(*pace));
            }
            let law = law(&matrix, &values);
            let (found, _) = at(integrator(&law, &values), time);
            let (again, _) = at(integrator(&law, &values), time);
            prop_assert!(found.iter().zip(&again).all(|(a, b)| a.to_bits() == b.to_bits()));
            let mut integrated = integrator(&law, &values);
            integrated.exact = None;
            let (expected, _) = at(integrated, time);
            for (a, b) in found.iter().zip(&expected) {
                prop_assert!((a - b).abs() < 2e-8 * (1.0 + a.abs()), "{found:?} is not {expected:?}");
            }
        }
    }
}
