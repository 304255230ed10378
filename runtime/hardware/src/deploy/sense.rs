//! Opening lines, holding what devices tell against the twin, going on after a journal, and leaving devices safe.

use matterix_ir::codes;
use matterix_ir::wire::Driver;
use matterix_runtime::backend::Backend;
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;

use super::device::Carrier;
use super::hardware::{Hardware, Mode, wall};
use super::journal::Entry;
use crate::link::{self, Line, Trouble};
use crate::port::Place;

/// Rounding, in units of the last digit that a device tells.
const ROUNDING: f64 = 0.51;

impl Hardware<'_, '_> {
    /// Opens all lines and says what drivers say then. On going on after a journal, only what moves and resets nothing.
    pub fn open(&mut self, again: bool) -> Result<(), Fault> {
        for index in 0..self.devices.len() {
            let device = &self.devices[index];
            let (Some(driver), name) = (device.driver, device.name) else { continue };
            if let (Carrier::Line { place, address, .. }, false) = (device.binding.carrier.clone(), self.is_dry()) {
                match self.linked(index, driver, &place, address.as_deref()) {
                    Ok(link) => self.devices[index].link = Some(link),
                    Err(trouble) => return Err(self.trouble(index, &trouble, driver.span)),
                }
            }
            for exchange in driver.open.iter().filter(|_| !again) {
                let texts = self.texts(&exchange.sends);
                self.say(index, &texts, exchange.expects.as_ref(), exchange.span)?;
                let Some(until) = exchange.until.as_ref().filter(|_| !self.is_dry()) else { continue };
                let text = self.texts(std::slice::from_ref(&until.asks)).concat();
                let tries = (self.twin.engine().eval(until.timeout) / 0.1).ceil().clamp(1.0, 1e6) as u32;
                let mut ready = false;
                for _ in 0..tries {
                    let asked = self.over(index, |link, driver, ear| link.is_ready(&text, until, driver, ear));
                    ready = asked.map_err(|trouble| self.trouble(index, &trouble, exchange.span))?;
                    if ready {
                        break;
                    }
                    std::thread::sleep(std::time::Duration::from_millis(100));
                }
                if !ready {
                    let message = format!("`{name}` was not ready in time");
                    return Err(self.fault(codes::DEVICE_LOST, exchange.span, message));
                }
            }
        }
        self.set_clock();
        if !again {
            let t = self.twin.now();
            self.keep(&Entry::Opened { t })?;
        }
        Ok(())
    }

    /// A new line to a device, with what answers over an earlier one said.
    fn linked(
        &self,
        index: usize,
        driver: &Driver,
        place: &Place,
        address: Option<&str>,
    ) -> Result<Box<dyn Line>, Trouble> {
        let mut link = link::open(place, driver, address)?;
        for (_, word, text) in self.kept.iter().filter(|(line, ..)| *line == index) {
            link.keep(word.clone(), text.clone());
        }
        Ok(link)
    }

    #[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
    pub(super) fn set_clock(&mut self) {
        self.origin = (self.twin.now(), std::time::Instant::now());
    }

    /// Goes through what an earlier process wrote before anything is said.
    pub fn follow_journal(&mut self, entries: Vec<Entry>) {
        let last = entries.iter().rev().find_map(|e| match e {
            Entry::Time { wall, .. } | Entry::Resumed { wall, .. } | Entry::Begin { wall, .. } => Some(*wall),
            _ => None,
        });
        for entry in &entries {
            let Entry::Kept { device, word, text, .. } = entry else { continue };
            if let Some(index) = self.devices.iter().position(|d| d.name == device) {
                self.kept.push((self.line_of(index), word.clone(), text.clone()));
            }
        }
        self.left_at = last.unwrap_or_else(wall);
        self.replay = entries.into();
        self.resuming = true;
    }

    /// From what was written to what is: the twin catches up with the clock, devices are asked, and must agree.
    pub(super) fn go_live(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        if !std::mem::take(&mut self.resuming) {
            return Ok(());
        }
        self.catch_up(out).map_err(|fault| {
            self.refused.set(true);
            let code = if fault.code == codes::DIVERGED { codes::JOURNAL_MISMATCH } else { fault.code };
            Fault { code, ..fault }
        })
    }

