//! Failures that leave a skill or a workflow without a word about them.

use std::collections::BTreeMap;

use matterix_ir::plan::{Caught, Plan, PlanStep, Step, StepId};
use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Clause, ClauseKind, Name, Sig};
use crate::names::verb_text;
use matterix_ir::listing::joined;

/// Names of failures, each with the first statement that it comes from.
type Escapes = BTreeMap<String, Span>;

/// Steps and where their statements may stand.
struct Body<'s> {
    steps: &'s [PlanStep],
    /// The text a reader can mend; what is called from there is told by the call.
    within: Span,
    /// Whether the `fail` statements of this text count.
    raised: bool,
}

/// What the body of a skill fails with but its `fails` does not name: a caller could not know.
pub fn undeclared(sig: &Sig, clauses: &[Clause], within: Span, steps: &[PlanStep], root: StepId) -> Option<Diagnostic> {
    let declared: Vec<_> = clauses.iter().filter_map(fails).flatten().map(|n| n.text.as_str()).collect();
    let mut escapes = Body { steps, within, raised: true }.escapes(root, within);
    escapes.retain(|name, _| !declared.contains(&name.as_str()));
    let at = *escapes.values().min()?;
    let verb = verb_text(&sig.verb);
    let headline = format!("`{verb}` may fail with {} but does not declare it", quoted(&escapes));
    let mut d = Diagnostic::error(codes::UNDECLARED_FAILURE, at, headline, "fails here");
    d = d.because(sig.span, "callers read its failures here");
    let names = escapes.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    let (title, place, text) = match clauses.iter().filter_map(fails).flatten().last() {
        Some(last) => (format!("add {} to its `fails`", quoted(&escapes)), last.span, format!(", {names}")),
        None => {
            let end = clauses.last().map_or(sig.span, |c| c.span);
            (format!("declare `fails {names}`"), end, format!("\n    fails {names}"))
        }
    };
    let end = Span { start: place.end, ..place };
    Some(d.help("declare it with `fails`, or handle it with `on NAME { }` after the steps").guess(title, end, text))
}

/// What ends a workflow because it has no handler: known to whoever wrote it, or not.
pub fn unhandled(plan: &Plan, name: Span, within: Span) -> Option<Diagnostic> {
    let escapes = Body { steps: &plan.steps, within, raised: false }.escapes(plan.root, within);
    let at = *escapes.values().min()?;
    let headline = format!("`{}` has no handler for {}", plan.workflow, quoted(&escapes));
    let d = Diagnostic::advice(codes::UNHANDLED_FAILURE, at, headline, "may fail here");
    Some(
        d.because(name, "the workflow ends then, after its `finally`")
            .help("add `on NAME { }` or `on failure { }` where the run can continue"),
    )
}

/// The failures that a clause declares.
pub(crate) fn fails(clause: &Clause) -> Option<&Vec<Name>> {
    match &clause.kind {
        ClauseKind::Fails(names) => Some(names),
        _ => None,
    }
}

fn quoted(escapes: &Escapes) -> String {
    let names: Vec<String> = escapes.keys().map(|n| format!("`{n}`")).collect();
    joined(&names, "and")
}

impl Body<'_> {
    /// The failures that leave a step: those that devices report and steps raise, but for the executor's own.
    fn escapes(&self, id: StepId, site: Span) -> Escapes {
        let Some(node) = self.steps.get(id.0 as usize) else { return Escapes::new() };
        let own = node.span.file == self.within.file
            && node.span.start >= self.within.start
            && node.span.end <= self.within.end
            && !node.span.is_empty();
        let site = if own { node.span } else { site };
        match &node.step {
            Step::Operation(o) => o.fails.iter().map(|name| (name.clone(), site)).collect(),
            // One without a name is for `on failure` alone.
            Step::Fail { name, .. } if name != "failure" && (self.raised || !own) => {
                Escapes::from([(name.clone(), site)])
            }
            Step::Guarded { body, handlers, finally } => {
                let mut open = self.escapes(*body, site);
                let mut out = Escapes::new();
                for (caught, handler) in handlers {
                    let takes =
                        |name: &str| matches!(caught, Caught::Any) || *caught == Caught::Named(name.to_string());
                    let taken: Escapes;
                    (taken, open) = open.into_iter().partition(|(name, _)| takes(name));
                    add(&mut out, self.escapes(*handler, site));
                    // When its turns are used up, the failure goes on.
                    if self.retries(*handler) {
                        add(&mut out, taken);
                    }
                }
                add(&mut out, open);
                finally.iter().for_each(|f| add(&mut out, self.escapes(*f, site)));
                out
            }
            Step::Try(alternatives) => alternatives.last().map(|s| self.escapes(*s, site)).unwrap_or_default(),
            step => {
                let mut out = Escapes::new();
                step.children().into_iter().for_each(|s| add(&mut out, self.escapes(s, site)));
                out
            }
        }
    }

    /// Whether a handler begins its body again.
    fn retries(&self, id: StepId) -> bool {
        let Some(node) = self.steps.get(id.0 as usize) else { return false };
        match &node.step {
            Step::Retry { .. } => true,
            // What stands in the handlers of a handler is theirs.
            Step::Guarded { body, .. } => self.retries(*body),
            step => step.children().into_iter().any(|s| self.retries(s)),
        }
    }
}

/// Adds failures, of the same name the first in the text.
fn add(out: &mut Escapes, more: Escapes) {
    for (name, span) in more {
        let first = out.entry(name).or_insert(span);
        *first = span.min(*first);
    }
}
