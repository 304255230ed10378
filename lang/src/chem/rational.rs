//! Exact fractions for counts of atoms and stoichiometric coefficients.

use std::cmp::Ordering;
use std::fmt;

/// A fraction in lowest terms with a positive denominator. Arithmetic is absent where it would overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rational {
    numerator: i128,
    denominator: i128,
}

impl Rational {
    /// 0
    pub const ZERO: Rational = Rational { numerator: 0, denominator: 1 };
    /// 1
    pub const ONE: Rational = Rational { numerator: 1, denominator: 1 };

    /// A whole number.
    pub fn whole(value: i64) -> Rational {
        Rational { numerator: value.into(), denominator: 1 }
    }

    /// `numerator / denominator`; absent where the denominator is zero.
    pub fn new(numerator: i128, denominator: i128) -> Option<Rational> {
        if denominator == 0 || numerator == i128::MIN || denominator == i128::MIN {
            return None;
        }
        let divisor = gcd(numerator, denominator).max(1) * denominator.signum();
        Some(Rational { numerator: numerator / divisor, denominator: denominator / divisor })
    }

    /// The decimal number that is written for `value`: `0.1` is one tenth. Absent beyond fifteen decimals or digits.
    pub fn from_decimal(value: f64) -> Option<Rational> {
        if !value.is_finite() || value.abs() >= 1e15 || (value != 0.0 && value.abs() < 1e-9) {
            return None;
        }
        let text = format!("{value}");
        let (whole, decimals) = text.split_once('.').unwrap_or((&text, ""));
        let scale = 10i128.checked_pow(u32::try_from(decimals.len()).ok()?)?;
        Rational::new(format!("{whole}{decimals}").parse().ok()?, scale)
    }

    /// The nearest number.
    pub fn to_f64(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    /// The numerator, with the sign.
    pub fn numerator(self) -> i128 {
        self.numerator
    }

    /// The denominator, above zero.
    pub fn denominator(self) -> i128 {
        self.denominator
    }

    /// Whether it is zero.
    pub fn is_zero(self) -> bool {
        self.numerator == 0
    }

    /// `self + other`.
    pub fn checked_add(self, other: Rational) -> Option<Rational> {
        let a = self.numerator.checked_mul(other.denominator)?;
        let b = other.numerator.checked_mul(self.denominator)?;
        Rational::new(a.checked_add(b)?, self.denominator.checked_mul(other.denominator)?)
    }

    /// `self - other`.
    pub fn checked_sub(self, other: Rational) -> Option<Rational> {
        self.checked_add(Rational { numerator: -other.numerator, ..other })
    }

    /// `self * other`.
    pub fn checked_mul(self, other: Rational) -> Option<Rational> {
        Rational::new(self.numerator.checked_mul(other.numerator)?, self.denominator.checked_mul(other.denominator)?)
    }

    /// `self / other`; absent too where `other` is zero.
    pub fn checked_div(self, other: Rational) -> Option<Rational> {
        self.checked_mul(Rational::new(other.denominator, other.numerator)?)
    }

    /// The sign: -1, 0 or 1.
    pub fn signum(self) -> i128 {
        self.numerator.signum()
    }
}

impl PartialOrd for Rational {
    fn partial_cmp(&self, other: &Rational) -> Option<Ordering> {
        self.checked_sub(*other).map(|difference| difference.signum().cmp(&0))
    }
}

impl fmt::Display for Rational {
    /// `3`, `-1/2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.denominator == 1 {
            write!(f, "{}", self.numerator)
        } else {
            write!(f, "{}/{}", self.numerator, self.denominator)
        }
    }
}

/// Greatest common divisor, not negative.
pub(crate) fn gcd(a: i128, b: i128) -> i128 {
    let (mut a, mut b) = (a.unsigned_abs(), b.unsigned_abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    i128::try_from(a).unwrap_or(i128::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn decimals_are_exact() {
        assert_eq!(Rational::from_decimal(0.5), Rational::new(1, 2));
        assert_eq!(Rational::from_decimal(0.1), Rational::new(1, 10));
        assert_eq!(Rational::from_decimal(-12.0), Some(Rational::whole(-12)));
        assert_eq!(Rational::from_decimal(6.5), Rational::new(13, 2));
        for bad in [f64::NAN, f64::INFINITY, 1e300, 1e-30] {
            assert_eq!(Rational::from_decimal(bad), None);
        }
    }

    #[test]
    fn zero_denominators_and_overflow_give_nothing() {
        assert_eq!(Rational::new(1, 0), None);
        assert_eq!(Rational::ONE.checked_div(Rational::ZERO), None);
        let huge = Rational::new(i128::MAX, 1).expect("whole");
        assert_eq!(huge.checked_add(huge), None);
        assert_eq!(huge.checked_mul(huge), None);
    }

    proptest! {
        #[test]
        fn field_laws(a in -999i128..999, b in 1i128..99, c in -999i128..999, d in 1i128..99) {
            let (x, y) = (Rational::new(a, b).expect("b > 0"), Rational::new(c, d).expect("d > 0"));
            prop_assert_eq!(x.checked_add(y).and_then(|s| s.checked_sub(y)), Some(x));
            prop_assert_eq!(x.checked_mul(y), y.checked_mul(x));
            if !y.is_zero() {
                prop_assert_eq!(x.checked_div(y).and_then(|q| q.checked_mul(y)), Some(x));
            }
            prop_assert_eq!(x < y, x.to_f64() < y.to_f64());
        }

        #[test]
        fn decimals_come_back(value in -1e9f64..1e9) {
            if let Some(r) = Rational::from_decimal(value) {
                prop_assert!((r.to_f64() - value).abs() <= value.abs() * 1e-15);
            }
        }
    }
}
