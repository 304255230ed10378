//! Newton's method on the logarithms of what makes each total up over what it should be.
//!
//! These are nearly linear in the logarithms of activities, so that a handful of steps suffices between femtomoles and kilomoles. A
//! start that is very far off is brought near by positive continuous fractions first (Carrayrou, Mose and Behra, AIChE J. 48 (2002)
//! 894), each total by itself.

use super::problem::{Problem, TEMPERATURES, Totals};
use super::state::{NO_IONS, State};
use crate::math;

/// A solution meets its conditions to this share.
const MET: f64 = 1e-11;

/// It is not sought any closer than to the first of these; nor than to the second, after a step from the third, which it squares: what
/// is left is rounding.
const CLOSE: f64 = 4e-15;
const ROUNDED: f64 = 1e-13;
const SQUARED: f64 = 1e-8;

/// How often Newton's method steps at most.
const MOST_STEPS: usize = 200;

/// Beyond this logarithm of a total over what it should be it is far off; so often it is brought nearer at most.
const FAR: f64 = 8.0;
const MOST_FRACTIONS: usize = 100;

/// The largest logarithm of a total over what it should be that is gone in one step.
const BEYOND: f64 = 500.0;

/// From here on activity coefficients move with the rest, unless that has led nowhere for so many steps.
const NEAR: f64 = 1.0;
const PATIENCE: usize = 6;

/// From here on they do in any case.
const VERY_NEAR: f64 = 0.02;

/// How far a logarithm goes in one step at most; less and less, so that nothing swings for ever.
const LONGEST: f64 = 8.0;

/// How far the temperature goes in one step at most, K.
const WARMEST_STEP: f64 = 25.0;

