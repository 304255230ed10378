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
    /// What declarations say to people.
    #[serde(default)]
    pub about: Vec<About>,
}

impl Offers {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.commands.is_empty() && self.shown.is_empty()
    }

    /// The text of a device's asset, of a capability that it has, or of the lab; empty where the declaration has none.
    pub fn docs(&self, device: Option<InstanceId>, capability: &str) -> &str {
        let found = self.about.iter().find(|a| a.device == device && a.capability == capability);
        found.map_or("", |a| a.docs.as_str())
    }
}

/// The documentation comment of a declaration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The device; nothing for the lab.
    pub device: Option<InstanceId>,
    /// The capability; empty for the device's asset and for the lab.
    pub capability: String,
    /// Its text.
    pub docs: String,
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
    /// The number it returns.
    pub result: Option<Kind>,
    /// Failures it may end with.
    pub fails: Vec<Failure>,
}

/// A failure that a command may end with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// As in `fails jammed`.
    pub name: String,
    /// How to mend it, where the text says so.
    pub help: Option<String>,
}

/// What a command is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// `t`.
    pub name: String,
    /// What values it takes.
    pub kind: Kind,
    /// Its type as written.
    pub declared: String,
    /// The least and the greatest number that its needs allow, SI.
    pub bounds: Bounds,
}

/// An interval of numbers, SI; without an end where nothing bounds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// The least.
    pub least: Option<Bound>,
    /// The greatest.
    pub greatest: Option<Bound>,
}

/// An end of an interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// SI.
    pub number: f64,
    /// Whether the number itself lies outside.
    pub is_open: bool,
}

impl Bounds {
    /// The numbers that lie in both.
    pub fn and(self, other: Bounds) -> Bounds {
        Bounds {
            least: tighter(self.least, other.least, |a, b| a > b),
            greatest: tighter(self.greatest, other.greatest, |a, b| a < b),
        }
    }

    /// The smallest interval around both.
    pub fn around(self, other: Bounds) -> Bounds {
        Bounds {
            least: looser(self.least, other.least, |a, b| a < b),
            greatest: looser(self.greatest, other.greatest, |a, b| a > b),
        }
    }
}

fn tighter(a: Option<Bound>, b: Option<Bound>, inside: fn(f64, f64) -> bool) -> Option<Bound> {
    match (a, b) {
        (Some(a), Some(b)) if a.number == b.number => Some(Bound { is_open: a.is_open || b.is_open, ..a }),
        (Some(a), Some(b)) => Some(if inside(a.number, b.number) { a } else { b }),
        (a, b) => a.or(b),
    }
}

fn looser(a: Option<Bound>, b: Option<Bound>, outside: fn(f64, f64) -> bool) -> Option<Bound> {
    let (a, b) = (a?, b?);
    Some(match a.number == b.number {
        true => Bound { is_open: a.is_open && b.is_open, ..a },
        false if outside(a.number, b.number) => a,
        false => b,
    })
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
    /// The local of the plan that receives its result.
    pub result: Option<u32>,
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
