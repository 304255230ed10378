//! Emulated devices at one line, with the lab that they stand in.

use matterix_ir::wire::Driver;
use matterix_runtime::backend::{Backend, Sim, Status};
use matterix_runtime::fault::Fault;
use matterix_runtime::process::Watch;

use super::device::Unit;

/// Devices of a lab, all at one line: each answers what is for it.
pub struct Emulator<'m> {
    sim: Sim<'m>,
    units: Vec<Unit<'m>>,
    /// What devices have said by themselves.
    spoken: Vec<u8>,
    /// Is told why commands are refused, and what it was told last.
    heeds: Box<dyn FnMut(&str) + 'm>,
    last: String,
}

impl<'m> Emulator<'m> {
    /// The device of the first of these drivers in a lab that has been started; the others speak over its line.
    pub fn new(sim: Sim<'m>, drivers: Vec<&'m Driver>, address: Option<&str>) -> Result<Self, String> {
        let (units, heeds) = (vec![Unit::new(drivers, address)?], Box::new(|_: &str| {}));
        Ok(Emulator { sim, units, spoken: Vec::new(), heeds, last: String::new() })
    }

    /// Tells why a command is refused that a device understands, once for one that is said again and again.
    pub fn heeded(&mut self, heeds: impl FnMut(&str) + 'm) {
        self.heeds = Box::new(heeds);
    }

    /// Puts another device at the line.
    pub fn join(&mut self, drivers: Vec<&'m Driver>, address: Option<&str>) -> Result<(), String> {
        self.units.push(Unit::new(drivers, address)?);
        Ok(())
    }

    /// The model behind it.
    pub fn sim(&mut self) -> &mut Sim<'m> {
        &mut self.sim
    }

    /// Lets lab time pass until then, s.
    pub fn pass(&mut self, until: f64) -> Result<(), Fault> {
        loop {
            for unit in &mut self.units {
                let mut device = unit.with(&mut self.sim);
                device.sweep()?;
                self.spoken.extend(device.speak()?);
            }
            let now = self.sim.now();
            if now >= until {
                return Ok(());
            }
            let (mut next, mut watches) = (until, Vec::new());
            for unit in &self.units {
                next = unit.next_due().clamp(now, next);
                for ticket in unit.running() {
                    let Ok(Status::Running { until: end, watch }) = self.sim.poll(ticket, &mut ()) else { continue };
                    next = end.unwrap_or(f64::INFINITY).clamp(now, next);
                    watches.extend(watch.map(|node| Watch { node, value: true }));
                }
            }
            self.sim.advance(next, &watches, &mut ())?;
        }
    }

    /// What devices have said by themselves since that was last asked for.
    pub fn spoken(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.spoken)
    }

    /// Changes to the line of another master: takes from the caller what has come in over that for each device of a request that is
    /// not whole, and gives back what has come in over the line before.
    pub fn change_line(&mut self, inputs: &mut Vec<Vec<u8>>) {
        inputs.resize(self.units.len(), Vec::new());
        self.units.iter_mut().zip(inputs).for_each(|(unit, input)| unit.change_line(input));
    }

    /// Bytes that have come in; the bytes that are answered.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Fault> {
        let mut out = Vec::new();
        for unit in &mut self.units {
            out.extend(unit.with(&mut self.sim).receive(bytes)?);
            for why in unit.refused() {
                if why != self.last {
                    (self.heeds)(&why);
                    self.last = why;
                }
            }
        }
        Ok(out)
    }

    /// An answer to what is no message at all; none where the driver knows none.
    pub fn complaint(&mut self, why: &str) -> Option<Vec<u8>> {
        let unit = self.units.first_mut()?;
        unit.with(&mut self.sim).complaint(why)
    }
}
