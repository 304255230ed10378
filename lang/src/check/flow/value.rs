//! What is known of a number before the run: exactly, one of a few, or within bounds.

use std::rc::Rc;

use matterix_ir::graph::{binary, unary};
use matterix_ir::interval::times;
use matterix_ir::{BinaryOp, UnaryOp};

/// Why a number is not known exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Imprecision {
    /// It differs between ways through the plan.
    Paths,
    /// It depends on what only a run can tell.
    Unknown,
}

/// What is known of a number.
#[derive(Clone, Debug, PartialEq)]
pub enum AbstractValue {
    /// This number.
    Point(f64),
    /// One of these, in rising order.
    Few(Rc<[f64]>, Imprecision),
    /// Between these, ends included.
    Range(f64, f64, Imprecision),
}

/// So many single values are kept apart before only their bounds are.
const MOST: usize = 8;

/// Numbers closer than this, relative to the larger, are not told apart.
pub(super) const CLOSE: f64 = 1e-10;

/// Two ways of working out one number differ by no more than this, relative to the larger.
pub(super) const ROUNDING: f64 = 1e-12;

thread_local! {
    /// No and yes, of which many comparisons are made.
    static EITHER: Rc<[f64]> = Rc::from([0.0, 1.0]);
}

impl AbstractValue {
    /// Nothing is known.
    pub fn top() -> Self {
        AbstractValue::Range(f64::NEG_INFINITY, f64::INFINITY, Imprecision::Unknown)
    }

    /// A truth value that is not known.
    pub fn unknown_bool(why: Imprecision) -> Self {
        AbstractValue::Few(EITHER.with(Rc::clone), why)
    }

    /// A number; what is no number is not known.
    pub fn point(value: f64) -> Self {
        if value.is_nan() { AbstractValue::top() } else { AbstractValue::Point(value) }
    }

    /// Whether both are the same to the last bit.
    pub fn is(&self, other: &AbstractValue) -> bool {
        match (self, other) {
            (AbstractValue::Point(a), AbstractValue::Point(b)) => a.to_bits() == b.to_bits(),
            (AbstractValue::Range(a, b, one), AbstractValue::Range(c, d, other)) => {
                a.to_bits() == c.to_bits() && b.to_bits() == d.to_bits() && one == other
            }
            (AbstractValue::Few(a, one), AbstractValue::Few(b, other)) => {
                one == other && (Rc::ptr_eq(a, b) || a.iter().map(|v| v.to_bits()).eq(b.iter().map(|v| v.to_bits())))
            }
            _ => false,
        }
    }

