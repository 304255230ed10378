//! Skills and `keep`: what must hold before, during and after a body.

use std::sync::Arc;

use matterix_ir::NodeId;
use matterix_ir::codes;
use matterix_ir::plan::{Condition, Step, StepId, Takes};
use matterix_ir::quantity::show_number;

use super::Executor;
use super::frame::{End, FrameId, Kind, Monitor, Stop};
use super::judge::Raised;
use crate::fault::Fault;

impl Executor<'_, '_> {
    /// Checks needs and invariants, then runs the body under watch.
    pub(super) fn begin_monitored(&mut self, id: FrameId, step: StepId) -> Result<(), Fault> {
        let plan = self.plan;
        let (needs, kept, body): (&[Arc<Condition>], &[Condition], StepId) = match &plan.get(step).step {
            Step::Skill { needs, invariants, body, .. } => (needs, invariants, *body),
            Step::Keep { condition, body } => (&[], std::slice::from_ref(condition), *body),
            Step::During { invariants, body } => (&[], invariants, *body),
            _ => return Ok(()),
        };
        if !self.needs_met(id, step, needs)? {
            return Ok(());
        }
        // What an operation keeps is looked at when it has begun.
        let from_start = matches!(plan.get(step).step, Step::During { .. });
        let mut monitors = Vec::new();
        for (index, condition) in kept.iter().enumerate() {
            let Some(follower) = self.follower(step, condition) else { continue };
            if !from_start && !self.follower_holds(&follower)? {
                let text = format!("`{}` is false at the start", condition.text);
                let raised = self.unmet(condition, "broken", codes::RUN_FAILED, text);
                self.fail(id, raised);
                return Ok(());
            }
            monitors.push(Monitor { follower, index });
        }
        self.set_kind(id, Kind::Monitored { monitors, breach: None });
        self.spawn(id, body);
        Ok(())
    }

    /// Raises a failure for the first need that is not met; whether all are.
    pub(super) fn needs_met(&mut self, id: FrameId, step: StepId, needs: &[Arc<Condition>]) -> Result<bool, Fault> {
        for need in needs {
            if !self.judge(step, need)? {
                let label = &self.plan.get(step).label;
                let text = format!("`{label}` needs `{}`, which is false", need.text);
                let raised = self.refused(need, label, text);
                self.fail(id, raised);
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// What a need or limit of a step that does not hold raises: in its own words where it has them.
    pub(super) fn refused(&mut self, condition: &Condition, label: &str, text: String) -> Raised {
        let raised = self.unmet(condition, condition.failure(), condition.code(), text);
        let raised = Raised { help: condition.advice(), ..raised };
        match self.said(condition) {
            Some(words) => Raised { text: format!("`{label}` failed: {words}"), measured: Vec::new(), ..raised },
            None => raised,
        }
    }

    /// What is so where a condition does not hold, in its own words.
    fn said(&mut self, condition: &Condition) -> Option<String> {
        let all = condition.refusal.as_ref()?.said.iter();
        let mut fails = all.filter(|said| self.backend.value(said.node, self.out).ok().flatten() == Some(0.0));
        let said = fails.next()?;
        self.words(&said.text).ok()
    }

    /// What a breach of an invariant raises.
    pub(super) fn broken(&mut self, condition: &Condition) -> Raised {
        let text = format!("`{}` became false", condition.text);
        self.unmet(condition, "broken", codes::RUN_FAILED, text)
    }

    pub(super) fn monitored_ended(&mut self, id: FrameId, end: End) -> Result<(), Fault> {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get_mut(&id) else { return Ok(()) };
        let (Kind::Monitored { breach, .. }, Some(step)) = (&mut frame.kind, frame.step) else { return Ok(()) };
        let started = frame.started;
        if let Some(breach) = breach.take() {
            if let End::Failed(trace) = end {
                self.state.suppressed.push(*trace);
            }
            self.conclude(id, End::Failed(breach));
            return Ok(());
        }
        if let (End::Done, Step::Skill { promises, takes, .. }) = (&end, &plan.get(step).step)
            && let Some(raised) = self.unkept(step, promises, *takes, started)?
        {
            let trace = self.trace(id, raised);
            self.out.failure(&trace);
            self.conclude(id, End::Failed(Box::new(trace)));
            return Ok(());
        }
        self.conclude(id, end);
        Ok(())
    }

    /// What a skill promised and did not keep.
    fn unkept(
        &mut self,
        step: StepId,
        promises: &[Condition],
        takes: Option<Takes>,
        started: f64,
    ) -> Result<Option<Raised>, Fault> {
        let label = &self.plan.get(step).label;
        for promise in promises {
            if !self.judge(step, promise)? {
                let text = format!("`{label}` does not achieve its effect: `{}` is false at its end", promise.text);
                return Ok(Some(self.unmet(promise, "promise", codes::PROMISE_BROKEN, text)));
            }
        }
        let Some((low, high)) = takes.and_then(|t| t.bounds) else { return Ok(None) };
        let (Some(low), Some(high)) = (self.backend.value(low, self.out)?, self.backend.value(high, self.out)?) else {
            return Ok(None);
        };
        let (took, rounding) = (self.state.now - started, 1e-9 * self.state.now.abs().max(1.0));
        if took >= low - rounding && took <= high + rounding {
            return Ok(None);
        }
        let [took, low, high] = [took, low, high].map(show_number);
        let text = format!("`{label}` took {took} s, outside its bounds {low} s .. {high} s");
        Ok(Some(Raised { code: codes::PROMISE_BROKEN, ..Raised::named("promise", text) }))
    }

    /// An invariant of a frame no longer holds: its body is stopped, then the frame fails.
    pub(super) fn breach(&mut self, id: FrameId, index: usize) {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get(&id) else { return };
        if frame.stop.is_some() || !matches!(frame.kind, Kind::Monitored { breach: None, .. }) {
            return;
        }
        let Some(step) = frame.step else { return };
        let children = frame.children.clone();
        let condition = match &plan.get(step).step {
            Step::Skill { invariants, .. } | Step::During { invariants, .. } => invariants.get(index),
            Step::Keep { condition, .. } => Some(condition),
            _ => None,
        };
        let Some(condition) = condition else { return };
        let stop = if matches!(plan.get(step).step, Step::During { .. }) { Stop::Now } else { Stop::Boundary };
        let raised = self.broken(condition);
        let trace = Box::new(self.trace(id, raised));
        self.out.failure(&trace);
        if let Some(Kind::Monitored { breach, .. }) = self.state.frames.get_mut(&id).map(|f| &mut f.kind) {
            *breach = Some(trace);
        }
        for child in children {
            self.stop(child, stop, false);
        }
    }

    pub(super) fn look_at_monitors(&mut self, id: FrameId, fired: &[NodeId]) -> Result<(), Fault> {
        let Some(Kind::Monitored { monitors, breach: None }) = self.state.frames.get(&id).map(|f| f.kind.clone())
        else {
            return Ok(());
        };
        let mut monitors = monitors;
        let mut broken = None;
        for monitor in &mut monitors {
            if self.news(&mut monitor.follower, false, fired)? == Some(false) && broken.is_none() {
                broken = Some(monitor.index);
            }
        }
        self.set_kind(id, Kind::Monitored { monitors, breach: None });
        if let Some(index) = broken {
            self.breach(id, index);
        }
        Ok(())
    }
}
