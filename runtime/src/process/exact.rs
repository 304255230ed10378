//! Parts that need no integration: rates linear in the states, by coefficients that stay as they are until the next discontinuity.
//!
//! From `x` on, after `s`, the states are `x + P(s) f`: `f` are the rates at `x`, `P(s) = s + A s^2 / 2 + A^2 s^3 / 6 ...`. It holds for
//! matrices of every kind, defective and singular ones among them. Steps are powers of 2. A few states are moved by the matrices `P`
//! ([`Doubled`]), many by the series applied to their rates ([`Series`]). A step is as long as its polynomial is good; as what
//! moves dies out, steps grow. Only rounding accumulates: by as much as the fastest rate is faster than a step is long, so
//! that a part with rates that are too far apart is left to the integrator.

use super::dense::POINTS;
use super::doubled::Doubled;
use super::series::Series;
use super::slopes::Slopes;
use super::tape::Tape;
use super::timed::kinds;

/// More states than this are moved by series: a product of matrices grows with the third power.
const FEW: usize = 10;

/// Powers of 2, s: no step is longer or shorter.
const LENGTHS: std::ops::RangeInclusive<i32> = -100..=40;

/// Steps this much longer than the fastest rate lose six digits.
const STIFF: f64 = 1e5;

/// Steps of many states are this much longer than the fastest rate at most: beyond, terms of the series cancel, and an integrator is cheaper.
pub(super) const FAR: f64 = 4.0;

/// So many steps that only [`STIFF`] or [`FAR`] keeps short lead nowhere.
const HELD: usize = 24;

/// A first step has this norm at most.
const FIRST: f64 = 0.25;

/// The error of a polynomial of degree 5 grows with this power of 2 when the step is twice as long; half as much again is left over.
const GROWTH: f64 = 96.0;

/// Who watches sees the ends of steps and draws straight lines between them: these may be off by this part of what has changed so far.
const BEND: f64 = 1.0 / 400.0;

/// In a step this much shorter than the fastest rate no curve departs from a straight line by more than [`BEND`] of what it changes by
/// in all: `h^2 / 8` of it.
const SHORT: f64 = 1.0 / 8.0;

/// Where the solution is computed, as parts of a step: where a polynomial is sampled, and where that is worst.
pub(super) const PLACES: [f64; 6] = [POINTS[1], POINTS[2], POINTS[3], POINTS[4], 1.0, 0.5];

/// States at [`PLACES`].
pub(super) type States = [Vec<f64>; PLACES.len()];

/// What a state's rate has of a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) row: u32,
    pub(super) column: u32,
    pub(super) value: f64,
}

/// How steps are computed.
#[derive(Clone)]
enum Means {
    Doubled(Doubled),
    Series(Series),
}

/// A part's law as a matrix, in units in which its rows and columns are alike.
#[derive(Clone)]
pub(super) struct Exact {
    means: Means,
    norm: f64,
    /// The units of the states: powers of 2, which round nothing.
    units: Vec<f64>,
    /// The exponent of the next step.
    next: i32,
    /// That of the longest one.
    most: i32,
    /// Steps in a row that could have been longer.
    held: usize,
    rates: Vec<f64>,
    /// The least and the most of each state so far.
    seen: Vec<(f64, f64)>,
}

/// A step that is good enough: its length, s, and the states at [`PLACES`].
pub(super) struct Stride {
    pub(super) length: f64,
    pub(super) states: States,
}

impl Exact {
    /// For a law that is linear by constant coefficients.
    pub(super) fn of(rates: &Tape) -> Self {
        let slopes = Slopes::new(rates, false);
        let mut registers = rates.registers();
        rates.run(0.0, &vec![0.0; rates.inputs], &mut registers);
        let pattern = &slopes.pattern;
        let mut values = vec![0.0; pattern.columns.len()];
        slopes.evaluate(rates, &registers, &mut slopes.memory(), &mut values);
        let mut entries = Vec::new();
        for row in 0..rates.inputs {
            let of_row =
                pattern.row(row).map(|at| Entry { row: row as u32, column: pattern.columns[at], value: values[at] });
            entries.extend(of_row.filter(|entry| entry.value != 0.0));
        }
        Exact::new(rates.inputs, entries)
    }

