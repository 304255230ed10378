//! Tests of the whole crate.

mod fmt_spec;
mod screen;
mod syntax_generator;
mod syntax_limits;
mod syntax_nested;
mod syntax_properties;
mod syntax_recovery;
mod syntax_trees;
mod vessels;
