//! What is known before the run at every point of a plan: what vessels hold, how devices stand, how much time has passed.
//!
//! Every value holds for each run in which devices do what they are told, however often a statement is done and
//! whichever way leads to it: turns of a loop and branches are joined.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::scene::InstanceId;
use crate::{Span, Unit};

/// Version of the serialised form; it changes when a field is renamed, removed or changes its meaning.
pub const POINTS_VERSION: u32 = 1;

/// What is known at every point of one workflow in one lab.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Points {
    /// [`POINTS_VERSION`].
    pub version: u32,
    /// Name of the workflow.
    pub workflow: String,
    /// Name of the lab.
    pub lab: String,
    /// Every thing of which something is known that can change, at the start; in the order of the lab.
    pub start: Arc<Vec<Thing>>,
    /// One per statement, in the order of the text.
    pub points: Vec<Point>,
}

/// A statement and what is known after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The statement.
    pub span: Span,
    /// As shown, without what stands in its block.
    pub label: String,
    /// Whether a way that was followed leads to it.
    pub reached: bool,
    /// Whether it is done several times, as in a loop: what is known holds after each of them.
    pub repeated: bool,
    /// Whether other statements stand in it.
    pub block: bool,
    /// Absent where no way that was followed goes on behind it.
    pub after: Option<Arc<After>>,
}

/// What is known after a statement, whichever of the times it was done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct After {
    /// Time since the beginning of the run, with durations as declared.
    pub elapsed: Value,
    /// Values that the plan keeps and that the statement has set: `first`, `grow.end`.
    pub kept: Vec<Fact>,
    /// All things, in the order of [`Points::start`].
    pub things: Vec<Thing>,
}

/// What is known of an instance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thing {
    /// Its number in the scene.
    pub instance: InstanceId,
    /// Its full name: `hotplate`, `beaker.contents`.
    pub name: String,
    /// States and derived quantities by name of the member: `target`, `tip`, `volume`, `temperature`.
    pub facts: Vec<Fact>,
    /// Amounts of the species that may be in it, by name.
    pub species: Vec<Fact>,
    /// Amounts at equilibrium of those of them that an equilibrium has.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub settled: Vec<Settled>,
    /// Reagents that it has touched or may have touched, where the library asks for that.
    pub reagents: Vec<Reagent>,
}

impl Thing {
    /// Whether the statement changes anything of it.
    pub fn changed(&self) -> bool {
        let facts = self.facts.iter().chain(&self.species);
        facts.chain(self.settled.iter().map(|s| &s.amount)).any(|f| f.changed)
            || self.reagents.iter().any(|r| r.changed)
    }
}

/// How much of a species there is at equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settled {
    /// Its amount.
    pub amount: Fact,
    /// Whether it is a solid beside the solution.
    pub solid: bool,
}

/// One thing that is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact {
    /// What it is about.
    pub name: String,
    /// What is known.
    pub value: Value,
    /// Whether the statement changes it.
    pub changed: bool,
    /// Whether it may be outside the range of its model: the value is then not to be relied on.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub outside: bool,
}

/// A reagent that a mixture has touched since it was last clean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reagent {
    /// What it was called where it was brought in.
    pub name: String,
    /// Whether it has for certain.
    pub certain: bool,
    /// Whether the statement changes that.
    pub changed: bool,
}

/// What is known of a value. Quantities are SI; the unit is the one to show them in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// This quantity.
    Exact(f64, Unit),
    /// One of these, in rising order.
    OneOf(Vec<f64>, Unit),
    /// Not less than the first and not more than the second, as far as they are known; one is.
    Between(Option<f64>, Option<f64>, Unit),
    /// One of these words: `true`, `nothing`, the name of an instance; certain if it is the only one.
    Words(Vec<String>),
    /// Only a run can tell.
    Unknown,
}
