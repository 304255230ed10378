//! What a lab offers to others: the commands of its devices and what is known of them, as data.

use serde::{Deserialize, Serialize};

use crate::plan::StepId;
use crate::scene::InstanceId;
use crate::{NodeId, Unit};

/// All of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Offers {
    /// Commands, by device and capability.
    pub commands: Vec<Offer>,
    /// Quantities, by device and capability.
    pub shown: Vec<Shown>,
}

impl Offers {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.commands.is_empty() && self.shown.is_empty()
    }
}

/// A command of a device, or a skill.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Offer {
    /// The device; nothing for a skill.
    pub device: Option<InstanceId>,
    /// What declares it: `Heater`; empty for a skill.
    pub capability: String,
    /// `stop heating`.
    pub verb: String,
    /// What its declaration says to people.
    pub docs: String,
    /// In the order of the declaration.
    pub parameters: Vec<Parameter>,
    /// What is done, for every arrangement of the things it is about.
    pub arrangements: Vec<Arranged>,
    /// Whether it takes time.
    pub lasts: bool,
    /// Failures it may end with.
    pub fails: Vec<String>,
}

/// What a command is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// `t`.
    pub name: String,
    /// What values it takes.
    pub kind: Kind,
}

/// A command with the things it is about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arranged {
    /// The things, in the order of the parameters that are things.
    pub things: Vec<InstanceId>,
    /// Locals of the plan for the other parameters, in their order.
    pub locals: Vec<u32>,
    /// The node of the plan.
    pub step: StepId,
}

/// A quantity of a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    /// The device.
    pub device: InstanceId,
    /// What declares it.
    pub capability: String,
    /// `temperature`.
    pub name: String,
    /// What its declaration says to people.
    pub docs: String,
    /// What values it has.
    pub kind: Kind,
    /// Its value.
    pub value: NodeId,
}

/// What values there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Kind {
    /// A number in a unit, which is a product of powers of base units where these are whole.
    Quantity {
        /// As people write it.
        unit: Unit,
        /// `kg`, 1; `s`, -2.
        bases: Option<Vec<(String, i32)>>,
    },
    /// A whole number.
    Whole,
    /// Yes or no.
    Truth,
    /// One of these, by its index.
    Words(Vec<String>),
    /// One of these things.
    Things(Vec<InstanceId>),
}
