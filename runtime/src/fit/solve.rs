//! Weighted least squares within a box: many places are looked at, and Levenberg and Marquardt's method goes on from the
//! best of them. It moves an angle whose sine is the place, so that it never leaves the box.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra_lm::{DMatrix, DVector, Dyn, Owned};

use super::scale::Scale;
use crate::study::{shared, sobol};

/// Places that are looked at, beside the middle of the box and the values as written.
const LOOKS: u64 = 30;

/// The best of them, from which the method goes on.
const STARTS: usize = 4;

/// Step of the differences that stand for derivatives, as a part of the range: well above what is lost to the tolerance of
/// a run (1e-8), well below what bends a response.
const STEP: f64 = 1e-4;

/// What a place that cannot be judged counts, per residual: more than any that can.
const WALL: f64 = 1e8;

/// What is fitted: residuals in standard deviations.
pub trait Model: Sync {
    /// The residuals at values of the parameters, SI; in words why there are none.
    fn residuals(&self, values: &[f64]) -> Result<Vec<f64>, String>;
}

/// How to go about it.
#[derive(Clone, Debug)]
pub struct Options<'c> {
    /// The values as written, SI; looked at where they lie in the box.
    pub nominal: Vec<f64>,
    /// Scrambles the places.
    pub seed: u64,
    /// On how many threads.
    pub jobs: usize,
    /// Set from outside to give up.
    pub cancel: &'c AtomicBool,
}

/// Why there is no solution.
#[derive(Clone, Debug, PartialEq)]
pub enum Unsolved {
    /// At no place there were residuals: what was said where it should have been easiest.
    Failed(String),
    /// Given up from outside.
    Cancelled,
}

/// The best place.
#[derive(Clone, Debug)]
pub struct Solution {
    /// SI.
    pub values: Vec<f64>,
    /// Places in the ranges.
    pub places: Vec<f64>,
    /// In standard deviations.
    pub residuals: Vec<f64>,
    /// By residual and parameter: change with the place.
    pub jacobian: DMatrix<f64>,
    /// How often residuals were computed.
    pub evaluations: u64,
    /// From how many places the method went on.
    pub starts: usize,
    /// How many of them led to a place as good as the best.
    pub agreed: usize,
}

/// Finds the place with the least sum of squares.
pub fn solve(
    model: &dyn Model,
    scales: &[Scale],
    options: &Options<'_>,
    done: &mut dyn FnMut(u64),
) -> Result<Solution, Unsolved> {
    let counted = Counted { model, scales, evaluations: AtomicU64::new(0) };
    let mut places = vec![vec![0.5; scales.len()]];
    let nominal: Vec<f64> = scales.iter().zip(&options.nominal).map(|(s, v)| s.place(*v)).collect();
    if nominal.len() == scales.len() && nominal.iter().all(|p| (0.0..=1.0).contains(p)) {
        places.push(nominal);
    }
    places.extend((0..LOOKS).map(|i| (0..scales.len()).map(|d| sobol(i, d, options.seed)).collect()));
    let look = |i: u64| places.get(i as usize).map(|p| counted.residuals(p)).unwrap_or(Err(String::new()));
    let looked = shared(places.len() as u64, options.jobs, options.cancel, look, done);
    if options.cancel.load(Ordering::Relaxed) {
        return Err(Unsolved::Cancelled);
    }
    let mut judged: Vec<(f64, usize)> =
        looked.iter().enumerate().filter_map(|(i, r)| Some((squares(r.as_ref().ok()?), i))).collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    if judged.is_empty() {
        let why = looked.into_iter().find_map(Result::err).unwrap_or_default();
        return Err(Unsolved::Failed(why));
    }
    judged.truncate(STARTS);
    let descend = |i: u64| judged.get(i as usize).map(|(_, at)| counted.descend(&places[*at]));
    let ends = shared(judged.len() as u64, options.jobs, options.cancel, descend, &mut |_| {});
    if options.cancel.load(Ordering::Relaxed) {
        return Err(Unsolved::Cancelled);
    }
    let costs: Vec<f64> = ends.iter().map(|e| e.as_ref().map_or(f64::INFINITY, |e| e.0)).collect();
    let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let Some(places) = ends.into_iter().flatten().find(|e| e.0 == best).map(|e| e.1) else {
        return Err(Unsolved::Failed("no start reached a minimum".to_string()));
    };
    let residuals = counted.residuals(&places).map_err(Unsolved::Failed)?;
    let Some(jacobian) = counted.jacobian(&places, &residuals) else {
        return Err(Unsolved::Failed("the response near the best fit cannot be computed".to_string()));
    };
    Ok(Solution {
        values: counted.values(&places),
        places,
        residuals,
        jacobian,
        evaluations: counted.evaluations.load(Ordering::Relaxed),
        starts: costs.len(),
        agreed: costs.iter().filter(|c| **c <= best * 1.01 + 1e-9).count(),
    })
}

