//! Forward kinematics: where links are in a configuration.

use crate::chain::{Chain, Move, Tree};
use crate::pose::{Pose, slid, turned};

impl Move {
    /// `pose` after this motion.
    #[inline]
    pub(crate) fn apply(&self, pose: &Pose, q: &[f64]) -> Pose {
        let by = self.multiplier * q[self.variable] + self.offset;
        if self.slides { slid(pose, by) } else { turned(pose, by) }
    }
}

impl Tree {
    /// Where every link is relative to the root, in the order of the robot's links.
    ///
    /// # Panics
    /// If `q` is shorter than the tree's variables.
    pub fn poses(&self, q: &[f64]) -> Vec<Pose> {
        let mut poses = Vec::new();
        self.poses_into(q, &mut poses);
        poses
    }

    /// As [`Tree::poses`], into a vector that is kept between calls.
    pub fn poses_into(&self, q: &[f64], poses: &mut Vec<Pose>) {
        poses.clear();
        poses.resize(self.links, Pose::identity());
        for knot in &self.knots {
            let at = poses[knot.parent] * knot.before;
            poses[knot.child] = match &knot.motion {
                None => at,
                Some((motion, after)) => motion.apply(&at, q) * after,
            };
        }
    }
}

impl Chain {
    /// Where the tip is relative to the base.
    ///
    /// # Panics
    /// If `q` is shorter than the chain's variables.
    pub fn tip(&self, q: &[f64]) -> Pose {
        self.stages.iter().fold(self.lead, |at, stage| stage.motion.apply(&at, q) * stage.after)
    }
}
