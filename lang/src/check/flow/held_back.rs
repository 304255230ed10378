//! What a transfer leaves behind of a quantity, as far as it is known.

use matterix_ir::BinaryOp;

use super::value::{AbstractValue, Imprecision};

/// What stays of a quantity, whatever share of the rest is taken.
pub(super) struct Staying {
    /// The quantity.
    pub state: u32,
    /// Whether `value` is a share of it, or so much of it.
    pub share: bool,
    /// How much.
    pub value: AbstractValue,
}

impl Staying {
    /// The share of the quantity that may leave, where that is one number.
    pub fn leaving(&self) -> Option<f64> {
        self.value.exact().filter(|_| self.share).map(|stays| 1.0 - stays.clamp(0.0, 1.0))
    }

    /// What a share of the rest takes of the quantity, and what it leaves.
    pub fn part(&self, fraction: &AbstractValue, held: &AbstractValue) -> (AbstractValue, AbstractValue) {
        let of = |a: &AbstractValue, b: &AbstractValue| AbstractValue::binary(BinaryOp::Mul, a, b);
        let less = |a: &AbstractValue, b: &AbstractValue| AbstractValue::binary(BinaryOp::Sub, a, b);
        if !self.share {
            let moved = of(fraction, &less(held, &self.value));
            let rest = less(held, &moved);
            return (moved, rest);
        }
        let one = AbstractValue::Point(1.0);
        // The share of all that leaves, and that of all that is left: each of what there is, so that what is not known of that counts once.
        let leaves = of(fraction, &less(&one, &self.within()));
        (of(&leaves, held), of(&less(&one, &leaves), held))
    }

    /// The share, of which rounding alone may leave 0 to 1.
    fn within(&self) -> AbstractValue {
        match self.value.exact() {
            Some(share) => AbstractValue::Point(share.clamp(0.0, 1.0)),
            None => {
                let (low, high) = self.value.bounds();
                let why = self.value.why().unwrap_or(Imprecision::Unknown);
                AbstractValue::Range(low.clamp(0.0, 1.0), high.clamp(0.0, 1.0), why)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn staying(share: bool, value: AbstractValue) -> Staying {
        Staying { state: 0, share, value }
    }

    #[test]
    fn a_share_stays_of_what_is_there() {
        let half = AbstractValue::Point(0.5);
        let (moved, rest) = staying(true, AbstractValue::Point(0.75)).part(&half, &AbstractValue::Point(8.0));
        assert_eq!((moved.exact(), rest.exact()), (Some(1.0), Some(7.0)));
        let (moved, rest) = staying(false, AbstractValue::Point(6.0)).part(&half, &AbstractValue::Point(8.0));
        assert_eq!((moved.exact(), rest.exact()), (Some(1.0), Some(7.0)));
    }

    #[test]
    fn a_share_that_is_not_known_bounds_what_leaves() {
        let share = AbstractValue::Range(0.5, 1.0 + 1e-12, Imprecision::Unknown);
        let (moved, rest) = staying(true, share).part(&AbstractValue::Point(1.0), &AbstractValue::Point(8.0));
        assert_eq!((moved.bounds(), rest.bounds()), ((0.0, 4.0), (4.0, 8.0)));
    }

    #[test]
    fn all_that_stays_leaves_nothing() {
        let all = staying(true, AbstractValue::Point(1.0 + 1e-12));
        assert_eq!(all.leaving(), Some(0.0));
        let (moved, rest) = all.part(&AbstractValue::Point(1.0), &AbstractValue::Point(8.0));
        assert_eq!((moved.exact(), rest.exact()), (Some(0.0), Some(8.0)));
    }
}