fn squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// A model by places, which counts how often it is asked.
struct Counted<'m> {
    model: &'m dyn Model,
    scales: &'m [Scale],
    evaluations: AtomicU64,
}

impl Counted<'_> {
    fn values(&self, places: &[f64]) -> Vec<f64> {
        self.scales.iter().zip(places).map(|(s, p)| s.value(*p)).collect()
    }

    fn residuals(&self, places: &[f64]) -> Result<Vec<f64>, String> {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        let residuals = self.model.residuals(&self.values(places))?;
        match residuals.iter().all(|r| r.is_finite()) {
            true => Ok(residuals),
            false => Err("a matched value is not finite".to_string()),
        }
    }

    /// Central differences, one-sided ones of the same order at the ends of a range.
    fn jacobian(&self, places: &[f64], here: &[f64]) -> Option<DMatrix<f64>> {
        let mut out = DMatrix::zeros(here.len(), places.len());
        for column in 0..places.len() {
            let at = |by: f64| {
                let mut moved = places.to_vec();
                moved[column] += by;
                self.residuals(&moved).ok()
            };
            let inward = if places[column] < STEP { STEP } else { -STEP };
            let central = (STEP..=1.0 - STEP).contains(&places[column]);
            let slope: Vec<f64> = if central {
                let (after, before) = (at(STEP)?, at(-STEP)?);
                after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * STEP)).collect()
            } else {
                let (one, two) = (at(inward)?, at(2.0 * inward)?);
                let three = here.iter().zip(&one).zip(&two);
                three.map(|((zero, one), two)| (4.0 * one - 3.0 * zero - two) / (2.0 * inward)).collect()
            };
            if slope.len() != here.len() {
                return None;
            }
            out.column_mut(column).copy_from_slice(&slope);
        }
        Some(out)
    }

    /// Goes down from a place: the sum of squares and the place where it ends.
    fn descend(&self, from: &[f64]) -> (f64, Vec<f64>) {
        // At the very end of a range the sine has no slope.
        let angles = from.iter().map(|p| (2.0 * p.clamp(0.01, 0.99) - 1.0).asin());
        let mut descent = Descent { counted: self, angles: DVector::zeros(0), residuals: Err(String::new()) };
        descent.set_params(&DVector::from_iterator(from.len(), angles));
        let method = LevenbergMarquardt::new().with_ftol(1e-9).with_xtol(1e-7).with_gtol(1e-9).with_patience(40);
        let (descent, _) = method.minimize(descent);
        let places = descent.places();
        (descent.residuals.as_ref().map_or(f64::INFINITY, |r| squares(r)), places)
    }
}

/// One descent, as the method wants to see it.
struct Descent<'m, 'c> {
    counted: &'c Counted<'m>,
    angles: DVector<f64>,
    residuals: Result<Vec<f64>, String>,
}

impl Descent<'_, '_> {
    fn places(&self) -> Vec<f64> {
        self.angles.iter().map(|x| 0.5 * (1.0 + x.sin())).collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Descent<'_, '_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        let was = self.residuals.as_ref().map_or(0, Vec::len);
        self.angles = x.clone();
        let found = self.counted.residuals(&self.places());
        // A place that cannot be judged is a bad one, and the method takes a shorter step.
        self.residuals = if was > 0 { Ok(found.unwrap_or_else(|_| vec![WALL; was])) } else { found };
    }

    fn params(&self) -> DVector<f64> {
        self.angles.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.residuals.as_ref().ok().map(|r| DVector::from_column_slice(r))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.residuals.as_ref().ok()?;
        let mut jacobian = self.counted.jacobian(&self.places(), here)?;
        for (mut column, x) in jacobian.column_iter_mut().zip(self.angles.iter()) {
            column *= 0.5 * x.cos();
        }
        Some(jacobian)
    }
}
