//! What there is: instances of assets, where they stand, and what their states mean.

use serde::{Deserialize, Serialize};

use crate::Span;

/// An instance, by its index in the [`Scene`]. The graph stores instances as this number, "nothing" as -1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct InstanceId(pub u32);

/// Position in metres and roll, pitch, yaw in radians, relative to the parent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// x, y, z in metres.
    pub position: [f64; 3],
    /// Roll, pitch, yaw in radians.
    pub rpy: [f64; 3],
}

/// A named point of an asset, for grasping, placing, pouring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Name, as in `beaker.grasp`.
    pub name: String,
    /// Relative to the asset.
    pub pose: Pose,
}

/// A primitive shape for pictures; metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// Edge lengths x, y, z; the origin at the middle of the base.
    Box([f64; 3]),
    /// Diameter and height; the origin at the middle of the base.
    Cylinder([f64; 2]),
}

/// One asset in the lab, or a part of one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// Full name: `hotplate`, `beaker.contents`, `left.panda`.
    pub name: String,
    /// Name of the asset type or, for a part, of its capability.
    pub kind: String,
    /// Names of all capabilities it has, inherited ones included.
    pub capabilities: Vec<String>,
    /// The instance it is a part of.
    pub owner: Option<InstanceId>,
    /// What it stood on when the run began.
    pub support: Option<InstanceId>,
    /// Where it stood when the run began, relative to its support or the lab.
    pub pose: Pose,
    /// Its named points.
    pub frames: Vec<Frame>,
    /// For pictures.
    pub shape: Option<Shape>,
    /// Its declaration.
    pub span: Span,
}

/// All instances of a lab, parts after their owners.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name of the lab.
    pub lab: String,
    /// By [`InstanceId`].
    pub instances: Vec<Instance>,
}

impl Scene {
    /// One instance.
    pub fn get(&self, id: InstanceId) -> &Instance {
        &self.instances[id.0 as usize]
    }

    /// The instance with this full name.
    pub fn find(&self, name: &str) -> Option<InstanceId> {
        self.instances.iter().position(|i| i.name == name).map(|i| InstanceId(i as u32))
    }
}
