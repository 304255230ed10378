//! Turns about an axis that bring vectors where they are to be (Paden 1986; Elias and Wen 2022).

use matterix_ir::math;
use nalgebra::{Matrix3, Vector3};

/// How much a cosine may exceed 1 by rounding.
const ROUNDING: f64 = 1e-9;

/// The rotation about a unit axis.
pub(crate) fn rotation(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let (s, c) = math::sin_cos(angle);
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * s + cross * cross * (1.0 - c)
}

/// The angle about `axis` that turns `from` nearest to `to`.
pub(crate) fn angle_between(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let sine = axis.dot(&from.cross(to));
    let cosine = from.dot(to) - axis.dot(from) * axis.dot(to);
    math::atan2(sine, cosine)
}

/// The angles about `axis` for which `along` . R `vector` is `value`: two, one twice, or none.
pub(crate) fn angles_with_component(
    axis: &Vector3<f64>,
    vector: &Vector3<f64>,
    along: &Vector3<f64>,
    value: f64,
) -> Option<[f64; 2]> {
    let parallel = axis * axis.dot(vector);
    let cosine = along.dot(&(vector - parallel));
    let sine = along.dot(&axis.cross(vector));
    let rest = value - along.dot(&parallel);
    let reach = (cosine * cosine + sine * sine).sqrt();
    // A vector along the axis does not move: any angle is as good.
    if reach < 1e-12 {
        return (rest.abs() < ROUNDING).then_some([0.0, 0.0]);
    }
    let ratio = rest / reach;
    if ratio.abs() > 1.0 + ROUNDING || ratio.is_nan() {
        return None;
    }
    let (middle, half) = (math::atan2(sine, cosine), math::acos(ratio.clamp(-1.0, 1.0)));
    Some([middle - half, middle + half])
}