    fn catch_up(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        let away = (wall() - self.left_at).max(0.0) * self.settings.speed;
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver else { continue };
            for alive in &driver.alive {
                let every = self.twin.engine().eval(alive.every);
                if self.twin.engine().eval(alive.condition) != 0.0 && away > every {
                    let name = self.devices[device].name;
                    let message = format!(
                        "nothing was said to `{name}` for {} s, while its driver says something every {} s so that it goes on",
                        matterix_ir::quantity::show_number(away),
                        matterix_ir::quantity::show_number(every)
                    );
                    let mut fault = self.fault(codes::JOURNAL_MISMATCH, driver.span, message);
                    fault.help.push("its watchdog may have stopped it: begin anew".to_owned());
                    return Err(fault);
                }
            }
        }
        let then = self.twin.now() + away;
        while self.twin.now() < then {
            self.twin.advance(then, &[], out)?;
        }
        self.open(true)?;
        let (t, wall) = (self.twin.now(), wall());
        self.keep(&Entry::Resumed { t, wall })?;
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver else { continue };
            for (line, told) in driver.told.iter().enumerate() {
                let holds = told.condition.is_none_or(|c| self.twin.engine().eval(c) != 0.0);
                if !holds {
                    continue;
                }
                let value = self.tell(device, line)?;
                if told.state.is_some_and(|s| !self.commanded.contains(&s)) {
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

    /// What is told of what was commanded must be that.
    pub(super) fn settled(&mut self, device: usize, line: usize, value: f64) -> Result<(), Fault> {
        let Some(told) = self.devices[device].driver.and_then(|d| d.told.get(line)) else { return Ok(()) };
        let wanted = self.twin.engine().eval(told.value);
        let unit = told.expects.slots.iter().find_map(|s| match s {
            matterix_ir::wire::Slot::Number(unit) => Some(unit),
            _ => None,
        });
        let Some(unit) = unit else { return Ok(()) };
        let step = 10f64.powi(-i32::from(self.digits_sent(device, unit)));
        if (unit.of_si(value) - unit.of_si(wanted)).abs() <= ROUNDING * step {
            return Ok(());
        }
        let (name, is, was) = (&told.name, unit.show(value), unit.show(wanted));
        let message = format!("`{name}` is {is} on the device, not {was} as it was told");
        let span = told.span;
        Err(self.fault(codes::DIVERGED, span, message))
    }

    /// Digits after the point with which a device is sent numbers in this unit.
    fn digits_sent(&self, device: usize, unit: &matterix_ir::Unit) -> u8 {
        let calls = self.devices[device].driver.into_iter().flat_map(|d| &d.calls);
        let pieces = calls.flat_map(|(_, e)| &e.sends).flat_map(|t| &t.pieces);
        let digits = pieces.filter_map(|p| match p {
            matterix_ir::wire::Piece::Number { unit: sent, digits, .. } if sent.symbol == unit.symbol => *digits,
            _ => None,
        });
        digits.max().unwrap_or(0)
    }

    /// Where devices are shadowed, what is told may not be far from what the twin supposes.
    pub(super) fn compared(&mut self, device: usize, line: usize, value: f64) -> Result<(), Fault> {
        if self.settings.mode == Mode::Shadow { self.held_against(device, line, value) } else { Ok(()) }
    }

    fn held_against(&mut self, device: usize, line: usize, value: f64) -> Result<(), Fault> {
        let Some(told) = self.devices[device].driver.and_then(|d| d.told.get(line)) else { return Ok(()) };
        let member = told.name.strip_prefix(self.devices[device].name).unwrap_or(&told.name).trim_start_matches('.');
        let tolerance = self.devices[device].binding.tolerances.iter().find(|(m, _)| m == member).map(|(_, t)| *t);
        let node = match told.reading.and_then(|r| self.program.model.readings.get(r as usize)) {
            Some(reading) => reading.value,
            None => told.value,
        };
        let supposed = self.twin.engine().eval(node);
        match tolerance {
            Some(tolerance) if (value - supposed).abs() > tolerance => {
                let (name, is, twin) = (&told.name, told.unit.show(value), told.unit.show(supposed));
                let apart = matterix_ir::quantity::show_number((value - supposed).abs() / told.unit.factor.abs());
                let message = format!("`{name}` is {is}, {apart} from the {twin} of the twin");
                let span = told.span;
                let mut fault = self.fault(codes::DIVERGED, span, message);
                fault.help.push("the device or the model is not what it was taken for".to_owned());
                Err(fault)
            }
            _ => Ok(()),
        }
    }

    /// After a run that did not end well: every device is told what makes it safe, whatever became of the others.
    pub fn secure(&mut self) -> Vec<String> {
        let mut troubles = Vec::new();
        for index in 0..self.devices.len() {
            let Some(driver) = self.devices[index].driver else { continue };
            if self.devices[index].link.is_none() && !self.is_dry() && !driver.safe.is_empty() {
                // A line that was lost may be there again.
                if let Carrier::Line { place, address, .. } = self.devices[index].binding.carrier.clone() {
                    self.devices[index].link = self.linked(index, driver, &place, address.as_deref()).ok();
                    if self.devices[index].link.is_some() {
                        self.devices[index].lost = None;
                    }
                }
            }
            let line = self.line_of(index);
            for exchange in &driver.safe {
                let texts = self.texts(&exchange.sends);
                if self.devices[line].link.as_ref().is_some_and(|link| link.lacks(&texts)) {
                    continue;
                }
                if let Err(fault) = self.say(index, &texts, exchange.expects.as_ref(), exchange.span) {
                    troubles.push(fault.message);
                    break;
                }
            }
        }
        troubles
    }

    /// Says what drivers say at the end, and closes all lines.
    pub fn close(&mut self) -> Result<(), Fault> {
        let mut first = Ok(());
        for index in 0..self.devices.len() {
            let Some(driver) = self.devices[index].driver.filter(|_| self.devices[index].lost.is_none()) else {
                continue;
            };
            for exchange in &driver.close {
                let texts = self.texts(&exchange.sends);
                let said = self.say(index, &texts, exchange.expects.as_ref(), exchange.span);
                first = first.and(said.map(|_| ()));
            }
            self.devices[index].link = None;
        }
        first
    }

    /// The first line of a journal.
    pub fn begin_journal(&mut self, digest: &str) -> Result<(), Fault> {
        let (digest, workflow, speed) = (digest.to_owned(), self.program.plan.workflow.clone(), self.settings.speed);
        self.keep(&Entry::Begin { version: super::journal::VERSION, digest, workflow, wall: wall(), speed })
    }

    /// The last line of a journal.
    pub fn end_journal(&mut self, status: &str) -> Result<(), Fault> {
        let t = self.twin.now();
        self.keep(&Entry::End { t, status: status.to_owned() })
    }
}
