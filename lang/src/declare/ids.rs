//! Indices into what is declared.

use serde::{Deserialize, Serialize};

/// A species, by its index in the species table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SpeciesId(pub u32);

/// A reaction (or the reverse of one), by its index in the reaction table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ReactionId(pub u32);
