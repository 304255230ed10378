//! A written `fail` to which every run comes, as what is known decides the condition it stands under.

use matterix_ir::plan::{Comparison, Condition, Step, StepId};
use matterix_ir::{Diagnostic, Severity, codes};

use super::Interpreter;
use super::report::shown;
use super::state::AbstractState;

impl<'l> Interpreter<'l, '_> {
    /// Reports a `fail` to which every run comes that follows the plan to here.
    pub(super) fn comes_to_fail(&mut self, id: StepId, name: &str, facts: &AbstractState) {
        let open = self.open > 0 || self.doubt > 0 || self.cleaning > 0 || facts.unsure;
        if open || self.is_taken(name) {
            return;
        }
        let Some(condition) = self.asked_before(id) else { return };
        if self.is_shared(condition.node) {
            return;
        }
        self.fails_for_certain(id, name, condition, facts);
    }

    /// Reports a `fail` that comes for certain.
    pub(super) fn fails_for_certain(&mut self, id: StepId, name: &str, condition: &Condition, facts: &AbstractState) {
        let headline = format!("every run that reaches this step fails with `{name}`");
        let mut d = Diagnostic::error(codes::RUN_FAILED, self.plan.get(id).span, headline, "fails here");
        if self.doubt > 0 {
            d.severity = Severity::Warning;
        }
        for site in self.sites.iter().rev().filter(|s| s.calls).take(2) {
            d = d.because(site.span, format!("in `{}`", site.label));
        }
        let holds = if self.eval(condition.node, facts).truth() == Some(false) { "is false" } else { "is true" };
        let mut is =
            |c: &Comparison| format!("`{}` is {}", c.text, shown(&self.eval(c.value, facts), |v| c.unit.show(v)));
        let values: Vec<String> = condition.compared.iter().map(&mut is).collect();
        let values = if values.is_empty() { String::new() } else { format!(": {}", values.join(", ")) };
        let d = d.because(condition.span, format!("`{}` {holds}{values}", condition.text));
        let d = self.with_history(d, condition, facts);
        self.found(d.help("change the steps before it, or handle the failure"), condition.span);
    }

    /// The condition of the innermost `if` around a step, where that does not ask for parameters alone.
    pub(super) fn asked_before(&mut self, id: StepId) -> Option<&'l Condition> {
        let plan = self.plan;
        let mut todo: Vec<(StepId, Option<&'l Condition>)> = vec![(plan.root, None)];
        let mut innermost = None;
        while let Some((at, around)) = todo.pop() {
            if at == id {
                innermost = around;
                break;
            }
            let step = &plan.get(at).step;
            let around = if let Step::If { condition, .. } = step { Some(condition) } else { around };
            todo.extend(step.children().into_iter().map(|child| (child, around)));
        }
        innermost.filter(|c| {
            let parts = self.parts(c.node);
            let constant = self.lab.graph.constant(c.node).is_some() && !self.lab.by_parameters.contains(&c.span);
            !parts.timed && (constant || !parts.states.is_empty())
        })
    }

    /// The conditions in steps that lead to a written `fail`.
    pub(super) fn asked_before_fails(&self, steps: impl Iterator<Item = StepId> + Clone) -> Vec<&'l Condition> {
        let plan = self.plan;
        let fails: Vec<StepId> = steps.clone().filter(|id| matches!(plan.get(*id).step, Step::Fail { .. })).collect();
        if fails.is_empty() {
            return Vec::new();
        }
        let leads = |id: &StepId| {
            let below = self.below(*id);
            fails.iter().any(|fail| below.contains(fail))
        };
        let asked = |id: StepId| match &plan.get(id).step {
            Step::If { condition, .. } if leads(&id) => Some(condition),
            _ => None,
        };
        steps.filter_map(asked).collect()
    }
}