impl Problem<'_> {
    /// Newton's method; the unknowns and what follows from them. Far from the solution activity coefficients stay as they are while the
    /// rest moves, and then follow: what they would be along the way is of no use.
    pub(super) fn newton(&self, x: Vec<f64>, totals: &Totals) -> Option<(Vec<f64>, State)> {
        let mut state = State::default();
        self.evaluate(&x, totals, &mut state);
        if largest(&state.residuals[..self.basis.masters.len()]) <= FAR {
            return self.refine(x, totals, state);
        }
        let near = |one_by_one: bool| {
            let (mut x, mut state) = (x.clone(), state.clone());
            match one_by_one {
                true => self.approach_one_by_one(&mut x, totals, &mut state),
                false => self.approach(&mut x, totals, &mut state),
            }
            self.refine(x, totals, state)
        };
        near(self.basis.is_steep).or_else(|| near(!self.basis.is_steep))
    }

    /// Newton's method from a point that is not far off.
    fn refine(&self, mut x: Vec<f64>, totals: &Totals, mut state: State) -> Option<(Vec<f64>, State)> {
        let places = self.places();
        let (mut least, mut best) = (f64::INFINITY, Vec::new());
        let mut idle = 0;
        let mut factors = self.linear();
        let (mut right, mut step) = (Vec::new(), Vec::new());
        for count in 0..MOST_STEPS {
            if !self.budget.spend() {
                return None;
            }
            let off = largest(&state.residuals);
            if !off.is_finite() {
                break;
            }
            let is_near = off < NEAR && idle < PATIENCE || off < VERY_NEAR;
            let free = match (is_near, self.is_isothermal()) {
                (false, _) => places.strength(),
                (true, true) => places.temperature(),
                (true, false) => places.count(),
            };
            let is_last = off <= CLOSE || off <= ROUNDED && least <= SQUARED;
            if !is_last {
                right.clear();
                right.extend(state.residuals[..free].iter().map(|r| -r));
                self.jacobian(&state, free, &mut factors.matrix);
                if !factors.factor() {
                    return None;
                }
                factors.solve_into(&right, &mut step);
            }
            let follows = (!is_near && !is_last && largest(&right) < 1.0).then(|| self.surroundings(&state));
            idle += 1;
            if off < least {
                idle = 0;
                least = off;
                best.clone_from(&x);
            }
            if is_last || (idle > 1 && least <= MET) {
                break;
            }
            self.step(&mut x, &step, LONGEST / (1.0 + count as f64 / 12.0));
            if let Some((sums, temperature)) = follows {
                // What swings is held the more firmly the longer it does.
                let share = 0.9 / (1.0 + count as f64 / 20.0);
                for (x, sum) in x[places.sums()].iter_mut().zip(sums) {
                    let shifted = *x + NO_IONS;
                    *x = shifted * math::pow((sum + NO_IONS) / shifted, share) - NO_IONS;
                }
                let known = &mut x[places.temperature()];
                let limits = (TEMPERATURES.0.max(*known - WARMEST_STEP), TEMPERATURES.1.min(*known + WARMEST_STEP));
                *known = (*known + share * (temperature - *known)).clamp(limits.0, limits.1);
            }
            self.evaluate(&x, totals, &mut state);
        }
        if least > MET {
            return None;
        }
        // The last step may have led away.
        if x != best {
            self.evaluate(&best, totals, &mut state);
        }
        Some((best, state))
    }

    /// Brings each total near what it should be, one at a time: its master grows by the ratio, to the power that makes the least of its
    /// members follow.
    fn approach(&self, x: &mut [f64], totals: &Totals, state: &mut State) {
        let least: Vec<f64> = (0..self.basis.masters.len()).map(|c| self.least_part(c)).collect();
        for _ in 0..MOST_FRACTIONS {
            let mut furthest = 0.0_f64;
            for (c, least) in least.iter().enumerate() {
                let [sum, wanted] = state.sides[c];
                let off = math::ln(wanted / sum);
                if !off.is_finite() {
                    return;
                }
                furthest = furthest.max(off.abs());
                // The further off it is, the bolder.
                let bold = 0.9 - 0.8 * math::exp(-off.abs());
                x[c] += math::ln(bold * math::exp((off / least).min(500.0)) + 1.0 - bold);
            }
            self.evaluate(x, totals, state);
            if furthest < FAR {
                return;
            }
        }
    }

    /// The same where members hold many of a master: the total that takes the longest way goes first, by itself, along the member
    /// that makes up most of it.
    fn approach_one_by_one(&self, x: &mut [f64], totals: &Totals, state: &mut State) {
        let masters = self.basis.masters.len();
        for _ in 0..MOST_FRACTIONS + 4 * masters {
            let way = |c: usize| {
                let [sum, wanted] = state.sides[c];
                // What is beyond all numbers is brought back by and by.
                math::ln(wanted / sum).clamp(-BEYOND, BEYOND) / self.most_part(c, state)
            };
            let furthest = (0..masters).map(|c| (c, way(c))).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let Some((c, way)) = furthest.filter(|(_, way)| way.abs() > NEAR) else { return };
            x[c] += way;
            self.evaluate(x, totals, state);
        }
    }

    /// How much of a master that member has which makes up most of its total.
    fn most_part(&self, c: usize, state: &State) -> f64 {
        let of = |i: usize| self.basis.of[i][c];
        let held = |i: &usize| of(*i) * state.amounts[*i];
        let adds = (0..self.basis.of.len()).filter(|i| of(*i) > 0.0);
        adds.max_by(|a, b| held(a).total_cmp(&held(b))).map_or(1.0, of)
    }

    /// The least of a master that a member has.
    fn least_part(&self, c: usize) -> f64 {
        let parts = self.basis.of.iter().map(|of| of[c]).filter(|part| *part > 0.0);
        parts.fold(f64::INFINITY, f64::min)
    }

    /// Takes a step in the unknowns that are free, as much of it as is not too long.
    fn step(&self, x: &mut [f64], step: &[f64], most: f64) {
        let places = self.places();
        let longest = step[..=places.solvent()].iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        let warmest = step.get(places.temperature()).map_or(0.0, |by| by.abs());
        let share = 1.0_f64.min(most / longest).min(WARMEST_STEP / warmest);
        for (i, (x, step)) in x.iter_mut().zip(step).enumerate() {
            let next = *x + share * step;
            *x = if places.sums().contains(&i) { next.max(0.1 * *x) } else { next };
        }
        let temperature = &mut x[places.temperature()];
        *temperature = temperature.clamp(TEMPERATURES.0, TEMPERATURES.1);
    }
}

/// The largest magnitude; not a number where one is none.
pub(super) fn largest(values: &[f64]) -> f64 {
    let nan_or = |most: f64, v: f64| if most.is_nan() || v.is_nan() { f64::NAN } else { most.max(v) };
    values.iter().map(|v| v.abs()).fold(0.0, nan_or)
}
