//! How each kind of step begins.

use std::collections::BTreeMap;

use matterix_ir::plan::{Condition, Step, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::{NodeId, Text};

use super::frame::{End, FrameId, Kind, Phase};
use super::judge::Raised;
use super::listener::StepState;
use super::{Executor, Recording, tree};
use crate::fault::Fault;

impl<'p> Executor<'p, '_> {
    /// Begins a frame, unless it has been stopped before.
    pub(super) fn enter(&mut self, id: FrameId) {
        let now = self.state.now;
        let Some(frame) = self.state.frames.get_mut(&id) else { return };
        let Some(step) = frame.step else { return };
        if frame.stop.is_some() {
            return self.finish(id, End::Stopped);
        }
        frame.started = now;
        frame.kind = Kind::Pass;
        self.mark(step, StepState::Running);
        if let Err(fault) = self.tell(step).and_then(|()| self.begin(id, step)) {
            self.fault(id, fault);
        }
    }

    /// Tells the listener that a node begins, with the values that it wants.
    fn tell(&mut self, step: StepId) -> Result<(), Fault> {
        let mut values = Vec::new();
        for node in self.out.wanted(step) {
            values.push(self.backend.value(node, self.out)?);
        }
        self.out.begins(self.state.now, step, &values);
        Ok(())
    }

    fn begin(&mut self, id: FrameId, step: StepId) -> Result<(), Fault> {
        let plan = self.plan;
        match &plan.get(step).step {
            Step::Sequence(_) => {
                self.set_kind(id, Kind::Sequence { next: 0 });
                self.next_in_sequence(id);
            }
            Step::Parallel(list) => self.begin_parallel(id, list),
            Step::Operation(_) | Step::Ask(_) => self.begin_act(id, step)?,
            Step::Guarded { body, .. } => {
                self.set_kind(id, Kind::Guarded { phase: Phase::Body, retries: 0 });
                self.spawn(id, *body);
            }
            Step::Retry { times } => {
                let times = self.count(*times, "`retry`")?;
                self.push_end(id, End::Retry(times));
            }
            Step::Try(_) => {
                self.set_kind(id, Kind::Try { index: 0 });
                self.next_alternative(id, 0);
            }
            Step::Skill { .. } | Step::Keep { .. } | Step::During { .. } => self.begin_monitored(id, step)?,
            Step::Named { start, body, end, .. } => {
                self.set_kind(id, Kind::Named);
                self.backend.set_local(*start, Some(self.state.now));
                self.backend.set_local(*end, None);
                self.spawn(id, *body);
            }
            Step::Wait { .. } | Step::WaitUntil { .. } | Step::Hold { .. } => self.begin_wait(id, step)?,
            Step::Within { limit, since, body } => self.begin_within(id, *limit, *since, *body)?,
            Step::If { condition, then, otherwise } => self.begin_if(id, step, condition, *then, *otherwise)?,
            Step::Repeat { times, .. } => {
                let left = self.count(*times, "`repeat`")?;
                self.set_kind(id, Kind::Repeat { left });
                self.turn(id)?;
            }
            Step::RepeatWhile { max, .. } => {
                let left = self.count(*max, "`max`")?;
                self.set_kind(id, Kind::RepeatWhile { left, first: true });
                self.turn(id)?;
            }
            Step::Claim { claims, .. } => {
                self.set_kind(id, Kind::Claim { granted: false });
                self.request(id, claims.clone());
            }
            Step::Start { job, body } => self.begin_job(id, job, *body),
            Step::Await { job } => self.begin_await(id, job),
            Step::Fail { name, text } => {
                let text = self.words(text)?;
                self.fail(id, Raised::named(name, text));
            }
            simple => {
                self.perform(step, simple)?;
                self.push_end(id, End::Done);
            }
        }
        Ok(())
    }

    /// Steps that are over at once.
    fn perform(&mut self, id: StepId, step: &'p Step) -> Result<(), Fault> {
        match step {
            Step::Let { local, value } => {
                let known = self.backend.value(*value, self.out)?;
                if known.is_some_and(|v| !v.is_finite()) {
                    self.backend.defined(*value)?;
                }
                self.backend.set_local(*local, known);
            }
            Step::Expect(conditions) => self.expect(id, conditions)?,
            Step::Record { name, value, unit, every } => {
                let every = self.duration(*every, "the interval of `record`")?.unwrap_or(f64::INFINITY);
                if every <= 0.0 {
                    return Err(self.unusable("the interval of `record` is 0 s".to_owned()));
                }
                // A turn of a loop that comes to it again finds it sampling.
                if self.state.recordings.get(&id).is_none_or(|r| r.every != every) {
                    self.state
                        .recordings
                        .insert(id, Recording { name, value, unit, since: self.state.now, every, turn: 0 });
                    self.sample()?;
                }
            }
            Step::Note(text) => {
                let text = self.words(text)?;
                self.out.note(self.state.now, id, &text);
            }
            _ => {}
        }
        Ok(())
    }

    /// A text with its values as they are now.
    pub(super) fn words(&mut self, text: &Text) -> Result<String, Fault> {
        let instances = &self.scene.instances;
        let name = |v: f64| match instances.get(v as usize) {
            Some(instance) if v >= 0.0 => instance.name.clone(),
            _ => "nothing".to_owned(),
        };
        text.show(|node| self.backend.value(node, self.out), name)
    }

    fn begin_parallel(&mut self, id: FrameId, list: &[StepId]) {
        self.set_kind(id, Kind::Parallel { end: None });
        let branches: Vec<FrameId> = list.iter().map(|&step| self.insert(Some(id), Some(step))).collect();
        if branches.is_empty() {
            return self.push_end(id, End::Done);
        }
        self.state.tasks.extend(branches.into_iter().rev().map(super::Task::Enter));
    }

    fn begin_wait(&mut self, id: FrameId, step: StepId) -> Result<(), Fault> {
        let plan = self.plan;
        match &plan.get(step).step {
            Step::Wait { duration } => {
                let duration = self.duration(*duration, "the time to wait")?.unwrap_or(0.0);
                let at = self.backend.moment_after(duration);
                self.set_kind(id, Kind::Wait { at });
                self.end_if(id, at <= self.state.now);
            }
            Step::WaitUntil { condition, timeout } => {
                let deadline = self.deadline(*timeout)?;
                let Some(follower) = self.follower(step, condition) else {
                    self.push_end(id, End::Done);
                    return Ok(());
                };
                let holds = self.follower_holds(&follower)?;
                self.set_kind(id, Kind::WaitUntil { follower, deadline });
                self.end_if(id, holds);
            }
            Step::Hold { condition, duration, timeout } => {
                let duration = self.duration(*duration, "the time to hold")?.unwrap_or(0.0);
                let deadline = self.deadline(*timeout)?;
                let Some(follower) = self.follower(step, condition) else {
                    let at = self.backend.moment_after(duration);
                    self.set_kind(id, Kind::Wait { at });
                    self.end_if(id, duration <= 0.0);
                    return Ok(());
                };
                let end = self.follower_holds(&follower)?.then(|| self.backend.moment_after(duration));
                self.set_kind(id, Kind::Hold { follower, duration, end, deadline });
                self.end_if(id, end.is_some_and(|e| e <= self.state.now));
            }
            _ => {}
        }
        Ok(())
    }

    fn end_if(&mut self, id: FrameId, over: bool) {
        if over {
            self.push_end(id, End::Done);
        }
    }

    fn deadline(&mut self, timeout: Option<NodeId>) -> Result<f64, Fault> {
        let Some(node) = timeout else { return Ok(f64::INFINITY) };
        let timeout = self.duration(node, "the timeout")?;
        Ok(timeout.map_or(f64::INFINITY, |t| self.backend.moment_after(t)))
    }

    fn begin_within(&mut self, id: FrameId, limit: NodeId, since: NodeId, body: StepId) -> Result<(), Fault> {
        let limit = self.duration(limit, "the limit of `within`")?;
        let since = self.backend.value(since, self.out)?;
        if since.is_some_and(|s| !s.is_finite()) {
            return Err(self.unusable("`within` refers to a time that is not known yet".to_owned()));
        }
        let rounding = 1e-9 * self.state.now.abs().max(1.0);
        match limit.zip(since) {
            Some((limit, since)) if self.state.now - since > limit + rounding => {
                let [passed, limit] = [self.state.now - since, limit].map(show_number);
                let text = format!("{passed} s have passed, but at most {limit} s are allowed");
                self.fail(id, Raised::named("late", text));
            }
            _ => {
                self.spawn(id, body);
            }
        }
        Ok(())
    }

    fn begin_if(
        &mut self,
        id: FrameId,
        step: StepId,
        condition: &Condition,
        then: StepId,
        otherwise: Option<StepId>,
    ) -> Result<(), Fault> {
        let holds = self.judge(step, condition)?;
        let (taken, left) = if holds { (Some(then), otherwise) } else { (otherwise, Some(then)) };
        for skipped in left.map(|s| tree::subtree(self.plan, s)).unwrap_or_default() {
            self.mark(skipped, StepState::Skipped);
        }
        match taken {
            Some(step) => {
                self.spawn(id, step);
            }
            None => self.push_end(id, End::Done),
        }
        Ok(())
    }

    /// Samples every `record` that is due.
    pub(super) fn sample(&mut self) -> Result<(), Fault> {
        let now = self.state.now;
        let due: BTreeMap<StepId, Recording<'p>> =
            self.state.recordings.iter().filter(|(_, r)| r.is_due(now)).map(|(&s, r)| (s, r.clone())).collect();
        for (step, recording) in due {
            let mut values = Vec::with_capacity(recording.value.len());
            for &node in recording.value {
                values.push(self.backend.value(node, self.out)?.unwrap_or(f64::NAN));
            }
            self.out.record(now, step, recording.name, &values, recording.unit);
            if let Some(recording) = self.state.recordings.get_mut(&step) {
                recording.turn += 1;
            }
        }
        while let Some(time) = self.limits.looks.times.get(self.state.looked)
            && *time <= now
        {
            let mut values = Vec::with_capacity(self.limits.looks.nodes.len());
            for &node in self.limits.looks.nodes {
                values.push(self.backend.value(node, self.out)?.unwrap_or(f64::NAN));
            }
            self.out.looked(self.state.looked, &values);
            self.state.looked += 1;
        }
        Ok(())
    }
}
