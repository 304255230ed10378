//! What is said to devices and asked of them, operation by operation.

use std::time::Duration;

use matterix_ir::plan::{Operation, StepId};
use matterix_ir::wire::{Driver, Exchange, Framing, Pattern, Template, Told};
use matterix_ir::{Span, codes, message};
use matterix_runtime::backend::{Backend, Ticket};
use matterix_runtime::fault::Fault;

use super::device::Listening;
use super::hardware::{Hardware, Mode};
use super::journal::Entry;
use crate::link::{DeviceError, Line, WireTap};
use crate::template;

/// A question is put at most so often in a row.
pub const ASKED: u32 = 3;

/// The failure that a driver gives to what comes while its device has no time for it.
const BUSY: &str = "busy";

/// No question is put again that might be answered later than so many seconds after the first.
const PATIENCE: f64 = 30.0;

impl<'m> Hardware<'m, '_> {
    /// Messages with the values that they have now; a fault where one does not fit its form.
    pub(super) fn texts(&mut self, sends: &[Template]) -> Result<Vec<String>, Fault> {
        let engine = self.twin.engine();
        let filled = |t: &Template| template::filled(t, |n| Some(engine.eval(n))).map_err(|why| (t.span, why));
        let texts: Result<_, _> = sends.iter().map(filled).collect();
        texts.map_err(|(span, why)| self.fault(codes::UNSENDABLE, span, why))
    }

    /// Says commands to a device.
    pub(super) fn say(
        &mut self,
        device: usize,
        texts: &[String],
        expects: Option<&Pattern>,
        span: Span,
    ) -> Result<Vec<f64>, Fault> {
        self.try_say(device, texts, expects).map_err(|trouble| self.trouble(device, &trouble, span))
    }

    pub(super) fn try_say(
        &mut self,
        index: usize,
        texts: &[String],
        expects: Option<&Pattern>,
    ) -> Result<Vec<f64>, DeviceError> {
        let time = self.twin.now();
        let is_dry = self.is_dry();
        if self.devices[index].driver.is_none() || self.settings.mode == Mode::Replay {
            return Ok(Vec::new());
        }
        self.renew(self.line_of(index));
        if let Some(why) = &self.devices[self.line_of(index)].lost {
            return Err(DeviceError::Lost(format!("nothing more can be sent to it: {why}")));
        }
        let device = &mut self.devices[index];
        if is_dry {
            let frames =
                device.codec.as_mut().map(|codec| codec.say(texts)).transpose().map_err(DeviceError::Unsaid)?;
            for frame in frames.into_iter().flatten() {
                (self.trace)(time, device.name, true, &frame);
            }
            return Ok(Vec::new());
        }
        let line = self.line_of(index);
        // Over a line that was opened anew another device may answer.
        self.same(index).map_err(|(_, trouble, _)| trouble)?;
        self.devices[line].said = true;
        self.devices[index].told = true;
        self.settings.exposed.told(self.devices[line].name);
        if self.devices[index].driver.is_some_and(|d| d.stays_on || !d.safe.is_empty()) {
            self.settings.exposed.told(self.devices[index].name);
        }
        self.over(index, |link, driver, ear| link.say(texts, expects, driver, ear))
    }

    /// Does something over the line of a device, with all that goes over it in the journal.
    pub(super) fn over<T>(
        &mut self,
        index: usize,
        act: impl FnOnce(&mut dyn Line, &Driver, &mut dyn WireTap) -> Result<T, DeviceError>,
    ) -> Result<T, DeviceError> {
        self.over_line(index, None, act)
    }

    /// Asks something over the line of a device, again where that comes to nothing; what went over it is in the journal then.
    /// A refusal is an answer, as some devices say once only what is wrong with them, but for one that is busy.
    pub(super) fn inquire<T>(
        &mut self,
        index: usize,
        act: impl FnMut(&mut dyn Line, &Driver, &mut dyn WireTap) -> Result<T, DeviceError>,
    ) -> Result<T, DeviceError> {
        self.again(index, true, act)
    }

    /// Says what is repeated anyway, again where that comes to nothing.
    pub(super) fn say_again(
        &mut self,
        index: usize,
        texts: &[String],
        expects: Option<&Pattern>,
    ) -> Result<Vec<f64>, DeviceError> {
        let is_open = self.devices[self.line_of(index)].lost.is_none();
        let Some(driver) = self.devices[index].driver.filter(|_| is_open && self.speaks()) else {
            return self.try_say(index, texts, expects);
        };
        let only_asks = driver.framing == Framing::Json && texts.iter().all(|text| message::only_asks(text));
        self.again(index, only_asks, |link, driver, ear| link.say(texts, expects, driver, ear))
    }

    fn again<T>(
        &mut self,
        index: usize,
        only_asks: bool,
        mut act: impl FnMut(&mut dyn Line, &Driver, &mut dyn WireTap) -> Result<T, DeviceError>,
    ) -> Result<T, DeviceError> {
        let begun = self.settings.world.elapsed();
        let mut asked = 1;
        loop {
            let done = self.over_line(index, only_asks.then(Vec::new), &mut act);
            let trouble = match done {
                Err(trouble @ (DeviceError::Silent(_) | DeviceError::Garbled(_))) => trouble,
                Err(DeviceError::Refused { failure, text }) if only_asks && failure == BUSY => {
                    DeviceError::Refused { failure, text }
                }
                other => return other,
            };
            if asked == ASKED || !self.has_time(index, begun) {
                return Err(trouble);
            }
            asked += 1;
            let (t, device) = (self.twin.now(), self.devices[index].name.to_owned());
            self.journal.note(&Entry::Again { t, device, why: trouble.text().to_owned() });
            self.over_line(index, None, |link, driver, ear| link.settle(driver, ear))?;
        }
    }

    /// Whether there is time for one more question: others wait meanwhile, and nobody waits who is to end.
    fn has_time(&self, index: usize, begun: Duration) -> bool {
        let timeout = self.devices[index].driver.map_or(0.0, |driver| driver.timeout);
        let passed = self.settings.world.elapsed().saturating_sub(begun).as_secs_f64();
        passed + timeout <= PATIENCE && !self.securing && !self.settings.control.is_stopped()
    }

    fn over_line<T>(
        &mut self,
        index: usize,
        unsaid: Option<Vec<Entry>>,
        act: impl FnOnce(&mut dyn Line, &Driver, &mut dyn WireTap) -> Result<T, DeviceError>,
    ) -> Result<T, DeviceError> {
        let (time, line) = (self.twin.now(), self.line_of(index));
        let (device, driver) = (self.devices[index].name, self.devices[index].driver);
        let (Some(link), Some(driver)) = (self.devices[line].link.as_deref_mut(), driver) else {
            return Err(DeviceError::Lost("its line is not open".to_owned()));
        };
        let (cancel, securing) = (self.settings.control.cancel(), self.securing);
        let (journal, trace) = (&mut self.journal, &mut *self.trace);
        let mut ear = Listening { time, device, journal, trace, cancel, securing, unsaid };
        let done = act(link, driver, &mut ear);
        self.settings.world.excuse();
        let unsaid = ear.unsaid.take().filter(|_| done.is_err());
        unsaid.iter().flatten().for_each(|entry| self.journal.note(entry));
        done
    }

    /// Takes in what devices say by themselves; it is in the journal where it is asked for.
    pub(super) fn take_in(&mut self) {
        for index in 0..self.devices.len() {
            let speaks_up = self.devices[index].driver.is_some_and(|d| d.heard().next().is_some());
            if !speaks_up || self.devices[self.line_of(index)].link.is_none() {
                continue;
            }
            // A line that is gone says so to who asks next.
            let _ = self.over_line(index, Some(Vec::new()), |link, driver, ear| {
                link.take_in(driver, ear);
                Ok(())
            });
        }
    }

    /// Something was done: what devices said before it says nothing of what is now.
    pub(super) fn forget_heard(&mut self) {
        self.devices.iter_mut().filter_map(|device| device.link.as_mut()).for_each(|link| link.forget_heard());
    }

    /// Whether a device tells this now, by its driver.
    pub(super) fn applies(&mut self, told: &Told) -> bool {
        told.condition.is_none_or(|condition| self.twin.engine().eval(condition) != 0.0)
    }

    /// Asks a device for a quantity, SI.
    pub(super) fn tell(&mut self, index: usize, line: usize) -> Result<f64, Fault> {
        let Some(told) = self.devices[index].driver.and_then(|d| d.told.get(line)) else { return Ok(f64::NAN) };
        if !self.applies(told) {
            let message = format!("`{}` cannot be sent now: a condition of its driver is false", told.name);
            return Err(self.fault(codes::DEVICE_REFUSED, told.span, message));
        }
        let text = self.texts(std::slice::from_ref(&told.asks))?.concat();
        let (time, is_dry) = (self.twin.now(), self.is_dry());
        let device = &mut self.devices[index];
        if is_dry {
            if let Some(codec) = device.codec.as_mut().filter(|_| told.heard.is_none()) {
                match codec.ask(&text) {
                    Ok(frame) => (self.trace)(time, device.name, true, &frame),
                    Err(why) => return Err(self.fault(codes::UNSENDABLE, told.span, why)),
                }
            }
            return Ok(self.twin.value(told.value, &mut ())?.unwrap_or(f64::NAN));
        }
        self.same(index).map_err(|(_, trouble, at)| self.trouble(index, &trouble, at))?;
        let asked = self.inquire(index, |link, driver, ear| link.tell(line, &text, told, driver, ear));
        asked.map_err(|trouble| self.trouble(index, &trouble, told.span))
    }

    /// Asks a device whether it is what it was told to be; what it tells is in the journal.
    pub(super) fn read_again(&mut self, index: usize, line: usize) -> Result<f64, Fault> {
        let value = self.tell(index, line)?;
        if let Some(told) = self.devices[index].driver.and_then(|d| d.told.get(line)) {
            let (t, name) = (self.twin.now(), told.name.clone());
            self.journal.note(&Entry::ReadBack { t, name, value });
        }
        Ok(value)
    }

    /// Tells an operation to its device.
    pub(super) fn begin(
        &mut self,
        device: usize,
        exchange: &'m Exchange,
        texts: Vec<String>,
        operation: &Operation,
        step: StepId,
        ticket: u64,
    ) -> Result<Option<(String, String)>, Fault> {
        let t = self.twin.now();
        let node = self.program.plan.get(step);
        let starting = Entry::Starting {
            t,
            ticket,
            step: step.0,
            label: node.label.clone(),
            span: self.span_text(node.span),
            device: self.devices[device].name.to_owned(),
            sends: texts.clone(),
        };
        self.keep(&starting)?;
        match self.try_say(device, &texts, exchange.expects.as_ref()) {
            Ok(_) => {
                self.forget_heard();
                self.keep(&Entry::Started { t, ticket })?;
                Ok(None)
            }
            Err(DeviceError::Refused { failure, text }) => {
                let text = format!("`{}` refuses `{}`: {text}", self.devices[device].name, operation.verb);
                self.keep(&Entry::Ended { t, ticket, failed: Some((failure.clone(), text.clone())) })?;
                Ok(Some((failure, text)))
            }
            Err(trouble) => Err(self.trouble(device, &trouble, exchange.span)),
        }
    }

    /// What answers said to a device by now.
    pub(super) fn words_of(&self, device: usize) -> Vec<(String, String)> {
        let Some(link) = self.devices.get(device).and_then(|_| self.devices[self.line_of(device)].link.as_deref())
        else {
            return Vec::new();
        };
        let own = self.devices[device].binding.instance;
        let kept = link.kept().into_iter().filter(|((of, _), _)| *of == own);
        kept.map(|((_, word), text)| (word, text)).collect()
    }

    /// What is asked now is asked about this operation: what answers said when it began is put in.
    pub(super) fn recall(&mut self, ticket: Ticket) {
        let Some(running) = self.running.get(&ticket) else { return };
        let (line, own) = (self.line_of(running.device), self.devices[running.device].binding.instance);
        let words = running.words.clone();
        if let Some(link) = self.devices[line].link.as_mut() {
            words.into_iter().for_each(|(word, text)| link.keep(own, word, text));
        }
    }

    /// Reads back what an operation has set, or what has come of what it moved, where its device tells it.
    pub(super) fn read_back(&mut self, device: usize, set: &[u32], moved: bool) -> Result<(), Fault> {
        let Some(driver) = self.devices[device].driver.filter(|_| !self.is_dry()) else { return Ok(()) };
        for (line, told) in driver.told.iter().enumerate() {
            let applies = self.applies(told);
            let concerned = told.state.map_or(moved, |s| set.contains(&s));
            if told.reading.is_some()
                || !applies
                || !concerned
                || !self.observed.is_settled(&self.program.model, told.value)
            {
                continue;
            }
            let value = self.read_again(device, line)?;
            self.settled(device, line, value)?;
        }
        Ok(())
    }
}
