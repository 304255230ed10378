//! How far a pose is from what is asked for, where not all of its rotation may matter.

use matterix_ir::math;
use nalgebra::{UnitVector3, Vector3, Vector6};

use super::Request;
use crate::pose::{Pose, rotation_vector};

/// What a radian counts beside a metre: about the length of a forearm.
pub(crate) const ARM: f64 = 0.3;

/// What of the target's rotation is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Facing {
    /// All of it.
    #[default]
    Exactly,
    /// Only where this axis of the tip points, in the tip's frame: a round vessel may be held from anywhere
    /// about its axis.
    Along(UnitVector3<f64>),
    /// None of it.
    Anyhow,
}

impl Request<'_> {
    /// What moves the tip to the target, in the base's frame: metres, and turns as lengths of an arc.
    pub(crate) fn residual(&self, at: &Pose) -> Vector6<f64> {
        let linear = self.target.translation.vector - at.translation.vector;
        let angular = self.turn(at) * ARM;
        Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    }

    /// The distance of a pose from what is asked for, in metres and radians.
    pub(crate) fn off(&self, at: &Pose) -> (f64, f64) {
        ((self.target.translation.vector - at.translation.vector).norm(), self.turn(at).norm())
    }

    /// The rotation vector of the least turn that brings a pose to face as asked for.
    fn turn(&self, at: &Pose) -> Vector3<f64> {
        match self.facing {
            Facing::Exactly => rotation_vector(&(self.target.rotation * at.rotation.inverse())),
            Facing::Along(axis) => {
                let (here, there) = (at.rotation * axis.into_inner(), self.target.rotation * axis.into_inner());
                let (cross, cosine) = (here.cross(&there), here.dot(&there));
                let sine = cross.norm();
                if sine > 1e-9 {
                    cross * (math::atan2(sine, cosine) / sine)
                } else if cosine > 0.0 {
                    cross
                } else {
                    // Exactly backwards: about any axis at right angles.
                    let helper = if here.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
                    here.cross(&helper).normalize() * std::f64::consts::PI
                }
            }
            Facing::Anyhow => Vector3::zeros(),
        }
    }

    /// A column of the Jacobian, in the residual's units and without what does not matter.
    pub(crate) fn effect(&self, column: &mut Vector6<f64>) {
        let mut angular = Vector3::new(column[3], column[4], column[5]) * ARM;
        match self.facing {
            Facing::Exactly => {}
            Facing::Along(axis) => {
                let there = self.target.rotation * axis.into_inner();
                angular -= there * there.dot(&angular);
            }
            Facing::Anyhow => angular = Vector3::zeros(),
        }
        column.fixed_rows_mut::<3>(3).copy_from(&angular);
    }
}
