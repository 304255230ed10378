//! Laws that are linear but for bends: where the lesser or the greater of two is taken, or a magnitude. A heater that gives no more than
//! it can is one.
//!
//! Between bends such a law is propagated ([`Exact`]). A step that would go past a bend ends there, and the law beyond it is another
//! one. Nothing else need know of it: on both sides of a bend the rates are the same.

use matterix_ir::{BinaryOp, UnaryOp};
use nalgebra::Vector6;

use super::bernstein::{control, halved};
use super::dense::{POINTS, shares};
use super::exact::{Exact, Stride, is_linear};
use super::tape::{Step, Tape, Term};

/// A law with more bends is integrated.
const MOST_BENDS: usize = 16;

/// So many bends one after the other, without a step that goes on to its end in between, lead nowhere.
const MOST_TURNS: usize = 24;

/// A difference smaller than this many units of rounding is none.
const NOISE: f64 = 64.0 * f64::EPSILON;

/// So many pieces of a step are looked at for one bend.
const MOST_PIECES: usize = 1000;

/// Bends are located to this share of a step.
const CLOSE: f64 = 1e-15;

/// Where a law takes one of two.
#[derive(Clone, Copy, Debug)]
struct Bend {
    /// Its step in the tape.
    step: usize,
    a: u32,
    /// The other one; zero for a magnitude.
    b: Option<u32>,
}

/// The law between bends.
#[derive(Clone)]
struct Straight {
    /// By bend, whether its first is less.
    less: Vec<bool>,
    /// The bends that it ends at.
    watched: Vec<usize>,
    /// What they rest on alone: the first of each, and the second if there is one.
    sides: Tape,
    registers: Vec<f64>,
    /// None where it is not linear.
    exact: Option<Exact>,
}

/// A law of a part that needs no integration.
#[derive(Clone)]
pub(super) struct Bent {
    bends: Vec<Bend>,
    /// Those that were met so far.
    met: Vec<Straight>,
    /// The present one.
    now: usize,
    turns: usize,
}

impl Bent {
    /// For a law that is linear by constant coefficients where its states are `values`, but for bends.
    pub(super) fn of(rates: &Tape, values: &[f64]) -> Option<Self> {
        let bends = bends(rates);
        // Most laws that are integrated do not bend.
        if bends.len() > MOST_BENDS || bends.is_empty() && !is_linear(rates) {
            return None;
        }
        let mut registers = rates.registers();
        let mut slopes = vec![0.0; values.len()];
        rates.run(0.0, values, &mut registers);
        rates.results(&registers, &mut slopes);
        // Who begins at a bend goes to the side that its rates lead to.
        let ahead: Vec<f64> = values.iter().zip(&slopes).map(|(value, slope)| value + slope).collect();
        let here = differences(&bends, rates, values, &mut registers);
        let there = differences(&bends, rates, &ahead, &mut registers);
        let less =
            here.iter().zip(&there).map(|((d, noise), (then, _))| if d.abs() > *noise { *d < 0.0 } else { then < d });
        let less = less.collect();
        let mut bent = Bent { bends, met: Vec::new(), now: 0, turns: 0 };
        bent.turn(rates, less);
        bent.met[0].exact.is_some().then_some(bent)
    }

    /// A step from `values` on, at which the rates are `slopes`, to the next bend at most; the polynomial through it may be off by
    /// `allowed`. None where the law is not linear from here on, or bends too often.
    pub(super) fn stride(&mut self, rates: &Tape, values: &[f64], slopes: &[f64], allowed: &[f64]) -> Option<Stride> {
        loop {
            let stride = self.met[self.now].exact.as_mut()?.stride(values, slopes, allowed)?;
            let Some((end, turned)) = self.first_bend(values, &stride) else {
                self.turns = 0;
                return Some(stride);
            };
            self.turns += 1;
            if self.turns > MOST_TURNS {
                return None;
            }
            let less =
                self.met[self.now].less.iter().enumerate().map(|(i, less)| *less != turned.contains(&i)).collect();
            self.turn(rates, less);
            if end > CLOSE {
                return Some(stride.up_to(end, values));
            }
        }
    }

