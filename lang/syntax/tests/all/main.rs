//! Tests of the whole crate.

mod blocks;
mod generator;
mod limits;
mod nested;
mod properties;
mod recovery;
mod spec;
mod trees;
