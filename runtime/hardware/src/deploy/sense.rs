//! Opening lines, holding what devices tell against the twin, and closing lines.

use matterix_ir::wire::{Driver, Exchange, Piece, Slot};
use matterix_ir::{Span, codes};
use matterix_runtime::backend::Backend;
use matterix_runtime::fault::Fault;

use super::device::Carrier;
use super::hardware::{Hardware, Mode, Unreached};
use super::journal::Entry;
use crate::link::{self, DeviceError, Line};
use crate::place::Place;

/// Rounding, in units of the last digit that a device tells.
const ROUNDING: f64 = 0.51;

impl Hardware<'_, '_> {
    /// Opens all lines and says nothing; devices that cannot be reached.
    pub fn connect(&mut self) -> Vec<Unreached> {
        let mut unreached = Vec::new();
        for index in 0..self.devices.len() {
            let Some(driver) = self.devices[index].driver.filter(|_| self.speaks()) else { continue };
            let Carrier::Line { place, address, .. } = self.devices[index].binding.carrier.clone() else { continue };
            match self.linked(index, driver, &place, address.as_deref()) {
                Ok(link) => self.put_through(index, link),
                Err(trouble) => unreached.push(self.not_reached(index, trouble)),
            }
        }
        unreached
    }

    pub(super) fn not_reached(&self, index: usize, trouble: DeviceError) -> Unreached {
        let device = &self.devices[index];
        Unreached { device: device.name.to_owned(), at: device.binding.at, trouble }
    }

    /// Says over open lines what drivers say first; what went wrong, and where the device is bound.
    pub fn open(&mut self) -> Result<(), (Fault, Option<Span>)> {
        if let Err((index, trouble, span)) = self.identify() {
            let fault = self.trouble(index, &trouble, span);
            return Err((fault, Some(self.devices[index].binding.at)));
        }
        for index in 0..self.devices.len() {
            let (driver, at) = (self.devices[index].driver, self.devices[index].binding.at);
            for exchange in driver.iter().flat_map(|driver| &driver.open) {
                self.first(index, exchange).map_err(|fault| (fault, Some(at)))?;
            }
        }
        self.set_clock();
        let (t, wall) = (self.twin.now(), self.wall());
        self.dated = wall;
        self.keep(&Entry::Opened { t, wall }).map_err(|fault| (fault, None))
    }

    fn first(&mut self, index: usize, exchange: &Exchange) -> Result<(), Fault> {
        let texts = self.texts(&exchange.sends)?;
        self.say(index, &texts, exchange.expects.as_ref(), exchange.span)?;
        let Some(until) = exchange.until.as_ref().filter(|_| !self.is_dry()) else { return Ok(()) };
        let text = self.texts(std::slice::from_ref(&until.asks))?.concat();
        let tries = (self.twin.engine().eval(until.timeout) / 0.1).ceil().clamp(1.0, 1e6) as u32;
        for _ in 0..tries {
            let asked = self.inquire(index, |link, driver, ear| link.is_ready(&text, until, driver, ear));
            if asked.map_err(|trouble| self.trouble(index, &trouble, exchange.span))? {
                return Ok(());
            }
            if self.settings.control.is_stopped() {
                let message = format!(
                    "the wait for `{}` was cancelled: a person stopped the deployment",
                    self.devices[index].name
                );
                return Err(self.fault(codes::RUN_FAILED, exchange.span, message));
            }
            self.settings.world.sleep(std::time::Duration::from_millis(100));
        }
        let message = format!("`{}` was not ready in time", self.devices[index].name);
        Err(self.fault(codes::DEVICE_LOST, exchange.span, message))
    }

    /// A new line to a device, with what answers over an earlier one said.
    pub(super) fn linked(
        &self,
        index: usize,
        driver: &Driver,
        place: &Place,
        address: Option<&str>,
    ) -> Result<Box<dyn Line>, DeviceError> {
        let opened = link::open(&self.settings.world, place, driver, address);
        self.settings.world.excuse();
        let mut link = opened?;
        for (_, device, word, text) in self.kept.iter().filter(|(line, ..)| *line == index) {
            link.keep(*device, word.clone(), text.clone());
        }
        Ok(link)
    }

