//! `matterixc doc`.

use crate::args::{Color, DocArgs};
use crate::pipeline::{self, Input};
use crate::terminal::{Stream, print};
use crate::{Exit, files};

use super::bill::show;

/// Compiles a workflow and writes it as a protocol; findings go to standard error.
pub fn doc(args: &DocArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The protocol; `Err` says in words what is wrong with usage or files.
fn attempt(args: &DocArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.subject.file, files::read(&args.subject.file)?);
    let (sources, text, found) = pipeline::document(&input, &args.subject.options());
    show(&sources, found, color);
    let Some(text) = text else { return Ok(Exit::Findings) };
    match &args.out {
        Some(path) => files::write(path, text)?,
        None => print(Stream::Out, &text),
    }
    Ok(Exit::Fine)
}
