//! Operations on intervals: every value that comes of the numbers within them lies within the result.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::graph::{BinaryOp, UnaryOp, binary, unary};

/// All numbers between two, ends included.
pub type Interval = (f64, f64);

/// Nothing is known.
pub const ALL: Interval = (f64::NEG_INFINITY, f64::INFINITY);

/// Units of rounding that a result is off by at most.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// An operation on one interval. Where it has no value for some of its numbers, nothing is known.
pub fn of_unary(op: UnaryOp, (low, high): Interval) -> Interval {
    match op {
        UnaryOp::Neg => (-high, -low),
        UnaryOp::Not if low > 0.0 || high < 0.0 => (0.0, 0.0),
        UnaryOp::Not => truth(low == 0.0 && high == 0.0, false),
        UnaryOp::Exp | UnaryOp::Atan => widened(unary(op, low), unary(op, high)),
        UnaryOp::Floor => (low.floor(), high.floor()),
        UnaryOp::Ln | UnaryOp::Sqrt if low >= 0.0 => widened(unary(op, low), unary(op, high)),
        UnaryOp::Ln | UnaryOp::Sqrt => ALL,
        UnaryOp::Abs if low >= 0.0 => (low, high),
        UnaryOp::Abs if high <= 0.0 => (-high, -low),
        UnaryOp::Abs => (0.0, high.max(-low)),
        UnaryOp::Sin => wave((low, high), FRAC_PI_2, unary(op, low), unary(op, high)),
        UnaryOp::Cos => wave((low, high), 0.0, unary(op, low), unary(op, high)),
    }
}

/// An operation on two intervals.
pub fn of_binary(op: BinaryOp, (a, b): Interval, (c, d): Interval) -> Interval {
    match op {
        BinaryOp::Add => widened(a + c, b + d),
        BinaryOp::Sub => widened(a - d, b - c),
        BinaryOp::Mul => corners([times(a, c), times(a, d), times(b, c), times(b, d)]),
        BinaryOp::Div if c > 0.0 || d < 0.0 => corners([a / c, a / d, b / c, b / d]),
        BinaryOp::Div => ALL,
        BinaryOp::Pow if c == d => power((a, b), c),
        BinaryOp::Pow if a > 0.0 => corners([binary(op, a, c), binary(op, a, d), binary(op, b, c), binary(op, b, d)]),
        BinaryOp::Pow => ALL,
        BinaryOp::Min => (a.min(c), b.min(d)),
        BinaryOp::Max => (a.max(c), b.max(d)),
        BinaryOp::Lt => truth(b < c, a >= d),
        BinaryOp::Le => truth(b <= c, a > d),
        BinaryOp::Eq => truth(a == b && c == d && a == c, b < c || a > d),
        BinaryOp::And => truth(holds((a, b)) && holds((c, d)), fails((a, b)) || fails((c, d))),
        BinaryOp::Or => truth(holds((a, b)) || holds((c, d)), fails((a, b)) && fails((c, d))),
    }
}

/// Whether a condition holds for all numbers within, or for none.
pub fn decided(condition: Interval) -> Option<bool> {
    match (holds(condition), fails(condition)) {
        (true, _) => Some(true),
        (_, true) => Some(false),
        _ => None,
    }
}

/// One of two intervals by a condition.
pub fn of_select(condition: Interval, a: Interval, b: Interval) -> Interval {
    if holds(condition) {
        a
    } else if fails(condition) {
        b
    } else {
        (a.0.min(b.0), a.1.max(b.1))
    }
}

fn holds((low, high): Interval) -> bool {
    low > 0.0 || high < 0.0
}

fn fails((low, high): Interval) -> bool {
    low == 0.0 && high == 0.0
}

fn truth(yes: bool, no: bool) -> Interval {
    match (yes, no) {
        (true, _) => (1.0, 1.0),
        (_, true) => (0.0, 0.0),
        _ => (0.0, 1.0),
    }
}

