//! What would go wrong, one family of checks a file.

mod consequences;
mod declarations;
mod ignored;
mod kinetics;
mod needs;

use matterix_ir::Diagnostic;

use crate::elaborate::reach::Reach;
use crate::elaborate::{Elaborator, Tables};
use crate::names::DeclId;

pub use consequences::without_consequences;
pub use declarations::{bind, declarations};

/// Checks a lab that no workflow of its file uses.
pub fn lab(tables: &Tables<'_>, id: DeclId) -> Vec<Diagnostic> {
    let mut reach = Reach::default();
    loop {
        let mut lab = Elaborator::new(tables, reach.clone());
        lab.lab(id);
        lab.initialise();
        let events = lab.events();
        lab.processes();
        drop(events);
        let next = Reach::compute(&lab);
        if next == reach {
            return lab.diagnostics;
        }
        reach = next;
    }
}

/// Checks the flattened model.
pub fn model(lab: &mut Elaborator<'_>) {
    kinetics::rates(lab);
}

pub use kinetics::{Starts, never_starts, starts};

/// Checks the plan against what is known before the run.
pub fn plan(lab: &mut Elaborator<'_>, plan: &matterix_ir::plan::Plan) {
    needs::constant(lab, plan);
}
