//! What a robot must not run into: named solids somewhere in the world.

mod distance;
mod obstacle;

pub use distance::Nearest;
pub(crate) use obstacle::Obstacle;

use std::collections::BTreeSet;

use crate::pose::Pose;

/// A solid about its own origin; metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Half the edge lengths along x, y, z.
    Cuboid([f64; 3]),
    /// Radius, and half the length along z.
    Cylinder(f64, f64),
    /// Radius, and half the length along z between the middles of the round ends.
    Capsule(f64, f64),
    /// Radius.
    Sphere(f64),
}

/// A solid somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// What it is called when a motion runs into it.
    pub name: String,
    /// Where it is.
    pub pose: Pose,
    /// What it is.
    pub shape: Shape,
}

/// Everything that stands around.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// In any order.
    pub bodies: Vec<Body>,
    /// Those that the robot stands on, by index: what of it does not move may touch them.
    pub beneath: BTreeSet<usize>,
}
