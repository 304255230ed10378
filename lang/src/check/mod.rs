//! What would go wrong, one family of checks a file.

use std::collections::BTreeMap;
use std::sync::Arc;

mod consequences;
mod declarations;
mod failures;
mod flow;
mod ignored;
mod kinetics;
mod mixing;
mod returns;
mod start;
#[cfg(test)]
mod tests;
mod time;
mod unused;

use matterix_ir::model::{Derivative, Event};
use matterix_ir::plan::Plan;
use matterix_ir::{Diagnostic, NodeId, Sources, Span, codes};

use self::flow::Window;
pub use self::flow::{AbstractValue, After, Seen, forbidden_on_any_way};
use crate::declare::ReactionId;
use crate::declare::Tables;
use crate::elaborate::hazards::Hazard;
use crate::eval::lab::Elaborator;
use crate::eval::lab::reach::Reach;
use crate::names::DeclId;
use crate::parallel;
use crate::semantic_index::Seeing;

pub use consequences::without_consequences;
pub use declarations::{bind, declarations, declarations_and};
pub use failures::{beyond, idle};
pub use unused::{Uses, reagents, things, uses};

/// Checks a lab that no workflow of its file uses, and notes what names mean where that is asked for.
pub fn lab(tables: &Tables<'_>, id: DeclId, seeing: &mut Seeing) -> Vec<Diagnostic> {
    let mut reach = Reach::default();
    loop {
        let mut lab = Elaborator::new(tables, reach.clone());
        lab.meanings = seeing.take();
        lab.open_parameters = true;
        lab.lab(id);
        lab.initialise();
        lab.targets.close();
        let events = lab.events();
        lab.targets.close();
        lab.processes();
        drop(events);
        lab.note_things(id);
        *seeing = lab.meanings.take();
        let next = Reach::compute(&lab);
        if next == reach {
            mixing::contents(&mut lab);
            lab.judge_standing();
            return lab.diagnostics;
        }
        reach = next;
    }
}

/// Checks the flattened model, and whether things stand where the lab puts them.
pub fn model(lab: &mut Elaborator<'_>) {
    kinetics::rates(lab);
    lab.judge_standing();
    start::unsolved(lab);
}

pub use kinetics::{Starts, never_starts, starts};

/// What comes of a plan beside its findings.
#[derive(Default)]
pub struct Judged {
    /// Between which temperatures each reaction can go on; nothing where the plan was not followed.
    pub windows: Option<BTreeMap<ReactionId, Window>>,
    /// What is known of the nodes that were asked for, at the start and at every statement.
    pub seen: Vec<Seen>,
    /// The hazards of the lab; none where contents and transfers are not right.
    pub hazards: Option<Arc<[Hazard]>>,
}

/// A plan in its lab, with the laws that hold there: what each analysis looks at, and none changes.
#[derive(Clone, Copy)]
pub struct Subject<'l, 'a> {
    /// The lab.
    pub lab: &'l Elaborator<'a>,
    /// The texts that both come from.
    pub sources: &'l Sources,
    /// The plan.
    pub plan: &'l Plan,
    /// The rates of change of the lab's states.
    pub derivatives: &'l [Derivative],
    /// What happens by itself.
    pub events: &'l [Event],
}

/// Checks the plan against what is known before the run, and tells what is known of the nodes in `asked`.
pub fn plan(
    lab: &mut Elaborator<'_>,
    sources: &Sources,
    plan: &Plan,
    derivatives: &[Derivative],
    events: &[Event],
    asked: Option<&[NodeId]>,
) -> Judged {
    // What is not whole cannot be followed.
    let whole = |d: &Diagnostic| !d.is_error() || matches!(d.code.family, "S1" | "H1" | "M1");
    let is_whole = lab.diagnostics.iter().all(whole);
    let ready = mixing::ready(lab);
    let hazards = ready.as_ref().map(mixing::Ready::hazards);
    let subject = Subject { lab, sources, plan, derivatives, events };
    let meets = move || ready.map_or_else(Vec::new, |ready| mixing::mixing(subject, ready));
    let takes = || time::plan(subject, time::Told::default());
    let dangers = hazards.as_deref().unwrap_or_default();
    let follow = || is_whole.then(|| flow::check(subject, dangers, asked));
    let (met, (taken, followed)) = match plan.steps.len() >= LARGE {
        true => parallel::join(meets, || parallel::join(takes, follow)),
        false => (meets(), (takes(), None)),
    };
    met.into_iter().for_each(|d| lab.report(d));
    if !lab.diagnostics.iter().chain(&taken).all(whole) {
        taken.into_iter().for_each(|d| lab.report(d));
        return Judged { hazards, ..Judged::default() };
    }
    let subject = Subject { lab, sources, plan, derivatives, events };
    let follow = || flow::check(subject, dangers, asked);
    let flow::Followed { found, windows, seen, lasting, never } = followed.unwrap_or_else(follow);
    // Times are compared again where following the plan tells how long steps last.
    let again = |met: &[[Span; 2]]| time::plan(subject, time::Told { lasting: &lasting, met, never: &never });
    let clashes = |d: &Diagnostic| d.code == codes::CLAIMED_TWICE;
    let vain = !never.is_empty() && taken.iter().any(clashes);
    let mut taken = if lasting.is_empty() && !vain { taken } else { again(&[]) };
    // Where the order of all steps is known, nothing is in doubt.
    let doubted = |d: &Diagnostic| clashes(d) && !d.is_error();
    if taken.iter().all(|d| !d.is_error()) && taken.iter().any(doubted) {
        match flow::turns(subject) {
            flow::Turns::Taken => taken.retain(|d| !doubted(d)),
            flow::Turns::Clash(met) => taken = again(&[met]),
            flow::Turns::Unknown => {}
        }
    }
    // What the order of the text brings about is said already.
    let is_said = |d: &Diagnostic| {
        dangers.iter().any(|h| h.code() == d.code)
            && lab.diagnostics.iter().any(|m| m.code == d.code && (m.span() == d.span() || m.headline == d.headline))
    };
    let found: Vec<Diagnostic> = found.into_iter().filter(|d| !is_said(d)).collect();
    for d in taken.into_iter().chain(found) {
        lab.report(d);
    }
    Judged { windows: Some(windows), seen, hazards }
}

/// Plans of fewer steps are judged faster by one thread than a second one starts.
const LARGE: usize = 300;
