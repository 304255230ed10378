//! How robots move: kinematics, collision checking, motion planning and time parametrisation.
//!
//! Everything is in SI units and 64-bit floats; a configuration is the positions of a chain's moving joints in
//! their order from the base.

pub mod chain;
mod forward;
mod halton;
pub mod inverse;
mod jacobian;
mod lanes;
pub mod meet;
pub mod plan;
pub mod pose;
pub mod spheres;
pub mod time;
pub mod touching;
pub mod variables;
mod vector;
pub mod world;

pub use chain::{Chain, Tree};
pub use pose::{Pose, placement};
pub use variables::{Malformed, Variable};
