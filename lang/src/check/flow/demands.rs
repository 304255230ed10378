//! What the plan itself asks of its steps: conditions that are kept, promises of skills, loops that end.

use matterix_ir::plan::{Comparison, Condition};
use matterix_ir::quantity::show_number;
use matterix_ir::undefined::{undefined, why};
use matterix_ir::{Code, NodeId, Span, codes};

use super::Flow;
use super::facts::Facts;
use super::report::shown;

impl Flow<'_, '_> {
    /// Looks whether what is kept still holds after an operation.
    pub(super) fn still_kept(&mut self, label: &str, facts: &Facts) {
        for condition in self.kept.clone() {
            if self.fails(condition, "broken", facts) {
                let label = self.called(label);
                let headline = format!("`{label}` breaks `{}`, which is kept here", condition.text);
                let about = Some((condition.span, "kept from here on"));
                self.asked_in_vain(codes::EXPECTATION_FAILED, headline, condition, about, facts);
            }
        }
    }

    /// Looks whether a skill has done what it promises.
    pub(super) fn promised(&mut self, label: &str, promises: &[Condition], facts: &Facts) {
        for promise in promises {
            if self.fails(promise, "promise", facts) {
                let label = self.called(label);
                let headline = format!("`{label}` promises `{}`, which does not hold at its end", promise.text);
                self.asked_in_vain(
                    codes::PROMISE_BROKEN,
                    headline,
                    promise,
                    Some((promise.span, "promised here")),
                    facts,
                );
            }
        }
    }

    /// Whether a number that the plan asks for is none, as something is divided by 0; reported.
    pub(super) fn without_value(&mut self, node: NodeId, span: Span, facts: &Facts) -> bool {
        if self.is_shared(node) {
            return false;
        }
        let graph = &self.lab.graph;
        let Some(at) = undefined(graph, node, &mut |n| self.eval(n, facts).exact()) else { return false };
        let headline = format!("this has no value: {}", why(graph.op(at)));
        let d = self.at_site(codes::NOT_A_NUMBER, headline, "asked for here".to_string(), self.doubt > 0);
        self.found(d, span);
        true
    }

    /// A loop that goes on at its last turn.
    pub(super) fn runs_out(&mut self, condition: &Condition, most: f64, facts: &Facts) {
        if self.fails_not(condition, "max", facts) {
            let turns = if most == 1.0 { "1 turn".to_string() } else { format!("{} turns", show_number(most)) };
            let headline = format!("`{}` still holds after {turns}, and the loop fails with `max`", condition.text);
            let mut is =
                |c: &Comparison| format!("`{}` is {}", c.text, shown(&self.eval(c.value, facts), |v| c.unit.show(v)));
            let said: Vec<String> = condition.compared.iter().map(&mut is).collect();
            let said = if said.is_empty() { "turns run out".to_string() } else { said.join(", ") };
            let d = self.at_site(codes::NOT_REACHED, headline, said, self.doubt > 0);
            let d = self.with_history(d, condition, facts);
            self.found(d.help("allow more turns, or say what happens then: `on max { }`"), condition.span);
        }
    }

    /// Whether a condition does not hold, nobody else may see to it, and nothing takes the failure that follows.
    fn fails(&mut self, condition: &Condition, failure: &str, facts: &Facts) -> bool {
        self.eval(condition.node, facts).truth() == Some(false)
            && !self.is_taken(failure)
            && !self.is_shared(condition.node)
    }

    /// The same of a condition that holds.
    fn fails_not(&mut self, condition: &Condition, failure: &str, facts: &Facts) -> bool {
        self.eval(condition.node, facts).truth() == Some(true)
            && !self.is_taken(failure)
            && !self.is_shared(condition.node)
    }

    /// A step as the reader wrote it.
    fn called(&self, label: &str) -> String {
        self.sites.last().filter(|s| s.calls).map_or(label.to_string(), |s| s.label.clone())
    }

    fn asked_in_vain(
        &mut self,
        code: Code,
        headline: String,
        condition: &Condition,
        about: Option<(Span, &str)>,
        facts: &Facts,
    ) {
        let measured = self.measured(condition, facts);
        let said = if measured.is_empty() { "not so here".to_string() } else { measured.join(", ") };
        let mut d = self.at_site(code, headline, said, self.doubt > 0);
        if let Some((span, label)) = about.filter(|(span, _)| *span != d.span()) {
            d = d.because(span, label);
        }
        let d = self.with_history(d, condition, facts);
        self.found(d, condition.span);
    }
}
