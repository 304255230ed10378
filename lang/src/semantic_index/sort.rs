//! What kind of value something is, apart from the lab in which it was evaluated.

use std::sync::Arc;

use crate::declare::Type;
use crate::names::DeclId;
use crate::units::Dimension;

/// What kind of value something is.
#[derive(Clone, Debug, PartialEq)]
pub enum Sort {
    /// Nothing is known.
    Any,
    /// A quantity: the dimension of a difference, and whether it is a point on a scale.
    Quantity(Dimension, bool),
    /// A truth value.
    Truth,
    /// A text.
    Text,
    /// One of these words.
    Word(Arc<[String]>),
    /// From one to another.
    Range(Box<Sort>),
    /// Several of different kinds.
    Tuple(Vec<Sort>),
    /// Several of one kind.
    List(Box<Sort>),
    /// A thing with all of these kinds; by its full name where it is one of a lab.
    Thing(Vec<DeclId>, Option<String>),
    /// A named point of a thing.
    Frame,
    /// Three numbers: red, green, blue.
    Color,
    /// A species.
    Species,
    /// A reaction.
    Reaction,
    /// What a vessel is made of.
    Material,
    /// A concentration whose kind is not said.
    Concentration,
    /// A recipe.
    Solution,
    /// A lab in a lab, by its full name.
    Lab(String),
    /// A capability or asset type itself.
    Kind(DeclId),
    /// A function or relation.
    Function(DeclId),
    /// A function of the compiler on a value.
    Method,
    /// A named step of a workflow.
    Step,
    /// A row of a table.
    Row(DeclId),
    /// No thing.
    Nothing,
    /// No limit.
    Unlimited,
}

impl Sort {
    /// A plain number.
    pub fn number() -> Sort {
        Sort::Quantity(Dimension::one(), false)
    }

    /// That of a type as it is declared.
    pub fn of_type(ty: &Type) -> Sort {
        match ty {
            Type::Any => Sort::Any,
            Type::Quantity { dimension, point, .. } => Sort::Quantity(dimension.clone(), *point),
            Type::Int => Sort::number(),
            Type::Bool => Sort::Truth,
            Type::Text => Sort::Text,
            Type::Place => Sort::Any,
            Type::Enum(words) => Sort::Word(words.clone()),
            Type::Species => Sort::Species,
            Type::Reaction => Sort::Reaction,
            Type::Material { .. } => Sort::Material,
            Type::Frame => Sort::Frame,
            Type::Color => Sort::Color,
            Type::Range(inner) => Sort::Range(Box::new(Sort::of_type(inner))),
            Type::List(inner) => Sort::List(Box::new(Sort::of_type(inner))),
            Type::Instance { kinds, .. } => Sort::Thing(kinds.to_vec(), None),
        }
    }

    /// What holds for another one as well: of a thing that is not always the same only its kinds, where they are.
    pub fn join(&mut self, other: Sort) {
        match (&mut *self, other) {
            (Sort::Any, known) => *self = known,
            (Sort::Nothing | Sort::Unlimited, known @ (Sort::Thing(..) | Sort::Quantity(..))) => *self = known,
            (Sort::Thing(kinds, name), Sort::Thing(others, other)) => {
                if *name != other {
                    *name = None;
                }
                // The stand-in that a declaration was checked with has the kinds that all have.
                if *kinds != others && others.len() == 1 && other.is_none() {
                    *kinds = others;
                }
            }
            (Sort::List(inner), Sort::List(other)) => inner.join(*other),
            (Sort::Quantity(dimension, _), Sort::Quantity(other, _)) if dimension.is_any() => *dimension = other,
            _ => {}
        }
    }
}

impl Sort {
    /// The declarations it names.
    pub(super) fn declared(&mut self) -> Vec<&mut DeclId> {
        match self {
            Sort::Thing(kinds, _) => kinds.iter_mut().collect(),
            Sort::Kind(id) | Sort::Function(id) | Sort::Row(id) => vec![id],
            Sort::Range(inner) | Sort::List(inner) => inner.declared(),
            Sort::Tuple(all) => all.iter_mut().flat_map(Sort::declared).collect(),
            _ => Vec::new(),
        }
    }
}
