//! What an expression stands for once names are resolved.

use std::sync::Arc;

use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Unit};

use crate::ast::Name;
use crate::declare::{ReactionId, SpeciesId};
use crate::names::DeclId;
use crate::units::Dimension;

/// A number with its dimension.
#[derive(Clone, Debug, PartialEq)]
pub struct Num {
    /// Its SI value.
    pub node: NodeId,
    /// The dimension of a difference.
    pub dimension: Dimension,
    /// A point on a scale, not a difference.
    pub point: bool,
    /// The unit it was written in, for display.
    pub unit: Option<Arc<Unit>>,
    /// Written as one literal, so that `353 K` may stand for a temperature.
    pub literal: bool,
}

/// What an expression stands for.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Reported already; agrees with everything.
    Error,
    /// A quantity.
    Num(Num),
    /// A truth value.
    Bool(NodeId),
    /// A text.
    Text(String),
    /// One of some words, by its index.
    Enum(NodeId, Arc<[String]>),
    /// The name of a place of a grid, and where it is written.
    Place(Name),
    /// A row of a table, by its number.
    Row(DeclId, u32),
    /// `a .. b`, closed.
    Range(Box<Num>, Box<Num>),
    /// `(a, b, c)`.
    Tuple(Vec<Value>),
    /// `[a, b, c]`.
    List(Vec<Value>),
    /// An instance known when compiling.
    Instance(InstanceId),
    /// An instance known when running, by its index or -1.
    InstanceNode(NodeId),
    /// No instance.
    Nothing,
    /// A limit that never limits.
    Unlimited,
    /// A grid of child assets of an instance, by its position.
    Grid(InstanceId, usize),
    /// An instance seen as one of its capabilities: `plate.Heater`.
    Qualified(InstanceId, DeclId),
    /// A species.
    Species(SpeciesId),
    /// A lab included in this one, by its full name.
    Included(String),
    /// A reaction.
    Reaction(ReactionId),
    /// `v[S]` before a unit says which concentration is meant.
    Concentration(InstanceId, SpeciesId),
    /// A named point of an instance.
    Frame(InstanceId, String),
    /// A capability or asset type, standing for all its instances.
    Kind(DeclId),
    /// A solution.
    Solution(DeclId),
    /// What a vessel is made of.
    Material(DeclId),
    /// A function or relation, called by name.
    Function(DeclId),
    /// A named step of the plan: locals of its start and end time.
    Step(u32, u32),
    /// A function of the compiler on a value: `r.order`, `m.basis`.
    Method(Box<Value>, String),
}

impl Value {
    /// The instance that it is, if it is one that is known and named in full.
    pub fn instance(&self) -> Option<InstanceId> {
        if let Value::Instance(id) = self { Some(*id) } else { None }
    }

    /// A list without lists in it, in its order; anything else as a list of one.
    pub fn flat(self) -> Vec<Value> {
        match self {
            Value::List(items) => items.into_iter().flat_map(Value::flat).collect(),
            other => vec![other],
        }
    }

    /// What it is, for "expected ..., found ...".
    pub fn what(&self) -> &'static str {
        match self {
            Value::Error => "an error",
            Value::Num(n) if n.point => "a point on a scale",
            Value::Num(_) => "a quantity",
            Value::Bool(_) => "a truth value",
            Value::Text(_) => "a text",
            Value::Place(_) => "a place",
            Value::Row(..) => "a row of a table",
            Value::Enum(..) => "a word",
            Value::Range(..) => "a range",
            Value::Tuple(_) => "a tuple",
            Value::List(_) | Value::Grid(..) => "a list",
            Value::Instance(_) | Value::InstanceNode(_) | Value::Qualified(..) => "an instance",
            Value::Nothing => "nothing",
            Value::Unlimited => "`unlimited`",
            Value::Species(_) => "a species",
            Value::Included(_) => "an included lab",
            Value::Reaction(_) => "a reaction",
            Value::Concentration(..) => "a concentration",
            Value::Frame(..) => "a frame",
            Value::Kind(_) => "a type",
            Value::Solution(_) => "a solution",
            Value::Material(_) => "a material",
            Value::Step(..) => "a step",
            Value::Function(_) | Value::Method(..) => "a function",
        }
    }
}
