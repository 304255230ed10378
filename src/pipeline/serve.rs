//! The lab of a program as a server of SiLA 2: on the twin, or on devices.

// A fault ends the run: how many bytes it is returned in is of no account.
#![allow(clippy::result_large_err)]

use std::net::SocketAddr;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use matterix_hardware::deploy::{
    Control, Device, Exposed, Hardware, Journal, Mode, Settings, digest, not_opened, not_reached, of_fault, unsafe_left,
};
use matterix_hardware::serve::{Attendant, Catalogue, Desk, Paced, catalogue};
use matterix_hardware::world::Machine;
use matterix_hardware::{binding, calibration};
use matterix_ir::offer::{Failure, Offer, Shown};
use matterix_ir::plan::{Plan, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, FileId, Program, Sources};
use matterix_runtime::backend::{Backend, Prepared, Sim};
use matterix_runtime::exec::{self, Limits, RunStatus};
use matterix_runtime::process::{Engine, Options};
use matterix_sila_wire::discovery::announce;
use matterix_sila_wire::{About, Door, serve as answer};

use super::deploy::traced;
use crate::terminal::{Stream, print};

/// What a server is given beside a program.
pub struct Service<'p> {
    /// Where it answers.
    pub address: SocketAddr,
    /// Its identifier.
    pub uuid: String,
    /// Whom it answers, and how.
    pub door: Door,
    /// Whether it says to the network that it is there.
    pub announced: bool,
    /// The text of the bindings and the file they are in; the twin alone without them.
    pub bindings: Option<(FileId, &'p str)>,
    /// Seconds of lab time per second.
    pub speed: f64,
    /// Where the noise of the twin starts.
    pub seed: u64,
    /// Shows all that goes over lines.
    pub trace: bool,
    /// What is kept of what is said to devices.
    pub journal: Journal,
    /// Kept up to date with what is told to devices.
    pub exposed: &'p Exposed,
    /// What people say meanwhile; it ends when they stop it.
    pub control: &'p Control,
    /// Who serves.
    pub who: String,
    /// Told where it answers, and what it offers.
    pub ready: &'p mut dyn FnMut(SocketAddr, &Catalogue<'_>),
}

/// Serves until it is ended; what was wrong before, or went wrong then.
pub fn serve(program: &Program, sources: &Sources, mut service: Service<'_>) -> Result<Vec<Diagnostic>, String> {
    let prepared = Prepared::new(program);
    let params = program.model.params.iter().map(|p| p.value).collect();
    let engine = Engine::new(&prepared.model, params, program.plan.locals.len(), Options::default());
    let engine = engine.and_then(|mut engine| engine.start(&mut ()).map(|()| engine)).map_err(|f| f.message)?;
    let twin = Sim::new(engine, &prepared, service.seed);
    let Some((file, text)) = service.bindings else {
        let mut twin = twin;
        let offers = program.offers.commands.iter().collect();
        let shown = program.offers.shown.iter().collect();
        return attend(program, sources, &mut twin, offers, shown, service).map(|(found, _)| found);
    };
    let (bindings, mut found) = binding::read(program, file, text);
    found.extend(calibration::unconfirmed(file, text));
    if found.iter().any(Diagnostic::is_error) {
        return Ok(found);
    }
    let digest = digest(program, &binding::canonical(program, &bindings))?;
    let devices: Vec<Device<'_>> = bindings.into_iter().map(|b| Device::new(program, b)).collect::<Result<_, _>>()?;
    let over = traced(service.trace);
    let Service { speed, control, exposed, .. } = service;
    let ended = AtomicBool::new(false);
    let world = Rc::new(Machine::new());
    let settings = Settings { mode: Mode::Real, speed, control, ended: &ended, world, exposed };
    let journal = std::mem::take(&mut service.journal);
    let mut hardware = Hardware::new(program, sources, twin, devices, settings, journal, Box::new(over));
    // What no device does or tells is not offered.
    let (offers, shown, left_out) = {
        let (observed, devices) = hardware.view();
        let driven = |o: &&Offer| {
            let said = |step| devices.iter().any(|d| d.driver.is_some_and(|driver| driver.call(step).is_some()));
            o.arrangements.iter().all(|a| operations(&program.plan, a.step).into_iter().all(said))
        };
        let seen = |s: &&Shown| !observed.asks(&program.model, s.value).1;
        let left_out = program.offers.commands.iter().filter(|o| !driven(o)).map(|o| named(program, o.device, &o.verb));
        let unseen = program.offers.shown.iter().filter(|s| !seen(s));
        let left_out = left_out.chain(unseen.map(|s| named(program, Some(s.device), &s.name)));
        let left_out: Vec<String> = left_out.collect();
        let offers = program.offers.commands.iter().filter(driven).cloned();
        let refusable = |mut offer: Offer| {
            let drivers = devices.iter().filter_map(|d| d.driver);
            let refused = drivers.flat_map(|d| d.refusals.iter().map(|r| r.failure.clone()));
            for name in refused.collect::<Vec<_>>() {
                if !offer.fails.iter().any(|f| f.name == name) {
                    offer.fails.push(Failure { name, help: None });
                }
            }
            offer
        };
        let offers: Vec<Offer> = offers.map(refusable).collect();
        let shown: Vec<&Shown> = program.offers.shown.iter().filter(seen).collect();
        (offers, shown, left_out)
    };
    if !left_out.is_empty() {
        let list = left_out.join(", ");
        print(Stream::Err, &format!("not served because no bound driver supports it: {list}\n"));
    }
    let unreached = hardware.connect();
    if !unreached.is_empty() {
        return Ok(unreached.iter().map(|u| not_reached(u, false)).collect());
    }
    if let Err(fault) = hardware.begin_journal(&digest, service.seed, &service.who) {
        return Ok(vec![of_fault(&program.plan, fault)]);
    }
    if let Err(failed) = hardware.open() {
        let mut found = vec![super::run::led_by_the_user(not_opened(&program.plan, failed), sources)];
        found.extend(hardware.secure().into_iter().map(unsafe_left));
        return Ok(found);
    }
    let (mut found, well) = attend(program, sources, &mut hardware, offers.iter().collect(), shown, service)?;
    if !well {
        found.extend(hardware.secure().into_iter().map(unsafe_left));
    }
    found.extend(hardware.close().err().map(|fault| of_fault(&program.plan, fault)));
    let status = if found.iter().any(Diagnostic::is_error) { "failed" } else { "ended" };
    found.extend(hardware.end_journal(status).err().map(|fault| of_fault(&program.plan, fault)));
    Ok(found)
}

