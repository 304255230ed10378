//! The contract between compiler and runtime.

use serde::{Deserialize, Serialize};

use crate::inventory::Inventory;
use crate::model::Model;
use crate::offer::Offers;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::wire::Driver;

/// Version of the serialised form; a reader refuses any other.
pub const PROGRAM_VERSION: u32 = 1;

/// A checked workflow in its lab, ready to execute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Program {
    /// [`PROGRAM_VERSION`].
    pub version: u32,
    /// Names of the source files, by file id, for spans.
    pub files: Vec<String>,
    /// What there is.
    pub scene: Scene,
    /// How it evolves.
    pub model: Model,
    /// What is done.
    pub plan: Plan,
    /// What was brought in, and how to count what becomes of it.
    #[serde(default)]
    pub inventory: Inventory,
    /// How devices are spoken to, where that was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drivers: Vec<Driver>,
    /// What the lab offers to others, where that was asked for.
    #[serde(default, skip_serializing_if = "Offers::is_empty")]
    pub offers: Offers,
}
