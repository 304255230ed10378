//! `matterixc plan`.

use std::sync::atomic::Ordering;

use matterix_ir::Diagnostic;

use crate::args::{Color, PlanArgs, RunFormat};
use crate::pipeline::{self, Input, Search};
use crate::terminal::{self, Stream, print, print_error};
use crate::{Exit, cancel, files};

use super::run::Findings;

/// Compiles and schedules; findings go to standard error, the schedule to standard output.
pub fn plan(args: &PlanArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The schedule; `Err` says in words what is wrong with usage or files.
fn attempt(args: &PlanArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.subject.file, files::read(&args.subject.file)?);
    let mut findings = Findings::new(args.format, color);
    let (sources, program, diagnostics) = pipeline::compile(&input, &args.subject.options());
    let is_wrong = diagnostics.iter().any(Diagnostic::is_error);
    findings.show(&sources, diagnostics);
    let Some(program) = program.filter(|_| !is_wrong) else {
        findings.end();
        return Ok(Exit::Findings);
    };
    let search = Search::Clock { time: args.time_limit, seed: args.seed };
    let cancel = cancel::on_interrupt_quietly()?;
    let schedule = match pipeline::schedule(&program, search, cancel) {
        Ok(schedule) => schedule,
        Err(found) => {
            findings.show(&sources, vec![*found]);
            findings.end();
            return Ok(Exit::Findings);
        }
    };
    let is_cut = cancel.load(Ordering::SeqCst);
    findings.end();
    match args.format {
        RunFormat::Human => print(Stream::Out, &pipeline::chart(&schedule, terminal::width(Stream::Out))),
        RunFormat::Json => print(Stream::Out, &pipeline::schedule_json(&schedule)?),
    }
    if let Some(path) = &args.svg {
        files::write(path, &pipeline::picture(&schedule)?)?;
    }
    if is_cut {
        print_error("stopped before the end of the search; the schedule above is the shortest found so far");
        return Ok(Exit::Findings);
    }
    Ok(Exit::Fine)
}
