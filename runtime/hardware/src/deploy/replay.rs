//! What an earlier process wrote, gone through again.

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::{Op, Span, codes};
use matterix_runtime::backend::Backend;
use matterix_runtime::fault::Fault;

use super::hardware::Hardware;
use super::journal::Entry;

/// What became of an operation that an earlier process began.
pub(super) enum Begun {
    /// Its device was told, or refused: the failure and what it says.
    Told(Option<(String, String)>),
    /// Something went wrong before it was told, or as it was.
    Not,
}

impl Hardware<'_, '_> {
    /// The next line of the earlier process that says what came from outside. Where it was gone on with in between, the lab has
    /// come to the time of that.
    pub(super) fn next_entry(&mut self) -> Option<Entry> {
        while let Some(Entry::Resumed { t, .. }) = self.front() {
            self.next_process(t);
        }
        self.front()
    }

    /// Another process went on here: the lab has come to the time of that, s.
    pub(super) fn next_process(&mut self, t: f64) {
        self.replay.pop_front();
        while self.twin.now() < t && self.twin.advance(t, &[], &mut ()).is_ok() {}
        self.forget_beats();
    }

    /// The next line that matters to the plan, wherever the lab is by then.
    pub(super) fn front(&mut self) -> Option<Entry> {
        while let Some(entry) = self.replay.front() {
            match entry {
                Entry::Opened { .. }
                | Entry::Clock { .. }
                | Entry::Kept { .. }
                | Entry::Out { .. }
                | Entry::ReadBack { .. }
                | Entry::Back { .. }
                | Entry::Again { .. }
                | Entry::Begin { .. }
                | Entry::Bound { .. }
                | Entry::Safe { .. }
                | Entry::End { .. } => {
                    self.replay.pop_front();
                }
                Entry::HeldUp { t, seconds } => {
                    self.held_up.push((*t, *seconds));
                    self.replay.pop_front();
                }
                other => return Some(other.clone()),
            }
        }
        None
    }

    /// The fault that the earlier process met at this moment.
    pub(super) fn replayed_fault(&mut self) -> Option<Fault> {
        let Some(Entry::Fault { t, tickets, fed, lost, code, text }) = self.front() else { return None };
        if t > self.twin.now() || (tickets, fed) != (self.tickets, self.fed) {
            return None;
        }
        self.replay.pop_front();
        let code = codes::find(&code).unwrap_or(codes::RUN_FAILED);
        let fault = self.fault(code, None::<Span>, text);
        if let Some(device) = self.devices.iter_mut().find(|d| Some(d.name) == lost.as_deref()) {
            device.lost = Some(fault.message.clone());
        }
        Some(fault)
    }

    pub(super) fn mismatch(&self, now: &str, before: &Entry) -> Fault {
        self.refused.set(true);
        let before = serde_json::to_string(before).unwrap_or_default();
        let message = format!("the journal does not fit the plan: {now}, but the journal has `{before}`");
        let mut fault = self.fault(codes::JOURNAL_MISMATCH, None::<Span>, message);
        fault.help.push("start again with a new journal".to_owned());
        fault
    }

    pub(super) fn span_text(&self, span: Span) -> String {
        let file = self.sources.get(span.file).map_or("", |f| f.name.as_str());
        let (line, column) = self.sources.line_column(span);
        format!("{file}:{line}:{column}")
    }

    /// What an operation's device did, as the earlier process has it.
    pub(super) fn replayed_start(
        &mut self,
        ticket: u64,
        step: StepId,
        label: &str,
        texts: &[String],
    ) -> Result<Option<Begun>, Fault> {
        let mut half_said = false;
        loop {
            let Some(entry) = self.next_entry() else {
                return if half_said { self.once_more(step, texts).map(|()| None) } else { Ok(None) };
            };
            if matches!(&entry, Entry::Fault { t, tickets, .. } if *t <= self.twin.now() && *tickets == self.tickets) {
                return Ok(Some(Begun::Not));
            }
            match entry {
                Entry::Started { ticket: t, .. } if half_said && t == ticket => {
                    self.replay.pop_front();
                    return Ok(Some(Begun::Told(None)));
                }
                Entry::Ended { ticket: t, failed, .. } if half_said && t == ticket => {
                    self.replay.pop_front();
                    return Ok(Some(Begun::Told(failed)));
                }
                // Another process has said it once more.
                Entry::Starting { t, ticket: before, step: at, ref sends, .. }
                    if before == ticket && at == step.0 && t == self.twin.now() =>
                {
                    if sends != texts {
                        let sends = texts.join("`, `");
                        return Err(self.mismatch(&format!("`{label}` sends `{sends}`"), &entry));
                    }
                    self.replay.pop_front();
                    half_said = true;
                }
                other => {
                    let now = show_number(self.twin.now());
                    return Err(self.mismatch(&format!("`{label}` starts at {now} s"), &other));
                }
            }
        }
    }

    /// What was cut off while it was being said is said once more only where that changes nothing.
    fn once_more(&mut self, step: StepId, sends: &[String]) -> Result<(), Fault> {
        let planned = self.program.plan.get(step);
        let Step::Operation(operation) = &planned.step else { return Ok(()) };
        if self.is_repeatable(operation, step) {
            self.half_said = operation.at_start.iter().chain(&operation.at_end).filter_map(Action::assigned).collect();
            return Ok(());
        }
        self.refused.set(true);
        let message = format!(
            "it is unknown whether `{}` was sent for `{}` before the journal stopped",
            sends.join("`, `"),
            planned.label
        );
        let mut fault = self.fault(codes::JOURNAL_MISMATCH, planned.span, message);
        fault.help.push("the device may have acted: check it, then start again from there".to_owned());
        Err(fault)
    }

    /// Whether saying it twice does what saying it once does: it only sets what does not depend on itself, at once. What a command
    /// does that sets nothing is not known.
    pub(super) fn is_repeatable(&self, operation: &Operation, step: StepId) -> bool {
        let lasts = self.devices.iter().filter_map(|d| d.driver?.call(step)).any(|e| e.until.is_some());
        let graph = &self.program.model.graph;
        let rests = |set: &[u32]| {
            let is_set = |op: &Op| matches!(op, Op::State(state) if set.contains(state));
            operation.at_start.iter().chain(&operation.at_end).any(|action| graph.depends(action.source(), is_set))
        };
        let only_sets = operation.assigned().is_some_and(|set| !rests(&set));
        !lasts && operation.until.is_none() && only_sets
    }
}
