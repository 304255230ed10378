//! Robots as trees of links and joints: what kinematics, planning and pictures need of one, in SI units.

use serde::{Deserialize, Serialize};

/// A rigid placement: a translation in metres and a unit quaternion (x, y, z, w).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// x, y, z in metres.
    pub position: [f64; 3],
    /// Unit quaternion, x, y, z, w.
    pub rotation: [f64; 4],
}

impl Default for Placement {
    fn default() -> Self {
        Self { position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] }
    }
}

/// A solid, its own origin at its middle; metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Solid {
    /// Edge lengths along x, y, z.
    Cuboid([f64; 3]),
    /// Radius and length, along z.
    Cylinder([f64; 2]),
    /// Radius.
    Sphere(f64),
    /// A mesh file by its name in the package that brought it, and its scale along x, y, z.
    Mesh(String, [f64; 3]),
}

/// A solid somewhere on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Relative to the link.
    pub placement: Placement,
    /// What it is.
    pub solid: Solid,
    /// Red, green, blue, opacity, each 0 to 1; `None` where the source names no colour.
    pub color: Option<[f64; 4]>,
}

/// Mass and its distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inertial {
    /// kg.
    pub mass: f64,
    /// Centre of mass and principal frame, relative to the link.
    pub placement: Placement,
    /// xx, xy, xz, yy, yz, zz in kg m^2, about the centre of mass in that frame.
    pub inertia: [f64; 6],
}

/// A rigid body of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Its name in the description.
    pub name: String,
    /// Unknown for links that are only frames.
    pub inertial: Option<Inertial>,
    /// What is seen.
    pub visual: Vec<Piece>,
    /// What collides.
    pub collision: Vec<Piece>,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointKind {
    /// Not at all.
    Fixed,
    /// Turns about its axis between limits; rad.
    Revolute,
    /// Turns about its axis without end; rad.
    Continuous,
    /// Slides along its axis; m.
    Prismatic,
}

/// What a joint can do; rad or m, per second, N m or N.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// Least position; minus infinity is written as the most negative number.
    pub lower: f64,
    /// Greatest position.
    pub upper: f64,
    /// Greatest speed.
    pub velocity: f64,
    /// Greatest torque or force.
    pub effort: f64,
    /// Greatest acceleration; `None` where the source names none.
    pub acceleration: Option<f64>,
    /// Greatest jerk; `None` where the source names none.
    pub jerk: Option<f64>,
}

/// A joint that follows another one: `position = multiplier * other + offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mimic {
    /// Index of the other joint.
    pub joint: u32,
    /// Factor.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
}

/// What connects two links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Its name in the description.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Index of the link it starts from.
    pub parent: u32,
    /// Index of the link it carries.
    pub child: u32,
    /// The child's frame at position zero, relative to the parent.
    pub origin: Placement,
    /// Unit vector in the child's frame.
    pub axis: [f64; 3],
    /// What it can do; `None` for fixed ones.
    pub limits: Option<JointLimits>,
    /// Whom it follows.
    pub mimic: Option<Mimic>,
}

/// A sphere of a robot's collision model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Index of its link.
    pub link: u32,
    /// Its middle, relative to the link; metres.
    pub center: [f64; 3],
    /// Metres.
    pub radius: f64,
}

/// A tree of links; parents before children, joint `i` carries the link it names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Its name in the description.
    pub name: String,
    /// The root first.
    pub links: Vec<Link>,
    /// In the order of the description, but for parents before children.
    pub joints: Vec<Joint>,
    /// Spheres that together cover the robot, for planning; empty where none were given.
    pub balls: Vec<Ball>,
    /// Pairs of links that may touch, by index, the lower first.
    pub touching: Vec<[u32; 2]>,
}

impl Robot {
    /// The link with this name.
    pub fn link(&self, name: &str) -> Option<u32> {
        self.links.iter().position(|l| l.name == name).map(|i| i as u32)
    }

    /// The joint with this name.
    pub fn joint(&self, name: &str) -> Option<u32> {
        self.joints.iter().position(|j| j.name == name).map(|i| i as u32)
    }
}
