//! What must not be: a failure of the step that brings it about, or that goes on where it comes about.

use matterix_ir::plan::StepId;

use super::Executor;
use super::failure::FailureTrace;
use super::frame::{End, FrameId};
use super::judge::Raised;
use super::listener::Alarm;

impl Executor<'_, '_> {
    /// Fails the steps that go on where something has come about that must not be.
    pub(super) fn alarmed(&mut self) {
        while let Some(alarm) = self.out.alarm() {
            let id = self.concerned(&alarm.around);
            self.sound(id, alarm);
        }
    }

    /// Fails a frame by what it has just brought about; whether there was anything.
    pub(super) fn alarmed_by(&mut self, id: FrameId) -> bool {
        let Some(alarm) = self.out.alarm() else { return false };
        self.sound(id, alarm);
        while let Some(more) = self.out.alarm() {
            let trace = self.trace_of(id, more);
            self.out.failure(&trace);
            self.state.suppressed.push(trace);
        }
        true
    }

    /// Fails a frame.
    pub(super) fn sound(&mut self, id: FrameId, alarm: Alarm) {
        let trace = self.trace_of(id, alarm);
        self.out.failure(&trace);
        self.push_end(id, End::Failed(Box::new(trace)));
    }

    fn trace_of(&self, id: FrameId, alarm: Alarm) -> FailureTrace {
        let Alarm { name, found, .. } = alarm;
        let raised = Raised { code: found.code, ..Raised::named(&name, found.headline) };
        FailureTrace { help: found.help, ..self.trace(id, raised) }
    }

    /// What goes on now in the innermost of some steps that has not ended, the latest last.
    fn concerned(&self, around: &[StepId]) -> FrameId {
        let runs =
            |step: &StepId| self.state.frames.iter().rev().find(|(_, f)| f.step == Some(*step)).map(|(&id, _)| id);
        let mut id = around.iter().find_map(runs).unwrap_or_default();
        while let Some(frame) = self.state.frames.get(&id) {
            let is_job = |child: &&FrameId| self.state.frames.get(child).is_some_and(|f| f.job);
            let own = frame.children.iter().rev().find(|child| !is_job(child));
            let Some(&next) = own.or(frame.children.last()) else { break };
            id = next;
        }
        id
    }
}