/// A power with a known exponent.
fn power((a, b): Interval, exponent: f64) -> Interval {
    let (low, high) = (binary(BinaryOp::Pow, a, exponent), binary(BinaryOp::Pow, b, exponent));
    let whole = exponent.fract() == 0.0;
    if a >= 0.0 || (whole && (exponent > 0.0 || b < 0.0)) {
        let (least, most) = (low.min(high), low.max(high));
        let through_zero = a < 0.0 && b > 0.0 && exponent % 2.0 == 0.0;
        return widened(if through_zero { 0.0 } else { least }, most);
    }
    ALL
}

/// A wave of period 2 pi between -1 and 1 with its crest at `crest`, and its values at the ends of an interval.
fn wave((low, high): Interval, crest: f64, at_low: f64, at_high: f64) -> Interval {
    // Rounding may put a crest a little beside where it is.
    let slack = ROUNDING * (low.abs().max(high.abs()) + 1.0);
    let meets = |at: f64| ((low - slack - at) / TAU).ceil() <= ((high + slack - at) / TAU).floor();
    let (least, most) = (at_low.min(at_high), at_low.max(at_high));
    let crosses = |at: f64| meets(at) || !(high - low).is_finite();
    let (least, most) = widened(least, most);
    let bottom = if crosses(crest + 0.5 * TAU) { -1.0 } else { least };
    let top = if crosses(crest) { 1.0 } else { most };
    (bottom, top)
}

fn corners(all: [f64; 4]) -> Interval {
    if all.iter().any(|v| v.is_nan()) {
        return ALL;
    }
    widened(all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// Bounds of what was rounded.
fn widened(low: f64, high: f64) -> Interval {
    if low.is_nan() || high.is_nan() {
        return ALL;
    }
    let out = |bound: f64, side: f64| if bound.is_finite() { bound + side * ROUNDING * bound.abs() } else { bound };
    (out(low, -1.0), out(high, 1.0))
}

/// A product of bounds, where nothing times without bound is nothing.
pub fn times(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENDS: [f64; 9] = [-7.3, -2.0, -1.0, -0.2, 0.0, 0.5, 1.0, 2.0, 9.1];

    fn intervals() -> impl Iterator<Item = Interval> {
        let pairs = ENDS.into_iter().flat_map(|a| ENDS.into_iter().map(move |b| (a, b)));
        pairs.filter(|(a, b)| a <= b)
    }

    fn within((low, high): Interval) -> impl Iterator<Item = f64> {
        (0..=6).map(move |k| (low + (high - low) * f64::from(k) / 6.0).clamp(low, high))
    }

    fn encloses((low, high): Interval, value: f64) -> bool {
        value.is_nan() || (low <= value && value <= high)
    }

    #[test]
    fn intervals_enclose_the_values_of_operations() {
        for a in intervals() {
            for op in UnaryOp::ALL {
                let all = of_unary(op, a);
                for x in within(a) {
                    assert!(encloses(all, unary(op, x)), "{op:?} of {x} in {a:?}: {all:?}");
                }
            }
            for b in intervals() {
                for op in BinaryOp::ALL {
                    let all = of_binary(op, a, b);
                    for (x, y) in within(a).flat_map(|x| within(b).map(move |y| (x, y))) {
                        assert!(encloses(all, binary(op, x, y)), "{op:?} of {x}, {y} in {a:?}, {b:?}: {all:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_wave_that_stays_on_one_flank_is_not_widened_to_its_crests() {
        let (low, high) = of_unary(UnaryOp::Sin, (0.1, 0.2));
        assert!(low > 0.099 && high < 0.199);
        assert_eq!(of_unary(UnaryOp::Sin, (1.0, 2.0)).1, 1.0);
        assert_eq!(of_unary(UnaryOp::Cos, (3.0, 3.3)).0, -1.0);
        assert_eq!(of_unary(UnaryOp::Cos, (-100.0, 100.0)), (-1.0, 1.0));
    }
}
