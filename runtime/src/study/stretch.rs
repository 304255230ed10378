//! A quantity over a stretch of time between two discontinuities: its integral, and its least or greatest value.
//!
//! The integral is by the pair of rules of Gauss and Kronrod with 7 and 15 points, halving where they differ (QUADPACK's QAG, Piessens et
//! al. 1983). What both miss, as a peak between their points, bounds of the quantity show: intervals over a piece.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use matterix_ir::interval::Interval;

/// The integral may be off by this share of the largest magnitude over the stretch.
const MEAN_ERROR: f64 = 1e-10;

/// The least and the greatest value may be off by this share of the bounds.
const PEAK_ERROR: f64 = 1e-10;

/// A piece whose points span less than this share of its bounds is halved: something may be hidden between them.
const SPANNED: f64 = 0.25;

/// Pieces of this share of the stretch hide nothing: bounds of an expression may be wide for no reason.
const HIDES: f64 = 1.0 / 256.0;

/// So many pieces of a stretch are integrated.
const MOST_PIECES: usize = 20_000;

/// So many pieces of a stretch are looked at for a peak.
const MOST_PEAKS: usize = 4000;

/// Places of the rule of Kronrod in half of `-1 .. 1`, the outermost first; every second one is one of Gauss's.
const PLACES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];

/// Weights of Kronrod's rule.
const FIFTEEN: [f64; 8] = [
    0.022_935_322_010_529_225,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_83,
];

/// Weights of Gauss's rule, of every second place.
const SEVEN: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_67, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// A quantity while nothing jumps: its value at a time, s, and bounds of it over a piece of time.
pub(super) struct Stretch<'a> {
    pub(super) value: &'a mut dyn FnMut(f64) -> f64,
    pub(super) bounds: &'a mut dyn FnMut(Interval) -> Interval,
}

impl Stretch<'_> {
    /// Its integral over a piece; not a number where it has no value somewhere, or changes more often than can be followed.
    pub(super) fn integral(&mut self, piece: Interval) -> f64 {
        let (mut todo, mut sum, mut pieces, mut largest) = (vec![piece], 0.0, 0, 0.0_f64);
        let length = piece.1 - piece.0;
        while let Some((from, to)) = todo.pop() {
            pieces += 1;
            let Some(seen) = self.sampled((from, to)).filter(|_| pieces <= MOST_PIECES) else { return f64::NAN };
            largest = largest.max(seen.low.abs()).max(seen.high.abs());
            let (low, high) =
                if to - from > HIDES * length { (self.bounds)((from, to)) } else { (seen.low, seen.high) };
            let is_seen = seen.high - seen.low >= SPANNED * (high - low) - MEAN_ERROR * largest;
            let middle = from + 0.5 * (to - from);
            let is_whole = middle <= from || middle >= to;
            if is_whole || is_seen && seen.error <= MEAN_ERROR * largest * length {
                sum += seen.integral;
            } else {
                todo.extend([(middle, to), (from, middle)]);
            }
        }
        sum
    }

    /// Both rules over a piece; none where there is no value somewhere.
    fn sampled(&mut self, (from, to): Interval) -> Option<Sampled> {
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let (mut fifteen, mut seven, mut low, mut high) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        for (k, (place, weight)) in PLACES.into_iter().zip(FIFTEEN).enumerate() {
            let sides = [-place, place];
            for side in &sides[usize::from(place == 0.0)..] {
                let value = (self.value)(centre + half * side);
                if !value.is_finite() {
                    return None;
                }
                (low, high) = (low.min(value), high.max(value));
                fifteen += weight * value;
                if k % 2 == 1 {
                    seven += SEVEN[k / 2] * value;
                }
            }
        }
        Some(Sampled { integral: half * fifteen, error: half * (fifteen - seven).abs(), low, high })
    }

    /// Its greatest value over a piece, or `reached` if that is greater; not a number where it has no value at a place that is looked at.
    pub(super) fn greatest(&mut self, (from, to): Interval, reached: f64) -> f64 {
        let mut best = reached;
        for end in [from, to] {
            let value = (self.value)(end);
            if value.is_nan() {
                return value;
            }
            best = best.max(value);
        }
        let mut open = BinaryHeap::from([Open { most: (self.bounds)((from, to)).1, piece: (from, to) }]);
        for _ in 0..MOST_PEAKS {
            let Some(Open { most, piece: (from, to) }) = open.pop() else { return best };
            let middle = from + 0.5 * (to - from);
            if most <= best + PEAK_ERROR * best.abs().max(most.abs()) || middle <= from || middle >= to {
                return best;
            }
            let value = (self.value)(middle);
            if value.is_nan() {
                return value;
            }
            best = best.max(value);
            for piece in [(from, middle), (middle, to)] {
                open.push(Open { most: (self.bounds)(piece).1, piece });
            }
        }
        best
    }
}

