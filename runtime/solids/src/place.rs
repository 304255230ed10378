//! Poses as parry has them.

use matterix_ir::pose::Pose;
use parry3d_f64::math::{Pose as Isometry, Rotation, Vector};

/// A pose of a scene; m.
pub fn isometry(pose: &Pose) -> Isometry {
    let [x, y, z, w] = pose.rotation;
    Isometry::from_parts(Vector::from(pose.position), Rotation::from_xyzw(x, y, z, w).normalize())
}

/// A pose for a scene; m.
pub fn pose(isometry: &Isometry) -> Pose {
    Pose { position: isometry.translation.to_array(), rotation: isometry.rotation.to_array() }
}
