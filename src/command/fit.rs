//! `matterixc fit`.

use matterix_ir::Diagnostic;

use crate::args::{Color, FitArgs, RunFormat};
use crate::pipeline::{self, Asked, Input};
use crate::progress::Count;
use crate::terminal::{Stream, print, print_error};
use crate::{Exit, cancel, files};

/// Compiles once, estimates and prints what the data say; findings and progress go to standard error.
pub fn fit(args: &FitArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The fit; `Err` says in words what is wrong with usage or files.
fn attempt(args: &FitArgs, color: Color) -> Result<Exit, String> {
    let many = &args.many;
    let input = Input::file(&many.file, files::read(&many.file)?);
    if let Some(dir) = &many.out {
        super::run::is_writable(dir)?;
    }
    let (sources, compiled, found) = pipeline::many(&input, &many.options(), true);
    let is_wrong = found.iter().any(Diagnostic::is_error);
    super::bill::show(&sources, found, color);
    let Some(compiled) = compiled.filter(|_| !is_wrong) else { return Ok(Exit::Findings) };
    let Some(fit) = pipeline::as_fit(&compiled) else { return Ok(Exit::Findings) };

    let cancel = cancel::on_interrupt_quietly()?;
    let asked = Asked { runs: None, seed: many.seed, jobs: many.threads(), cancel };
    let mut count = Count::new(many.format == RunFormat::Human);
    let done = pipeline::fit(&compiled.program, fit, &asked, &mut |n| count.reached(n, None));
    count.finish();
    match done? {
        Ok(Some(done)) => {
            print(Stream::Out, if many.format == RunFormat::Json { &done.json } else { &done.page });
            if let Some(dir) = &many.out {
                done.write(dir)?;
            }
            Ok(if done.is_whole { Exit::Fine } else { Exit::Findings })
        }
        Ok(None) => {
            print_error("stopped before the end of the fit");
            Ok(Exit::Findings)
        }
        Err(found) => {
            super::bill::show(&sources, vec![*found], color);
            Ok(Exit::Findings)
        }
    }
}
