//! Robots that move: what they are made of, where everything is meanwhile, where they are to go and how they get there.

mod approach;
mod assembly;
mod drive;
mod effort;
pub mod exact;
mod fall;
pub mod fingers;
pub mod fixture;
pub mod flight;
mod gantry;
pub mod goal;
mod hands;
mod lead_in;
mod led;
mod load;
mod outline;
pub mod perform;
mod perturb;
mod postures;
mod preflight;
mod regrip;
pub mod stage;
pub mod surroundings;
mod swing;
mod tilt;
mod together;
mod turn;

pub use assembly::Assembly;
pub use fixture::Fixture;
pub use perform::{Meeting, Moment, Part, Performed, Refused};
pub use perturb::{Moved, Perturbation, perturb};
pub use preflight::{Nowhere, Store, preflight, supported};
pub use stage::{Actor, Carried, Stage};
pub use together::together;
