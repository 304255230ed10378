//! `matterixc check`.

use std::path::{Path, PathBuf};

use matterix_ir::hidden::visible;
use matterix_ir::points::Points;
use matterix_ir::{Diagnostic, Severity, Sources};
use matterix_runtime::motion::Store;

use super::watch;
use crate::Exit;
use crate::args::{CheckArgs, Color};
use crate::cache;
use crate::files;
use crate::pipeline::{self, Advice, Input, Mended, Mending};
use crate::report::points::{self, Found as At};
use crate::report::{Format, Reporter, stricter};
use crate::terminal::{self, Stream, paint, print, print_error};

/// Findings, and the texts they are in.
type Found = (Sources, Vec<Diagnostic>);

/// Reports on every file that can be read; findings go to standard output.
pub fn check(args: &CheckArgs, color: Color) -> Exit {
    if args.at.is_some() && args.files.len() > 1 {
        print_error("`--at` needs exactly one file");
        return Exit::Usage;
    }
    if args.watch {
        return super::or_complain(watch::watch(&args.files, |files| look(args, files, color)));
    }
    let (found, exit) = look(args, &args.files, color);
    paint(Stream::Out, &found);
    exit
}

/// Looks through files once: what is to be printed, and how it ends.
fn look(args: &CheckArgs, files: &[PathBuf], color: Color) -> (String, Exit) {
    let mut reporter = Reporter::new(args.format, terminal::look(Stream::Out, color));
    let mut exit = Exit::Fine;
    let mut out = String::new();
    let cache = cache::of(args.no_cache);
    for path in files {
        let (input, left) = match read(path, args, &*cache) {
            Ok(read) => read,
            Err(message) => {
                print_error(&message);
                exit = Exit::Usage;
                continue;
            }
        };
        let (sources, mut diagnostics, known) = match args.contents {
            true => pipeline::contents(&input),
            false => {
                let advice = if args.strict { Advice::Given } else { Advice::LeftOut };
                let check = || pipeline::check(&input, args.fidelity, advice, &*cache);
                let (sources, diagnostics) = left.unwrap_or_else(check);
                (sources, diagnostics, Vec::new())
            }
        };
        match args.strict {
            true => diagnostics.iter_mut().for_each(|d| d.severity = stricter(d.severity)),
            false => diagnostics.retain(|d| d.severity != Severity::Advice),
        }
        out += &reporter.render(&sources, diagnostics);
        if args.contents {
            match contents(args, path, &known, &sources) {
                Ok(text) => out += &text,
                Err(message) => {
                    print_error(&message);
                    exit = Exit::Usage;
                }
            }
        }
    }
    if exit == Exit::Fine || reporter.tally() != Default::default() || args.format != Format::Human {
        out += &reporter.summary();
    }
    let exit = if reporter.tally().errors > 0 { exit.max(Exit::Findings) } else { exit };
    (out, exit)
}

/// A file, mended where that is wanted, with what is left to find then; what was done is said on standard error.
fn read(path: &Path, args: &CheckArgs, cache: &dyn Store) -> Result<(Input, Option<Found>), String> {
    let input = Input::file(path, files::read(path)?);
    let Some(which) = args.fix else { return Ok((input, None)) };
    let Mending { input, done, sources, found } = pipeline::mend(input, which, args.fidelity, cache);
    if !done.is_empty() {
        files::replace(path, &input.bytes)?;
    }
    for Mended { at: (line, column), title } in &done {
        print(Stream::Err, &format!("{}:{line}:{column}: fixed: {title}\n", input.name));
    }
    Ok((input, Some((sources, found))))
}

/// What is known at the statements of a file; `Err` says in words why there is no such place.
fn contents(args: &CheckArgs, path: &Path, known: &[Points], sources: &Sources) -> Result<String, String> {
    let json = args.format == Format::Json;
    let mut out = String::new();
    let Some(place) = args.at else {
        for points in known {
            out += &if json {
                visible(&points::json(points, None, sources)).into_owned()
            } else {
                points::table(points, sources) + "\n"
            };
        }
        return Ok(out);
    };
    let mut missed = None;
    let mut shown = false;
    for points in known {
        match points::find(points, place, sources) {
            At::Statement(index) => {
                out += &match json {
                    true => visible(&points::json(points, Some(index), sources)).into_owned(),
                    false => points::all(points, index, sources) + "\n",
                };
                shown = true;
            }
            other => missed = missed.or(Some(other)),
        }
    }
    let path = path.display();
    match missed {
        _ if shown => Ok(out),
        None => Err(format!("`check` could not follow any workflow of `{path}`")),
        Some(At::NoLine(lines)) => Err(format!("`{path}` has {lines} lines")),
        Some(At::Nothing(before, after)) => {
            let near: Vec<String> = before.into_iter().chain(after).map(|l| l.to_string()).collect();
            let near =
                if near.is_empty() { String::new() } else { format!("; the nearest are at {}", near.join(" and ")) };
            Err(format!("`{path}` has no statement of a workflow at this place{near}"))
        }
        Some(At::Statement(_)) => Ok(out),
    }
}
