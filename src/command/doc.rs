//! `matterixc doc`.

use std::fs;

use crate::args::{Color, DocArgs};
use crate::pipeline::{self, Input};
use crate::terminal::{Stream, complain, print};
use crate::{Exit, files};

use super::bill::show;

/// Compiles a workflow and writes it as a protocol; findings go to standard error.
pub fn doc(args: &DocArgs, color: Color) -> Exit {
    match attempt(args, color) {
        Ok(exit) => exit,
        Err(message) => {
            complain(&message);
            Exit::Usage
        }
    }
}

/// The protocol; `Err` says in words what is wrong with usage or files.
fn attempt(args: &DocArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.file, files::read(&args.file)?);
    let (sources, text, found) = pipeline::document(&input, args.workflow.as_deref(), args.lab.as_deref(), &args.set);
    show(&sources, found, color);
    let Some(text) = text else { return Ok(Exit::Findings) };
    match &args.out {
        Some(path) => {
            fs::write(path, text).map_err(|e| format!("cannot write `{}`: {}", path.display(), files::reason(&e)))?;
        }
        None => print(Stream::Out, &text),
    }
    Ok(Exit::Fine)
}
