//! Leaving devices safe: what breaks off what they do, what their drivers call safe, and who could not be brought to that.

use std::time::Duration;

use matterix_ir::Span;
use matterix_ir::plan::Step;
use matterix_ir::wire::{Driver, Exchange, Template, Until};

use matterix_runtime::backend::Backend;

use super::device::Carrier;
use super::hardware::{Hardware, Mode, Running};
use super::journal::Entry;
use crate::link::DeviceError;
use crate::place::Place;

/// Longest time until a device that took what makes it safe says that it is.
const SECURED: Duration = Duration::from_secs(30);

/// So many answers that may still come are counted: each costs one more attempt.
const MOST_OWED: u32 = 5;

/// How often it is asked.
pub(super) const POLL: Duration = Duration::from_millis(200);

impl Hardware<'_, '_> {
    /// Nothing is gone on with: devices may be as an earlier process has left them. Whether there are any behind lines.
    pub fn abandon(&mut self) -> bool {
        if matches!(self.settings.mode, Mode::Dry | Mode::Replay) {
            return false;
        }
        self.expose();
        true
    }

    /// Devices may be as somebody else has left them.
    pub(super) fn expose(&mut self) {
        for device in self.devices.iter_mut().filter(|d| d.driver.is_some()) {
            device.told = true;
            device.said = device.host.is_none();
            if device.said {
                self.settings.exposed.told(device.name);
            }
        }
    }

    /// The names of the devices that have been made safe.
    pub fn secured(&self) -> Vec<String> {
        self.made_safe.iter().map(|index| format!("`{}`", self.devices[*index].name)).collect()
    }

    /// The twin breaks off what a device is told to break off: it does what the command does that says the same, and sets back what
    /// the end of the operation would have set back.
    pub(super) fn halt_twin(&mut self, running: &Running<'_>) {
        let driver = self.devices.get(running.device).and_then(|d| d.driver).filter(|d| !d.halt.is_empty());
        let Some(driver) = driver.filter(|_| !running.ready) else { return self.twin.halt(running.twin) };
        // What cannot be set back stays as it was: nobody waits for it any more.
        let _ = self.twin.break_off(running.twin);
        let said = |exchange: &Exchange| exchange.sends.iter().map(|t| t.pieces.clone()).collect::<Vec<_>>();
        let halt: Vec<_> = driver.halt.iter().flat_map(said).collect();
        let program = self.program;
        let same = driver.calls.iter().filter(|(_, e)| e.until.is_none() && said(e) == halt);
        let mut same = same.filter_map(|(step, _)| match &program.plan.get(*step).step {
            Step::Operation(operation) if operation.until.is_none() && operation.takes.is_none() => Some(operation),
            _ => None,
        });
        if let Some(operation) = same.next()
            && let Ok(ticket) = self.twin.begin(operation, &mut ())
        {
            let _ = self.twin.poll(ticket, &mut ());
        }
    }

    /// Breaks off what a device does for an operation. Whether it did, is not known where it refuses.
    pub(super) fn break_off(&mut self, running: &Running<'_>) {
        let Some(driver) = self.devices.get(running.device).and_then(|d| d.driver) else { return };
        if running.ready || !self.is_live() || self.unreached.is_some() {
            return;
        }
        for exchange in &driver.halt {
            let why = match self.texts(&exchange.sends) {
                Err(fault) => fault.message,
                Ok(texts) => match self.try_say(running.device, &texts, exchange.expects.as_ref()) {
                    Ok(_) => continue,
                    Err(trouble) => self.trouble(running.device, &trouble, exchange.span).message,
                },
            };
            self.unhalted.push((self.devices[running.device].binding.at, why));
        }
    }

    /// Where each device is bound that did not break off what it did when it was told to, and why.
    pub fn unhalted(&self) -> &[(Span, String)] {
        &self.unhalted
    }

    /// After a run that did not end well: every device to which something was said is told what makes it safe, whatever became
    /// of the others, and for each answer there are seconds only. Where each is bound that is not known to be safe, and why.
    pub fn secure(&mut self) -> Vec<(Span, String)> {
        self.securing = true;
        let mut troubles = Vec::new();
        // A device over the line of another one may be told something only when that one has ended what it did.
        let mut all: Vec<usize> = (0..self.devices.len()).collect();
        all.sort_by_key(|index| self.devices[*index].host.is_some());
        for index in all {
            if let Err(why) = self.secure_one(index) {
                troubles.push((self.devices[index].binding.at, why));
            }
        }
        self.securing = false;
        for index in 0..self.devices.len() {
            if let Some(why) = self.left_on(index) {
                troubles.push((self.devices[index].binding.at, format!("`{}`: {why}", self.devices[index].name)));
            }
        }
        troubles
    }

