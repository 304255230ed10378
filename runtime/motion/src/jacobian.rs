//! How the tip of a chain moves when its variables do.

use nalgebra::{Vector3, Vector6};

use crate::chain::Chain;
use crate::pose::Pose;

impl Chain {
    /// The geometric Jacobian in the base's frame: for each variable the velocity of the tip (m) and its angular
    /// velocity (rad) per unit of the variable. Returns where the tip is.
    ///
    /// # Panics
    /// If `q` is shorter than the chain's variables.
    pub fn jacobian(&self, q: &[f64], columns: &mut Vec<Vector6<f64>>) -> Pose {
        columns.clear();
        columns.resize(self.variables().len(), Vector6::zeros());
        let mut at = self.lead;
        // The velocity of the base's origin under each rotation first, as the tip is not yet known.
        for stage in &self.stages {
            let motion = &stage.motion;
            let axis: Vector3<f64> = at.rotation.matrix().column(2) * motion.multiplier;
            let column = &mut columns[motion.variable];
            if motion.slides {
                *column += Vector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0);
            } else {
                let moment = at.translation.vector.cross(&axis);
                *column += Vector6::new(moment.x, moment.y, moment.z, axis.x, axis.y, axis.z);
            }
            at = motion.apply(&at, q) * stage.after;
        }
        let tip = at.translation.vector;
        for column in columns {
            let angular = Vector3::new(column[3], column[4], column[5]);
            let linear = angular.cross(&tip);
            column[0] += linear.x;
            column[1] += linear.y;
            column[2] += linear.z;
        }
        at
    }
}