    /// Opens a lost line anew, once, where no late answer can be taken for another one's. The loss has ended the run: what is
    /// said from then on is what `finally` says.
    pub(super) fn renew(&mut self, line: usize) {
        let device = &self.devices[line];
        let Carrier::Line { place, address, .. } = device.binding.carrier.clone() else { return };
        if device.lost.is_none() || device.renewed || !device.said || self.is_dry() || !self.is_live() {
            return;
        }
        let Some(driver) = device.driver.filter(|_| place.keeps_answers_apart()) else { return };
        self.devices[line].renewed = true;
        let Ok(link) = self.linked(line, driver, &place, address.as_deref()) else { return };
        self.put_through(line, link);
        if let Err((device, trouble, at)) = self.same_behind(line) {
            self.trouble(device, &trouble, at);
        }
    }

    /// A line is open from here on; who is behind it has not said so yet, under any of its addresses.
    pub(super) fn put_through(&mut self, line: usize, link: Box<dyn Line>) {
        (self.devices[line].link, self.devices[line].lost) = (Some(link), None);
        for device in self.behind(line) {
            self.devices[device].known = false;
        }
    }

    /// The devices behind a line: also those that share its port or connection.
    pub(super) fn behind(&self, line: usize) -> Vec<usize> {
        let place = |index: usize| match &self.devices[index].binding.carrier {
            Carrier::Line { place, .. } => Some(place),
            _ => None,
        };
        let here = place(line);
        let is_behind = |device: &usize| {
            let of = self.line_of(*device);
            of == line || (here.is_some() && place(of) == here)
        };
        (0..self.devices.len()).filter(is_behind).collect()
    }

    pub(super) fn set_clock(&mut self) {
        // What has been until now is no part of the lab's time, or is caught up with.
        self.settings.world.held_up();
        self.origin = (self.twin.now(), self.settings.world.elapsed());
    }

    /// What is told of what was commanded must be that.
    pub(super) fn settled(&mut self, device: usize, line: usize, value: f64) -> Result<(), Fault> {
        let Some(told) = self.devices[device].driver.and_then(|d| d.told.get(line)) else { return Ok(()) };
        let wanted = self.twin.engine().eval(told.value);
        let one = matterix_ir::Unit::one();
        let (unit, step) = told
            .expects
            .slots
            .iter()
            .find_map(|s| match s {
                Slot::Number(unit, form) => {
                    Some((unit, form.step(unit.of_si(wanted)).max(self.step_sent(device, unit, wanted))))
                }
                Slot::Word(_) => Some((&one, 1.0)),
                _ => None,
            })
            .unwrap_or((&one, 0.0));
        if (unit.of_si(value) - unit.of_si(wanted)).abs() <= ROUNDING * step {
            return Ok(());
        }
        let (name, is, was) = (&told.name, told.show(value), told.show(wanted));
        let message = format!("`{name}` is {is} on the device, but it was set to {was}");
        let span = told.span;
        Err(self.fault(codes::DIVERGED, span, message))
    }

    /// How far apart two numbers near this one are, SI, that a device is sent in this unit: the finest of all forms; 1 where it is
    /// sent none.
    fn step_sent(&self, device: usize, unit: &matterix_ir::Unit, near: f64) -> f64 {
        let calls = self.devices[device].driver.into_iter().flat_map(|d| &d.calls);
        let pieces = calls.flat_map(|(_, e)| &e.sends).flat_map(|t| &t.pieces);
        let steps = pieces.filter_map(|p| match p {
            Piece::Number { unit: sent, form, .. } if sent.symbol == unit.symbol => Some(form.step(unit.of_si(near))),
            _ => None,
        });
        steps.fold(f64::INFINITY, f64::min).min(1.0)
    }

    /// Where devices are shadowed, what is told may not be far from what the twin supposes.
    pub(super) fn compared(&mut self, device: usize, line: usize, value: f64) -> Result<(), Fault> {
        if self.settings.mode == Mode::Shadow { self.held_against(device, line, value) } else { Ok(()) }
    }

    pub(super) fn held_against(&mut self, device: usize, line: usize, value: f64) -> Result<(), Fault> {
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
                let message = format!("`{name}` is {is}, but {twin} on the twin: they differ by {apart}");
                let span = told.span;
                let mut fault = self.fault(codes::DIVERGED, span, message);
                fault.help.push("check the device, its calibration and the model".to_owned());
                Err(fault)
            }
            _ => Ok(()),
        }
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
                let said = texts.and_then(|t| self.say(index, &t, exchange.expects.as_ref(), exchange.span));
                first = first.and(said.map(|_| ()));
            }
            self.devices[index].link = None;
        }
        first
    }
}