/// Lets the executor do what is asked for, until it is ended; what went wrong, and whether nothing was going on then.
fn attend(
    program: &Program,
    sources: &Sources,
    backend: &mut dyn Backend,
    offers: Vec<&Offer>,
    shown: Vec<&Shown>,
    service: Service<'_>,
) -> Result<(Vec<Diagnostic>, bool), String> {
    let catalogue = catalogue(&program.scene, &program.offers, offers, shown)?;
    let (name, features) = (program.scene.lab.clone(), catalogue.features.clone());
    let about = format!("The lab `{name}`. {}", program.offers.docs(None, "")).trim_end().to_owned();
    let version = env!("CARGO_PKG_VERSION").to_owned();
    let about = About { name, description: about, version, uuid: service.uuid };
    let chain = service.door.identity.as_ref().map(|identity| identity.chain.clone());
    let (server, requests) = answer(service.address, about.clone(), service.door, features)?;
    // Whoever knows the address needs no network to find it.
    let announced = service.announced.then(|| announce(&about, server.address, chain.as_deref()));
    let _announced = announced
        .and_then(|announced| announced.map_err(|why| print(Stream::Err, &format!("not announced: {why}\n"))).ok());
    (service.ready)(server.address, &catalogue);
    let desk = Desk::new(catalogue, &program.scene, &program.plan, requests);
    let mut say = |text: &str| print(Stream::Err, text);
    let mut listener = Attendant::new(&desk, sources, &mut say);
    let mut paced = Paced::new(backend, &desk, service.control.cancel(), service.speed);
    let limits = Limits { cancel: Some(service.control.cancel()), horizon: f64::INFINITY, ..Limits::default() };
    let execution = exec::execute(&program.plan, &program.scene, &mut paced, limits, &mut listener);
    let well = execution.status == RunStatus::Cancelled;
    desk.end(if well { "the server is shut down" } else { "the lab stopped with a fault" });
    // What was told last is still on its way.
    std::thread::sleep(std::time::Duration::from_millis(200));
    drop(server);
    let fault = execution.failure.iter().filter(|_| !well);
    let found = fault.map(exec::diagnostic).map(|d| super::run::led_by_the_user(d, sources)).collect();
    Ok((found, well && !desk.was_busy()))
}

/// A command or quantity of a thing, as people say it.
fn named(program: &Program, device: Option<InstanceId>, what: &str) -> String {
    match device {
        Some(device) => format!("`{what}` of `{}`", program.scene.get(device).name),
        None => format!("`{what}`"),
    }
}

/// The operations below a node of the plan.
fn operations(plan: &Plan, step: StepId) -> Vec<StepId> {
    let (mut found, mut open) = (Vec::new(), vec![step]);
    while let Some(step) = open.pop() {
        if matches!(plan.get(step).step, Step::Operation(_)) {
            found.push(step);
        }
        open.extend(plan.get(step).step.children());
    }
    found
}