    /// What people have set by hand and the plan has not brought back: nothing can be sent there.
    fn left_on(&mut self, index: usize) -> Option<String> {
        let device = &self.devices[index];
        let instance = device.binding.instance;
        if device.binding.carrier != Carrier::Hand || !device.told || !self.speaks() {
            return None;
        }
        let program = self.program;
        let ends = program.plan.ends.iter().filter(|end| end.instance == instance);
        let engine = self.twin.engine();
        let left = ends.filter(|end| engine.eval(end.condition.node) == 0.0);
        let left: Vec<String> = left.map(|end| end.condition.failure().replace('_', " ")).collect();
        let undone = self.devices[index].undone.join("`, `");
        match (left.is_empty(), undone.is_empty()) {
            (_, false) => Some(format!("it was set by hand, but nobody confirmed `{undone}`")),
            (false, true) => Some(format!("it was set by hand and is {}", left.join(", "))),
            (true, true) => None,
        }
    }

    /// A person has not done to a device what they were asked to do.
    pub(super) fn not_set_by_hand(&mut self, index: usize, label: &str) {
        if let Some(device) = self.devices.get_mut(index).filter(|d| d.binding.carrier == Carrier::Hand) {
            device.undone.push(label.to_owned());
        }
    }

    /// A person has done something to a device.
    pub(super) fn set_by_hand(&mut self, index: usize) {
        if self.devices.get(index).is_none_or(|d| d.binding.carrier != Carrier::Hand) {
            return;
        }
        self.devices[index].told = true;
        match self.left_on(index) {
            Some(_) => self.settings.exposed.told(self.devices[index].name),
            None => self.settings.exposed.safe(self.devices[index].name),
        }
    }

    /// Makes a device safe; why that is not known to have come about.
    fn secure_one(&mut self, index: usize) -> Result<(), String> {
        let (Some(driver), line) = (self.devices[index].driver, self.line_of(index)) else { return Ok(()) };
        let named = |why: &str, name: &str| format!("`{name}`: {why}");
        let name = self.devices[index].name;
        let was_told = self.devices[line].said && self.speaks();
        if !was_told && self.settings.mode != Mode::Dry {
            return Ok(());
        }
        if driver.safe.is_empty() {
            if !driver.stays_on || !self.devices[index].told || !self.speaks() {
                return Ok(());
            }
            let why = "its driver has no `safe` line";
            let (t, device, trouble) = (self.twin.now(), name.to_owned(), Some(why.to_owned()));
            self.note_safe(Entry::Safe { t, device, trouble });
            return Err(named(why, name));
        }
        self.relink(line);
        let mut done = self.made_safe_if_same(index, driver);
        if let Err(DeviceError::Lost(_) | DeviceError::Silent(_) | DeviceError::Garbled(_)) = done
            && self.devices[line].lost.is_none()
        {
            // What was said may not have come through, and a line that was lost may be there again.
            if !matches!(done, Err(DeviceError::Garbled(_))) {
                let link = self.devices[line].link.take();
                self.devices[line].owed += link.map_or(0, |link| link.owed());
                self.relink(line);
            }
            done = self.made_safe_if_same(index, driver);
        }
        let (t, device) = (self.twin.now(), name.to_owned());
        if done != Ok(false) {
            let trouble = done.as_ref().err().map(|trouble| trouble.text().to_owned());
            self.note_safe(Entry::Safe { t, device, trouble });
        }
        match done {
            Ok(true) => {
                self.made_safe.push(index);
                self.settings.exposed.safe(name);
                Ok(())
            }
            Ok(false) => Ok(()),
            Err(trouble) => {
                self.trouble(index, &trouble, driver.span);
                Err(named(trouble.text(), name))
            }
        }
    }

    /// An older copy of the journal does not know that a device was made safe: how far it got is on disk beside it.
    fn note_safe(&mut self, entry: Entry) {
        // A journal that cannot be written ends no attempt to make the others safe.
        let _ = self.journal.keep(&entry);
    }

