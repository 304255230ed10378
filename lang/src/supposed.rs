//! What would go wrong with other values of a workflow's truth values and words: constants decide with the default, so a branch that
//! only another value takes is not followed. The workflow is judged once more for each other value, as if it had been given.

use matterix_ir::{Diagnostic, Severity, Span, codes};

use crate::check::forbidden_on_any_way;
use crate::eval::lab::choices::Choice;

/// So many other values are judged for one workflow.
const MOST_VALUES: usize = 16;

/// What is found with other values of `chosen`, the parameters that have their defaults, and was not found with those. `judge` gives
/// all that is found with one other value; nothing where it was told to stop. Where processors are `free` they share the values.
pub(crate) fn found(
    chosen: &[Choice],
    workflow: Span,
    usual: &[Diagnostic],
    free: bool,
    judge: impl Fn(&Choice) -> Option<Vec<Diagnostic>> + Sync,
) -> Option<Vec<Diagnostic>> {
    let others: Vec<Choice> = chosen.iter().flat_map(others).collect();
    let mut out: Vec<Diagnostic> = Vec::new();
    if others.len() > MOST_VALUES {
        let headline = format!("`check` tried only {MOST_VALUES} of {} other values of the parameters", others.len());
        let left: Vec<String> = others[MOST_VALUES..].iter().map(|c| format!("`{}: {}`", c.name, c.word)).collect();
        let said = format!("branches that only {} would take are not checked", left.join(" or "));
        out.push(Diagnostic::warning(codes::NOT_ANALYSED, workflow, headline, said));
    }
    let tried = &others[..others.len().min(MOST_VALUES)];
    let mut judged = if free { crate::parallel::map(tried, &judge) } else { Vec::new() }.into_iter();
    for other in tried {
        for d in judged.next().unwrap_or_else(|| judge(other))? {
            let known = |f: &Diagnostic| f.code == d.code && f.span() == d.span();
            if tells(&d) && !usual.iter().chain(&out).any(known) {
                out.push(with(d, other));
            }
        }
    }
    Some(out)
}

/// The values that a parameter does not have.
fn others(choice: &Choice) -> impl Iterator<Item = Choice> + '_ {
    let words = choice.words.iter().filter(|word| **word != choice.word);
    words.map(|word| Choice { word: word.clone(), ..choice.clone() })
}

/// Whether a finding is one for whoever gives the value. What is expected, never done or of no use may be so for the default.
fn tells(d: &Diagnostic) -> bool {
    let of_default = [codes::EXPECTATION_FAILED, codes::DEAD_BRANCH, codes::UNUSED, codes::NOT_ANALYSED];
    d.severity != Severity::Advice && !of_default.contains(&d.code)
}

/// A finding that holds with another value only: an error where it is one on any way.
fn with(mut d: Diagnostic, other: &Choice) -> Diagnostic {
    if !forbidden_on_any_way(d.code) {
        d.severity = Severity::Warning;
    }
    d.help(format!("this also happens with `{}` = `{}`", other.name, other.word))
}