    fn new(size: usize, mut entries: Vec<Entry>) -> Self {
        let units = balance(size, &mut entries);
        let norm = norm(size, &entries);
        let (means, most) = match size <= FEW {
            true => (Means::Doubled(Doubled::new(size, &entries, norm)), STIFF),
            false => (Means::Series(Series { entries }), FAR),
        };
        let (next, most) = match norm > 0.0 {
            true => (exponent(FIRST / norm), exponent(most / norm).min(*LENGTHS.end())),
            false => (0, *LENGTHS.end()),
        };
        let (rates, seen) = (vec![0.0; size], vec![(f64::INFINITY, f64::NEG_INFINITY); size]);
        Exact { means, norm, units, next: next.min(most), most, held: 0, rates, seen }
    }

    /// A step from `values` on, at which the rates are `slopes`; the polynomial through it may be off by `allowed`. None where
    /// there is none, or where too many have been too short.
    pub(super) fn stride(&mut self, values: &[f64], slopes: &[f64], allowed: &[f64]) -> Option<Stride> {
        self.rates.iter_mut().zip(slopes).zip(&self.units).for_each(|((r, s), u)| *r = s / u);
        self.seen.iter_mut().zip(values).for_each(|(seen, value)| *seen = (seen.0.min(*value), seen.1.max(*value)));
        loop {
            if !LENGTHS.contains(&self.next) || self.held > HELD {
                return None;
            }
            let states = self.states(values, allowed);
            let is_drawn = self.norm * 2f64.powi(self.next) <= SHORT;
            let bend = if is_drawn { 0.0 } else { bend(values, &states, allowed, &self.seen) };
            let error = worst(values, &states, allowed).max(bend);
            if error <= 1.0 {
                let length = 2f64.powi(self.next);
                let more = [1.0, GROWTH].iter().filter(|more| GROWTH * *more * error < 1.0).count() as i32;
                let is_held = self.next == self.most && self.most < *LENGTHS.end() && more > 0;
                self.held = if is_held { self.held + 1 } else { 0 };
                self.next = (self.next + more).min(self.most);
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

    fn states(&mut self, values: &[f64], allowed: &[f64]) -> States {
        let units = &self.units;
        let mut states = match &mut self.means {
            Means::Doubled(doubled) => doubled.moved(self.next, &self.rates),
            Means::Series(series) => {
                let allowed: Vec<f64> = allowed.iter().zip(units).map(|(allowed, unit)| allowed / unit).collect();
                series.moved(self.next, &self.rates, &allowed)
            }
        };
        for states in &mut states {
            for ((state, unit), value) in states.iter_mut().zip(units).zip(values) {
                *state = value + unit * *state;
            }
        }
        states
    }
}

/// The largest sum of a row.
fn norm(size: usize, entries: &[Entry]) -> f64 {
    let mut sums = vec![0.0; size];
    entries.iter().for_each(|e| sums[e.row as usize] += e.value.abs());
    sums.into_iter().fold(0.0, f64::max)
}

/// The exponent of the power of 2 next below `length`.
fn exponent(length: f64) -> i32 {
    const BIAS: i32 = 1023;
    ((length.to_bits() >> 52) & 0x7ff) as i32 - BIAS
}

/// How far the polynomial through a step is off, as a part of what is allowed.
fn worst(values: &[f64], states: &States, allowed: &[f64]) -> f64 {
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
fn bend(values: &[f64], states: &States, allowed: &[f64], seen: &[(f64, f64)]) -> f64 {
    let part = |i: usize| {
        let (start, middle, end) = (values[i], states[5][i], states[4][i]);
        let (least, most) = (seen[i].0.min(end), seen[i].1.max(end));
        (middle - 0.5 * (start + end)).abs() / (BEND * (most - least) + allowed[i])
    };
    (0..values.len()).map(part).fold(0.0, f64::max).powi(3)
}

/// Gives states units in which rows and columns are alike (Parlett and Reinsch 1969, without permutations).
fn balance(size: usize, entries: &mut [Entry]) -> Vec<f64> {
    let mut units = vec![1.0; size];
    // The entries off the diagonal, by row and by column.
    let (mut rows, mut columns) = (vec![Vec::new(); size], vec![Vec::new(); size]);
    for (k, entry) in entries.iter().enumerate().filter(|(_, e)| e.row != e.column) {
        rows[entry.row as usize].push(k);
        columns[entry.column as usize].push(k);
    }
    let mut is_done = false;
    for _ in 0..100 {
        if std::mem::replace(&mut is_done, true) {
            break;
        }
        for (i, own) in units.iter_mut().enumerate() {
            let sum = |of: &[usize]| of.iter().map(|k| entries[*k].value.abs()).sum::<f64>();
            let (row, column) = (sum(&rows[i]), sum(&columns[i]));
            if !(row.is_normal() && column.is_normal()) {
                continue;
            }
            let unit = 2f64.powi((exponent(row) - exponent(column)) / 2);
            if (row / unit + column * unit) < 0.95 * (row + column) {
                rows[i].iter().for_each(|k| entries[*k].value /= unit);
                columns[i].iter().for_each(|k| entries[*k].value *= unit);
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

    /// A network of `size` species: each becomes three others, at rates between 1 and `spread` per second.
    fn network(size: usize, spread: f64) -> Vec<f64> {
        let mut matrix = vec![0.0; size * size];
        for from in 0..size {
            for k in 0..3 {
                let (to, share) = ((from * (7 + k) + 1 + k) % size, ((from * 13 + k * 5) % 17) as f64 / 16.0);
                let rate = spread.powf(share);
                matrix[to * size + from] += rate;
                matrix[from * size + from] -= rate;
            }
        }
        matrix
    }

    #[test]
    fn many_states_are_moved_as_the_integrator_moves_them() {
        for (size, spread, time) in [(11, 1.0, 3.0), (40, 10.0, 2.0), (200, 3.0, 5.0)] {
            let law = law(&network(size, spread), &vec![0.0; size]);
            let values: Vec<f64> = (0..size).map(|i| f64::from(u8::from(i == 3))).collect();
            let exact = integrator(&law, &values);
            assert!(exact.exact.is_some());
            let (found, steps) = at(exact, time);
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            let mut integrated = integrator(&law, &values);
            integrated.exact = None;
            let (expected, others) = at(integrated, time);
            for (a, b) in found.iter().zip(&expected) {
                assert!((a - b).abs() < 1e-9, "{a} is not {b}");
            }
            assert!(steps < others, "{steps} steps, {others} by the integrator");
        }
    }

    #[test]
    fn many_states_with_rates_far_apart_are_integrated_in_the_end() {
        let law = law(&network(30, 1e6), &[0.0; 30]);
        let values: Vec<f64> = (0..30).map(|i| f64::from(u8::from(i == 3))).collect();
        let (states, steps) = at(integrator(&law, &values), 100.0);
        assert!((states.iter().sum::<f64>() - 1.0).abs() < 1e-7);
        assert!(steps < 1000, "{steps}");
    }

    /// Each of 60 vessels in a row leaks into the next: what has arrived in the last one is 1 less the terms of a series.
    #[test]
    fn a_long_row_is_exact() {
        let size = 60;
        let mut matrix = vec![0.0; size * size];
        for i in 0..size {
            if i + 1 < size {
                matrix[i * size + i] = -1.0;
                matrix[(i + 1) * size + i] = 1.0;
            }
        }
        let values: Vec<f64> = (0..size).map(|i| f64::from(u8::from(i == 0))).collect();
        let time: f64 = 50.0;
        let (states, _) = exactly(&matrix, &vec![0.0; size], &values, time);
        let mut term = (-time).exp();
        let mut left = 0.0;
        for (i, state) in states[..size - 1].iter().enumerate() {
            assert!((state - term).abs() < 1e-12, "{i}: {state} is not {term}");
            left += term;
            term *= time / (i + 1) as f64;
        }
        assert!((states[size - 1] - (1.0 - left)).abs() < 1e-11);
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
