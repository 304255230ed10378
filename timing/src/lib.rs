//! When the steps of a plan can happen.
//!
//! Compiler and runtime read a plan's times through the same eyes: what a node of the graph is worth before a run
//! ([`value`]), which differences of times must hold ([`network`]), what follows for every step ([`walk`]), who uses
//! and who claims which instance ([`usage`]).

mod counted;
pub mod interval;
pub mod network;
pub mod usage;
pub mod value;
pub mod walk;

pub use interval::Interval;
pub use matterix_ir::quantity::ROUNDING;
pub use network::{Edge, Network, Point, Reason, Scope, Why};
pub use value::{Known, Linear};
pub use walk::{Timing, Visit};
