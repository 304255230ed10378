//! What would go wrong, one family of checks a file.

use std::collections::BTreeMap;

mod consequences;
mod declarations;
mod flow;
mod ignored;
mod kinetics;
mod mixing;
mod time;

use matterix_ir::model::{Derivative, Event};
use matterix_ir::plan::Plan;
use matterix_ir::{Diagnostic, Severity, Sources};

use self::flow::Window;
use crate::elaborate::reach::Reach;
use crate::elaborate::{Elaborator, Tables};
use crate::eval::ReactionId;
use crate::names::DeclId;

pub use consequences::without_consequences;
pub use declarations::{bind, declarations};

/// Checks a lab that no workflow of its file uses.
pub fn lab(tables: &Tables<'_>, id: DeclId) -> Vec<Diagnostic> {
    let mut reach = Reach::default();
    loop {
        let mut lab = Elaborator::new(tables, reach.clone());
        lab.open_parameters = true;
        lab.lab(id);
        lab.initialise();
        let events = lab.events();
        lab.processes();
        drop(events);
        let next = Reach::compute(&lab);
        if next == reach {
            mixing::contents(&mut lab);
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
pub fn plan(
    lab: &mut Elaborator<'_>,
    sources: &Sources,
    plan: &Plan,
    derivatives: &[Derivative],
    events: &[Event],
) -> Option<BTreeMap<ReactionId, Window>> {
    mixing::mixing(lab, plan);
    time::plan(lab, plan, derivatives, events);
    // What is not whole cannot be followed.
    let whole = |d: &Diagnostic| d.severity != Severity::Error || matches!(d.code.family, "S1" | "H1" | "M1");
    if !lab.diagnostics.iter().all(whole) {
        return None;
    }
    let (found, windows) = flow::check(lab, sources, plan, events, derivatives);
    for d in found {
        lab.report(d);
    }
    Some(windows)
}
