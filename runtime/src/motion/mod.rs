//! Robots that move: what they are made of, where everything is meanwhile, where they are to go and how they get there.

pub mod assembly;
pub mod exact;
pub mod goal;
pub mod perform;
mod preflight;
pub mod stage;
pub mod surroundings;

pub use assembly::Assembly;
pub use perform::{Meeting, Moment, Performed, Refused};
pub use preflight::{preflight, supported};
pub use stage::{Actor, Carried, Stage};