    /// Opens a line anew that was lost.
    fn relink(&mut self, line: usize) {
        if let (Carrier::Line { place, address, .. }, Some(driver), None, false) = (
            self.devices[line].binding.carrier.clone(),
            self.devices[line].driver,
            &self.devices[line].link,
            !self.speaks(),
        ) {
            match self.linked(line, driver, &place, address.as_deref()) {
                Ok(link) => self.put_through(line, link),
                Err(trouble) => self.devices[line].lost = Some(trouble.text().to_owned()),
            }
        }
    }

    /// Says what makes a device safe, unless another one is behind its line by now.
    fn made_safe_if_same(&mut self, index: usize, driver: &Driver) -> Result<bool, DeviceError> {
        let line = self.line_of(index);
        if let (None, Some(why)) = (&self.devices[line].link, &self.devices[line].lost) {
            return Err(DeviceError::Lost(why.clone()));
        }
        self.same(index).map_err(|(_, trouble, _)| trouble)?;
        self.say_safe(index, driver)
    }

    /// Says what makes a device safe; whether there was something to say to it.
    fn say_safe(&mut self, index: usize, driver: &Driver) -> Result<bool, DeviceError> {
        let line = self.line_of(index);
        let (mut said, mut heard) = (false, false);
        for exchange in &driver.safe {
            let texts = self.sayable(&exchange.sends)?;
            if self.devices[line].link.as_mut().is_some_and(|link| link.lacks(driver, &texts)) {
                continue;
            }
            said = true;
            heard |= exchange.expects.is_some() || exchange.until.is_some();
            for _ in 0..self.attempts(index) {
                self.say_one(index, exchange, &texts)?;
            }
        }
        if said && self.speaks() {
            self.forget_heard();
            if !heard {
                for _ in 0..self.attempts(index) {
                    self.prove(index, driver)?;
                }
            }
            self.has_ended(index)?;
        }
        Ok(said)
    }

    /// How often something is said so that one of the answers must be to it: as many as are owed over its line may be to what was said
    /// before, where nothing in them tells them apart.
    fn attempts(&self, index: usize) -> u32 {
        let line = &self.devices[self.line_of(index)];
        match &line.binding.carrier {
            Carrier::Line { place: Place::Serial(_) | Place::Tcp(_), .. } if self.speaks() => {
                let owed = line.owed + line.link.as_ref().map_or(0, |link| link.owed());
                1 + owed.min(MOST_OWED)
            }
            _ => 1,
        }
    }

    /// Messages with the values that they have now.
    pub(super) fn sayable(&mut self, sends: &[Template]) -> Result<Vec<String>, DeviceError> {
        self.texts(sends).map_err(|fault| DeviceError::Unsaid(fault.message))
    }

    /// With `until` it counts what the device tells in the end, not whether it took the command: a run that a person has stopped
    /// refuses to be stopped.
    fn say_one(&mut self, index: usize, exchange: &Exchange, texts: &[String]) -> Result<(), DeviceError> {
        let said = self.try_say(index, texts, exchange.expects.as_ref());
        let Some(until) = exchange.until.as_ref().filter(|_| self.speaks()) else { return said.map(|_| ()) };
        match said {
            Ok(_) => self.wait_for(index, until),
            Err(refused @ DeviceError::Refused { .. }) => self.wait_for(index, until).map_err(|_| refused),
            Err(other) => Err(other),
        }
    }

    fn wait_for(&mut self, index: usize, until: &Until) -> Result<(), DeviceError> {
        let text = self.sayable(std::slice::from_ref(&until.asks))?.concat();
        let timeout = Duration::try_from_secs_f64(self.twin.engine().eval(until.timeout)).unwrap_or(SECURED);
        let begun = self.settings.world.elapsed();
        loop {
            let ready = self.over(index, |link, driver, ear| link.is_ready(&text, until, driver, ear));
            if ready? {
                return Ok(());
            }
            let passed = self.settings.world.elapsed().saturating_sub(begun);
            if passed >= timeout.min(SECURED) {
                let seconds = timeout.min(SECURED).as_secs_f64();
                return Err(DeviceError::Silent(format!("it did not report within {seconds} s that it is safe")));
            }
            self.settings.world.sleep(POLL);
        }
    }
}
