//! Rigid placements in the form of a document.

use matterix_ir::robot::Placement;

use crate::document::Pose;

/// As documents have it.
pub(crate) fn pose(of: Placement) -> Pose {
    let [x, y, z] = of.position.map(|v| v as f32);
    let [a, b, c, d] = of.rotation.map(|v| v as f32);
    Pose([x, y, z, a, b, c, d])
}
