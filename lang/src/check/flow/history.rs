//! How what a condition looks at came to be what it is.

use matterix_ir::model::{Action, Domain};
use matterix_ir::plan::{Condition, Step, Term};
use matterix_ir::{Diagnostic, NodeId, Op, Span};

use super::Interpreter;
use super::report::STEPS_SHOWN;
use super::state::AbstractState;
use super::value::AbstractValue;

impl Interpreter<'_, '_> {
    /// Adds how the members a condition reads came to be what they are, in the order it happened.
    pub(super) fn with_history(&mut self, d: Diagnostic, condition: &Condition, facts: &AbstractState) -> Diagnostic {
        self.history_of(d, condition, facts, false)
    }

    /// The same; where it was `worded` what is so, only what happened is added.
    pub(super) fn history_of(
        &mut self,
        mut d: Diagnostic,
        condition: &Condition,
        facts: &AbstractState,
        worded: bool,
    ) -> Diagnostic {
        let (node, terms) = (condition.node, condition.terms.as_slice());
        let mut said: Vec<(Span, String)> = Vec::new();
        if terms.is_empty() {
            said = self.changes_behind(node, facts);
        }
        for term in terms {
            let mut steps = self.history(term, facts);
            if steps.is_empty() {
                steps = self.stood(term, facts);
            }
            if steps.is_empty() && !worded {
                let states = self.parts(term.node).states.clone();
                let owner = states.first().map(|s| self.lab.state_owner[*s as usize]);
                let value = self.eval(term.node, facts);
                let span = owner.map(|o| self.declared_at(o)).unwrap_or_default();
                if !span.is_empty() && value.why().is_none() {
                    let begun = self.start();
                    let since = if self.eval(term.node, &begun) == value { "from the start" } else { "by then" };
                    steps.push((span, format!("`{}` is {} {since}", term.name, self.show(&value, &term.domain))));
                }
            }
            steps.reverse();
            said.extend(steps);
        }
        said.dedup();
        for (span, text) in said {
            d = d.because(span, text);
        }
        d
    }

    /// Which things stand from the start where a member would be something else without them.
    fn stood(&mut self, term: &Term, facts: &AbstractState) -> Vec<(Span, String)> {
        let value = self.eval(term.node, facts);
        let mut without = facts.clone();
        let mut out = Vec::new();
        for state in self.parts(term.node).states.clone() {
            let at = state as usize;
            let Some(on) = facts.states[at].exact().filter(|v| *v >= 0.0) else { continue };
            let owner = self.lab.state_owner[at];
            let thing = &self.lab.instances[owner.0 as usize];
            let Some((word, below)) = thing.placed.first().filter(|(_, below)| f64::from(below.0) == on) else {
                continue;
            };
            if self.lab.states[at].domain != Domain::Instance {
                continue;
            }
            let there = std::mem::replace(&mut without.states[at], AbstractValue::Point(-1.0));
            let decides = self.eval(term.node, &without) != value;
            without.states[at] = there;
            if decides && out.len() < STEPS_SHOWN {
                let (name, below) = (self.lab.spoken_name(owner), self.lab.spoken_name(*below));
                out.push((self.declared_at(owner), format!("`{name}` is {word} `{below}` from the start")));
            }
        }
        out
    }

    /// The changes of states behind a condition that names no member itself, as one that calls a function.
    fn changes_behind(&mut self, node: NodeId, facts: &AbstractState) -> Vec<(Span, String)> {
        let mut order = self.order(node).to_vec();
        let mut said = Vec::new();
        let mut at = 0;
        while let Some(node) = order.get(at).copied() {
            at += 1;
            let Op::State(s) = self.lab.graph.op(node) else { continue };
            let state = &self.lab.states[s as usize];
            let term = Term { name: state.name.clone(), node, domain: state.domain.clone() };
            let lineage = self.lab.lineage.iter();
            let mut touched =
                lineage.flat_map(|(mixture, of)| of.iter().map(move |(reagent, s)| (*mixture, reagent, *s)));
            let touched = touched.find(|t| t.2 == s).map(|(mixture, reagent, _)| (mixture, reagent.clone()));
            let latest: Vec<_> = self.history(&term, facts).into_iter().take(1).collect();
            // What came from another thing has a story there.
            if touched.is_some()
                && let Some((span, _)) = latest.first()
            {
                let from = self.sources_of(s, *span);
                order.extend(from.into_iter().filter(|n| !order.contains(n)).collect::<Vec<_>>());
            }
            let latest = latest.into_iter();
            said.extend(latest.map(|(span, text)| match &touched {
                Some((mixture, reagent)) => (
                    span,
                    format!("`{}` has been in contact with `{reagent}` after this", self.lab.spoken_name(*mixture)),
                ),
                None => (span, text),
            }));
            if said.len() == STEPS_SHOWN {
                break;
            }
        }
        said.sort_by_key(|(span, _)| *span);
        said
    }

    /// What a statement looked at when it changed a state, other than that state.
    fn sources_of(&self, state: u32, statement: Span) -> Vec<NodeId> {
        let graph = &self.lab.graph;
        let mut out = Vec::new();
        for step in self.plan.steps.iter().filter(|s| s.span == statement) {
            let Step::Operation(operation) = &step.step else { continue };
            for action in operation.at_start.iter().chain(&operation.at_end) {
                if let Action::Assign { state: s, value, .. } = action
                    && *s == state
                {
                    let looked_at = graph.schedule([*value]);
                    out.extend(
                        looked_at.into_iter().filter(|n| matches!(graph.op(*n), Op::State(from) if from != state)),
                    );
                }
            }
        }
        out
    }

    /// The latest statements that changed a member, latest first, each once.
    pub(super) fn history(&mut self, term: &Term, facts: &AbstractState) -> Vec<(Span, String)> {
        let states = self.parts(term.node).states.clone();
        let mut then = facts.clone();
        let mut at = facts.history.clone();
        let mut steps: Vec<(Span, String)> = Vec::new();
        while let Some(event) = at {
            let concerned: Vec<_> = event.before.iter().filter(|(s, _)| states.contains(s)).cloned().collect();
            if !concerned.is_empty() {
                let after = self.eval(term.node, &then);
                for (state, before) in concerned {
                    then.states[state as usize] = before;
                }
                let told = event.span.is_empty() || steps.iter().any(|(s, _)| *s == event.span);
                if self.eval(term.node, &then) != after && !told {
                    if steps.len() == STEPS_SHOWN {
                        break;
                    }
                    let text = format!("{} after this", self.said(term, &after));
                    steps.push((event.span, text));
                }
            }
            at = event.earlier.clone();
        }
        steps
    }

    /// What a member is; of how much a mixture holds, which no state of its own says, that its vessel holds it.
    fn said(&self, term: &Term, value: &AbstractValue) -> String {
        let domain = match (&term.domain, value.exact()) {
            (Domain::Quantity(unit), Some(si)) => Domain::Quantity(unit.fit_for(si)),
            (domain, _) => domain.clone(),
        };
        let shown = self.show(value, &domain);
        let is_worked_out = !matches!(self.lab.graph.op(term.node), Op::State(_));
        let held = [".volume", ".mass"].into_iter().find_map(|member| term.name.strip_suffix(member));
        match held.filter(|_| is_worked_out) {
            Some(vessel) => format!("`{}` holds {shown}", vessel.strip_suffix(".contents").unwrap_or(vessel)),
            None => format!("`{}` is {shown}", term.name),
        }
    }
}
