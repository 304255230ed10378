//! Databases of PHREEQC (Parkhurst and Appelo, U.S. Geological Survey Techniques and Methods 6-A43, 2013): dissolved species with constants,
//! enthalpies, analytic expressions and activity coefficients, and solid phases.
//!
//! Numbers of Pitzer's law become `interaction` items.
//!
//! Each species that a reaction defines becomes an `equilibrium`, and a `species` where the library has none of its formula. Reactions with
//! electrons are left out: each state of oxidation counts as an element of its own. So are gases, and what is bound to surfaces or
//! exchangers.

mod database;
mod interactions;
mod lines;
mod names;
mod write;

use std::collections::BTreeSet;

use crate::{Imported, Mistake};

/// What is wanted of a database.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Elements beside hydrogen and oxygen; all where there are none.
    pub elements: BTreeSet<String>,
    /// Solid phases, as the database calls them.
    pub phases: BTreeSet<String>,
}

/// The module that a database makes; `title` is how it is called there.
///
/// # Errors
/// The first line that cannot be read, or an element or phase that is wanted and not there.
pub fn import(text: &str, title: &str, wanted: &Wanted) -> Result<Imported, Mistake> {
    let database = database::read(text)?;
    database.has(wanted)?;
    write::module(&database, title, wanted)
}

#[cfg(test)]
mod tests;
