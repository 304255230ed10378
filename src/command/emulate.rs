//! `matterixc emulate`.

use std::fmt::Write;

use matterix_ir::Diagnostic;

use super::run::Findings;
use crate::args::{Color, EmulateArgs, RunFormat};
use crate::pipeline::{self, Input, Line, Options, Wires};
use crate::terminal::{Stream, print};
use crate::{Exit, cancel, files};

/// The name of the one device of a lab that an asset alone stands in.
const ALONE: &str = "device";

/// Answers as a device until it is interrupted; where it answers is printed first.
pub fn emulate(args: &EmulateArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

fn attempt(args: &EmulateArgs, color: Color) -> Result<Exit, String> {
    if args.link.is_some() && !args.pty {
        return Err("`--link` needs `--pty`".to_owned());
    }
    let named: Vec<(&str, Option<&str>)> = args
        .device
        .iter()
        .map(|d| d.split_once('@').map_or((d.as_str(), None), |(name, address)| (name, Some(address))))
        .collect();
    let (mut input, devices) = match (&args.file, named.as_slice()) {
        (Some(file), _) => (Input::file(file, files::read(file)?), named),
        (None, [(asset, address)]) => (Input::stdin(alone(asset)?.into_bytes()), vec![(ALONE, *address)]),
        (None, _) => return Err("several devices need a lab: give its file with `--file`".to_owned()),
    };
    let workflow = args.workflow.clone().or_else(|| input.idle());
    let options = Options { workflow, wires: Wires::Served, ..Options::default() };
    let (sources, program, diagnostics) = pipeline::compile(&input, &options);
    let is_wrong = diagnostics.iter().any(Diagnostic::is_error);
    let Some(program) = program.filter(|_| !is_wrong) else {
        let mut findings = Findings::new(RunFormat::Human, color);
        findings.show(&sources, diagnostics);
        findings.end();
        return Ok(Exit::Findings);
    };
    let cancel = cancel::on_interrupt_quietly()?;
    let line = match args.tcp {
        Some(port) => Line::Tcp(port),
        None => Line::Pty(args.link.as_deref()),
    };
    let mut ready = |place: &str| print(Stream::Out, &format!("{place}\n"));
    let driver = args.driver.as_deref();
    pipeline::emulate(&program, &devices, driver, &line, (args.speed, args.seed), cancel, &mut ready)?;
    Ok(Exit::Fine)
}

/// A lab with nothing in it but an asset of the library.
fn alone(asset: &str) -> Result<String, String> {
    let name = asset.rsplit("::").next().unwrap_or(asset);
    let module = matterix_lang::library::home_of(name)
        .ok_or_else(|| format!("the library has no asset `{name}`: give the file of its lab with `--file`"))?;
    let mut text = String::from("mtx 1\n");
    // Writing to a text cannot fail.
    let _ = writeln!(text, "use {module}::{name}");
    let _ = writeln!(text, "lab emulated {{ ambient: 22 degC, {ALONE} = {name} at (0, 0, 0) m }}");
    let _ = writeln!(text, "workflow idle in emulated {{ wait 1 s }}");
    Ok(text)
}
