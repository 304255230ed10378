//! Dimensions: exact rational exponents over the base dimensions the library declares.

use std::fmt::Write;
use std::sync::Arc;

/// A fraction in lowest terms with a positive denominator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Rational {
    /// Numerator.
    pub num: i32,
    /// Denominator, above 0.
    pub den: i32,
}

impl Rational {
    /// `num / den`; `den` must not be 0.
    pub fn new(num: i32, den: i32) -> Self {
        let g = gcd(num.unsigned_abs(), den.unsigned_abs()).max(1) as i32;
        let sign = if den < 0 { -1 } else { 1 };
        Rational { num: sign * num / g, den: sign * den / g }
    }

    /// The fraction nearest to `value` with a denominator up to 12, if it is exact to 1e-9.
    pub fn approximate(value: f64) -> Option<Self> {
        (1..=12).find_map(|den| {
            let num = (value * f64::from(den)).round();
            ((num / f64::from(den) - value).abs() < 1e-9 && num.abs() < 1e6).then(|| Rational::new(num as i32, den))
        })
    }

    fn plus(self, other: Self) -> Self {
        Rational::new(self.num * other.den + other.num * self.den, self.den * other.den)
    }

    fn times(self, other: Self) -> Self {
        Rational::new(self.num * other.num, self.den * other.den)
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// A product of powers of base dimensions; `any` stands for "unknown, reported already" and agrees with everything.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Dimension {
    /// In the order of the bases; none for a plain number. Values are copied far more often than multiplied.
    powers: Option<Arc<[(u16, Rational)]>>,
    any: bool,
}

impl Dimension {
    /// A plain number.
    pub fn one() -> Self {
        Dimension::default()
    }

    /// Agrees with everything.
    pub fn any() -> Self {
        Dimension { powers: None, any: true }
    }

    /// The base dimension with this index.
    pub fn base(index: u16) -> Self {
        Dimension::of(vec![(index, Rational::new(1, 1))])
    }

    fn of(powers: Vec<(u16, Rational)>) -> Self {
        Dimension { powers: (!powers.is_empty()).then(|| powers.into()), any: false }
    }

    /// Its bases, by index, with their exponents.
    pub fn powers(&self) -> &[(u16, Rational)] {
        self.powers.as_deref().unwrap_or(&[])
    }

    /// Whether it agrees with everything.
    pub fn is_any(&self) -> bool {
        self.any
    }

    /// Whether it is a plain number.
    pub fn is_one(&self) -> bool {
        !self.any && self.powers.is_none()
    }

    /// Whether a value of one may stand where the other is expected.
    pub fn agrees(&self, other: &Self) -> bool {
        self.any || other.any || self.powers == other.powers
    }

    /// The dimension of a product.
    pub fn times(&self, other: &Self) -> Self {
        if self.any || other.any {
            return Dimension::any();
        }
        if other.powers.is_none() {
            return self.clone();
        }
        let mut powers = self.powers().to_vec();
        for &(base, exponent) in other.powers() {
            match powers.binary_search_by_key(&base, |p| p.0) {
                Ok(i) => {
                    powers[i].1 = powers[i].1.plus(exponent);
                    if powers[i].1.num == 0 {
                        powers.remove(i);
                    }
                }
                Err(i) => powers.insert(i, (base, exponent)),
            }
        }
        Dimension::of(powers)
    }

    /// The dimension of a quotient.
    pub fn over(&self, other: &Self) -> Self {
        self.times(&other.power(Rational::new(-1, 1)))
    }

    /// The dimension of a power.
    pub fn power(&self, exponent: Rational) -> Self {
        if self.any {
            return Dimension::any();
        }
        if exponent.num == 0 {
            return Dimension::one();
        }
        Dimension::of(self.powers().iter().map(|&(b, e)| (b, e.times(exponent))).collect())
    }

    /// Whether it contains none of the bases of another.
    pub fn is_free_of(&self, other: &Self) -> bool {
        !self.any && !self.powers().iter().any(|(b, _)| other.powers().iter().any(|(o, _)| o == b))
    }

    /// As a product of unit symbols, given the symbol of each base dimension: `kg*m^2/s^3`.
    pub fn show(&self, symbol: impl Fn(u16) -> String) -> String {
        let mut up = String::new();
        let mut down = String::new();
        for &(base, e) in self.powers() {
            let out = if e.num > 0 { &mut up } else { &mut down };
            if !out.is_empty() {
                out.push('*');
            }
            out.push_str(&symbol(base));
            let magnitude = e.num.abs();
            let _ = match (magnitude, e.den) {
                (1, 1) => Ok(()),
                (n, 1) => write!(out, "^{n}"),
                (n, d) => write!(out, "^{n}/{d}"),
            };
        }
        match (up.is_empty(), down.is_empty(), down.contains('*')) {
            (true, true, _) => "1".into(),
            (false, true, _) => up,
            (true, false, false) => format!("1/{down}"),
            (true, false, true) => format!("1/({down})"),
            (false, false, false) => format!("{up}/{down}"),
            (false, false, true) => format!("{up}/({down})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn dimension() -> impl Strategy<Value = Dimension> {
        prop::collection::vec((0u16..4, -3i32..4, 1i32..4), 0..4).prop_map(|parts| {
            parts
                .into_iter()
                .fold(Dimension::one(), |d, (b, n, m)| d.times(&Dimension::base(b).power(Rational::new(n, m))))
        })
    }

    proptest! {
        #[test]
        fn products_form_a_group(a in dimension(), b in dimension(), c in dimension()) {
            prop_assert_eq!(a.times(&b), b.times(&a));
            prop_assert_eq!(a.times(&b).times(&c), a.times(&b.times(&c)));
            prop_assert!(a.over(&a).is_one());
            prop_assert_eq!(a.times(&b).over(&b), a);
        }

        #[test]
        fn powers_multiply(a in dimension(), n in 1i32..5, m in 1i32..5) {
            let root = a.power(Rational::new(n, m));
            prop_assert_eq!(root.power(Rational::new(m, n)), a);
        }
    }

    #[test]
    fn shows_quotients() {
        let names = |i: u16| ["kg", "m", "s"][i as usize].to_string();
        let force = Dimension::base(0).times(&Dimension::base(1)).over(&Dimension::base(2).power(Rational::new(2, 1)));
        assert_eq!(force.show(names), "kg*m/s^2");
        assert_eq!(Dimension::one().over(&force).show(names), "s^2/(kg*m)");
    }
}
