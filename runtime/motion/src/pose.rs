//! Rigid placements as rotation matrix and translation, which is what chains multiply fastest.

use matterix_ir::math;
use matterix_ir::robot::Placement;
use nalgebra::{IsometryMatrix3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Where a frame is relative to another one; metres.
pub type Pose = IsometryMatrix3<f64>;

/// A placement of a description as a pose.
pub fn pose(placement: &Placement) -> Pose {
    let [x, y, z, w] = placement.rotation;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
    Pose::from_parts(Translation3::from(placement.position), rotation)
}

/// A pose as a placement of a description.
pub fn placement(pose: &Pose) -> Placement {
    let q = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    Placement { position: pose.translation.vector.into(), rotation: [q.i, q.j, q.k, q.w] }
}

/// A rotation that takes the third axis to this unit vector.
pub(crate) fn from_third_axis(axis: &Vector3<f64>) -> Rotation3<f64> {
    // The helper is the basis vector least along the axis, so that the cross product is well conditioned.
    let helper = if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    if axis.z == 1.0 {
        return Rotation3::identity();
    }
    let x = (helper - axis * axis.dot(&helper)).normalize();
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, axis.cross(&x), *axis]))
}

/// `pose` turned about its own third axis.
#[inline]
pub(crate) fn turned(pose: &Pose, angle: f64) -> Pose {
    let (s, c) = math::sin_cos(angle);
    let m = pose.rotation.matrix();
    let (x, y) = (m.column(0), m.column(1));
    let turned = Matrix3::from_columns(&[x * c + y * s, y * c - x * s, m.column(2).into()]);
    Pose::from_parts(pose.translation, Rotation3::from_matrix_unchecked(turned))
}

/// `pose` moved along its own third axis.
#[inline]
pub(crate) fn slid(pose: &Pose, by: f64) -> Pose {
    let moved = pose.translation.vector + pose.rotation.matrix().column(2) * by;
    Pose::from_parts(Translation3::from(moved), pose.rotation)
}

/// The rotation vector (axis times angle, 0 to pi) of a rotation.
pub fn rotation_vector(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let m = rotation.matrix();
    let twice = Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]);
    let sine = 0.5 * twice.norm();
    let cosine = 0.5 * (m.trace() - 1.0);
    if sine > 1e-6 {
        return twice * (0.5 * math::atan2(sine, cosine) / sine);
    }
    if cosine > 0.0 {
        return twice * 0.5;
    }
    // Half a turn: the symmetric part is 2 a a' - 1; its longest column is along the axis a.
    let symmetric = m + Matrix3::identity();
    let longest = (0..3).max_by(|&i, &j| symmetric[(i, i)].total_cmp(&symmetric[(j, j)])).unwrap_or(0);
    symmetric.column(longest).normalize() * std::f64::consts::PI
}

/// How far two poses are apart: metres and radians.
pub fn distance(a: &Pose, b: &Pose) -> (f64, f64) {
    let linear = (a.translation.vector - b.translation.vector).norm();
    (linear, rotation_vector(&a.rotation.rotation_to(&b.rotation)).norm())
}
