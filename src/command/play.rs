//! `matterixc emit --play`: a file is given to a device that runs it by itself.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use matterix_hardware::deploy::{Carrier, unsafe_left};
use matterix_hardware::link::{DeviceError, WireTap};
use matterix_hardware::play::{Sheet, Unplayed, play as played};
use matterix_hardware::{binding, calibration};
use matterix_ir::Diagnostic;

use super::bill::show;
use crate::args::Color;
use crate::pipeline::{self, Input, Options, Wires};
use crate::terminal::{Stream, print, step_aside};
use crate::{Exit, files};

/// Gives the file to the one device of the bindings whose driver says how.
pub fn play(
    input: &Input,
    options: &Options,
    path: &Path,
    (name, bytes): (&str, Vec<u8>),
    cancel: &AtomicBool,
    color: Color,
) -> Result<Exit, String> {
    let text = String::from_utf8(files::read(path)?).map_err(|_| format!("`{}` is not UTF-8", path.display()))?;
    let (mut sources, program, found) = pipeline::compile(input, &Options { wires: Wires::Called, ..options.clone() });
    let Some(program) = program.filter(|_| found.iter().all(|d| !d.is_error())) else {
        show(&sources, found, color);
        return Ok(Exit::Findings);
    };
    let file = sources.add(path.display().to_string(), text.clone());
    let (bindings, mut found) = binding::read(&program, file, &text);
    found.extend(calibration::unconfirmed(file, &text));
    if !found.is_empty() {
        show(&sources, found, color);
        return Ok(Exit::Findings);
    }
    let players: Vec<_> = bindings
        .iter()
        .filter_map(|b| match &b.carrier {
            Carrier::Line { driver, place, .. } => Some((&program.drivers[*driver], place, b.at)),
            _ => None,
        })
        .filter(|(driver, ..)| !driver.play.is_empty())
        .collect();
    let [(driver, place, at)] = players.as_slice() else {
        let several = if players.is_empty() { "no device in these bindings" } else { "more than one device" };
        return Err(format!("{several} has a driver that can run a file"));
    };
    let device = &program.scene.get(driver.instance).name;
    step_aside()?;
    print(Stream::Err, &format!("sent `{name}` to `{device}`, {} bytes\n", bytes.len()));
    let sheet = Sheet { name: name.to_owned(), bytes };
    let broken = match played(&program, driver, place, sheet, cancel, &mut Silent) {
        Ok(()) => {
            print(Stream::Err, &format!("`{device}` has run the file\n"));
            return Ok(Exit::Fine);
        }
        Err(broken) => broken,
    };
    // What is on its deck was switched on by the file, and nobody knows by which name.
    let on_it = program.drivers.iter().filter(|d| {
        !broken.is_untouched && d.stays_on && d.host.as_ref().is_some_and(|h| h.instance == driver.instance)
    });
    let on_it = on_it.map(|d| format!("`{}`: `{device}` ran the file by itself", program.scene.get(d.instance).name));
    let left = broken.left.map(|why| format!("`{device}`: {why}")).into_iter().chain(on_it);
    let left: Vec<Diagnostic> = left.map(|why| unsafe_left((*at, why))).collect();
    let trouble = match broken.why {
        Unplayed::Stopped => {
            show(&sources, left, color);
            print(Stream::Err, "the run was stopped\n");
            return Ok(Exit::Findings);
        }
        Unplayed::DeviceError(trouble) => trouble,
    };
    let why = match &trouble {
        DeviceError::Refused { failure, text } => format!("{failure}: {text}"),
        other => other.text().to_owned(),
    };
    let d = Diagnostic::error(trouble.code(), *at, format!("`{device}`: {why}"), "did not run to the end");
    show(&sources, std::iter::once(d).chain(left).collect(), color);
    Ok(Exit::Findings)
}

/// Nothing of it is shown.
struct Silent;

impl WireTap for Silent {
    fn out(&mut self, _: &[u8]) {}
    fn back(&mut self, _: &[u8]) {}
    fn kept(&mut self, _: &str, _: &str) {}
}