    /// The law on these sides of all bends, from here on.
    fn turn(&mut self, rates: &Tape, less: Vec<bool>) {
        let seen = self.met.get(self.now).and_then(|from| from.exact.as_ref()).map(Exact::seen);
        let known = self.met.iter().position(|straight| straight.less == less);
        self.now = known.unwrap_or_else(|| {
            let tape = straightened(rates, &self.bends, &less);
            let watched = watched(&tape, &self.bends);
            let outputs = watched.iter().map(|i| self.bends[*i]).flat_map(|bend| std::iter::once(bend.a).chain(bend.b));
            let sides = tape.only(outputs.collect());
            let is_straight = is_linear(&tape) && is_linear(&sides);
            let exact = is_straight.then(|| Exact::of(&tape));
            let registers = sides.registers();
            self.met.push(Straight { less, watched, sides, registers, exact });
            self.met.len() - 1
        });
        if let (Some(seen), Some(exact)) = (seen, &mut self.met[self.now].exact) {
            exact.see(&seen);
        }
    }

    /// The first bend within a step, as a share of it, with all that bend there.
    fn first_bend(&mut self, values: &[f64], stride: &Stride) -> Option<(f64, Vec<usize>)> {
        let straight = &mut self.met[self.now];
        if straight.watched.is_empty() {
            return None;
        }
        let inner = &stride.states[..POINTS.len() - 1];
        // Beyond a bend the law is drawn out: what bends there as well has to be the polynomial that it is up to there.
        let points = std::iter::once(values).chain(inner.iter().map(Vec::as_slice));
        let sampled: Vec<Vec<(f64, f64)>> = points.map(|values| straight.differences(&self.bends, values)).collect();
        let mut found: Vec<(f64, usize)> = Vec::new();
        for (k, &bend) in straight.watched.iter().enumerate() {
            // As a number that is positive as long as the law is the same.
            let sign = if straight.less[bend] { -1.0 } else { 1.0 };
            let noise = sampled.iter().map(|all| all[k].1).fold(0.0, f64::max);
            let difference = Vector6::from_iterator(sampled.iter().map(|all| sign * all[k].0 + noise));
            let mut pieces = MOST_PIECES;
            found.extend(first_below(control(difference), 0.0, 1.0, &mut pieces).map(|at| (at, bend)));
        }
        let first = found.iter().map(|(at, _)| *at).reduce(f64::min)?;
        Some((first, found.iter().filter(|(at, _)| *at <= first + CLOSE).map(|(_, bend)| *bend).collect()))
    }
}

impl Straight {
    /// By bend that is watched, how much more its first is than its second, and a difference that is none.
    fn differences(&mut self, bends: &[Bend], values: &[f64]) -> Vec<(f64, f64)> {
        self.sides.run(0.0, values, &mut self.registers);
        let mut outputs = self.sides.outputs.iter().map(|output| self.registers[*output as usize]);
        let mut next = || outputs.next().unwrap_or_default();
        let watched = self.watched.iter().map(|bend| bends[*bend].b.is_some());
        watched.map(|has_both| (next(), if has_both { next() } else { 0.0 })).map(apart).collect()
    }
}

/// How much more one is than the other, and a difference that is none.
fn apart((a, b): (f64, f64)) -> (f64, f64) {
    (a - b, NOISE * a.abs().max(b.abs()))
}

/// The same by bend, of all that a law has.
fn differences(bends: &[Bend], law: &Tape, values: &[f64], registers: &mut [f64]) -> Vec<(f64, f64)> {
    law.run(0.0, values, registers);
    let worth = |register: u32| registers[register as usize];
    bends.iter().map(|bend| apart((worth(bend.a), bend.b.map_or(0.0, worth)))).collect()
}

/// Where a polynomial first falls below zero between `from` and `to`. One that goes along zero, so that no number of pieces tells, counts
/// as below from there on.
fn first_below(control: Vector6<f64>, from: f64, to: f64, pieces: &mut usize) -> Option<f64> {
    if control.iter().all(|c| *c >= 0.0) {
        return None;
    }
    *pieces = pieces.saturating_sub(1);
    if *pieces == 0 || control[0].is_nan() || control[0] < 0.0 {
        return Some(from);
    }
    if to - from <= CLOSE {
        return (control[5] < 0.0).then_some(to);
    }
    let (left, right) = halved(control);
    let middle = from + 0.5 * (to - from);
    first_below(left, from, middle, pieces).or_else(|| first_below(right, middle, to, pieces))
}

