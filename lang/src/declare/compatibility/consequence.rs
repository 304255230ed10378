//! What happens when things meet that should not: the words of the language for it.

use matterix_ir::Severity;

/// A consequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Consequence(usize);

/// Name in the text, in words, and how bad it is: what hurts people or ends the experiment is an error.
const TABLE: &[(&str, &str, Severity)] = &[
    ("explosion", "an explosion", Severity::Error),
    ("toxic_gas", "toxic gas", Severity::Error),
    ("fire", "fire", Severity::Error),
    ("flammable_gas", "flammable gas", Severity::Error),
    ("polymerisation", "violent polymerisation", Severity::Error),
    ("violent", "a violent reaction", Severity::Error),
    ("dissolving", "the wall dissolves", Severity::Error),
    ("etching", "the wall is etched", Severity::Error),
    ("heat", "heat", Severity::Warning),
    ("gas", "gas", Severity::Warning),
    ("toxic_solution", "a toxic substance goes into solution", Severity::Warning),
    ("softening", "the wall softens or cracks", Severity::Warning),
    ("unknown", "a hazard that is not known in detail", Severity::Warning),
];

impl Consequence {
    /// By its name in the text.
    pub fn named(name: &str) -> Option<Consequence> {
        TABLE.iter().position(|t| t.0 == name).map(Consequence)
    }

    /// Every name.
    pub fn names() -> impl Iterator<Item = &'static str> {
        TABLE.iter().map(|t| t.0)
    }

    /// In words.
    pub fn words(self) -> &'static str {
        TABLE[self.0].1
    }

    /// How bad it is.
    pub fn severity(self) -> Severity {
        TABLE[self.0].2
    }
}
