//! Feature definitions of SiLA 2 (Standardization in Lab Automation; part A, 1.1): read from their XML, and written.

pub mod feature;
pub mod form;
mod read;
pub mod words;
mod write;

pub use feature::Feature;
pub use read::{MOST_BYTES, Problem, read};
pub use write::write;
