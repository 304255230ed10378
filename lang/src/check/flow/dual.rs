//! Numbers with the rate at which they change while states move evenly, so that a comparison of what has just become equal comes
//! out as it does from then on.

use matterix_ir::graph::{binary, unary};
use matterix_ir::values::Rules;
use matterix_ir::{BinaryOp, Op, UnaryOp};

use super::eval::Exact;
use super::even::Even;
use super::value::AbstractValue;

/// A number and its rate, per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Dual {
    pub value: f64,
    pub slope: f64,
}

impl Dual {
    fn still(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }

    fn of_truth(holds: bool) -> Self {
        Dual::still(f64::from(u8::from(holds)))
    }
}

/// Values after a time while states move evenly; those of states that do not are as they are known.
pub(super) struct Along<'e> {
    pub exact: Exact<'e>,
    pub even: &'e Even,
    /// s
    pub time: f64,
}

impl Rules for Along<'_> {
    type Value = Dual;

    fn leaf(&self, op: Op) -> Option<Dual> {
        match op {
            Op::State(s) if self.even.open.contains(&s) => None,
            Op::State(s) => {
                let slope = self.even.slope(s);
                Some(Dual { value: self.exact.leaf(op)? + slope * self.time, slope })
            }
            Op::Time => Some(Dual { value: self.exact.leaf(op)? + self.time, slope: 1.0 }),
            other => self.exact.leaf(other).map(Dual::still),
        }
    }

    fn unary(&self, op: UnaryOp, a: Dual) -> Option<Dual> {
        let value = Some(unary(op, a.value)).filter(|v| !v.is_nan())?;
        let rate = match op {
            _ if a.slope == 0.0 => 0.0,
            UnaryOp::Neg => -1.0,
            UnaryOp::Not | UnaryOp::Floor => 0.0,
            UnaryOp::Exp => value,
            UnaryOp::Ln => 1.0 / a.value,
            UnaryOp::Sqrt => 0.5 / value,
            UnaryOp::Abs => a.value.signum(),
            UnaryOp::Atan => 1.0 / (1.0 + a.value * a.value),
            UnaryOp::Sin | UnaryOp::Cos => return None,
        };
        Some(Dual { value, slope: rate * a.slope })
    }

    fn binary(&self, op: BinaryOp, a: Dual, b: Dual) -> Option<Dual> {
        if matches!(op, BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq) {
            return compare(op, a, b);
        }
        let value = Some(binary(op, a.value, b.value)).filter(|v| !v.is_nan())?;
        let slope = match op {
            _ if a.slope == 0.0 && b.slope == 0.0 => 0.0,
            BinaryOp::Add => a.slope + b.slope,
            BinaryOp::Sub => a.slope - b.slope,
            BinaryOp::Mul => a.slope * b.value + a.value * b.slope,
            BinaryOp::Div => (a.slope - value * b.slope) / b.value,
            BinaryOp::Pow if b.slope == 0.0 => b.value * binary(op, a.value, b.value - 1.0) * a.slope,
            BinaryOp::Pow => return None,
            BinaryOp::Min => {
                if a.value <= b.value {
                    a.slope
                } else {
                    b.slope
                }
            }
            BinaryOp::Max => {
                if a.value >= b.value {
                    a.slope
                } else {
                    b.slope
                }
            }
            _ => 0.0,
        };
        Some(Dual { value, slope }).filter(|dual| !dual.slope.is_nan())
    }

    fn truth(&self, condition: Dual) -> Option<bool> {
        Some(condition.value != 0.0)
    }
}

/// A comparison: as it comes out, or from now on where only rounding parts its sides.
fn compare(op: BinaryOp, a: Dual, b: Dual) -> Option<Dual> {
    let slope = a.slope - b.slope;
    let close = a.value == b.value || AbstractValue::exactly(op, a.value, b.value).is_none();
    if !close || slope == 0.0 {
        return AbstractValue::exactly(op, a.value, b.value).map(Dual::still);
    }
    Some(Dual::of_truth(match op {
        BinaryOp::Eq => false,
        _ => slope < 0.0,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_just_become_equal_comes_out_as_it_moves() {
        let (goal, rising) = (Dual::still(3e-5), Dual { value: 3e-5, slope: 1e-6 });
        assert_eq!(compare(BinaryOp::Le, goal, rising), Some(Dual::of_truth(true)));
        assert_eq!(compare(BinaryOp::Lt, goal, rising), Some(Dual::of_truth(true)));
        assert_eq!(compare(BinaryOp::Le, rising, goal), Some(Dual::of_truth(false)));
        assert_eq!(compare(BinaryOp::Le, goal, goal), Some(Dual::of_truth(true)));
        assert_eq!(compare(BinaryOp::Lt, goal, Dual::still(3e-5 * (1.0 + 1e-15))), None);
    }
}
