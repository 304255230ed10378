//! `matterixc study`.

use matterix_ir::Diagnostic;

use crate::args::{Color, RunFormat, StudyArgs};
use crate::pipeline::{self, Asked, Input};
use crate::progress::Count;
use crate::terminal::{Stream, print, print_error};
use crate::{Exit, cancel, files};

/// Compiles once, runs many times and prints figures; findings and progress go to standard error.
pub fn study(args: &StudyArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The study; `Err` says in words what is wrong with usage or files.
fn attempt(args: &StudyArgs, color: Color) -> Result<Exit, String> {
    let many = &args.many;
    let input = Input::file(&many.file, files::read(&many.file)?);
    if let Some(dir) = &many.out {
        super::run::is_writable(dir)?;
    }
    let (sources, compiled, found) = pipeline::many(&input, &many.options(), false);
    let is_wrong = found.iter().any(Diagnostic::is_error);
    super::bill::show(&sources, found, color);
    let Some(compiled) = compiled.filter(|_| !is_wrong) else { return Ok(Exit::Findings) };
    let Some(study) = pipeline::as_study(&compiled) else { return Ok(Exit::Findings) };

    let cancel = cancel::on_interrupt_quietly()?;
    let asked = Asked { runs: args.runs, seed: many.seed, jobs: many.threads(), cancel };
    let mut count = Count::new(many.format == RunFormat::Human);
    let done = pipeline::study(&compiled.program, study, &asked, &mut |n, all| count.reached(n, Some(all)));
    count.finish();
    let done = done?;
    print(Stream::Out, if many.format == RunFormat::Json { &done.json } else { &done.page });
    if let Some(dir) = &many.out {
        done.write(dir)?;
    }
    if !done.is_whole {
        print_error("stopped before all runs had ended; the figures above cover the finished runs");
        return Ok(Exit::Findings);
    }
    Ok(Exit::Fine)
}
