//! What fails where branches are followed one after the other, in either order, but holds in the order of time.

use std::collections::BTreeMap;

use matterix_ir::Span;

use super::super::Interpreter;
use super::super::report::Finding;
use super::super::state::AbstractState;
use super::super::trace_partitioning::Place;

/// How conditions come out in the order of time, by the statement that asks for them and their own place.
#[derive(Debug, Default)]
pub(in crate::check::flow) struct Judged(BTreeMap<Place, Course>);

/// How one of them comes out.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    /// Whether the statement was come to.
    seen: bool,
    /// Whether it is not known to hold somewhere.
    open: bool,
}

impl Judged {
    /// The conditions that these findings say do not hold.
    pub(super) fn of(findings: &[Finding]) -> Self {
        let errors = findings.iter().filter(|f| f.is_error());
        Judged(errors.map(|f| (f.place(), Course::default())).collect())
    }

    /// Whether a condition was asked for and held each time.
    pub(super) fn holds(&self, place: Place) -> bool {
        self.0.get(&place).is_some_and(|course| course.seen && !course.open)
    }
}

impl Interpreter<'_, '_> {
    /// Notes how a condition comes out at the statement that is followed now.
    pub(in crate::check::flow) fn judge(&mut self, about: Span, truth: Option<bool>) {
        if self.judged.0.is_empty() {
            return;
        }
        let place = (self.site(), about);
        if let Some(course) = self.judged.0.get_mut(&place) {
            course.seen = true;
            course.open |= truth != Some(true);
        }
    }

    /// Notes how limits come out after time has passed.
    pub(super) fn judge_limits(&mut self, facts: &AbstractState) {
        if self.judged.0.is_empty() {
            return;
        }
        for limit in &self.plan.limits {
            let about = limit.condition.span;
            if self.judged.0.keys().any(|(_, span)| *span == about)
                && self.eval(limit.condition.node, facts).truth() != Some(true)
            {
                let of_limit = self.judged.0.iter_mut().filter(|((_, span), _)| *span == about);
                of_limit.for_each(|(_, course)| course.open = true);
            }
        }
    }
}
