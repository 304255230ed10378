//! From the journal of an earlier process to devices: the beginning and the end of a journal, and what must be so in between.

use matterix_ir::codes;
use matterix_ir::quantity::show_number;
use matterix_runtime::backend::Backend;
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;

use super::hardware::{Hardware, Mode};
use super::identity::first_said;
use super::journal::{Entry, VERSION};
use super::moved::places;
use super::preflight::asked_for;
use crate::link::DeviceError;

/// So much may the clock of the machine have been set back, s, before nobody knows how long devices were alone.
const SET_BACK: f64 = 1.0;

impl Hardware<'_, '_> {
    /// The first line of a journal.
    pub fn begin_journal(&mut self, digest: &str, seed: u64, who: &str) -> Result<(), Fault> {
        let (digest, workflow, speed) = (digest.to_owned(), self.program.plan.workflow.clone(), self.settings.speed);
        let (tool, pid) = (env!("CARGO_PKG_VERSION").to_owned(), std::process::id());
        let (wall, who) = (self.wall(), who.to_owned());
        self.keep(&Entry::Begin { version: VERSION, tool, digest, workflow, wall, speed, seed, pid, who })?;
        self.note_places();
        Ok(())
    }

    /// The last line of a journal.
    pub fn end_journal(&mut self, status: &str) -> Result<(), Fault> {
        let (t, wall, states) = (self.twin.now(), self.wall(), self.states());
        self.keep(&Entry::End { t, status: status.to_owned(), wall, states })
    }

    /// Goes through what an earlier process wrote before anything is said; `who` goes on after it.
    pub fn follow_journal(&mut self, entries: Vec<Entry>, who: &str) {
        let mut begins = None;
        for entry in &entries {
            match entry {
                Entry::Starting { ticket, .. } => begins = Some(*ticket),
                Entry::Started { .. } | Entry::Ended { .. } => begins = None,
                Entry::Kept { device, word, text, .. } => {
                    if let Some(ticket) = begins {
                        self.begun_with.entry(ticket).or_default().push((word.clone(), text.clone()));
                    }
                    if let Some(index) = self.devices.iter().position(|d| d.name == device) {
                        let instance = self.devices[index].binding.instance;
                        self.kept.push((self.line_of(index), instance, word.clone(), text.clone()));
                    }
                }
                _ => {}
            }
        }
        self.ends_at = match entries.last() {
            Some(Entry::End { t, .. }) => *t,
            _ => f64::INFINITY,
        };
        self.left_at = self.last_seen(&entries);
        self.places = places(&entries);
        self.said_first = first_said(&entries);
        if self.settings.mode != Mode::Replay {
            self.expose();
        }
        self.replay = entries.into();
        self.resuming = true;
        self.who = who.to_owned();
    }

    /// Lab time and s since 1970 at the last line: the clock went on from the last line that says what it showed.
    fn last_seen(&self, entries: &[Entry]) -> (f64, f64) {
        let last = entries.last().map_or(0.0, Entry::time);
        let dated = entries.iter().rev().find_map(|e| Some((e.time(), e.wall()?)));
        let (then, wall) = dated.unwrap_or_else(|| (last, self.wall()));
        (last, wall + (last - then).max(0.0) / self.settings.speed)
    }

    /// The lab time that the clock has come to when a journal is gone on with, s.
    pub(super) fn catches_up_to(&mut self) -> f64 {
        let (then, wall) = self.left_at;
        let to = then + (self.wall() - wall).max(0.0) * self.settings.speed;
        *self.caught_up.get_or_insert(to)
    }

    /// From what was written to what is: the twin catches up with the clock, devices are asked, and must agree.
    pub(super) fn go_live(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        if self.settings.mode == Mode::Replay {
            self.refused.set(true);
            let message = "the journal ends before the plan does".to_owned();
            return Err(self.fault(codes::JOURNAL_MISMATCH, None::<matterix_ir::Span>, message));
        }
        if !std::mem::take(&mut self.resuming) {
            return Ok(());
        }
        self.catch_up(out).map_err(|fault| {
            self.refused.set(true);
            if self.unreached.is_some() {
                self.journal.seal();
            }
            let code = if fault.code == codes::DIVERGED { codes::JOURNAL_MISMATCH } else { fault.code };
            Fault { code, ..fault }
        })
    }

