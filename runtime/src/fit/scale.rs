//! A parameter as a place in its range: 0 at its lower end, 1 at its upper end.

/// The range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// SI.
    pub low: f64,
    /// SI.
    pub high: f64,
    /// Equal steps are equal ratios.
    pub log: bool,
}

impl Scale {
    /// The value at a place, SI.
    pub fn value(&self, place: f64) -> f64 {
        let place = place.clamp(0.0, 1.0);
        match self.log {
            true => (self.low.ln() + (self.high / self.low).ln() * place).exp().clamp(self.low, self.high),
            false => (self.low + (self.high - self.low) * place).clamp(self.low, self.high),
        }
    }

    /// The place of a value.
    pub fn place(&self, value: f64) -> f64 {
        match self.log {
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        }
    }

    /// How fast the value changes with the place, SI.
    pub fn slope(&self, place: f64) -> f64 {
        match self.log {
            true => self.value(place) * (self.high / self.low).ln(),
            false => self.high - self.low,
        }
    }

    /// A value moved by so many places, SI; not held to the range.
    pub fn moved(&self, value: f64, by: f64) -> f64 {
        match self.log {
            true => value * ((self.high / self.low).ln() * by).exp(),
            false => value + (self.high - self.low) * by,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_values_are_inverse() {
        for log in [false, true] {
            let scale = Scale { low: 1e7, high: 1e10, log };
            for place in [0.0, 0.25, 0.5, 1.0] {
                assert!((scale.place(scale.value(place)) - place).abs() < 1e-12);
                let slope = (scale.value(place + 1e-6) - scale.value(place - 1e-6)) / 2e-6;
                assert!(!(0.1..0.9).contains(&place) || (slope / scale.slope(place) - 1.0).abs() < 1e-6);
            }
        }
    }
}
