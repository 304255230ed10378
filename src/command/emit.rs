//! `matterixc emit`.

use std::sync::atomic::Ordering;

use matterix_ir::Diagnostic;

use crate::args::{Color, EmitArgs};
use crate::pipeline::{self, Input};
use crate::terminal::{self, print_error};

use super::bill::show;
use crate::{Exit, cache, cancel, files};

/// Compiles, performs once on the digital twin and writes what was done; findings go to standard error. Nothing is written
/// where there is an error.
pub fn emit(args: &EmitArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

fn attempt(args: &EmitArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.subject.file, files::read(&args.subject.file)?);
    let (sources, wired, mut found) = pipeline::wire(&input, &args.subject.options(), args.target.wire());
    let is_wrong = |found: &[Diagnostic]| found.iter().any(Diagnostic::is_error);
    let cancel = cancel::on_interrupt()?;
    let mut written = None;
    if let Some((program, wiring)) = wired.filter(|_| !is_wrong(&found)) {
        found.extend(pipeline::motions(&program, &*cache::of(args.no_cache)));
        if !is_wrong(&found) {
            let (bytes, more) = pipeline::emit(&program, &wiring, &sources, args.target, args.seed, cancel);
            found.extend(more);
            written = bytes;
        }
    }
    show(&sources, found, color);
    let Some(bytes) = written else {
        if cancel.load(Ordering::SeqCst) {
            print_error("stopped before the end of the workflow; nothing is written");
        }
        return Ok(Exit::Findings);
    };
    if let Some(bindings) = &args.play {
        let name = match args.target {
            pipeline::Target::OpentronsPython => "protocol.py",
            pipeline::Target::Urscript => "program.script",
            _ => "protocol.json",
        };
        return super::play::play(&input, &args.subject.options(), bindings, (name, bytes), cancel, color);
    }
    match &args.out {
        Some(path) => files::write(path, bytes)?,
        None => terminal::pour(&bytes),
    }
    Ok(Exit::Fine)
}
