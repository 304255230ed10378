//! Files of other programs as modules of the language.
//!
//! An importer says what it has left out and why; nothing is dropped in silence, and nothing is guessed.

pub mod opentrons;
pub mod phreeqc;

/// Why a file cannot be imported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// Line of the file, from 1; 0 where it is of no line.
    pub line: usize,
    /// What is wrong with it.
    pub why: String,
}

/// What a file has that its module has not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Line of the file, or number of the command, from 1.
    pub line: usize,
    /// As the file calls it.
    pub name: String,
    /// Why it is left out.
    pub why: String,
}

/// A module, and what it lacks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Imported {
    /// Text of the module.
    pub text: String,
    /// What is left out, in the order of the file.
    pub left_out: Vec<LeftOut>,
    /// Files that stand beside it, by name.
    pub files: Vec<(String, String)>,
}