/// What the points of a piece show.
struct Sampled {
    integral: f64,
    /// How far both rules are apart.
    error: f64,
    low: f64,
    high: f64,
}

/// A piece in which something greater may lie.
struct Open {
    most: f64,
    piece: Interval,
}

impl Ord for Open {
    fn cmp(&self, other: &Open) -> Ordering {
        self.most.total_cmp(&other.most)
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Open) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Open) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

#[cfg(test)]
mod tests {
    use super::*;

    fn integral(
        piece: Interval,
        mut value: impl FnMut(f64) -> f64,
        mut bounds: impl FnMut(Interval) -> Interval,
    ) -> f64 {
        Stretch { value: &mut value, bounds: &mut bounds }.integral(piece)
    }

    fn greatest(
        piece: Interval,
        mut value: impl FnMut(f64) -> f64,
        mut bounds: impl FnMut(Interval) -> Interval,
    ) -> f64 {
        Stretch { value: &mut value, bounds: &mut bounds }.greatest(piece, f64::NEG_INFINITY)
    }

    /// Half of its height 8.3 s beside its peak at 300 s.
    fn bell(t: f64) -> f64 {
        (-((t - 300.0) / 10.0_f64).powi(2)).exp()
    }

    fn of_bell((from, to): Interval) -> Interval {
        let most = if from <= 300.0 && to >= 300.0 { 1.0 } else { bell(from).max(bell(to)) };
        (bell(from).min(bell(to)), most)
    }

    #[test]
    fn both_rules_are_exact_for_polynomials() {
        for degree in 0..=13 {
            let power = |t: f64| t.powi(degree);
            let found = integral((0.0, 2.0), power, |(a, b)| (power(a), power(b)));
            let exact = 2.0_f64.powi(degree + 1) / f64::from(degree + 1);
            assert!((found / exact - 1.0).abs() < 1e-14, "degree {degree}: {found} instead of {exact}");
        }
    }

    #[test]
    fn a_peak_between_the_points_counts() {
        let exact = 10.0 * std::f64::consts::PI.sqrt();
        let found = integral((0.0, 10_000.0), bell, of_bell);
        assert!((found / exact - 1.0).abs() < 1e-6, "{found}");
        let most = greatest((0.0, 9_876.0), bell, of_bell);
        assert!((most - 1.0).abs() < 1e-9, "{most}");
    }

    #[test]
    fn a_jump_is_found() {
        let step = |t: f64| f64::from(u8::from(t > 1.0 / 3.0));
        let bounds = |(a, b): Interval| (step(a), step(b));
        assert!((integral((0.0, 1.0), step, bounds) - 2.0 / 3.0).abs() < 1e-9);
        assert_eq!(greatest((0.0, 1.0), step, bounds), 1.0);
    }

    #[test]
    fn what_has_no_value_somewhere_has_no_mean() {
        assert!(integral((-1.0, 1.0), f64::sqrt, |_| (0.0, 1.0)).is_nan());
        assert!(greatest((-1.0, 1.0), f64::sqrt, |_| (0.0, 1.0)).is_nan());
    }

    #[test]
    fn what_changes_too_often_has_no_mean() {
        assert!(integral((0.0, 1e9), f64::sin, |_| (-1.0, 1.0)).is_nan());
    }
}
