//! Moments as exact sums of durations.
//!
//! A thousand waits of 0.1 s end after 100 s. Each sum is rounded, so what rounding took from a moment is kept and added where
//! the next duration begins there.

use std::collections::BTreeMap;

/// What rounding took from moments to come.
#[derive(Clone, Debug, Default)]
pub struct Moments {
    /// By the bits of the moment, s, which stand in the order of the moments.
    rests: BTreeMap<u64, f64>,
}

impl Moments {
    /// The moment `duration` s after `now`, which is 0 s or later.
    pub fn after(&mut self, now: f64, duration: f64) -> f64 {
        self.rests = self.rests.split_off(&now.to_bits());
        let rest = self.rests.get(&now.to_bits()).copied().unwrap_or(0.0);
        let sum = now + duration;
        if !sum.is_finite() {
            return sum;
        }
        // Two-sum (Knuth, The Art of Computer Programming 2, 4.2.2).
        let part = sum - now;
        let lost = (now - (sum - part)) + (duration - part) + rest;
        let moment = sum + lost;
        let left = (sum - moment) + lost;
        if left != 0.0 && left.is_finite() && moment > now {
            self.rests.entry(moment.to_bits()).or_insert(left);
        }
        moment
    }
}

#[cfg(test)]
mod tests {
    use super::Moments;

    #[test]
    fn durations_add_up() {
        let mut moments = Moments::default();
        assert_eq!((0..1000).fold(0.0, |now, _| moments.after(now, 0.1)), 100.0);
        let mut moments = Moments::default();
        assert_eq!((0..10_000).fold(0.0, |now, _| moments.after(now, 1.0 / 3.0)), 10_000.0 * (1.0 / 3.0));
        assert!(moments.rests.len() < 3);
        assert_eq!(moments.after(5.0, 0.0), 5.0);
        assert_eq!(moments.after(5.0, f64::INFINITY), f64::INFINITY);
    }
}
