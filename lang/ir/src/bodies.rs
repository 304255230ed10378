//! What a recording says of bodies: their true shapes and how robots are jointed, for whoever judges or shows it later.

use serde::{Deserialize, Serialize};

use crate::robot::Robot;
use crate::scene::{Shape, Solid};

/// All bodies of a lab.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bodies {
    /// What has a shape.
    pub things: Vec<Thing>,
    /// What has joints.
    pub machines: Vec<Machine>,
}

/// A rigid thing; where it is, the recording tells under its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thing {
    /// Full name.
    pub name: String,
    /// The outermost thing it is a part of; itself, if of none.
    pub whole: String,
    /// Its body, from the middle of its base.
    pub shape: Option<Shape>,
    /// More of it.
    pub solids: Vec<Solid>,
    /// What its parts take out of it.
    #[serde(default)]
    pub rooms: Vec<Solid>,
    /// Whether its shape is only what it takes out of what it is a part of.
    #[serde(default)]
    pub hollow: bool,
}

/// A robot with the tools mounted on it; where its links are, the recording tells as `NAME.LINK`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Full name.
    pub name: String,
    /// Links, joints, limits; the joints that move by themselves are recorded in this order.
    pub robot: Robot,
    /// The link that is brought to goals.
    pub tip: u32,
    /// Links from this one on are of tools.
    pub tools: u32,
}
