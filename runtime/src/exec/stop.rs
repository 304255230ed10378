//! Stopping: of subtrees after failures and breaches, of the whole run on cancellation and fault.

use matterix_ir::codes;

use super::failure::FailureTrace;
use super::frame::{End, FrameId, Kind, Stop};
use super::judge::Raised;
use super::{Abort, Executor};
use crate::fault::Fault;

impl Executor<'_, '_> {
    /// Marks a frame and those below it to end early; `pierce` reaches into a `finally` that runs, too.
    pub(super) fn stop(&mut self, id: FrameId, stop: Stop, pierce: bool) {
        let mut open = vec![id];
        let mut over = Vec::new();
        while let Some(id) = open.pop() {
            let Some(frame) = self.state.frames.get_mut(&id) else { continue };
            frame.stop = frame.stop.max(Some(stop));
            let halted = stop == Stop::Now && matches!(frame.kind, Kind::Operation { .. });
            if frame.waits() || halted {
                over.push(id);
            }
            if pierce || !frame.shields() {
                open.extend(frame.children.iter().rev());
            }
        }
        for id in over.into_iter().rev() {
            self.push_end(id, End::Stopped);
        }
    }

    /// Stops the whole plan.
    pub(super) fn stop_all(&mut self, stop: Stop, pierce: bool) {
        self.stop(0, stop, pierce);
    }

    /// A frame cannot go on: the run ends, or the `finally` it stands in if the run is ending already.
    pub(super) fn fault(&mut self, id: FrameId, fault: Fault) {
        let is_asked = |id| self.state.frames.get(&id).is_some_and(|f| f.asked);
        let is_of_numbers = matches!(
            fault.code,
            codes::UNUSABLE_NUMBER | codes::TRANSFER_FRACTION | codes::NOT_A_NUMBER | codes::ENDLESS_INSTANT
        );
        // Who asks for what cannot be is told so; others are left alone.
        if is_of_numbers && (is_asked(id) || self.ancestors(id).any(is_asked)) {
            return self
                .fail(id, Raised { code: fault.code, span: fault.span, ..Raised::named("unusable", fault.message) });
        }
        let trace = self.fault_trace(id, fault);
        self.abort(trace);
        self.stop_all(Stop::Now, false);
        let in_finally = std::iter::once(id)
            .chain(self.ancestors(id))
            .find(|&f| self.parent(f).and_then(|p| self.state.frames.get(&p)).is_some_and(super::Frame::shields));
        if let Some(root) = in_finally {
            self.stop(root, Stop::Now, true);
        }
        if self.state.frames.get(&id).is_some_and(|f| f.children.is_empty()) {
            self.push_end(id, End::Stopped);
        }
    }

    /// The backend cannot go on: everything that runs is given up; each `finally` not yet begun still gets its turn.
    pub(super) fn fault_everywhere(&mut self, fault: Fault) {
        let leaf = self.state.frames.iter().find(|(_, f)| f.children.is_empty() && f.step.is_some()).map(|(&id, _)| id);
        let trace = match leaf {
            Some(id) => self.fault_trace(id, fault),
            None => FailureTrace::of_fault(self.plan, fault),
        };
        self.abort(trace);
        self.stop_all(Stop::Now, true);
    }

    fn fault_trace(&self, id: FrameId, fault: Fault) -> FailureTrace {
        let raised = Raised {
            name: fault.code.name.to_owned(),
            text: fault.message,
            code: fault.code,
            span: fault.span,
            measured: Vec::new(),
            help: None,
        };
        FailureTrace {
            fault: true,
            time: fault.time,
            help: fault.help,
            because: fault.because,
            ..self.trace(id, raised)
        }
    }

    pub(super) fn abort(&mut self, trace: FailureTrace) {
        self.out.failure(&trace);
        match self.state.abort {
            None => self.state.abort = Some(Abort::Fault(Box::new(trace))),
            Some(_) => self.state.suppressed.push(trace),
        }
    }
}
