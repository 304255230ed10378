//! Where links are: one frame after another, as the description says it.

use matterix_ir::robot::{JointKind, Robot};
use matterix_solids::{Isometry, Vector, isometry};

/// Indices of the joints that move by themselves.
pub(crate) fn variables(robot: &Robot) -> Vec<usize> {
    let own = |i: &usize| robot.joints[*i].kind != JointKind::Fixed && robot.joints[*i].mimic.is_none();
    (0..robot.joints.len()).filter(own).collect()
}

/// The joints between a link and the root.
pub(crate) fn above(robot: &Robot, link: u32) -> Vec<u32> {
    let before = |link: u32| robot.joints.iter().position(|j| j.child == link).map(|j| j as u32);
    let next = |joint: &u32| before(robot.joints[*joint as usize].parent);
    std::iter::successors(before(link), next).collect()
}

/// Whether one joint is all that is between two links, or between what is rigidly fixed to either: how they fit together there
/// is no matter of motion.
pub(crate) fn are_joined(robot: &Robot, moved: &[Option<u32>], a: usize, b: usize) -> bool {
    let above = |link: usize| {
        let joint = robot.joints.get(moved.get(link).copied().flatten()? as usize)?;
        Some(moved.get(joint.parent as usize).copied().flatten())
    };
    above(a) == Some(moved[b]) || above(b) == Some(moved[a])
}

/// All links, given where the root is and the positions of the joints that move by themselves.
pub(crate) fn links(robot: &Robot, root: &Isometry, variables: &[usize], q: &[f64]) -> Vec<Isometry> {
    let value =
        |joint: usize| variables.iter().position(|v| *v == joint).and_then(|i| q.get(i)).copied().unwrap_or(0.0);
    let mut links = vec![*root; robot.links.len()];
    for (index, joint) in robot.joints.iter().enumerate() {
        let position = match joint.mimic {
            Some(mimic) => mimic.multiplier * value(mimic.joint as usize) + mimic.offset,
            None => value(index),
        };
        let axis = Vector::from(joint.axis);
        let moved = match joint.kind {
            JointKind::Fixed => Isometry::identity(),
            JointKind::Prismatic => Isometry::from_translation(axis * position),
            JointKind::Revolute | JointKind::Continuous => Isometry::rotation(axis * position),
        };
        links[joint.child as usize] = links[joint.parent as usize] * isometry(&joint.origin) * moved;
    }
    links
}

/// Of each link the joint nearest to it on the way from the root that moves; none for those that stand with the root.
pub(crate) fn moved_by(robot: &Robot) -> Vec<Option<u32>> {
    let mut by = vec![None; robot.links.len()];
    for (index, joint) in robot.joints.iter().enumerate() {
        by[joint.child as usize] =
            if joint.kind == JointKind::Fixed { by[joint.parent as usize] } else { Some(index as u32) };
    }
    by
}
