//! What a package declares, ready for lookups: kinds with what they inherit, units, species, reactions, what must not meet. Nothing here
//! belongs to a lab, and nothing is evaluated.

pub mod compatibility;
pub mod equilibria;
pub mod failures;
pub mod fields;
pub mod ids;
pub mod interactions;
pub mod kinds;
pub mod properties;
pub mod reactions;
pub mod species;
pub mod tables;
pub mod types;
pub mod units;

pub use ids::{ReactionId, SpeciesId};
pub use tables::{MemberRef, Tables};
pub use types::Type;
