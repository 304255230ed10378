//! Files that others run, from a workflow that has been performed once on the digital twin.
//!
//! A file is a list of what is done: it has no branches. What is written is therefore the course of one performance, and
//! only where nothing that is measured decides that course ([`course`]). What devices are told is said by their drivers in
//! the language ([`matterix_ir::wire`]); here is only what a format asks for.

// A finding ends the writing: how many bytes it is returned in is of no account.
#![allow(clippy::result_large_err)]

pub mod course;
pub mod finding;
pub mod opentrons;
pub mod performance;
mod place;
pub mod robots;
pub mod steps;

pub use performance::Performance;

use matterix_ir::script::Wiring;
use matterix_ir::{Diagnostic, Program, Sources};

/// What a performance is written from.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'p> {
    /// The workflow in its lab.
    pub program: &'p Program,
    /// What devices are told.
    pub wiring: &'p Wiring,
    /// Its text.
    pub sources: &'p Sources,
}

/// The bytes of a file with warnings, or what keeps it from being written.
pub type Written = Result<(Vec<u8>, Vec<Diagnostic>), Vec<Diagnostic>>;
