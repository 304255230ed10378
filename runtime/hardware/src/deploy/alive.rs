//! Watchdogs: what is repeated so that a device goes on, and what tells it that it need not listen any more.

use matterix_ir::codes;
use matterix_ir::quantity::show_number;
use matterix_ir::wire::{Alive, Served};
use matterix_runtime::backend::Backend;
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;

use super::device::Beat;
use super::hardware::Hardware;
use crate::link::DeviceError;

impl Hardware<'_, '_> {
    /// Says what is due by now. What has begun to hold is said at once, what no longer holds is taken back if `over`.
    pub(super) fn beat(&mut self, over: bool, out: &mut dyn Listener) -> Result<(), Fault> {
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver.filter(|_| self.devices[device].lost.is_none()) else {
                continue;
            };
            for (index, alive) in driver.alive.iter().enumerate() {
                let (now, heard) = (self.twin.now(), self.settings.world.elapsed());
                let holds = self.twin.engine().eval(alive.condition) != 0.0;
                let every = self.twin.engine().eval(alive.every);
                let last = self.devices[device].beats[index];
                match (holds, last) {
                    (true, None) => {}
                    (true, Some(last)) if now >= last.at + every => {}
                    (false, Some(_)) if over => {
                        self.devices[device].beats[index] = None;
                        if let Some(end) = &alive.at_end {
                            self.serve(device, end, out)?;
                        }
                        continue;
                    }
                    _ => continue,
                }
                self.devices[device].beats[index] = Some(Beat { at: now, heard });
                self.serve(device, &alive.repeated, out)?;
                if self.is_live() && !self.is_dry() {
                    self.heard_in_time(device, alive, last)?;
                }
            }
        }
        Ok(())
    }

    /// A watchdog that heard nothing for longer than it waits may have stopped its device, whatever the device answers now.
    fn heard_in_time(&mut self, device: usize, alive: &Alive, last: Option<Beat>) -> Result<(), Fault> {
        let (Some(last), Some(within)) = (last, alive.within) else { return Ok(()) };
        let patience = self.twin.engine().eval(within);
        let alone = self.settings.world.elapsed().saturating_sub(last.heard).as_secs_f64() * self.settings.speed;
        if alone <= patience {
            return Ok(());
        }
        let message = format!(
            "`{}` received nothing for {} s, longer than its watchdog waits ({} s): it may have stopped",
            self.devices[device].name,
            show_number(alone),
            show_number(patience)
        );
        let mut fault = self.fault(codes::DIVERGED, alive.repeated.exchange.span, message);
        fault.help.push(
            "this computer was busy or asleep, or a line was slow: check the device, then start again".to_owned(),
        );
        Err(fault)
    }

    /// When watchdogs trip that hear nothing from now on: device, s from now, s that it waits.
    pub(super) fn watchdogs(&mut self) -> Vec<(usize, f64, f64)> {
        let mut found = Vec::new();
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver else { continue };
            for (index, alive) in driver.alive.iter().enumerate() {
                let Some(within) = alive.within else { continue };
                if self.twin.engine().eval(alive.condition) == 0.0 {
                    continue;
                }
                let patience = self.twin.engine().eval(within);
                let waited = self.devices[device].beats[index].map_or(0.0, |last| self.twin.now() - last.at);
                found.push((device, patience - waited, patience));
            }
        }
        found
    }

    /// Devices that would go to others if they heard nothing hear that somebody is there.
    pub(super) fn hold(&mut self) -> Result<(), Fault> {
        for index in 0..self.devices.len() {
            let is_due = self.devices[index].link.as_ref().is_some_and(|link| link.is_to_be_held());
            if is_due && self.speaks() {
                let span = self.devices[index].driver.map_or_else(Default::default, |d| d.span);
                let held = self.over(index, |link, driver, ear| link.hold(driver, ear));
                held.map_err(|trouble| self.trouble(index, &trouble, span))?;
            }
        }
        Ok(())
    }

    /// Devices were alone: what is to be repeated is said at once.
    pub(super) fn forget_beats(&mut self) {
        self.devices.iter_mut().for_each(|device| device.beats.fill(None));
    }

    /// When something is due next, s.
    pub(super) fn next_beat(&mut self) -> f64 {
        let mut next = f64::INFINITY;
        for device in 0..self.devices.len() {
            let Some(driver) = self.devices[device].driver.filter(|_| self.devices[device].lost.is_none()) else {
                continue;
            };
            for (index, alive) in driver.alive.iter().enumerate() {
                if let Some(last) = self.devices[device].beats[index] {
                    next = next.min(last.at + self.twin.engine().eval(alive.every));
                }
            }
        }
        next
    }

    /// A command apart from the plan.
    fn serve(&mut self, device: usize, served: &Served, out: &mut dyn Listener) -> Result<(), Fault> {
        let texts = self.texts(&served.exchange.sends)?;
        let ticket = self.twin.begin(&served.operation, out)?;
        self.twin.poll(ticket, out)?;
        self.fed += 1;
        if !self.is_live() && !self.is_dry() {
            return self.replayed_fault().map_or(Ok(()), Err);
        }
        let said = self.say_again(device, &texts, served.exchange.expects.as_ref());
        said.map(|_| ()).map_err(|trouble| {
            let fault = self.trouble(device, &trouble, served.exchange.span);
            match trouble {
                DeviceError::Refused { failure, .. } => {
                    Fault { message: format!("{}: `{failure}`", fault.message), ..fault }
                }
                _ => fault,
            }
        })
    }
}
