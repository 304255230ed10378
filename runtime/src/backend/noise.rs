//! What a device reports: the true value with the declared noise and resolution.
//!
//! The noise is a pure function of (seed, reading, report): each pair of seed and reading owns a SplitMix64 sequence,
//! addressed by the report's number (or the instant, for a reading without a period) instead of being drawn from in
//! turn. So a sample depends neither on the order nor on the number of looks, and a recorder that samples the same
//! instant sees what the control flow saw. Between two reports of a reading the true value moves on, its noise does not. Uniform numbers become normal ones by Box and Muller's transform.

use matterix_ir::math;
use matterix_ir::model::Reading;

/// What reading number `index` reports of the true value `value` at `time`, SI.
pub fn measure(reading: &Reading, index: usize, seed: u64, time: f64, value: f64) -> f64 {
    let noisy = match reading.noise {
        Some(sigma) if sigma > 0.0 => value + sigma * normal(key(seed, index, report(reading, time))),
        _ => value,
    };
    match reading.resolution {
        Some(step) if step > 0.0 => (noisy / step).round() * step,
        _ => noisy,
    }
}

/// The reading's time between reports, if it has a usable one, s.
pub fn period(reading: &Reading) -> Option<f64> {
    reading.period.filter(|p| p.is_finite() && *p > 0.0)
}

/// Which report the one at `time` is; a report due now within rounding counts as made.
fn report(reading: &Reading, time: f64) -> u64 {
    period(reading).map_or(time.to_bits(), |p| (time / p + 1e-9).floor() as u64)
}

/// Where the numbers of one thing begin.
pub(crate) fn key(seed: u64, index: usize, report: u64) -> u64 {
    mix(mix(mix(seed) ^ index as u64) ^ report)
}

/// A sample of the standard normal distribution.
fn normal(key: u64) -> f64 {
    let (first, second) = (uniform(mix(key)), uniform(mix(key ^ 0xD1B5_4A32_D192_ED03)));
    (-2.0 * math::ln(first)).sqrt() * math::cos(std::f64::consts::TAU * second)
}

/// In `(0, 1]`, from the upper 53 bits.
pub(crate) fn uniform(bits: u64) -> f64 {
    ((bits >> 11) + 1) as f64 / (1u64 << 53) as f64
}

/// One output of SplitMix64 (Steele, Lea, Flood 2014) at state `x`.
pub(crate) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_has_mean_zero_and_deviation_one() {
        let samples: Vec<f64> = (0..20_000).map(|i| normal(key(7, 3, i))).collect();
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / samples.len() as f64;
        assert!(mean.abs() < 0.03, "{mean}");
        assert!((variance - 1.0).abs() < 0.04, "{variance}");
    }

    #[test]
    fn streams_of_readings_differ() {
        assert_ne!(normal(key(7, 0, 5)), normal(key(7, 1, 5)));
        assert_ne!(normal(key(7, 0, 5)), normal(key(8, 0, 5)));
    }
}
