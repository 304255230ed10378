//! Judging: conditions and numbers of the plan, with what was measured.

use matterix_ir::codes;
use matterix_ir::plan::{Comparison, Condition, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::{Code, NodeId, Span};

use super::Executor;
use super::failure::{FailureTrace, Measured};
use super::frame::{End, Follower, FrameId};
use super::listener::{Assumption, ExpectationResult, Verdict};
use crate::backend::Follow;
use crate::fault::Fault;

/// Largest count that is exact.
const MAX_COUNT: f64 = 9_007_199_254_740_992.0;

/// What is raised, apart from where.
pub(super) struct Raised {
    pub name: String,
    pub text: String,
    pub code: Code,
    /// Its cause, where it is not the whole statement.
    pub span: Option<Span>,
    pub measured: Vec<Measured>,
    /// How to mend it.
    pub help: Option<String>,
}

impl Raised {
    /// A failure that handlers know as `name`.
    pub fn named(name: &str, text: impl Into<String>) -> Self {
        Raised {
            name: name.to_owned(),
            text: text.into(),
            code: codes::RUN_FAILED,
            span: None,
            measured: Vec::new(),
            help: None,
        }
    }
}

impl Executor<'_, '_> {
    /// Whether a condition holds, with readings sampled now; `None` if it cannot be known.
    pub(super) fn holds(&mut self, condition: &Condition) -> Result<Option<bool>, Fault> {
        let value = self.defined_value(condition.node).map_err(|f| at(f, condition.span))?;
        Ok(value.map(truth))
    }

    /// Whether a thing is as it should be at the end; none where that cannot be known.
    pub(super) fn ended(&mut self, condition: &Condition) -> Result<Option<bool>, Fault> {
        let value = self.backend.ended(condition.node, self.out);
        let value = value.and_then(|value| self.defined(condition.node, value));
        Ok(value.map_err(|f| at(f, condition.span))?.map(truth))
    }

    /// Whether a condition holds; one that cannot be known is assumed to.
    pub(super) fn judge(&mut self, step: StepId, condition: &Condition) -> Result<bool, Fault> {
        let holds = self.holds(condition)?;
        if holds.is_none() {
            self.assume(step, condition);
        }
        Ok(holds.unwrap_or(true))
    }

    /// Whether a followed condition holds now.
    pub(super) fn follower_holds(&mut self, follower: &Follower) -> Result<bool, Fault> {
        Ok(self.defined_value(follower.node())?.is_none_or(truth))
    }

    /// The value of a condition; fails where a number that is none decides.
    fn defined_value(&mut self, node: NodeId) -> Result<Option<f64>, Fault> {
        let value = self.backend.value(node, self.out)?;
        self.defined(node, value)
    }

    /// A value of a node, where it is none that is no number.
    fn defined(&mut self, node: NodeId, value: Option<f64>) -> Result<Option<f64>, Fault> {
        if value.is_some() {
            self.backend.defined(node)?;
        }
        Ok(value)
    }

    /// Notes that a condition was taken to hold.
    pub(super) fn assume(&mut self, step: StepId, condition: &Condition) {
        let (text, span) = (condition.text.clone(), condition.span);
        self.state.assumptions.push(Assumption { step, text, span, time: self.state.now });
        self.out.assumed(self.state.now, step, condition);
    }

    /// A follower of `condition`; `None`, with a note, if it can only be assumed.
    pub(super) fn follower(&mut self, step: StepId, condition: &Condition) -> Option<Follower> {
        let follow = self.backend.follow(condition.node);
        if follow == Follow::Assumed {
            self.assume(step, condition);
            return None;
        }
        Some(Follower::new(condition.node, follow, self.state.now))
    }

    /// A duration or interval, s; `None` if it cannot be known.
    pub(super) fn duration(&mut self, node: NodeId, what: &str) -> Result<Option<f64>, Fault> {
        let value = self.backend.value(node, self.out)?;
        match value {
            Some(v) if !(v.is_finite() && v >= 0.0) => Err(self.unusable(format!("{what} is {} s", show_number(v)))),
            _ => Ok(value),
        }
    }

    /// A whole number; 1 if it cannot be known.
    pub(super) fn count(&mut self, node: NodeId, what: &str) -> Result<u64, Fault> {
        let value = self.backend.value(node, self.out)?.unwrap_or(1.0);
        if value.fract() == 0.0 && (0.0..=MAX_COUNT).contains(&value) {
            return Ok(value as u64);
        }
        Err(self.unusable(format!("{what} is {}, but must be a whole number", show_number(value))))
    }

    /// A number of the plan that cannot be used.
    pub(super) fn unusable(&self, message: String) -> Fault {
        self.run_fault(codes::UNUSABLE_NUMBER, message)
    }

    /// What the comparisons of a condition measure now.
    pub(super) fn measured(&mut self, compared: &[Comparison]) -> Vec<Measured> {
        let mut all = Vec::with_capacity(compared.len());
        for one in compared {
            let mut value = |node: Option<NodeId>| node.and_then(|n| self.backend.value(n, self.out).ok().flatten());
            let (text, unit) = (one.text.clone(), one.unit.clone());
            let (quantity, low, high) = (value(Some(one.value)), value(one.low), value(one.high));
            all.push(Measured { text, value: quantity, low, high, unit });
        }
        all
    }

    /// Judges expectations; none stops the run.
    pub(super) fn expect(&mut self, step: StepId, conditions: &[Condition]) -> Result<(), Fault> {
        for condition in conditions {
            let seen = self.backend.observe(condition.node, self.out).map_err(|f| at(f, condition.span))?;
            let verdict = match seen.map(truth) {
                // What has no value is as nobody expects it.
                Some(true) if self.backend.defined(condition.node).is_ok() => Verdict::Passed,
                Some(_) => Verdict::Failed,
                None => Verdict::NotObserved,
            };
            let compared = self.measured(&condition.compared);
            let (text, span) = (condition.text.clone(), condition.span);
            let result = ExpectationResult { step, text, span, time: self.state.now, verdict, compared };
            self.out.expectation(&result);
            self.state.expectations.push(result);
        }
        Ok(())
    }

    /// A failure of `condition` at a step.
    pub(super) fn unmet(&mut self, condition: &Condition, name: &str, code: Code, text: String) -> Raised {
        let measured = self.measured(&condition.compared);
        Raised { name: name.to_owned(), text, code, span: Some(condition.span), measured, help: None }
    }

    /// The trace of something raised in a frame.
    pub(super) fn trace(&self, id: FrameId, raised: Raised) -> FailureTrace {
        let frames = std::iter::once(id).chain(self.ancestors(id)).filter_map(|f| self.state.frames.get(&f));
        let steps: Vec<_> =
            frames.filter_map(|f| f.step.map(|s| FailureTrace::entry(self.plan, s, f.started))).collect();
        let span = raised.span.or(steps.first().map(|s| s.span)).unwrap_or_default();
        let Raised { name, text, code, measured, help, .. } = raised;
        let help = help.into_iter().collect();
        FailureTrace {
            name,
            text,
            code,
            fault: false,
            span,
            time: self.state.now,
            steps,
            measured,
            help,
            because: Vec::new(),
        }
    }

    /// Raises a failure in a frame, which ends with it.
    pub(super) fn fail(&mut self, id: FrameId, raised: Raised) {
        let trace = self.trace(id, raised);
        self.out.failure(&trace);
        self.push_end(id, End::Failed(Box::new(trace)));
    }
}

/// Not 0, and a number.
pub(super) fn truth(value: f64) -> bool {
    value != 0.0 && !value.is_nan()
}

/// The fault, at `span` where it has no place of its own.
pub(super) fn at(mut fault: Fault, span: Span) -> Fault {
    fault.span = fault.span.or(Some(span));
    fault
}
