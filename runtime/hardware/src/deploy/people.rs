//! Questions to people, and what they answer.

use matterix_ir::plan::StepId;
use matterix_runtime::backend::{Backend, Ticket};
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;

use super::control::Answer;
use super::hardware::Hardware;
use super::journal::Entry;

impl Hardware<'_, '_> {
    /// Puts a question, unless the earlier process has put it.
    pub(super) fn put(
        &mut self,
        ticket: Ticket,
        step: StepId,
        text: String,
        out: &mut dyn Listener,
    ) -> Result<(), Fault> {
        match self.next_entry() {
            Some(Entry::Asked { ticket: before, step: at, text: was, .. })
                if before == ticket.0 && at == step.0 && was == text =>
            {
                self.replay.pop_front();
            }
            Some(other) => return Err(self.mismatch(&format!("`{text}` is asked"), &other)),
            None => {
                self.go_live(out)?;
                let (t, wall) = (self.twin.now(), self.wall());
                // Put first: whoever reads in the journal that it was asked can answer it.
                self.settings.control.ask(ticket.0, &text);
                let asked = self.keep(&Entry::Asked { t, ticket: ticket.0, step: step.0, text: text.clone(), wall });
                asked.inspect_err(|_| self.settings.control.withdraw(ticket.0))?;
            }
        }
        self.questions.insert(ticket, text);
        Ok(())
    }

    /// What was answered, once.
    pub(super) fn answer(&mut self, ticket: Ticket) -> Result<Option<Answer>, Fault> {
        if !self.questions.contains_key(&ticket) {
            return Ok(None);
        }
        let answer = match self.front() {
            Some(Entry::Answered { t, ticket: of, yes, who, .. }) if of == ticket.0 && t <= self.twin.now() => {
                self.replay.pop_front();
                Answer { yes, who }
            }
            Some(_) => return Ok(None),
            None => {
                let Some(answer) = self.settings.control.answered(ticket.0) else { return Ok(None) };
                let (t, wall) = (self.twin.now(), self.wall());
                let Answer { yes, who } = answer.clone();
                self.keep(&Entry::Answered { t, ticket: ticket.0, yes, who, wall })?;
                answer
            }
        };
        self.questions.remove(&ticket);
        self.fresh.clear();
        if answer.yes && self.is_live() {
            self.check_settings()?;
        }
        if let Some(fault) = self.replayed_fault() {
            return Err(fault);
        }
        Ok(Some(answer))
    }

    /// Puts questions again that the earlier process has not had an answer to.
    pub(super) fn ask_again(&mut self) {
        for (ticket, text) in &self.questions {
            self.settings.control.ask(ticket.0, text);
        }
    }
}
