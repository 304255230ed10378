//! Which values the runs of a study take. A point is a function of its number and the seed alone.

use matterix_ir::study::{Draw, Study};
use statrs::distribution::{ContinuousCDF, Normal};

use crate::backend::noise::{key, uniform};

/// Points of a Sobol sequence before it begins anew with another scramble, as sobol_burley has them.
const SEQUENCE: u64 = 1 << 16;

/// Dimensions of a Sobol sequence, as sobol_burley has them; more of them take another scramble.
const DIMENSIONS: usize = 256;

/// The values of all runs of a study.
#[derive(Clone, Debug)]
pub struct Design<'s> {
    study: &'s Study,
    seed: u64,
}

/// One coordinate of a point of an Owen-scrambled Sobol sequence, in `[0, 1)`.
pub(crate) fn sobol(number: u64, dimension: usize, seed: u64) -> f64 {
    let scramble = key(seed, dimension / DIMENSIONS, number / SEQUENCE) as u32;
    f64::from(sobol_burley::sample((number % SEQUENCE) as u32, (dimension % DIMENSIONS) as u32, scramble))
}

impl<'s> Design<'s> {
    /// The points of a study.
    pub fn new(study: &'s Study, seed: u64) -> Self {
        Design { study, seed }
    }

    /// How many points the grids have together; none where there is no grid.
    pub fn grid(study: &Study) -> Option<u64> {
        let sizes = study.varied.iter().filter_map(|v| match v.draw {
            Draw::Grid(n) => Some(u64::from(n)),
            _ => None,
        });
        sizes.fold(None, |all, n| Some(all.unwrap_or(1u64).saturating_mul(n)))
    }

    /// The values of a run, in the order of the study, SI.
    pub fn point(&self, run: u64) -> Vec<f64> {
        let mut sequence = 0;
        // Of several grids the last one changes fastest.
        let mut rest = run;
        let mut places = vec![0; self.study.varied.len()];
        for (place, v) in places.iter_mut().zip(&self.study.varied).rev() {
            if let Draw::Grid(n) = v.draw {
                (*place, rest) = (rest % u64::from(n), rest / u64::from(n));
            }
        }
        let mut out = Vec::with_capacity(places.len());
        for (index, (v, place)) in self.study.varied.iter().zip(places).enumerate() {
            let (low, high) = (v.free.low, v.free.high);
            let even = || uniform(key(self.seed ^ STREAM, index, run));
            out.push(match v.draw {
                Draw::Uniform => between(low, high, even()),
                Draw::Sobol => {
                    sequence += 1;
                    between(low, high, sobol(run, sequence - 1, self.seed))
                }
                Draw::Grid(n) => on_grid(low, high, place as f64, f64::from(n.saturating_sub(1).max(1))),
                Draw::Normal(mean, sd) => normal(low, high, mean, sd, even()),
            });
        }
        out
    }
}

/// Keeps the numbers of a study apart from those of the readings' noise.
const STREAM: u64 = 0x5354_5544_5900_0001;

/// One of a grid's values, of which the last has the number `last`: whole numbers between whole numbers stay whole.
fn on_grid(low: f64, high: f64, place: f64, last: f64) -> f64 {
    (low * (last - place) + high * place) / last
}

fn between(low: f64, high: f64, part: f64) -> f64 {
    if part == 1.0 { high } else { low + (high - low) * part }
}

/// The value of a normal distribution cut off at both ends, below which this part of it lies.
fn normal(low: f64, high: f64, mean: f64, sd: f64, part: f64) -> f64 {
    let Ok(normal) = Normal::new(mean, sd) else { return mean.clamp(low, high) };
    let (below, above) = (normal.cdf(low), normal.cdf(high));
    normal.inverse_cdf(below + (above - below) * part).clamp(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use matterix_ir::study::{Free, Varied};
    use matterix_ir::{Span, Unit};

    fn study(draws: &[Draw]) -> Study {
        let varied = draws.iter().enumerate().map(|(i, draw)| Varied {
            free: Free {
                name: format!("x{i}"),
                param: i as u32,
                low: 2.0,
                high: 6.0,
                unit: Unit::one(),
                span: Span::default(),
            },
            draw: *draw,
        });
        let varied = varied.collect();
        Study {
            name: "s".into(),
            span: Span::default(),
            varied,
            runs: None,
            reports: Vec::new(),
            over_time: Vec::new(),
        }
    }

    /// Mean and standard deviation of a coordinate over many points.
    fn moments(draw: Draw, runs: u64) -> (f64, f64) {
        let study = study(&[draw]);
        let design = Design::new(&study, 11);
        let values: Vec<f64> = (0..runs).map(|i| design.point(i)[0]).collect();
        assert!(values.iter().all(|v| (2.0..=6.0).contains(v)));
        let mean = values.iter().sum::<f64>() / runs as f64;
        (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / runs as f64).sqrt())
    }

    #[test]
    fn even_draws_have_the_moments_of_their_range() {
        // Mean 4 and deviation 4 / sqrt(12).
        let (mean, sd) = moments(Draw::Uniform, 20_000);
        assert!((mean - 4.0).abs() < 0.03 && (sd - 1.1547).abs() < 0.02, "{mean} {sd}");
        // A Sobol sequence is even to the order of 1 / n.
        let (mean, sd) = moments(Draw::Sobol, 4096);
        assert!((mean - 4.0).abs() < 1e-3 && (sd - 1.1547).abs() < 1e-3, "{mean} {sd}");
    }

    #[test]
    fn normal_draws_are_cut_off() {
        // The middle half of a range of four deviations: the deviation of a normal distribution cut at two of them.
        let (mean, sd) = moments(Draw::Normal(4.0, 1.0), 20_000);
        assert!((mean - 4.0).abs() < 0.03 && (sd - 0.8796).abs() < 0.02, "{mean} {sd}");
    }

    #[test]
    fn a_grid_between_whole_numbers_has_whole_numbers() {
        let all: Vec<f64> = (0..40).map(|place| on_grid(1.0, 40.0, f64::from(place), 39.0)).collect();
        assert_eq!(all, (1..=40).map(f64::from).collect::<Vec<_>>());
    }

    #[test]
    fn grids_go_with_each_other_and_have_both_ends() {
        let study = study(&[Draw::Grid(3), Draw::Uniform, Draw::Grid(2)]);
        assert_eq!(Design::grid(&study), Some(6));
        let design = Design::new(&study, 0);
        let points: Vec<(f64, f64)> = (0..6).map(|i| (design.point(i)[0], design.point(i)[2])).collect();
        assert_eq!(points, [(2.0, 2.0), (2.0, 6.0), (4.0, 2.0), (4.0, 6.0), (6.0, 2.0), (6.0, 6.0)]);
    }

    #[test]
    fn a_sequence_goes_on_beyond_its_length() {
        assert_ne!(sobol(0, 0, 3), sobol(SEQUENCE, 0, 3));
        assert_ne!(sobol(5, 0, 3), sobol(5, DIMENSIONS, 3));
    }
}
