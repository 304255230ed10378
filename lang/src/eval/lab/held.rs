//! What the lab says its vessels hold.

use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Span};

use crate::declare::SpeciesId;
use crate::eval::Num;
use crate::names::DeclId;

/// A term of a `holding`, as the lab noted it.
#[derive(Clone, Debug)]
pub struct Held {
    /// The mixture.
    pub mixture: Option<InstanceId>,
    /// The species or solution.
    pub substance: String,
    /// The declaration of a solution.
    pub solution: Option<DeclId>,
    /// As written.
    pub quantity: Num,
    /// mol, or kg where counted by mass.
    pub amounts: Vec<(SpeciesId, NodeId)>,
    /// Where it is written.
    pub span: Span,
}
