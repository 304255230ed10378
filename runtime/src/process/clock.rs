//! Lab time counted from the last discontinuity on.
//!
//! A double resolves lab time after a week to 1e-10 s; the first step after a discontinuity may be 1e-20 s long. So the
//! integrator counts from 0 again at each discontinuity, and wherever its steps become too short for the time that it has counted.

/// Where a count of time begins in lab time, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Clock {
    begin: f64,
    /// What `begin` cannot resolve.
    rest: f64,
}

impl Clock {
    /// Lab time itself.
    pub(super) const LAB: Clock = Clock { begin: 0.0, rest: 0.0 };

    /// Counts from the lab time `time`, s.
    pub(super) fn from(time: f64) -> Self {
        Clock { begin: time, rest: 0.0 }
    }

    /// The lab time at `local`, s.
    pub(super) fn lab(&self, local: f64) -> f64 {
        self.begin + (self.rest + local)
    }

    /// The lab times of a piece of local time, s.
    pub(super) fn span(&self, (from, to): (f64, f64)) -> (f64, f64) {
        (self.lab(from), self.lab(to))
    }

    /// The local time at the lab time `time`, s.
    pub(super) fn local(&self, time: f64) -> f64 {
        (time - self.begin) - self.rest
    }

    /// Counts from the present `local` on.
    pub(super) fn restart(&mut self, local: f64) {
        let rest = self.rest + local;
        let begin = self.begin + rest;
        // Fast two-sum (Dekker 1971): `begin` is the larger of the two.
        self.rest = rest - (begin - self.begin);
        self.begin = begin;
    }
}

#[cfg(test)]
mod tests {
    use super::Clock;

    #[test]
    fn steps_below_the_rounding_of_lab_time_add_up() {
        let mut clock = Clock::from(1e6);
        for _ in 0..1000 {
            clock.restart(1e-12);
        }
        assert!((clock.local(1e6) + 1e-9).abs() < 1e-15);
        assert_eq!(clock.lab(0.0), 1e6 + 1e-9);
    }
}
