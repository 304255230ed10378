//! `matterixc fmt`.

use std::path::Path;

use crate::Exit;
use crate::args::{Color, FmtArgs};
use crate::files;
use crate::pipeline::{self, Input};
use crate::report::{Format, Reporter};
use crate::terminal::{self, Stream, paint, pour, print, print_error};

/// Rewrites every file that can be read and parsed; the others stay as they are.
pub fn fmt(args: &FmtArgs, color: Color) -> Exit {
    let mut reporter = Reporter::new(Format::Human, terminal::look(Stream::Err, color));
    let exits: Vec<Exit> = args.files.iter().map(|path| one(path, args, &mut reporter)).collect();
    if reporter.tally() != Default::default() {
        print(Stream::Err, &reporter.summary());
    }
    exits.into_iter().max().unwrap_or(Exit::Fine)
}

fn one(path: &Path, args: &FmtArgs, reporter: &mut Reporter) -> Exit {
    let from_stdin = path == Path::new("-");
    let bytes = if from_stdin { files::read_stdin() } else { files::read(path) };
    let input = match bytes {
        Ok(bytes) if from_stdin => Input::stdin(bytes),
        Ok(bytes) => Input::file(path, bytes),
        Err(message) => return usage(&message),
    };
    let formatted = match pipeline::format(&input) {
        Ok(text) => text,
        Err((sources, diagnostics)) => {
            paint(Stream::Err, &reporter.render(&sources, diagnostics));
            return Exit::Findings;
        }
    };
    let differs = formatted.as_bytes() != input.bytes;
    if args.check {
        if differs {
            print(Stream::Out, &format!("{}: not formatted\n", input.name));
        }
        return if differs { Exit::Findings } else { Exit::Fine };
    }
    if args.stdout || from_stdin {
        pour(formatted.as_bytes());
    } else if differs && let Err(message) = files::replace(path, &formatted) {
        return usage(&message);
    }
    Exit::Fine
}

fn usage(message: &str) -> Exit {
    print_error(message);
    Exit::Usage
}
