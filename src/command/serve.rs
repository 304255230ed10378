//! `matterixc serve`.

use std::net::{SocketAddr, TcpListener, ToSocketAddrs};
use std::path::Path;

use matterix_hardware::deploy::Journal;
use matterix_ir::Diagnostic;
use matterix_sila_wire::tls::{Identity, hosts};
use matterix_sila_wire::{Door, Users};

use super::run::Findings;
use crate::args::{Color, RunFormat, ServeArgs};
use crate::pipeline::{self, Input, Options, Service, Wires};
use crate::terminal::{Stream, print, step_aside};
use crate::{Exit, cancel, files};

/// Offers a lab to others until it is interrupted; where it answers is printed first.
pub fn serve(args: &ServeArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

fn attempt(args: &ServeArgs, color: Color) -> Result<Exit, String> {
    let mut input = Input::file(&args.file, files::read(&args.file)?);
    let workflow = args.workflow.clone().or_else(|| input.idle());
    let bindings = match &args.bind {
        Some(path) => {
            let text = String::from_utf8(files::read(path)?);
            Some((path, text.map_err(|_| format!("`{}` is not UTF-8 text", path.display()))?))
        }
        None => None,
    };
    if bindings.is_some() && args.journal.is_none() {
        return Err("serving devices needs a journal of the sent messages: add `--journal FILE`".to_string());
    }
    let mut findings = Findings::new(RunFormat::Human, color);
    let options = Options { workflow, wires: Wires::Offered, ..Options::default() };
    let (mut sources, program, diagnostics) = pipeline::compile(&input, &options);
    let is_wrong = diagnostics.iter().any(Diagnostic::is_error);
    findings.show(&sources, diagnostics);
    let Some(mut program) = program.filter(|_| !is_wrong) else {
        findings.end();
        return Ok(Exit::Findings);
    };
    matterix_hardware::serve::wait_for_ever(&mut program);
    let place = (args.host.as_str(), args.tcp).to_socket_addrs().ok().and_then(|mut all| all.next());
    let address: SocketAddr = place.ok_or_else(|| format!("unknown host `{}`", args.host))?;
    // Before anything is made for it: a certificate is for the address.
    drop(TcpListener::bind(address).map_err(|e| format!("cannot listen on `{address}`: {e}"))?);
    let file =
        bindings.as_ref().map(|(path, text)| (sources.add(path.display().to_string(), text.clone()), text.as_str()));
    let mut ready = |address: SocketAddr, catalogue: &matterix_hardware::serve::Catalogue<'_>| {
        print(Stream::Out, &format!("{address}\n"));
        for feature in &catalogue.features {
            let (commands, properties) = (feature.commands.len(), feature.properties.len());
            let count = |n: usize, one: &str, more: &str| format!("{n} {}", if n == 1 { one } else { more });
            let (commands, properties) =
                (count(commands, "command", "commands"), count(properties, "property", "properties"));
            print(Stream::Err, &format!("{}: {commands}, {properties}\n", feature.id()));
        }
    };
    let journal = args.journal.as_deref().map(Journal::create).transpose().map_err(|e| e.text().to_owned())?;
    if bindings.is_some() {
        step_aside()?;
    }
    cancel::last_words(super::deploy::left_exposed);
    cancel::on_interrupt_quietly()?;
    let uuid = match &args.uuid {
        Some(given) => matterix_sila_wire::uuid(given).ok_or_else(|| format!("`{given}` is not a UUID"))?,
        None => crate::identity::of(&args.file, &program.scene.lab)?,
    };
    let door = door(args, address, &uuid)?;
    let service = Service {
        address,
        uuid,
        door,
        announced: !args.no_discovery,
        bindings: file,
        speed: args.speed,
        seed: args.seed,
        trace: args.trace,
        journal: journal.unwrap_or_default(),
        exposed: &super::deploy::EXPOSED,
        control: &super::deploy::CONTROL,
        who: crate::keys::person(),
        ready: &mut ready,
    };
    let found = pipeline::serve(&program, &sources, service);
    args.journal.iter().for_each(|path| super::deploy::forget_empty(path));
    let found = found?;
    let failed = found.iter().any(Diagnostic::is_error);
    findings.show(&sources, found);
    findings.end();
    Ok(if failed { Exit::Findings } else { Exit::Fine })
}

/// Whom the server answers, and how.
fn door(args: &ServeArgs, address: SocketAddr, uuid: &str) -> Result<Door, String> {
    let text = |path: &Path| {
        let text = String::from_utf8(files::read(path)?);
        text.map_err(|_| format!("`{}` is not UTF-8 text", path.display()))
    };
    let users = args
        .users
        .as_deref()
        .map(|path| Users::read(&text(path)?).map_err(|why| format!("`{}`: {why}", path.display())))
        .transpose()?;
    let (identity, file) = match (&args.certificate, &args.key) {
        _ if args.insecure => return Ok(Door { identity: None, users }),
        (Some(chain), Some(key)) => {
            let identity = Identity { chain: text(chain)?, key: text(key)? };
            identity.is_sound().map_err(|why| format!("`{}`, `{}`: {why}", chain.display(), key.display()))?;
            (identity, chain.clone())
        }
        _ => crate::identity::certificate(uuid, &hosts(&args.host, address.ip()))?,
    };
    let fingerprint = identity.fingerprint()?;
    print(Stream::Err, &format!("certificate: {}\nfingerprint: {fingerprint}\n", file.display()));
    Ok(Door { identity: Some(identity), users })
}
