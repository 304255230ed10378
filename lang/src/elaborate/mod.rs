//! Elaboration: a lab with the laws that hold over it, as one flat model: what is written in the lab, its contents, reactions, processes,
//! events, hazards and balances.

pub mod articulation;
pub mod balances;
mod conserve;
pub mod contents;
mod declared;
pub mod events;
pub mod hazards;
pub mod held_back;
pub mod include;
mod instants;
mod joints;
pub mod lab;
mod labels;
pub mod laws;
mod mended;
pub mod mixtures;
mod pairs;
pub mod prune;
pub mod solutions;
mod tuples;
mod whereabouts;
pub mod writes;

pub use declared::declared;
