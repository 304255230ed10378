//! Studies and fits: many runs of one workflow, compiled once. What varies is a parameter of the model; what is reported
//! or matched is looked at where the workflow's own names mean what they mean in it.

mod choose;
pub mod data;
mod draws;
mod lines;
mod paths;
mod reports;

pub use choose::choose;
pub use lines::{count_of, resolve};

use matterix_ir::Span;
use matterix_ir::study::{Fit, Study};

use crate::syntax::relocate::Relocate;

/// What many runs are for.
#[derive(Clone, Debug, PartialEq)]
pub enum Many {
    /// To see what becomes of what varies.
    Study(Study),
    /// To find what data say of parameters.
    Fit(Fit),
}

impl Relocate for Many {
    fn moved(&mut self, to: &dyn Fn(Span) -> Span) {
        match self {
            Many::Study(study) => {
                let free = study.varied.iter_mut().map(|varied| &mut varied.free.span);
                let reports = study.reports.iter_mut().map(|report| &mut report.span);
                free.chain(reports).chain([&mut study.span]).for_each(|span| span.moved(to));
            }
            Many::Fit(fit) => {
                let free = fit.estimates.iter_mut().map(|estimate| &mut estimate.free.span);
                let columns = fit.matches.iter_mut().map(|matched| &mut matched.column_span);
                let own = [&mut fit.span, &mut fit.data_span];
                free.chain(columns).chain(own).for_each(|span| span.moved(to));
            }
        }
    }
}
