//! What the plan itself asks of its steps: conditions that are kept, promises of skills, loops that end.

use matterix_ir::plan::{Comparison, Condition, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::undefined::{undefined, why};
use matterix_ir::{BinaryOp, Code, NodeId, Op, Span, codes};

use super::Interpreter;
use super::actions::Asked;
use super::report::shown;
use super::state::AbstractState;
use super::value::CLOSE;

/// Steps that a run takes at one moment, and no more.
const MOST_AT_ONCE: f64 = 100_000.0;

/// A moment behind another one, as a share of the time or of 1 s.
const BEHIND: f64 = 1e-6;

impl Interpreter<'_, '_> {
    /// Conditions that are must be true throughout and hold now: they end the step that is followed where they break.
    pub(super) fn may_break_here(&mut self, facts: &AbstractState) -> Vec<(NodeId, bool)> {
        // What is followed aside, or more closely, is no step that goes on.
        if self.unbroken.is_empty() || self.refinements > 0 || self.guards.is_empty() {
            return Vec::new();
        }
        let mut nodes: Vec<NodeId> = self.unbroken.iter().map(|(condition, _)| condition.node).collect();
        nodes.retain(|node| !self.is_shared(*node) && self.eval(*node, facts).truth() == Some(true));
        nodes.into_iter().map(|node| (node, false)).collect()
    }

    /// Whether it is the time `end`, s, and none of these is broken there, but would be beyond.
    pub(super) fn only_touches(&mut self, conditions: &[NodeId], end: Option<f64>, facts: &AbstractState) -> bool {
        let is_end = facts.time.exact().zip(end).is_some_and(|(now, end)| (now - end).abs() <= CLOSE * end.abs());
        is_end && conditions.iter().all(|condition| self.eval(*condition, facts).truth() != Some(false))
    }

    /// Some of these are broken now: where a handler takes that, the step goes no further. Otherwise it ends just behind that moment,
    /// where what asks for them is found broken.
    pub(super) fn ends_broken(&mut self, broken: &[NodeId], facts: &mut AbstractState) {
        if self.is_taken("broken") {
            // Handlers within the body do not take it; for those around it counts as broken at any time.
            let open = self.guards.len();
            if self.unbroken.iter().any(|(condition, guards)| *guards == open && broken.contains(&condition.node)) {
                self.raise("broken", facts.clone());
            }
            self.stopped = true;
            return;
        }
        let behind = BEHIND * facts.time.bounds().1.max(1.0);
        let mut beyond = facts.clone();
        self.unheard(|flow| flow.course(behind, &[], &mut beyond));
        *facts = beyond;
    }

    /// Looks whether what is kept still holds after an operation.
    pub(super) fn still_kept(&mut self, label: &str, facts: &AbstractState) {
        for condition in self.kept.clone() {
            if self.fails(condition, "broken", facts) {
                let label = self.called(label);
                let headline = format!("`{label}` makes `{}` false, which must stay true here", condition.text);
                let about = Some((condition.span, "must stay true from here on"));
                self.asked_in_vain(codes::EXPECTATION_FAILED, headline, condition, about, facts);
            }
        }
    }

    /// Looks whether what a command or skill asks for all the time still holds after some time. What is reported is unknown from then on.
    pub(super) fn still_goes_on(&mut self, label: &str, facts: &mut AbstractState) {
        for condition in self.during.clone() {
            if self.fails(condition, "broken", facts) {
                let label = self.called(label);
                let headline = format!("`{label}` stops early: `{}` becomes false", condition.text);
                let about = Some((condition.span, "must be true throughout"));
                self.asked_in_vain(codes::EXPECTATION_FAILED, headline, condition, about, facts);
                let states = self.parts(condition.node).states.clone();
                self.forget(&states, facts);
            }
        }
    }

    /// Looks whether what a skill asks for all the time holds when it begins.
    pub(super) fn begins_under(&mut self, label: &str, invariants: &[Condition], facts: &mut AbstractState) -> Asked {
        for condition in invariants {
            if self.eval(condition.node, facts).truth() != Some(false) || self.is_shared(condition.node) {
                continue;
            }
            let label = self.called(label);
            let headline = format!("`{label}` cannot start: `{}` is false", condition.text);
            let about = Some((condition.span, "must be true throughout"));
            let tell =
                |flow: &mut Self| flow.asked_in_vain(codes::EXPECTATION_FAILED, headline, condition, about, facts);
            self.unless_taken("broken", tell);
            if self.is_taken("broken") {
                self.raise("broken", facts.clone());
                return Asked::Handled;
            }
            return Asked::Unmet;
        }
        Asked::Met
    }

    /// Reports a wait for something that cannot be while what is kept around it holds.
    pub(super) fn waits_against_keep(&mut self, label: &str, awaited: &Condition, facts: &AbstractState) {
        for condition in self.kept.clone() {
            let open = self.is_taken("broken") || self.is_shared(condition.node) || self.is_shared(awaited.node);
            if open || !self.excludes(awaited.node, condition.node, facts) {
                continue;
            }
            let (label, kept) = (self.called(label), &condition.text);
            let headline = format!("`{label}` cannot end while `{kept}` must stay true");
            let said = format!("`{}` and `{kept}` cannot both be true", awaited.text);
            let d = self.at_site(codes::EXPECTATION_FAILED, headline, said, self.doubt > 0);
            let d = d.because(condition.span, "must stay true from here on");
            let d = d.help("wait for a value that `keep` allows, or end the `keep` before the wait");
            self.found(d, condition.span);
        }
    }

    /// Whether two conditions cannot hold at the same time: they set limits to one value that leave nothing between them.
    fn excludes(&mut self, one: NodeId, other: NodeId, facts: &AbstractState) -> bool {
        let (mut these, mut those) = (Vec::new(), Vec::new());
        self.limits_set(one, facts, &mut these);
        self.limits_set(other, facts, &mut those);
        these.iter().any(|(value, low, high)| {
            those.iter().any(|(same, least, most)| value == same && (low > most || least > high))
        })
    }

    /// The limits that a condition sets to values: value, least, most.
    fn limits_set(&mut self, node: NodeId, facts: &AbstractState, out: &mut Vec<(NodeId, f64, f64)>) {
        match self.lab.graph.op(node) {
            Op::Binary(BinaryOp::And, a, b) => {
                self.limits_set(a, facts, out);
                self.limits_set(b, facts, out);
            }
            Op::Binary(BinaryOp::Lt | BinaryOp::Le, a, b) => {
                let mut fixed =
                    |n: NodeId| self.parts(n).states.is_empty().then(|| self.eval(n, facts).exact()).flatten();
                match (fixed(a), fixed(b)) {
                    (Some(low), None) => out.push((b, low, f64::INFINITY)),
                    (None, Some(high)) => out.push((a, f64::NEG_INFINITY, high)),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// Looks whether a skill has done what it promises.
    pub(super) fn promised(&mut self, label: &str, promises: &[Condition], facts: &AbstractState) {
        for promise in promises {
            if self.fails(promise, "promise", facts) {
                let label = self.called(label);
                let headline = format!("`{label}` does not achieve its effect: `{}` is false at its end", promise.text);
                self.asked_in_vain(
                    codes::PROMISE_BROKEN,
                    headline,
                    promise,
                    Some((promise.span, "its effect is declared here")),
                    facts,
                );
            }
        }
    }

    /// Whether a number that the plan asks for is none, as something is divided by 0; reported.
    pub(super) fn without_value(&mut self, node: NodeId, span: Span, facts: &AbstractState) -> bool {
        if self.is_shared(node) {
            return false;
        }
        let graph = &self.lab.graph;
        // What it rests on is worked out once.
        self.enclose(node, facts);
        let Some(at) = undefined(graph, node, &mut |n| self.values.of(n).exact()) else { return false };
        let headline = format!("this has no value: {}", why(graph, at));
        let d = self.at_site(codes::NOT_A_NUMBER, headline, "used here".to_string(), self.doubt > 0);
        self.found(d, span);
        true
    }

    /// Whether neither the steps of a loop nor what goes on by itself change what a condition asks for.
    pub(super) fn stays_so(&mut self, condition: &Condition, body: StepId, facts: &AbstractState) -> bool {
        let parts = self.parts(condition.node);
        if parts.timed || self.lab.graph.depends(condition.node, |op| matches!(op, Op::Local(_))) {
            return false;
        }
        let mut changed = self.writes(body);
        changed.extend(self.events.iter().flat_map(|event| self.changed_by(&event.actions)));
        changed.extend(self.derivatives.iter().map(|d| d.state));
        parts.states.iter().all(|s| !changed.contains(s)) && self.eval(condition.node, facts).truth() == Some(true)
    }

    /// A loop that goes on at its last turn.
    pub(super) fn runs_out(&mut self, condition: &Condition, most: f64, facts: &AbstractState) {
        if self.goes_on_for_ever(condition, facts) {
            let turns = if most == 1.0 { "1 turn".to_string() } else { format!("{} turns", show_number(most)) };
            let headline = format!("`{}` is still true after {turns}: the loop fails with `max`", condition.text);
            let mut is =
                |c: &Comparison| format!("`{}` is {}", c.text, shown(&self.eval(c.value, facts), |v| c.unit.show(v)));
            let said: Vec<String> = condition.compared.iter().map(&mut is).collect();
            let said = if said.is_empty() { "no turns are left".to_string() } else { said.join(", ") };
            let d = self.at_site(codes::NOT_REACHED, headline, said, self.doubt > 0);
            let d = self.with_history(d, condition, facts);
            let d = d.help("allow more turns, or handle the failure: `on max { }`");
            self.unless_taken("max", |flow| flow.found(d, condition.span));
        }
    }

    /// A loop of which each turn leaves all as it was.
    pub(super) fn turns_alike(&mut self, condition: &Condition, most: f64, timeless: bool, facts: &AbstractState) {
        if !timeless || most <= MOST_AT_ONCE {
            return self.runs_out(condition, most, facts);
        }
        if self.goes_on_for_ever(condition, facts) {
            let headline = format!("`{}` stays true in every turn, and no turn takes any time", condition.text);
            let said = "this loop never ends".to_owned();
            let d = self.at_site(codes::ENDLESS_INSTANT, headline, said, self.doubt > 0);
            let d = self.with_history(d, condition, facts);
            let d = d.help("let the body wait, or change the condition");
            self.unless_taken("max", |flow| flow.found(d, condition.span));
        }
    }

    /// Whether a condition does not hold, nobody else may see to it, and nothing takes the failure that follows.
    fn fails(&mut self, condition: &Condition, failure: &str, facts: &AbstractState) -> bool {
        self.eval(condition.node, facts).truth() == Some(false)
            && !self.is_taken(failure)
            && !self.is_shared(condition.node)
    }

    /// Whether the condition of a loop holds, and nobody else may see to its end.
    fn goes_on_for_ever(&mut self, condition: &Condition, facts: &AbstractState) -> bool {
        self.eval(condition.node, facts).truth() == Some(true) && !self.is_shared(condition.node)
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
        facts: &AbstractState,
    ) {
        let measured = self.measured(condition, facts);
        let said = if measured.is_empty() { "false here".to_string() } else { measured.join(", ") };
        let mut d = self.at_site(code, headline, said, self.doubt > 0);
        if let Some((span, label)) = about.filter(|(span, _)| *span != d.span()) {
            d = d.because(span, label);
        }
        let d = self.with_history(d, condition, facts);
        self.found(d, condition.span);
    }
}
