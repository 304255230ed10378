//! A `hold` of what holds now and breaks off for certain: by a timer, or by what flows evenly.

use matterix_ir::NodeId;
use matterix_ir::plan::Condition;
use matterix_ir::quantity::show_duration;
use matterix_ir::{Code, codes};

use super::Interpreter;
use super::course::Course;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};

/// So many times a condition breaks off before the rest is left to the run.
const MOST_BREAKS: usize = 100;

impl Interpreter<'_, '_> {
    /// After how long, s, a condition that holds now first breaks off, where it never lasts `lasts` s within `left` s.
    pub(super) fn breaks_off(
        &mut self,
        condition: NodeId,
        lasts: f64,
        left: f64,
        facts: &AbstractState,
    ) -> Option<f64> {
        let begun = facts.time.exact().filter(|_| !self.is_shared(condition))?;
        let first = self.unheard(|flow| flow.first_break(condition, lasts, begun + left, facts));
        self.stopped = false;
        first.map(|first| first - begun)
    }

    fn first_break(&mut self, condition: NodeId, lasts: f64, end: f64, facts: &AbstractState) -> Option<f64> {
        let mut along = facts.clone();
        let mut first = None;
        for _ in 0..MOST_BREAKS {
            let now = along.time.exact()?;
            if now + lasts > end {
                return first;
            }
            match self.course(lasts, &[(condition, false)], &mut along) {
                Course::Reached(_) => first = first.or(Some(along.time.exact()?)),
                Course::Passed | Course::Left(_) => return None,
            }
            match self.course(end - along.time.exact()?, &[(condition, true)], &mut along) {
                Course::Reached(_) => {}
                Course::Passed => return first,
                Course::Left(left) => {
                    self.pass(&AbstractValue::Range(0.0, left, Imprecision::Unknown), &mut along);
                    return first.filter(|_| self.eval(condition, &along).truth() == Some(false));
                }
            }
        }
        None
    }

    /// Reports a `hold` that cannot come to its end.
    pub(super) fn never_held(&mut self, condition: &Condition, (lasts, after): (f64, f64), limited: bool) {
        let (code, how): (Code, _) = match limited {
            true => (codes::NOT_REACHED, "before the timeout"),
            false => (codes::WAITS_FOR_EVER, "without a break"),
        };
        let headline = format!("`{}` never stays true for {} {how}", condition.text, show_duration(lasts));
        let said = format!("it becomes false {} after it became true", show_duration(after));
        let d = self.at_site(code, headline, said, self.doubt > 0);
        let d = d.help("require it for a shorter time, or change the timer or flow that ends it");
        self.found(d, condition.span);
    }
}
