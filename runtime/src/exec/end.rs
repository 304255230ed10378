//! How each kind of step goes on when a step below it ends.

use matterix_ir::codes;
use matterix_ir::plan::{Caught, Step, StepId};

use super::failure::FailureTrace;
use super::frame::{End, Frame, FrameId, Kind, Phase, Stop};
use super::judge::Raised;
use super::listener::{OperationState, StepState};
use super::{Executor, tree};
use crate::fault::Fault;

impl<'p> Executor<'p, '_> {
    /// Ends a frame and tells its parent.
    pub(super) fn finish(&mut self, id: FrameId, end: End) {
        let Some(frame) = self.state.frames.remove(&id) else { return };
        self.leave(id, &frame, &end);
        let Some(parent) = frame.parent else {
            self.state.end = Some(self.stray(end));
            return;
        };
        if let Some(parent) = self.state.frames.get_mut(&parent) {
            parent.children.retain(|&c| c != id);
        }
        self.grant(false);
        if frame.job {
            let end = self.stray(end);
            self.job_ended(parent, id, end);
        } else {
            self.body_ended(parent, end);
        }
    }

    /// What a frame leaves behind: its state, its end time, what it held.
    fn leave(&mut self, id: FrameId, frame: &Frame, end: &End) {
        let plan = self.plan;
        self.state.claims.release(id);
        let Some(step) = frame.step else { return };
        match (&frame.kind, &plan.get(step).step) {
            (Kind::Operation { ticket, .. }, Step::Operation(operation)) => {
                self.backend.halt(*ticket);
                self.out.operation(self.state.now, step, operation, OperationState::Halted);
            }
            (Kind::Asked { ticket }, _) => self.backend.halt(*ticket),
            (
                Kind::WaitUntil { .. } | Kind::Hold { .. },
                Step::WaitUntil { condition, .. } | Step::Hold { condition, .. },
            ) if matches!(end, End::Done) => self.comes_behind(frame.parent, condition.node),
            (Kind::Named, Step::Named { end, .. }) => self.backend.set_local(*end, Some(self.state.now)),
            _ => {}
        }
        let state = match end {
            End::Done | End::Retry(_) => StepState::Done,
            End::Failed(_) => StepState::Failed,
            End::Stopped => StepState::Skipped,
        };
        self.mark(step, state);
    }

    /// A `retry` that no handler took is a failure.
    pub(super) fn stray(&mut self, end: End) -> End {
        let End::Retry(_) = end else { return end };
        let raised = Raised::named("retry", "`retry` is only for handlers");
        End::Failed(Box::new(self.trace(0, raised)))
    }

    /// Ends a frame as its child ended; while it is being stopped a failure is only reported.
    pub(super) fn conclude(&mut self, id: FrameId, end: End) {
        let stopped = self.state.frames.get(&id).is_some_and(|f| f.stop.is_some());
        let end = match end {
            End::Failed(trace) if stopped => {
                self.state.suppressed.push(*trace);
                End::Stopped
            }
            end => end,
        };
        self.push_end(id, end);
    }

    pub(super) fn child_ended(&mut self, id: FrameId, end: End) -> Result<(), Fault> {
        let Some(frame) = self.state.frames.get(&id) else { return Ok(()) };
        let stopped = frame.stop.is_some();
        match (&frame.kind, end) {
            (Kind::Sequence { .. }, End::Done) => self.next_in_sequence(id),
            (Kind::Parallel { .. }, end) => self.branch_ended(id, end),
            (Kind::Guarded { .. }, end) => self.guarded_ended(id, end),
            (Kind::Try { index }, End::Failed(trace)) if !stopped => {
                let next = index + 1;
                self.set_kind(id, Kind::Try { index: next });
                if !self.next_alternative(id, next) {
                    self.push_end(id, End::Failed(trace));
                }
            }
            (Kind::Monitored { .. }, end) => self.monitored_ended(id, end)?,
            (Kind::Repeat { .. } | Kind::RepeatWhile { .. }, End::Done) => self.turn(id)?,
            (_, end) => self.conclude(id, end),
        }
        Ok(())
    }

    /// Begins the next step of a sequence, or ends it.
    pub(super) fn next_in_sequence(&mut self, id: FrameId) {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get_mut(&id) else { return };
        let (Kind::Sequence { next }, Some(step)) = (&mut frame.kind, frame.step) else { return };
        let Step::Sequence(list) = &plan.get(step).step else { return };
        let child = list.get(*next).copied();
        *next += 1;
        match child {
            None => self.push_end(id, End::Done),
            Some(_) if frame.stop.is_some() => self.push_end(id, End::Stopped),
            Some(child) => {
                self.spawn(id, child);
            }
        }
    }

    /// Begins an alternative, or ends an empty `try`; whether there was one to begin.
    pub(super) fn next_alternative(&mut self, id: FrameId, index: usize) -> bool {
        let plan = self.plan;
        let Some(step) = self.state.frames.get(&id).and_then(|f| f.step) else { return false };
        let Step::Try(list) = &plan.get(step).step else { return false };
        if list.is_empty() {
            self.push_end(id, End::Done);
        }
        let child = list.get(index).map(|&child| self.spawn(id, child));
        child.is_some()
    }

    /// The first failure of a branch stops the others; the frame ends when all have.
    fn branch_ended(&mut self, id: FrameId, end: End) {
        let Some(frame) = self.state.frames.get_mut(&id) else { return };
        let Kind::Parallel { end: first } = &mut frame.kind else { return };
        let children = frame.children.clone();
        match (first.as_ref(), end) {
            (_, End::Done) => {}
            (None | Some(End::Stopped), end) => {
                *first = Some(end);
                children.iter().for_each(|&sibling| self.stop(sibling, Stop::Boundary, false));
            }
            (Some(_), End::Failed(trace)) => self.state.suppressed.push(*trace),
            (Some(_), _) => {}
        }
        if children.is_empty()
            && let Some(Kind::Parallel { end }) = self.state.frames.get(&id).map(|f| &f.kind)
        {
            let end = end.clone().unwrap_or(End::Done);
            self.conclude(id, end);
        }
    }

    fn guarded_ended(&mut self, id: FrameId, end: End) {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get_mut(&id) else { return };
        let (Kind::Guarded { phase, retries }, Some(step)) = (&mut frame.kind, frame.step) else { return };
        let Step::Guarded { body, handlers, finally } = &plan.get(step).step else { return };
        let stopped = frame.stop.is_some();
        match (std::mem::replace(phase, Phase::Body), end) {
            (Phase::Body, End::Failed(trace)) if !stopped => match handler(handlers, &trace) {
                Some(handler) => {
                    *phase = Phase::Handler(trace);
                    self.again(id, handler);
                }
                None => self.begin_finally(id, End::Failed(trace), *finally),
            },
            (Phase::Handler(_), End::Retry(times)) if !stopped && *retries < times => {
                *retries += 1;
                self.again(id, *body);
            }
            (Phase::Handler(trace), End::Retry(_)) => self.begin_finally(id, End::Failed(trace), *finally),
            (Phase::Finally(after), end) => self.after_finally(id, after, end),
            (_, end) => self.begin_finally(id, end, *finally),
        }
    }

    /// Runs the `finally`, if there is one, and keeps what is to be passed on.
    fn begin_finally(&mut self, id: FrameId, after: End, finally: Option<StepId>) {
        let Some(step) = finally else { return self.conclude(id, after) };
        if let Some(Kind::Guarded { phase, .. }) = self.state.frames.get_mut(&id).map(|f| &mut f.kind) {
            *phase = Phase::Finally(after);
        }
        self.spawn(id, step);
    }

    /// A failing `finally` fails a block that ended well and is reported beside one that did not.
    fn after_finally(&mut self, id: FrameId, after: End, end: End) {
        if matches!(end, End::Failed(_) | End::Stopped) {
            self.name_undone(id);
        }
        let end = match (after, self.stray(end)) {
            (End::Done | End::Retry(_), end @ (End::Failed(_) | End::Stopped)) => end,
            (after, End::Failed(trace)) => {
                self.state.suppressed.push(*trace);
                after
            }
            (after, _) => after,
        };
        self.conclude(id, end);
    }

    /// A `finally` broke off: what it would have done is said.
    fn name_undone(&mut self, id: FrameId) {
        let plan = self.plan;
        let Some(Step::Guarded { finally: Some(finally), .. }) =
            self.state.frames.get(&id).and_then(|f| f.step).map(|step| &plan.get(step).step)
        else {
            return;
        };
        let begun = self.state.steps[finally.0 as usize].started;
        let (mut undone, mut open) = (Vec::new(), vec![*finally]);
        while let Some(step) = open.pop() {
            let record = &self.state.steps[step.0 as usize];
            let is_begun = record.started.is_some() && record.started >= begun;
            let node = &plan.get(step).step;
            match node {
                Step::Operation(_) | Step::Ask(_) if !is_begun => undone.push(step),
                _ if is_begun && record.state == StepState::Done => {}
                _ => open.extend(node.children()),
            }
        }
        undone.sort_by_key(|step| plan.get(*step).span.start);
        let labels: Vec<String> = undone.iter().map(|id| format!("`{}`", plan.get(*id).label)).collect();
        if !labels.is_empty() {
            let raised =
                Raised::named("unfinished", format!("a `finally` stopped early: {} did not run", labels.join(", ")));
            let trace = self.trace(id, Raised { span: Some(plan.get(*finally).span), ..raised });
            self.state.suppressed.push(trace);
        }
    }

    /// Begins the next turn of a loop, or ends it.
    pub(super) fn turn(&mut self, id: FrameId) -> Result<(), Fault> {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get(&id) else { return Ok(()) };
        let (kind, stopped) = (frame.kind.clone(), frame.stop.is_some());
        let Some(step) = frame.step else { return Ok(()) };
        match (kind, &plan.get(step).step) {
            (Kind::Repeat { left: 0 }, _) => self.push_end(id, End::Done),
            (Kind::Repeat { .. } | Kind::RepeatWhile { .. }, _) if stopped => self.push_end(id, End::Stopped),
            (Kind::Repeat { left }, Step::Repeat { body, .. }) => {
                self.set_kind(id, Kind::Repeat { left: left - 1 });
                self.again(id, *body);
            }
            (Kind::RepeatWhile { left, first }, Step::RepeatWhile { condition, body, .. }) => {
                let holds = self.holds(condition)?;
                if holds.is_none() && first {
                    self.assume(step, condition);
                }
                if !holds.unwrap_or(first) {
                    self.push_end(id, End::Done);
                } else if left == 0 {
                    let text = format!("`{}` is still true after the last turn", condition.text);
                    let raised = self.unmet(condition, "max", codes::RUN_FAILED, text);
                    self.fail(id, raised);
                } else {
                    self.set_kind(id, Kind::RepeatWhile { left: left - 1, first: false });
                    self.again(id, *body);
                }
            }
            _ => self.push_end(id, End::Done),
        }
        Ok(())
    }

    /// Begins a step that may have run before: what is below it is pending again.
    fn again(&mut self, parent: FrameId, step: StepId) {
        for below in tree::subtree(self.plan, step) {
            if self.state.steps[below.0 as usize].state != StepState::Pending {
                self.mark(below, StepState::Pending);
            }
        }
        self.spawn(parent, step);
    }
}

/// The first handler that takes a failure.
fn handler(handlers: &[(Caught, StepId)], trace: &FailureTrace) -> Option<StepId> {
    let takes = |caught: &Caught| match caught {
        Caught::Any => true,
        Caught::Named(name) => *name == trace.name,
    };
    handlers.iter().find(|(caught, _)| takes(caught)).map(|(_, step)| *step)
}