/// By register, whether it moves.
fn moving(tape: &Tape) -> Vec<bool> {
    let mut moves = vec![true; tape.first_result()];
    moves[..tape.time()].fill(false);
    for step in &tape.steps {
        let mut any = false;
        tape.operands(step, &mut |register| any |= moves[register as usize]);
        moves.push(any);
    }
    moves
}

/// The steps of a law that take one of two that move.
fn bends(rates: &Tape) -> Vec<Bend> {
    let moves = moving(rates);
    let own = &moves[rates.first_result()..];
    let steps = rates.steps.iter().enumerate().filter(|(i, _)| own[*i]);
    let bend = |(step, what): (usize, &Step)| match *what {
        Step::Binary(BinaryOp::Min | BinaryOp::Max, a, b) => Some(Bend { step, a, b: Some(b) }),
        Step::Unary(UnaryOp::Abs, a) => Some(Bend { step, a, b: None }),
        _ => None,
    };
    steps.filter_map(bend).collect()
}

/// The law on these sides of its bends.
fn straightened(rates: &Tape, bends: &[Bend], less: &[bool]) -> Tape {
    let mut tape = rates.clone();
    for (bend, less) in bends.iter().zip(less) {
        let (factor, register) = match (tape.steps[bend.step], bend.b) {
            (Step::Binary(BinaryOp::Min, ..), Some(b)) => (1.0, if *less { bend.a } else { b }),
            (_, Some(b)) => (1.0, if *less { b } else { bend.a }),
            (_, None) => (if *less { -1.0 } else { 1.0 }, bend.a),
        };
        tape.steps[bend.step] = Step::Sum(tape.terms.len() as u32, 1);
        tape.terms.push(Term { factor, register });
    }
    tape
}

/// The bends that a straightened law rests on: what is taken times zero counts for nothing.
fn watched(tape: &Tape, bends: &[Bend]) -> Vec<usize> {
    let first = tape.first_result();
    let mut registers = tape.registers();
    tape.run(0.0, &vec![0.0; tape.inputs], &mut registers);
    let moves = moving(tape);
    let is_zero = |register: u32| !moves[register as usize] && registers[register as usize] == 0.0;
    let mut needed = vec![false; first + tape.steps.len()];
    tape.outputs.iter().for_each(|output| needed[*output as usize] = true);
    // The sides of a bend that are not taken decide where it is.
    let sides: Vec<Option<&Bend>> = (0..tape.steps.len()).map(|i| bends.iter().find(|bend| bend.step == i)).collect();
    for (i, step) in tape.steps.iter().enumerate().rev() {
        if !needed[first + i] {
            continue;
        }
        match (*step, sides[i]) {
            (_, Some(bend)) => [Some(bend.a), bend.b].into_iter().flatten().for_each(|r| needed[r as usize] = true),
            (Step::Binary(BinaryOp::Mul, a, b), _) if is_zero(a) || is_zero(b) => {
                needed[if is_zero(a) { a } else { b } as usize] = true;
            }
            (step, _) => tape.operands(&step, &mut |register| needed[register as usize] = true),
        }
    }
    (0..bends.len()).filter(|i| needed[first + bends[*i].step]).collect()
}