    /// Whether both say the same but for rounding.
    pub fn is_close(&self, other: &AbstractValue) -> bool {
        match (self, other) {
            (AbstractValue::Point(a), AbstractValue::Point(b)) => {
                a == b || (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
            }
            _ => self == other,
        }
    }

    /// The bounds, ends included.
    pub fn bounds(&self) -> (f64, f64) {
        match self {
            AbstractValue::Point(v) => (*v, *v),
            AbstractValue::Few(all, _) => (all[0], all[all.len() - 1]),
            AbstractValue::Range(low, high, _) => (*low, *high),
        }
    }

    /// Why it is not known exactly, if it is not.
    pub fn why(&self) -> Option<Imprecision> {
        match self {
            AbstractValue::Point(_) => None,
            AbstractValue::Few(_, why) | AbstractValue::Range(_, _, why) => Some(*why),
        }
    }

    /// The number, if it is known exactly.
    pub fn exact(&self) -> Option<f64> {
        match self {
            AbstractValue::Point(v) => Some(*v),
            _ => None,
        }
    }

    /// Whether, as a truth value, it is certainly not 0, certainly 0, or neither.
    pub fn truth(&self) -> Option<bool> {
        match self {
            AbstractValue::Point(v) => Some(*v != 0.0),
            AbstractValue::Few(all, _) => {
                let zeros = all.iter().filter(|v| **v == 0.0).count();
                if zeros == 0 { Some(true) } else { (zeros == all.len()).then_some(false) }
            }
            AbstractValue::Range(low, high, _) => (*low > 0.0 || *high < 0.0).then_some(true),
        }
    }

    /// Whether it may be this number.
    pub fn may_be(&self, value: f64) -> bool {
        match self {
            AbstractValue::Point(v) => *v == value,
            AbstractValue::Few(all, _) => all.contains(&value),
            AbstractValue::Range(low, high, _) => (*low..=*high).contains(&value),
        }
    }

    fn values(&self) -> Option<&[f64]> {
        match self {
            AbstractValue::Point(v) => Some(std::slice::from_ref(v)),
            AbstractValue::Few(all, _) => Some(all),
            AbstractValue::Range(..) => None,
        }
    }

    /// One of these numbers.
    pub fn of(mut all: Vec<f64>, why: Imprecision) -> Self {
        if all.iter().any(|v| v.is_nan()) {
            return AbstractValue::top();
        }
        all.sort_by(f64::total_cmp);
        all.dedup();
        match all.as_slice() {
            [one] => AbstractValue::Point(*one),
            [first, .., last] if all.len() > MOST => AbstractValue::Range(*first, *last, why),
            _ => AbstractValue::Few(all.into(), why),
        }
    }

    fn range(low: f64, high: f64, why: Imprecision) -> Self {
        if low.is_nan() || high.is_nan() {
            return AbstractValue::top();
        }
        if low == high { AbstractValue::Point(low) } else { AbstractValue::Range(low, high, why) }
    }

    /// What becomes of it where its least becomes one number and its most another, in any order: one of two stays that, and
    /// numbers that are not told apart are one.
    pub fn with_ends(&self, a: f64, b: f64) -> Self {
        match self {
            _ if (a - b).abs() <= CLOSE * a.abs().max(b.abs()) => AbstractValue::point(a),
            AbstractValue::Point(_) => AbstractValue::point(a),
            AbstractValue::Few(all, why) if all.len() == 2 => AbstractValue::of(vec![a, b], *why),
            AbstractValue::Few(_, why) | AbstractValue::Range(_, _, why) => {
                AbstractValue::range(a.min(b), a.max(b), *why)
            }
        }
    }

    /// Either of two, depending on the way taken.
    pub fn join(&self, other: &AbstractValue, because: Imprecision) -> AbstractValue {
        if self == other {
            return self.clone();
        }
        let why = [self.why(), other.why()].into_iter().flatten().max().map_or(because, |w| w.max(because));
        match (self.values(), other.values()) {
            (Some(a), Some(b)) => AbstractValue::of(a.iter().chain(b).copied().collect(), why),
            _ => {
                let ((a, b), (c, d)) = (self.bounds(), other.bounds());
                AbstractValue::range(a.min(c), b.max(d), why)
            }
        }
    }

    /// What is known where another range holds as well. Two that only rounding parts are the first.
    pub fn within(self, other: &AbstractValue) -> AbstractValue {
        let (AbstractValue::Range(a, b, why), AbstractValue::Range(c, d, _)) = (&self, other) else {
            return if self.why().is_none() || matches!(other, AbstractValue::Range(..)) {
                self
            } else {
                other.clone()
            };
        };
        let (low, high) = (a.max(*c), b.min(*d));
        if low <= high { AbstractValue::Range(low, high, *why) } else { self }
    }

    /// An operation on one number.
    pub fn unary(op: UnaryOp, a: &AbstractValue) -> AbstractValue {
        let Some(why) = a.why() else { return AbstractValue::point(unary(op, a.bounds().0)) };
        if let Some(all) = a.values() {
            return AbstractValue::of(all.iter().map(|v| unary(op, *v)).collect(), why);
        }
        let (low, high) = a.bounds();
        match op {
            UnaryOp::Neg => AbstractValue::range(-high, -low, why),
            UnaryOp::Not => match a.truth() {
                Some(truth) => AbstractValue::Point(f64::from(u8::from(!truth))),
                None => AbstractValue::unknown_bool(why),
            },
            UnaryOp::Exp | UnaryOp::Atan | UnaryOp::Floor => AbstractValue::range(unary(op, low), unary(op, high), why),
            UnaryOp::Ln | UnaryOp::Sqrt if low >= 0.0 => AbstractValue::range(unary(op, low), unary(op, high), why),
            UnaryOp::Abs if low >= 0.0 => AbstractValue::range(low, high, why),
            UnaryOp::Abs if high <= 0.0 => AbstractValue::range(-high, -low, why),
            UnaryOp::Abs => AbstractValue::range(0.0, high.max(-low), why),
            UnaryOp::Sin | UnaryOp::Cos => AbstractValue::range(-1.0, 1.0, why),
            UnaryOp::Ln | UnaryOp::Sqrt => AbstractValue::top(),
        }
    }

    /// An operation on two numbers.
    pub fn binary(op: BinaryOp, a: &AbstractValue, b: &AbstractValue) -> AbstractValue {
        if let (AbstractValue::Point(x), AbstractValue::Point(y)) = (a, b) {
            return AbstractValue::points(op, *x, *y);
        }
        // What decides alone does not need the other.
        match op {
            BinaryOp::And if a.truth() == Some(false) || b.truth() == Some(false) => return AbstractValue::Point(0.0),
            BinaryOp::Or if a.truth() == Some(true) || b.truth() == Some(true) => return AbstractValue::Point(1.0),
            // Nothing over something is nothing; over nothing it is no number, and no definition asks for that.
            BinaryOp::Div if a.exact() == Some(0.0) && b.exact().is_none() => return AbstractValue::Point(0.0),
            BinaryOp::Mul if a.exact() == Some(0.0) || b.exact() == Some(0.0) => return AbstractValue::Point(0.0),
            _ => {}
        }
        let why = a.why().max(b.why()).unwrap_or(Imprecision::Paths);
        if let (Some(x), Some(y)) = (a.values(), b.values())
            && x.len() * y.len() <= MOST * MOST
        {
            let mut all = Vec::with_capacity(x.len() * y.len());
            for p in x {
                for q in y {
                    match AbstractValue::points(op, *p, *q) {
                        AbstractValue::Point(v) => all.push(v),
                        AbstractValue::Few(some, _) => all.extend(some.iter()),
                        other => return other,
                    }
                }
            }
            return AbstractValue::of(all, why);
        }
        AbstractValue::ranges(op, a.bounds(), b.bounds(), why)
    }

    /// Two exact numbers. Where a comparison hangs on rounding, it is left open.
    pub fn points(op: BinaryOp, a: f64, b: f64) -> AbstractValue {
        if hangs_on_rounding(op, a, b) {
            AbstractValue::unknown_bool(Imprecision::Unknown)
        } else {
            AbstractValue::point(binary(op, a, b))
        }
    }

    /// The same where it comes to one number.
    #[inline]
    pub fn exactly(op: BinaryOp, a: f64, b: f64) -> Option<f64> {
        if hangs_on_rounding(op, a, b) { None } else { Some(binary(op, a, b)).filter(|v| !v.is_nan()) }
    }

    fn ranges(op: BinaryOp, (a, b): (f64, f64), (c, d): (f64, f64), why: Imprecision) -> AbstractValue {
        let decided = |yes: bool, no: bool| match (yes, no) {
            (true, _) => AbstractValue::Point(1.0),
            (_, true) => AbstractValue::Point(0.0),
            _ => AbstractValue::unknown_bool(why),
        };
        match op {
            BinaryOp::Add => AbstractValue::range(a + c, b + d, why),
            BinaryOp::Sub => AbstractValue::range(a - d, b - c, why),
            BinaryOp::Mul => AbstractValue::corners([times(a, c), times(a, d), times(b, c), times(b, d)], why),
            BinaryOp::Div if c > 0.0 || d < 0.0 => AbstractValue::corners([a / c, a / d, b / c, b / d], why),
            // Nothing is below zero where neither operand is.
            BinaryOp::Div if a >= 0.0 && c >= 0.0 => AbstractValue::range(a / d, f64::INFINITY, why),
            BinaryOp::Div => AbstractValue::top(),
            BinaryOp::Pow if a >= 0.0 && c == d => {
                let (low, high) = (binary(op, a, c), binary(op, b, c));
                AbstractValue::range(low.min(high), low.max(high), why)
            }
            BinaryOp::Pow => AbstractValue::top(),
            BinaryOp::Min => AbstractValue::range(a.min(c), b.min(d), why),
            BinaryOp::Max => AbstractValue::range(a.max(c), b.max(d), why),
            // Where it hangs on rounding it is left open, as it is for exact numbers.
            BinaryOp::Lt => decided(b < c && !are_close(b, c), a >= d && !are_close(a, d)),
            BinaryOp::Le => decided(b <= c && !are_close(b, c), a > d && !are_close(a, d)),
            BinaryOp::Eq => decided(false, b < c && !are_close(b, c) || a > d && !are_close(a, d)),
            BinaryOp::And | BinaryOp::Or => {
                let truth = |low: f64, high: f64| AbstractValue::Range(low, high, why).truth();
                match (op, truth(a, b), truth(c, d)) {
                    (BinaryOp::And, Some(true), Some(true)) => AbstractValue::Point(1.0),
                    _ => AbstractValue::unknown_bool(why),
                }
            }
        }
    }

    fn corners(all: [f64; 4], why: Imprecision) -> AbstractValue {
        let low = all.iter().copied().fold(f64::INFINITY, f64::min);
        let high = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if all.iter().any(|v| v.is_nan()) { AbstractValue::top() } else { AbstractValue::range(low, high, why) }
    }

    /// One of two by a condition.
    pub fn select(c: &AbstractValue, a: &AbstractValue, b: &AbstractValue) -> AbstractValue {
        match c.truth() {
            Some(true) => a.clone(),
            Some(false) => b.clone(),
            None => a.join(b, c.why().unwrap_or(Imprecision::Paths)),
        }
    }
}

/// Whether a comparison is of numbers that are not told apart. Nothing is close to what has no limit.
#[inline]
fn hangs_on_rounding(op: BinaryOp, a: f64, b: f64) -> bool {
    matches!(op, BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq) && are_close(a, b)
}

/// Whether two numbers differ, but by no more than rounding.
#[inline]
fn are_close(a: f64, b: f64) -> bool {
    a != b && (a - b).abs() <= CLOSE * a.abs().max(b.abs()) && a.is_finite() && b.is_finite()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::sample::select;

    use super::*;

    fn known() -> impl Strategy<Value = (AbstractValue, f64)> {
        let value = -50.0..50.0_f64;
        prop_oneof![
            value.clone().prop_map(|v| (AbstractValue::Point(v), v)),
            (value.clone(), value.clone()).prop_map(|(a, b)| (AbstractValue::of(vec![a, b], Imprecision::Paths), a)),
            (value.clone(), value, 0.0..1.0_f64).prop_map(|(a, b, t)| {
                let (low, high) = (a.min(b), a.max(b));
                (AbstractValue::range(low, high, Imprecision::Paths), low + t * (high - low))
            }),
        ]
    }

    fn holds(known: &AbstractValue, value: f64) -> bool {
        let (low, high) = known.bounds();
        let slack = 1e-9 * value.abs().max(1.0);
        value.is_nan() || (low - slack <= value && value <= high + slack)
    }

    proptest! {
        #[test]
        fn a_result_lies_within_what_is_known((a, x) in known(), (b, y) in known(), op in select(BinaryOp::ALL.to_vec())) {
            let result = binary(op, x, y);
            prop_assert!(holds(&AbstractValue::binary(op, &a, &b), result), "{a:?} {op:?} {b:?}");
        }

        #[test]
        fn either_way_lies_within_the_join((a, x) in known(), (b, y) in known()) {
            let both = a.join(&b, Imprecision::Paths);
            prop_assert!(holds(&both, x) && holds(&both, y));
        }

        #[test]
        fn one_operand_lies_within_what_is_known((a, x) in known()) {
            for op in UnaryOp::ALL {
                prop_assert!(holds(&AbstractValue::unary(op, &a), unary(op, x)), "{op:?} {a:?}");
            }
        }
    }

    #[test]
    fn rounding_decides_nothing() {
        let tenth = (0..10).map(|_| 0.1).sum::<f64>();
        assert_eq!(
            AbstractValue::binary(BinaryOp::Le, &AbstractValue::Point(1.0), &AbstractValue::Point(tenth)).truth(),
            None
        );
        assert_eq!(
            AbstractValue::binary(BinaryOp::Le, &AbstractValue::Point(1.0), &AbstractValue::Point(1.0)).truth(),
            Some(true)
        );
        let without_limit = AbstractValue::Point(f64::INFINITY);
        assert_eq!(AbstractValue::binary(BinaryOp::Le, &AbstractValue::Point(3.0), &without_limit).truth(), Some(true));
    }
}
