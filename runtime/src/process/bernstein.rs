//! Polynomials by their control points, in Bernstein form: such a polynomial lies between the least and the greatest of them.

use std::sync::OnceLock;

use matterix_ir::interval::Interval;
use nalgebra::{Matrix6, Vector6};

use super::dense::POINTS;

/// The control points of a polynomial that is given at [`POINTS`].
pub(super) fn control(sampled: Vector6<f64>) -> Vector6<f64> {
    static FROM_SAMPLES: OnceLock<Matrix6<f64>> = OnceLock::new();
    let matrix = FROM_SAMPLES.get_or_init(|| {
        const CHOICES: [f64; 6] = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];
        // `powi` rounds as the optimiser likes.
        let power = |x: f64, n: usize| (0..n).map(|_| x).product::<f64>();
        let shares = |k: usize, j: usize| CHOICES[j] * power(POINTS[k], j) * power(1.0 - POINTS[k], 5 - j);
        Matrix6::from_fn(shares).try_inverse().unwrap_or_else(Matrix6::zeros)
    });
    matrix * sampled
}

/// Bounds of a polynomial that is given at [`POINTS`].
pub(super) fn hull(sampled: Vector6<f64>) -> Interval {
    let points = control(sampled);
    (points.min(), points.max())
}

/// The control points of the first and of the second half of a polynomial (de Casteljau).
pub(super) fn halved(mut control: Vector6<f64>) -> (Vector6<f64>, Vector6<f64>) {
    let (mut left, mut right) = (control, control);
    for level in 1..6 {
        for k in 0..6 - level {
            control[k] = 0.5 * (control[k] + control[k + 1]);
        }
        left[level] = control[0];
        right[5 - level] = control[5 - level];
    }
    (left, right)
}
