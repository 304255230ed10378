//! What a recording says of bodies: their true shapes and how robots are jointed, for whoever judges or shows it later.

use serde::{Deserialize, Serialize};

use crate::pose::Pose;
use crate::robot::{Inertial, Robot};
use crate::scene::{Shape, Solid};

/// All bodies of a lab.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bodies {
    /// What has a shape.
    pub things: Vec<Thing>,
    /// What has joints.
    pub machines: Vec<Machine>,
    /// What has a place of its own.
    #[serde(default)]
    pub standing: Vec<Standing>,
}

/// A thing that is no part of another one and of which the lab says where it stands when the run begins.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Full name.
    pub name: String,
    /// What it stands on, then what that is a part of or stands on, down to the lab; full names.
    pub carriers: Vec<String>,
    /// Whether the text gives its place on that; else it is somewhere on it, or where there is one place only.
    pub told: bool,
    /// Whether it can be gripped or has joints.
    pub loose: bool,
}

/// A rigid thing; where it is, the recording tells under its name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Thing {
    /// Full name.
    pub name: String,
    /// The outermost thing it is a part of; itself, if of none.
    pub whole: String,
    /// Its body, from the middle of its base.
    pub shape: Option<Shape>,
    /// More of it.
    pub solids: Vec<Solid>,
    /// What others run into instead of it; the body itself where there is nothing here.
    #[serde(default)]
    pub collision: Vec<Solid>,
    /// What is seen instead of it; the body itself where there is nothing here.
    #[serde(default)]
    pub visual: Option<Shape>,
    /// Its mass, empty, and how that is distributed, if both are known.
    #[serde(default)]
    pub inertial: Option<Inertial>,
    /// Coefficient of friction of its surface, if that is known.
    #[serde(default)]
    pub friction: Option<f64>,
    /// What its parts take out of it.
    #[serde(default)]
    pub rooms: Vec<Solid>,
    /// Whether its shape is only what it takes out of what it is a part of.
    #[serde(default)]
    pub hollow: bool,
}

impl Thing {
    /// What others run into.
    pub fn hull(&self) -> impl Iterator<Item = (&Shape, Pose)> {
        let own = self.collision.is_empty();
        let main = self.shape.iter().filter(move |_| own).map(|shape| (shape, Pose::IDENTITY));
        let more = if own { &self.solids } else { &self.collision };
        main.chain(more.iter().map(|solid| (&solid.shape, solid.pose)))
    }
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
