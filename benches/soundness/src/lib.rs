//! x
pub mod explore;
pub mod generate;
pub mod interpret;
pub mod judge;
pub mod plan;
pub mod print;
pub mod random;
pub mod world;
