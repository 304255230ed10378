//! Chemistry without diagnostics: formulas, structures, balances and templates with typed errors.

pub mod balance;
pub mod constants;
pub mod elements;
pub mod formula;
pub mod pattern;
pub mod rational;
pub mod species_name;
pub mod structure;
pub mod template;
mod template_run;

#[cfg(test)]
mod stdlib_tests;

pub use balance::{Imbalance, check as check_balance};
pub use elements::Element;
pub use formula::{Formula, FormulaError};
pub use pattern::Pattern;
pub use rational::Rational;
pub use species_name::{Phase, SpeciesName};
pub use structure::{Structure, StructureError};
pub use template::{Participant, TemplateError, check as check_template};
