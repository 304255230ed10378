//! Jobs: bodies that run beside what follows, and the blocks that wait for them.

use matterix_ir::plan::StepId;

use super::frame::{End, FrameId, Job, Kind, Stop};
use super::judge::Raised;
use super::{Executor, Task};

/// The frame around the whole plan.
const ROOT: FrameId = 0;

impl<'p> Executor<'p, '_> {
    pub(super) fn begin_job(&mut self, id: FrameId, name: &'p str, body: StepId) {
        let scope = self.ancestors(id).find(|f| self.is_scope(*f)).unwrap_or(0);
        if self.find_job(id, name).is_some_and(|(_, job)| job.end.is_none()) {
            return self.fail(id, Raised::named("job", format!("job `{name}` is still running")));
        }
        let frame = self.insert(Some(scope), Some(body));
        if let Some(new) = self.state.frames.get_mut(&frame) {
            new.job = true;
        }
        if let Some(scope) = self.state.frames.get_mut(&scope) {
            scope.jobs.push(Job { name: name.to_owned(), frame, end: None, awaited: false });
        }
        self.state.job_names.insert(name);
        self.push_end(id, End::Done);
        self.state.tasks.push(Task::Enter(frame));
    }

    /// Begins what is asked for from outside, beside the plan; whatever becomes of it is nobody else's business.
    pub(super) fn begin_asked(&mut self) {
        if self.state.abort.is_some() {
            return;
        }
        for step in self.out.given_up() {
            let is_it = |(_, f): &(&FrameId, &super::Frame)| f.job && f.parent == Some(ROOT) && f.step == Some(step);
            if let Some(job) = self.state.frames.iter().find(is_it).map(|(&id, _)| id) {
                self.stop(job, Stop::Now, false);
                self.drain();
            }
        }
        for asked in self.out.asked(self.state.now) {
            if self.plan.steps.len() <= asked.step.0 as usize {
                continue;
            }
            for (local, value) in asked.locals {
                self.backend.set_local(local, Some(value));
            }
            let frame = self.insert(Some(ROOT), Some(asked.step));
            if let Some(new) = self.state.frames.get_mut(&frame) {
                (new.job, new.asked) = (true, true);
            }
            if let Some(root) = self.state.frames.get_mut(&ROOT) {
                root.jobs.retain(|j| j.end.is_none());
                root.jobs.push(Job { name: String::new(), frame, end: None, awaited: true });
            }
            self.state.tasks.push(Task::Enter(frame));
            self.drain();
        }
    }

    pub(super) fn begin_await(&mut self, id: FrameId, name: &str) {
        let found = self.find_job(id, name).map(|(scope, job)| (scope, job.frame, job.end.clone()));
        match found {
            Some((scope, job, end)) => {
                self.take_job(scope, job);
                match end {
                    Some(end) => self.push_end(id, end),
                    None => self.set_kind(id, Kind::Await { job }),
                }
            }
            // Its block has waited for it.
            None if self.state.job_names.contains(name) => self.push_end(id, End::Done),
            None => self.fail(id, Raised::named("job", format!("job `{name}` has not been started"))),
        }
    }

    /// The innermost, latest job of this name around a frame, with the frame it belongs to.
    fn find_job(&self, id: FrameId, name: &str) -> Option<(FrameId, &Job)> {
        self.ancestors(id).find_map(|f| {
            let jobs = &self.state.frames.get(&f)?.jobs;
            jobs.iter().rev().find(|j| j.name == name).map(|j| (f, j))
        })
    }

    /// Someone takes the result of a job.
    fn take_job(&mut self, scope: FrameId, job: FrameId) {
        let jobs = self.state.frames.get_mut(&scope).map(|f| &mut f.jobs);
        for found in jobs.into_iter().flatten().filter(|j| j.frame == job) {
            found.awaited = true;
        }
    }

    /// Whether jobs started in a frame belong to it.
    pub(super) fn is_scope(&self, id: FrameId) -> bool {
        self.state.frames.get(&id).is_some_and(|f| {
            f.step.is_none()
                || matches!(
                    f.kind,
                    Kind::Guarded { .. } | Kind::Try { .. } | Kind::Monitored { .. } | Kind::Claim { .. }
                )
        })
    }

    /// The body of a frame ended: its jobs end before it goes on.
    pub(super) fn body_ended(&mut self, id: FrameId, end: End) {
        let Some(frame) = self.state.frames.get_mut(&id) else { return };
        let running: Vec<FrameId> = frame.jobs.iter().filter(|j| j.end.is_none()).map(|j| j.frame).collect();
        if running.is_empty() {
            return self.joined(id, end);
        }
        let stop = frame.stop.or((!matches!(end, End::Done)).then_some(Stop::Boundary));
        frame.joining = Some(end);
        if let Some(stop) = stop {
            running.into_iter().for_each(|job| self.stop(job, stop, false));
        }
    }

    pub(super) fn job_ended(&mut self, scope: FrameId, job: FrameId, end: End) {
        let waiting: Vec<FrameId> = self
            .state
            .frames
            .iter()
            .filter(|(_, f)| matches!(f.kind, Kind::Await { job: awaited } if awaited == job))
            .map(|(&id, _)| id)
            .collect();
        for id in waiting.into_iter().rev() {
            self.push_end(id, end.clone());
        }
        let Some(frame) = self.state.frames.get_mut(&scope) else { return };
        for ended in frame.jobs.iter_mut().filter(|j| j.frame == job) {
            ended.end = Some(end.clone());
        }
        if frame.jobs.iter().all(|j| j.end.is_some())
            && let Some(body) = frame.joining.take()
        {
            self.joined(scope, body);
        }
    }

    /// Body and jobs have ended; a failure that nobody has taken counts.
    fn joined(&mut self, id: FrameId, end: End) {
        let jobs = self.state.frames.get_mut(&id).map(|f| std::mem::take(&mut f.jobs)).unwrap_or_default();
        let lost = |job: Job| match job.end {
            Some(End::Failed(trace)) if !job.awaited => Some(trace),
            _ => None,
        };
        let mut lost = jobs.into_iter().filter_map(lost);
        let end = match end {
            End::Done => lost.next().map_or(End::Done, End::Failed),
            end => end,
        };
        lost.for_each(|trace| self.state.suppressed.push(*trace));
        if let Err(fault) = self.child_ended(id, end) {
            self.fault(id, fault);
        }
    }
}