impl Stride {
    /// The same up to a share of it.
    fn up_to(&self, end: f64, begin: &[f64]) -> Stride {
        let states = std::array::from_fn(|k| {
            let place = super::exact::PLACES[k] * end;
            let shares = shares(place);
            let mixed = |i: usize| {
                let inner = self.states[..5].iter().zip(&shares[1..]);
                shares[0] * begin[i] + inner.map(|(states, share)| share * states[i]).sum::<f64>()
            };
            (0..begin.len()).map(mixed).collect()
        });
        Stride { length: end * self.length, states }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::exact::tests::integrator;
    use super::super::integrator::{Integrator, Next};
    use super::*;

    /// A tape in the making: constants first, then as many states, then steps.
    struct Law(Tape);

    impl Law {
        fn new(constants: &[f64], inputs: usize) -> Self {
            Law(Tape { constants: constants.to_vec(), inputs, ..Tape::default() })
        }

        fn state(&self, i: usize) -> u32 {
            (self.0.time() + 1 + i) as u32
        }

        fn add(&mut self, step: Step) -> u32 {
            self.0.steps.push(step);
            (self.0.first_result() + self.0.steps.len() - 1) as u32
        }

        fn binary(&mut self, op: BinaryOp, a: u32, b: u32) -> u32 {
            self.add(Step::Binary(op, a, b))
        }

        fn sum(&mut self, terms: &[(f64, u32)]) -> u32 {
            let first = self.0.terms.len() as u32;
            self.0.terms.extend(terms.iter().map(|(factor, register)| Term { factor: *factor, register: *register }));
            self.add(Step::Sum(first, terms.len() as u32))
        }

        fn of(mut self, outputs: &[u32]) -> Tape {
            self.0.outputs = outputs.to_vec();
            self.0
        }
    }

    /// The states at these times, s, and how many steps it took.
    fn at(mut integrator: Integrator, times: &[f64]) -> (Vec<Vec<f64>>, usize) {
        let (mut found, mut steps): (Vec<Vec<f64>>, usize) = (Vec::new(), 0);
        while found.len() < times.len() {
            let size = integrator.moving.len();
            let run = integrator.run(&mut |dense| {
                steps += 1;
                while let Some(time) = times.get(found.len()).filter(|t| **t <= dense.clock.lab(dense.end)) {
                    let mut states = vec![0.0; size];
                    dense.at(dense.clock.local(*time), &mut states);
                    found.push(states);
                }
                Next::Step
            });
            run.expect("steps are found");
        }
        (found, steps)
    }

    /// x' = clamp(2 (10 - x), 0, 3)
    fn heater() -> Tape {
        let mut law = Law::new(&[20.0, 0.0, 3.0], 1);
        let state = law.state(0);
        let asked = law.sum(&[(1.0, 0), (-2.0, state)]);
        let some = law.binary(BinaryOp::Max, asked, 1);
        let given = law.binary(BinaryOp::Min, some, 2);
        law.of(&[given])
    }

    #[test]
    fn a_heater_gives_what_it_can() {
        let integrator = integrator(&heater(), &[0.0]);
        assert!(integrator.exact.is_some());
        let full = 17.0 / 6.0;
        let times = [0.5, 2.0, full, 3.0, 4.0, 9.0];
        let (found, steps) = at(integrator, &times);
        for (time, states) in times.iter().zip(&found) {
            let expected = if *time <= full { 3.0 * time } else { 10.0 - 1.5 * f64::exp(-2.0 * (time - full)) };
            assert!((states[0] - expected).abs() < 1e-9, "{time} s: {} is not {expected}", states[0]);
        }
        assert!(steps < 80, "{steps}");
    }

    #[test]
    fn who_begins_at_a_bend_goes_where_the_rates_lead() {
        // x' = 1, y' = |x|, from x = 0 on, where the sides are equal.
        let mut law = Law::new(&[1.0], 2);
        let state = law.state(0);
        let size = law.add(Step::Unary(UnaryOp::Abs, state));
        let tape = law.of(&[0, size]);
        let (found, _) = at(integrator(&tape, &[0.0, 0.0]), &[3.0]);
        assert!((found[0][1] - 4.5).abs() < 1e-9, "{found:?}");
        let (found, _) = at(integrator(&tape, &[-2.0, 0.0]), &[1.0, 5.0]);
        assert!((found[0][1] - 1.5).abs() < 1e-9 && (found[1][1] - 6.5).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_bend_that_is_touched_is_none() {
        // A swing that comes to 1 and back: y' = min(x, 1) = x.
        let mut law = Law::new(&[1.0, 0.0], 3);
        let (x, v) = (law.state(0), law.state(1));
        let minus = law.sum(&[(-1.0, x)]);
        let less = law.binary(BinaryOp::Min, x, 0);
        let tape = law.of(&[v, minus, less]);
        let (found, steps) = at(integrator(&tape, &[0.0, 1.0, 0.0]), &[7.0]);
        assert!((found[0][2] - (1.0 - f64::cos(7.0))).abs() < 1e-8, "{found:?}");
        assert!(steps < 500, "{steps}");
    }

    #[test]
    fn what_goes_along_a_bend_is_seen_to_do_so() {
        // A double root, off by rounding: no subdivision tells.
        let touch = |s: f64| (s - 0.52).powi(2) * 1e-3;
        let rough = control(Vector6::from_iterator(POINTS.iter().map(|s| touch(*s))));
        assert!(first_below(rough, 0.0, 1.0, &mut MOST_PIECES.clone()).is_none_or(|at| (at - 0.52).abs() < 1e-6));
        let nothing = Vector6::repeat(f64::NAN);
        assert_eq!(first_below(nothing, 0.0, 1.0, &mut MOST_PIECES.clone()), Some(0.0));
        // A dip between the points.
        let dip = |s: f64| (s - 0.52).powi(2) - 1e-6;
        let sampled = Vector6::from_iterator(POINTS.iter().map(|s| dip(*s)));
        let at = first_below(control(sampled), 0.0, 1.0, &mut MOST_PIECES.clone());
        assert!(at.is_some_and(|at| (at - 0.519).abs() < 1e-9), "{at:?}");
    }

    #[test]
    fn a_bend_of_the_clock_or_of_a_product_is_integrated() {
        let mut law = Law::new(&[5.0], 1);
        let time = law.0.time() as u32;
        let late = law.binary(BinaryOp::Min, time, 0);
        let state = law.state(0);
        let both = law.sum(&[(1.0, late), (-1.0, state)]);
        assert!(Bent::of(&law.of(&[both]), &[0.0]).is_none());
        let mut law = Law::new(&[5.0], 1);
        let state = law.state(0);
        let square = law.binary(BinaryOp::Mul, state, state);
        let less = law.binary(BinaryOp::Min, square, 0);
        assert!(Bent::of(&law.of(&[less]), &[9.0]).is_none(), "though it is 5 there");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn a_bent_law_that_is_propagated_is_an_integrated_one(
            entries in prop::collection::vec(-1.0..1.0_f64, 9),
            bounds in prop::collection::vec(-1.0..1.0_f64, 4),
            values in prop::collection::vec(-2.0..2.0_f64, 3),
        ) {
            // x' = A x + min(max(x0 - x1, c0), c1), with magnitudes and bends in bends.
            let mut law = Law::new(&bounds, 3);
            let states: Vec<u32> = (0..3).map(|i| law.state(i)).collect();
            let apart = law.sum(&[(1.0, states[0]), (-1.0, states[1])]);
            let least = law.binary(BinaryOp::Max, apart, 0);
            let most = law.binary(BinaryOp::Min, least, 1);
            let far = law.add(Step::Unary(UnaryOp::Abs, states[2]));
            let lesser = law.binary(BinaryOp::Min, far, most);
            let greater = law.binary(BinaryOp::Max, lesser, 2);
            let outputs: Vec<u32> = (0..3).map(|row| {
                let mut terms: Vec<(f64, u32)> =
                    (0..3).map(|i| (entries[row * 3 + i] - if i == row { 2.0 } else { 0.0 }, states[i])).collect();
                terms.push((1.0, [most, greater, far][row]));
                terms.push((1.0, 3));
                law.sum(&terms)
            }).collect();
            let tape = law.of(&outputs);
            let times = [0.1, 0.7, 2.0, 5.0];
            let propagated = integrator(&tape, &values);
            prop_assert!(propagated.exact.is_some());
            let (found, _) = at(propagated, &times);
            let mut integrated = integrator(&tape, &values);
            integrated.exact = None;
            let (expected, _) = at(integrated, &times);
            for (a, b) in found.iter().flatten().zip(expected.iter().flatten()) {
                prop_assert!((a - b).abs() < 5e-8 * (1.0 + a.abs()), "{found:?} is not {expected:?}");
            }
        }
    }
}