    fn catch_up(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        let back = self.left_at.1 - self.wall();
        if back > SET_BACK {
            let message = format!(
                "the clock of this computer is {} s before the last line of the journal: the time without contact to the devices is unknown",
                show_number(back)
            );
            let mut fault = self.fault(codes::JOURNAL_MISMATCH, None::<matterix_ir::Span>, message);
            fault.help.push("set the clock, or start again with a new journal".to_owned());
            return Err(fault);
        }
        let watchdogs = self.watchdogs();
        self.in_time(&watchdogs)?;
        let then = self.catches_up_to();
        while self.twin.now() < then {
            self.twin.advance(then, &[], out)?;
        }
        self.forget_beats();
        self.set_clock();
        self.are_the_same()?;
        self.check_devices()?;
        self.in_time(&watchdogs)?;
        // Only now: a watchdog has heard nothing yet, and where nobody answered the journal is as it was.
        let (t, wall, pid, who) = (self.twin.now(), self.wall(), std::process::id(), self.who.clone());
        self.keep(&Entry::Resumed { t, wall, pid, who })?;
        self.note_places();
        self.answers = 0;
        self.half_said.clear();
        self.ask_again();
        Ok(())
    }

    /// Watchdogs have not tripped meanwhile.
    fn in_time(&mut self, watchdogs: &[(usize, f64, f64)]) -> Result<(), Fault> {
        let away = (self.wall() - self.left_at.1).max(0.0) * self.settings.speed;
        let Some((device, left, patience)) = watchdogs.iter().find(|(_, left, _)| away > *left) else { return Ok(()) };
        let (device, span) =
            (&self.devices[*device], self.devices[*device].driver.map_or_else(Default::default, |d| d.span));
        let message = format!(
            "`{}` has received nothing for {} s, longer than its watchdog waits ({} s): it may have stopped",
            device.name,
            show_number(away + patience - left),
            show_number(*patience)
        );
        let mut fault = self.fault(codes::JOURNAL_MISMATCH, span, message);
        fault.help.push("check the device, then start again with a new journal".to_owned());
        Err(fault)
    }

    /// Devices answer what the workflow asks of them, and are as they were told to be.
    fn check_devices(&mut self) -> Result<(), Fault> {
        let used = asked_for(self.program, &self.observed);
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver else { continue };
            for (line, told) in driver.told.iter().enumerate() {
                let holds = self.applies(told);
                let was_set = told.state.is_some_and(|s| self.commanded.contains(&s));
                let is_unknown = told.state.is_some_and(|s| self.half_said.contains(&s));
                if !holds || is_unknown || !(was_set || used.contains(&told.value)) {
                    continue;
                }
                let value = match self.tell(device, line) {
                    Err(fault) if fault.code == codes::DEVICE_LOST => {
                        let why = self.devices[self.line_of(device)].lost.clone();
                        let trouble = DeviceError::Lost(why.unwrap_or_else(|| fault.message.clone()));
                        self.unreached = Some(self.not_reached(device, trouble));
                        return Err(fault);
                    }
                    told => told?,
                };
                if told.state.is_some() && !was_set {
                    continue;
                }
                if told.reading.is_none()
                    && self.observed.is_settled(&self.program.model, told.value)
                    && !self.is_busy(device)
                {
                    self.settled(device, line, value)?;
                } else {
                    self.held_against(device, line, value)?;
                }
            }
        }
        Ok(())
    }

    /// Devices still are as they were told to be: asked where time has passed that the plan does not foresee.
    pub(super) fn check_settings(&mut self) -> Result<(), Fault> {
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver.filter(|_| !self.is_dry()) else { continue };
            let is_busy = self.is_busy(device);
            for (line, told) in driver.told.iter().enumerate() {
                let holds = self.applies(told);
                let was_set = told.state.is_some_and(|s| self.commanded.contains(&s));
                if holds && was_set && !is_busy && self.observed.is_settled(&self.program.model, told.value) {
                    let value = self.read_again(device, line)?;
                    self.settled(device, line, value)?;
                }
            }
        }
        Ok(())
    }
}
