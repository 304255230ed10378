//! Studies and fits: many runs of one workflow, compiled once. What varies is a parameter of the model; what is reported
//! or matched is looked at where the workflow's own names mean what they mean in it.

mod choose;
pub mod data;
mod draws;
mod lines;
mod open;
mod paths;
mod reports;

pub use choose::choose;
pub use lines::{count_of, resolve};
pub use open::Open;

use matterix_ir::study::{Fit, Study};

/// What many runs are for.
#[derive(Clone, Debug, PartialEq)]
pub enum Many {
    /// To see what becomes of what varies.
    Study(Study),
    /// To find what data say of parameters.
    Fit(Fit),
}
