//! A device of a lab as an emulator.

// A fault ends the run: how many bytes it is returned in is of no account.
#![allow(clippy::result_large_err)]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use matterix_hardware::emulate::{Emulator, Stop, serve_http, serve_pty, serve_tcp};
use matterix_ir::Program;
use matterix_ir::wire::{Driver, Transport};
use matterix_runtime::backend::{Prepared, Sim};
use matterix_runtime::process::{Engine, Options};

use crate::terminal::{Stream, print};

/// Where an emulator answers.
pub enum Line<'p> {
    /// At a pseudo-terminal, with a link to it.
    Pty(Option<&'p Path>),
    /// At a port of this machine.
    Tcp(u16),
}

/// Answers as devices of the program's lab, each with its address where that is not its driver's, until `cancel` is set; `ready` is
/// given the place.
pub fn emulate(
    program: &Program,
    devices: &[(&str, Option<&str>)],
    driver: Option<&str>,
    line: &Line<'_>,
    (speed, seed): (f64, u64),
    cancel: &AtomicBool,
    ready: &mut dyn FnMut(&str),
) -> Result<(), String> {
    let mut units = Vec::new();
    for (device, address) in devices {
        units.push((drivers_of(program, device, driver)?, *address));
    }
    let chosen = units.first().and_then(|(drivers, _)| drivers.first()).copied().ok_or("name a device")?;
    if let Transport::Sila { .. } = chosen.transport {
        let why = "a driver over `sila` needs a server, not a line";
        return Err(format!("{why}: use `matterixc serve`"));
    }
    together(&units)?;
    let prepared = Prepared::new(program);
    let params = program.model.params.iter().map(|p| p.value).collect();
    let engine = Engine::new(&prepared.model, params, program.plan.locals.len(), Options::default());
    let engine = engine.and_then(|mut engine| engine.start(&mut ()).map(|()| engine)).map_err(|f| f.message)?;
    let mut units = units.into_iter();
    let (first, address) = units.next().ok_or("name a device")?;
    let mut emulator = Emulator::new(Sim::new(engine, &prepared, seed), first, address)?;
    units.try_for_each(|(drivers, address)| emulator.join(drivers, address))?;
    emulator.heeded(|why| print(Stream::Err, &format!("{why}\n")));
    let stop = Stop { cancel, speed };
    if let Transport::Http { header } = &chosen.transport {
        let Line::Tcp(port) = line else {
            return Err(format!("`{}` uses HTTP: give its port with `--tcp`", chosen.name));
        };
        return serve_http(&mut emulator, *port, header.as_ref(), stop, ready);
    }
    match line {
        Line::Pty(link) => serve_pty(&mut emulator, *link, stop, ready),
        Line::Tcp(port) => serve_tcp(&mut emulator, *port, stop, ready),
    }
}

/// The driver of a device, and those over its line.
fn drivers_of<'p>(program: &'p Program, device: &str, driver: Option<&str>) -> Result<Vec<&'p Driver>, String> {
    let instance = program.scene.find(device).ok_or_else(|| format!("the lab has no `{device}`"))?;
    let all: Vec<_> = program.drivers.iter().filter(|d| d.instance == instance && d.host.is_none()).collect();
    let list = all.iter().map(|d| format!("`{}`", d.name)).collect::<Vec<_>>().join(", ");
    let chosen = match (driver, all.as_slice()) {
        (Some(name), _) => all.iter().find(|d| d.name == name).copied(),
        (None, [only]) => Some(*only),
        (None, []) => return Err(format!("`{device}` has no driver")),
        (None, _) => return Err(format!("`{device}` has several drivers: choose one with `--driver`: {list}")),
    };
    let chosen = chosen.ok_or_else(|| format!("`{device}` has no such driver: it has {list}"))?;
    let is_its = |d: &&Driver| d.host.as_ref().is_some_and(|h| h.instance == instance && h.driver == chosen.name);
    Ok(std::iter::once(chosen).chain(program.drivers.iter().filter(is_its)).collect())
}

/// Devices at one line have addresses that tell them apart.
fn together(units: &[(Vec<&Driver>, Option<&str>)]) -> Result<(), String> {
    let address = |(drivers, given): &(Vec<&Driver>, Option<&str>)| {
        given.map(str::to_owned).or_else(|| drivers.first().and_then(|d| d.address.clone()))
    };
    for (at, unit) in units.iter().enumerate().skip(1) {
        let own = address(unit);
        if own.is_none() || units[..at].iter().any(|other| address(other) == own) {
            return Err("devices on one line need an address each, as in `pump@2`".to_owned());
        }
    }
    Ok(())
}
