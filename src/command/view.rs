//! `matterixc view`.

use matterix_ir::Diagnostic;
use matterix_view::{Document, from_recording, page, serve};

use crate::args::{Color, ViewArgs};
use crate::pipeline::{self, Input};
use crate::terminal::{Stream, print};
use crate::{Exit, cancel, files};

use super::bill::show;

/// Shows a lab or a recording in a browser, or writes the page to a file; findings go to standard error.
pub fn view(args: &ViewArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The page; `Err` says in words what is wrong with usage or files.
fn attempt(args: &ViewArgs, color: Color) -> Result<Exit, String> {
    let Some(document) = document(args, color)? else { return Ok(Exit::Findings) };
    let page = page::page(&document).map_err(|e| format!("cannot write the page: {e}"))?;
    if let Some(path) = &args.export {
        files::write(path, &page)?;
        return Ok(Exit::Fine);
    }
    let failed = |e: std::io::Error| format!("cannot serve the page on port {}: {}", args.port, files::reason(&e));
    let mut served = serve::Served::new(page, args.port).map_err(failed)?;
    let stop = cancel::on_interrupt_quietly()?;
    print(Stream::Out, &format!("{}\n", served.url()));
    print(Stream::Err, "open this address in a browser; Ctrl-C ends\n");
    served.until(stop).map_err(failed)?;
    Ok(Exit::Fine)
}

/// What is to be shown; `None` where the program has errors, which are said.
fn document(args: &ViewArgs, color: Color) -> Result<Option<Document>, String> {
    let file = &args.subject.file;
    let file = if file.is_dir() { &file.join("recording.mcap") } else { file };
    let bytes = files::read_recording(file)?;
    if from_recording::is_recording(&bytes) {
        let subject = &args.subject;
        if subject.workflow.is_some() || subject.lab.is_some() || !subject.set.is_empty() {
            return Err("a recording has one workflow in one lab: remove --workflow, --lab and --set".to_string());
        }
        let read = from_recording::from_recording(&bytes);
        return read.map(Some).map_err(|e| format!("cannot show `{}`: {e}", file.display()));
    }
    if file.extension().is_some_and(|e| e == "mcap") {
        return Err(format!("cannot show `{}`: it is not a recording", file.display()));
    }
    let input = Input::file(file, bytes);
    let (sources, program, found) = pipeline::compile(&input, &args.subject.options());
    let wrong = found.iter().any(Diagnostic::is_error);
    show(&sources, found, color);
    Ok(program.filter(|_| !wrong).map(|program| pipeline::still(&program, &sources)))
}
