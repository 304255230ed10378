//! How long steps take and how often they are done, where that cannot be.

use std::collections::BTreeMap;

use matterix_ir::plan::{LONGEST_RUN, Operation, StepId};
use matterix_ir::quantity::{show_duration, show_number};
use matterix_ir::{Code, NodeId, Severity, codes};

use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, MOST_STEPS};

impl Interpreter<'_, '_> {
    /// A duration as it is when a step is reached, s; reported where it is negative on every way.
    pub(super) fn duration(&mut self, node: NodeId, facts: &AbstractState) -> AbstractValue {
        let time = self.eval(node, facts);
        let (_, longest) = time.bounds();
        if longest < 0.0 {
            let wrong =
                format!("`{}` would last {}: a duration cannot be negative", self.label(), show_duration(longest));
            let said = "negative duration".to_owned();
            self.found_here(codes::TYPE_MISMATCH, wrong, said, "use a duration of 0 s or more");
            // Said already: when it would end is not known.
            return AbstractValue::Range(0.0, f64::INFINITY, Imprecision::Unknown);
        }
        time
    }

    /// Notes how long an operation lasts that begins now, where that follows from states.
    pub(super) fn note_duration(&mut self, id: StepId, operation: &Operation, facts: &AbstractState) {
        let Some(takes) = operation.takes.filter(|t| operation.until.is_none() && t.bounds.is_none()) else { return };
        let parts = self.parts(takes.nominal);
        if parts.states.is_empty() {
            return;
        }
        let open = parts.timed || self.is_shared(takes.nominal);
        let (low, high) = if open { (0.0, f64::INFINITY) } else { self.eval(takes.nominal, facts).bounds() };
        let (least, most) = self.lasting.entry(id).or_insert((f64::INFINITY, 0.0));
        (*least, *most) = (least.min(low.max(0.0)), most.max(high.max(0.0)));
    }

    /// Nothing is known of how long the operations in a body last: it is done more often than it was followed.
    pub(super) fn durations_unknown(&mut self, body: StepId) {
        for id in self.below(body) {
            self.lasting.insert(id, (0.0, f64::INFINITY));
        }
    }

    /// How long operations last of which that follows from states, s.
    pub(super) fn durations(&mut self) -> BTreeMap<StepId, (f64, f64)> {
        if self.steps > MOST_STEPS {
            return BTreeMap::new();
        }
        let mut all = std::mem::take(&mut self.lasting);
        all.retain(|_, (low, high)| *low > 0.0 || high.is_finite());
        all
    }

    /// How often a body is done; reported where that is no whole number, or less than none.
    pub(super) fn turns(&mut self, node: NodeId, facts: &AbstractState) -> AbstractValue {
        let times = self.eval(node, facts);
        if let Some(exact) = times.exact().filter(|n| *n < 0.0 || n.fract() != 0.0) {
            let wrong =
                format!("`{}` would repeat {} times: this must be a whole number", self.label(), show_number(exact));
            let said = "not a whole number of turns".to_owned();
            self.found_here(codes::TYPE_MISMATCH, wrong, said, "use a whole number, 0 or more");
        }
        times
    }

    /// Reports the first statement on a way that cannot end within the longest time a run may take.
    pub(super) fn outlasts(&mut self, before: f64, after: &AbstractState) {
        let (least, _) = after.time.bounds();
        if before > LONGEST_RUN || least <= LONGEST_RUN {
            return;
        }
        let wrong = format!("`{}` would end only after {}", self.label(), show_duration(least));
        let most = show_duration(LONGEST_RUN);
        let said = format!("a run stops after {most}");
        let mend = "shorten it, or split the workflow into several runs";
        self.found_here(codes::WAITS_FOR_EVER, wrong, said, mend);
    }

    /// Reports what is wrong with the statement that is followed now; a warning where it may not be reached.
    fn found_here(&mut self, code: Code, headline: String, said: String, mend: &str) {
        let d = self.at_site(code, headline, said, self.doubt > 0).help(mend);
        let about = d.span();
        self.found(d, about);
    }

    /// Says once that a limit of this check is reached at the statement that is followed now, and what is not known behind it.
    pub(super) fn not_analysed(&mut self, severity: Severity, headline: String, said: &str) {
        let mut d = self.at_site(codes::NOT_ANALYSED, headline, said.to_owned(), false);
        d.severity = severity;
        let about = d.span();
        self.found(d, about);
    }

    /// The statement that is followed now, as written.
    fn label(&self) -> String {
        self.sites.last().map(|s| s.label.clone()).unwrap_or_default()
    }
}
