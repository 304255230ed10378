//! The `.mtx` compiler front end: text to a checked [`matterix_ir::Program`]. Pure: no files, no clock, no printing.
//!
//! The stages are functions from one representation to the next that return their findings beside the result:
//! [`syntax`] text to tree, [`names`] modules and scopes, [`declare`] what a package says, for lookups, [`eval`] expressions and the lab
//! that they ask about, [`elaborate`] what holds over that lab, as one flat model, [`lower`] the workflow as a plan,
//! [`check`](mod@check) what would go wrong. [`fmt`] writes text in its one style.

mod calibration;
pub mod catalogue;
pub mod check;
pub mod chem;
pub mod declare;
pub mod elaborate;
mod escapes;
pub mod eval;
mod fixpoint;
mod hints;
pub mod import;
pub mod inventory;
mod labs;
pub mod labware;
pub mod library;
pub mod load;
pub mod loader;
pub mod lower;
pub mod names;
mod near;
mod parallel;
pub mod program;
pub mod program_points;
pub mod prose;
pub mod reference;
pub mod semantic_index;
mod session;
mod sheet;
mod sila;
mod stop;
mod study;
mod supposed;
pub mod task;
pub mod units;

pub use matterix_syntax::{self as syntax, ast, fmt};

pub use calibration::{Calibration, Gauged};
pub use loader::{LibraryOnly, Loader};
pub use lower::Wires;
pub use program::{Compiled, Options, Test, check, check_and, compile, contents, document, many_runs, script, tests};
pub use semantic_index::{Meanings, SemanticIndex};
pub use session::{Foreseen, Session};
pub use stop::Stop;
pub use study::Many;
