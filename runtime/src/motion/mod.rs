//! Robots that move: what they are made of, where everything is meanwhile, where they are to go and how they get there.

pub mod assembly;
mod drive;
pub mod fixture;
mod gantry;
pub mod goal;
mod known;
pub mod perform;
mod preflight;
pub mod stage;
pub mod surroundings;

pub use assembly::Assembly;
pub use fixture::Fixture;
pub use perform::{Meeting, Moment, Part, Performed, Refused};
pub use preflight::{preflight, supported};
pub use stage::{Actor, Carried, Stage};
