//! `matterixc emit`.

use std::sync::atomic::Ordering;

use matterix_ir::Diagnostic;

use crate::args::{Color, EmitArgs};
use crate::pipeline::{self, Input, Options};
use crate::terminal::{self, print_error};

use super::bill::show;
use crate::{Exit, cache, cancel, files, tips};

/// Compiles, performs once on the digital twin and writes what was done; findings go to standard error. Nothing is written
/// where there is an error.
pub fn emit(args: &EmitArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

fn attempt(args: &EmitArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.subject.file, files::read(&args.subject.file)?);
    let kept = args.tips.as_deref().map(tips::read).transpose()?.unwrap_or_default();
    let options = Options { measured: kept.clone(), ..args.subject.options() };
    let (sources, wired, mut found) = pipeline::wire(&input, &options, args.target.wire());
    let is_wrong = |found: &[Diagnostic]| found.iter().any(Diagnostic::is_error);
    let cancel = cancel::on_interrupt()?;
    let mut written = None;
    if let Some((program, wiring)) = wired.filter(|_| !is_wrong(&found)) {
        if args.tips.is_some() {
            tips::agrees(&kept, &program)?;
        }
        found.extend(pipeline::motions(&program, &*cache::of(args.no_cache)));
        if !is_wrong(&found) {
            let (emitted, more) = pipeline::emit(&program, &wiring, &sources, args.target, args.seed, cancel);
            found.extend(more);
            written = emitted.map(|emitted| (emitted, program));
        }
    }
    show(&sources, found, color);
    let Some((pipeline::Emitted { bytes, states }, program)) = written else {
        if cancel.load(Ordering::SeqCst) {
            print_error("stopped before the end of the workflow; nothing is written");
        }
        return Ok(Exit::Findings);
    };
    if let Some(bindings) = &args.play {
        let name = match args.target {
            pipeline::Target::OpentronsPython => "protocol.py",
            pipeline::Target::Urscript => "program.script",
            pipeline::Target::OpentronsJson => "protocol.json",
            _ => return Err("no device plays a file of this target: `--play` takes `opentrons-json`, `opentrons-python` and `urscript`".to_owned()),
        };
        // Whatever became of it, the robot may have taken these tips.
        let played = super::play::play(&input, &options, bindings, (name, bytes), cancel, color)?;
        if let Some(path) = &args.tips {
            tips::write(path, &program, &states)?;
        }
        return Ok(played);
    }
    match &args.out {
        Some(path) => files::write(path, bytes)?,
        None => terminal::pour(&bytes),
    }
    if let Some(path) = &args.tips {
        tips::write(path, &program, &states)?;
    }
    Ok(Exit::Fine)
}
