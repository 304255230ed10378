//! Closed intervals of numbers, as bounds of what is not known exactly.

/// All numbers from `min` to `max`, ends included where they are finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
}

impl Interval {
    /// Every number.
    pub const ANY: Interval = Interval { min: f64::NEG_INFINITY, max: f64::INFINITY };
    /// Nothing but 0.
    pub const ZERO: Interval = Interval { min: 0.0, max: 0.0 };
    /// A duration of which nothing is known, s.
    pub const SOME_TIME: Interval = Interval { min: 0.0, max: f64::INFINITY };

    /// One number; any, where it is none.
    pub fn exactly(value: f64) -> Self {
        if value.is_nan() { Interval::ANY } else { Interval { min: value, max: value } }
    }

    /// The number, if there is only one.
    pub fn exact(self) -> Option<f64> {
        (self.min == self.max && self.min.is_finite()).then_some(self.min)
    }

    /// As a duration: nothing below 0.
    pub fn as_duration(self) -> Self {
        Interval { min: self.min.max(0.0), max: self.max.max(0.0) }
    }

    /// Multiplied by a number.
    pub fn scaled(self, by: f64) -> Self {
        let product = |x: f64| if by == 0.0 { 0.0 } else { x * by };
        let (a, b) = (product(self.min), product(self.max));
        Interval { min: a.min(b), max: a.max(b) }
    }

    /// Either of two.
    pub fn either(self, other: Self) -> Self {
        Interval { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The later of two.
    pub fn later(self, other: Self) -> Self {
        Interval { min: self.min.max(other.min), max: self.max.max(other.max) }
    }

    /// Applies a function that grows with its operand.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Interval { min: f(self.min), max: f(self.max) }
    }
}

impl std::ops::Add for Interval {
    type Output = Interval;

    fn add(self, other: Interval) -> Interval {
        let (min, max) = (self.min + other.min, self.max + other.max);
        // Unlimited less unlimited is anything.
        Interval {
            min: if min.is_nan() { f64::NEG_INFINITY } else { min },
            max: if max.is_nan() { f64::INFINITY } else { max },
        }
    }
}
