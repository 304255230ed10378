//! A lab as a server: its devices are features, what they can be told are commands, what they show are properties.

mod desk;
mod features;
mod paced;
mod values;

pub use desk::{Attendant, Desk};
pub use features::{Catalogue, catalogue};
pub use paced::Paced;
