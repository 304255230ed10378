//! How long steps take and how often they are done, where that cannot be.

use matterix_ir::plan::LONGEST_RUN;
use matterix_ir::quantity::{show_duration, show_number};
use matterix_ir::{Code, NodeId, Severity, codes};

use super::Flow;
use super::facts::Facts;
use super::value::{Known, Why};

impl Flow<'_, '_> {
    /// A duration as it is when a step is reached, s; reported where it is negative on every way.
    pub(super) fn duration(&mut self, node: NodeId, facts: &Facts) -> Known {
        let time = self.eval(node, facts);
        let (_, longest) = time.bounds();
        if longest < 0.0 {
            let wrong = format!("`{}` cannot be done: a duration cannot be negative", self.label());
            let said = format!("would take {}", show_duration(longest));
            self.found_here(codes::TYPE_MISMATCH, wrong, said, "give a duration of 0 s or more");
            // Said already: when it would end is not known.
            return Known::Range(0.0, f64::INFINITY, Why::Unknown);
        }
        time
    }

    /// How often a body is done; reported where that is no whole number, or less than none.
    pub(super) fn turns(&mut self, node: NodeId, facts: &Facts) -> Known {
        let times = self.eval(node, facts);
        if let Some(exact) = times.exact().filter(|n| *n < 0.0 || n.fract() != 0.0) {
            let wrong = format!("`{}` cannot be done: how often is a whole number", self.label());
            let said = format!("{} times", show_number(exact));
            self.found_here(codes::TYPE_MISMATCH, wrong, said, "give a whole number, 0 or more");
        }
        times
    }

    /// Reports the first statement on a way that cannot end within the longest time a run may take.
    pub(super) fn outlasts(&mut self, before: f64, after: &Facts) {
        let (least, _) = after.time.bounds();
        if before > LONGEST_RUN || least <= LONGEST_RUN {
            return;
        }
        let wrong = format!("`{}` ends when no run goes on any more", self.label());
        let (end, most) = (show_duration(least), show_duration(LONGEST_RUN));
        let said = format!("not before {end}; a run ends after {most}");
        let mend = "make it shorter, or divide the workflow into several runs";
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
