//! `matterixc check`.

use std::path::Path;

use matterix_ir::points::Points;
use matterix_ir::{Severity, Sources};

use crate::Exit;
use crate::args::{CheckArgs, Color};
use crate::cache;
use crate::files;
use crate::pipeline::{self, Input};
use crate::report::points::{self, Found};
use crate::report::{Format, Reporter};
use crate::terminal::{self, Stream, complain, print};

/// Reports on every file that can be read; findings go to standard output.
pub fn check(args: &CheckArgs, color: Color) -> Exit {
    if args.at.is_some() && args.files.len() > 1 {
        complain("a place is in one file: give one with `--at`");
        return Exit::Usage;
    }
    let mut reporter = Reporter::new(args.format, terminal::look(Stream::Out, color));
    let mut exit = Exit::Fine;
    let cache = cache::of(args.no_cache);
    for path in &args.files {
        let bytes = match files::read(path) {
            Ok(bytes) => bytes,
            Err(message) => {
                complain(&message);
                exit = Exit::Usage;
                continue;
            }
        };
        let input = Input::file(path, bytes);
        let (sources, mut diagnostics, known) = match args.contents {
            true => pipeline::contents(&input),
            false => {
                let (sources, diagnostics) = pipeline::check(&input, args.fidelity, &*cache);
                (sources, diagnostics, Vec::new())
            }
        };
        match args.strict {
            true => diagnostics.iter_mut().for_each(|d| d.severity = stricter(d.severity)),
            false => diagnostics.retain(|d| d.severity != Severity::Advice),
        }
        print(Stream::Out, &reporter.render(&sources, diagnostics));
        if args.contents
            && let Err(message) = contents(args, path, &known, &sources)
        {
            complain(&message);
            exit = Exit::Usage;
        }
    }
    if exit == Exit::Fine || reporter.tally() != Default::default() || args.format != Format::Human {
        print(Stream::Out, &reporter.summary());
    }
    if reporter.tally().errors > 0 { exit.max(Exit::Findings) } else { exit }
}

/// Prints what is known at the statements of a file; `Err` says in words why there is no such place.
fn contents(args: &CheckArgs, path: &Path, known: &[Points], sources: &Sources) -> Result<(), String> {
    let json = args.format == Format::Json;
    let Some(place) = args.at else {
        for points in known {
            let text = if json { points::json(points, None, sources) } else { points::table(points, sources) + "\n" };
            print(Stream::Out, &text);
        }
        return Ok(());
    };
    let mut missed = None;
    let mut shown = false;
    for points in known {
        match points::find(points, place, sources) {
            Found::Statement(index) => {
                let text = match json {
                    true => points::json(points, Some(index), sources),
                    false => points::all(points, index, sources) + "\n",
                };
                print(Stream::Out, &text);
                shown = true;
            }
            found => missed = missed.or(Some(found)),
        }
    }
    let path = path.display();
    match missed {
        _ if shown => Ok(()),
        None => Err(format!("nothing is known of `{path}`: none of its workflows could be followed")),
        Some(Found::NoLine(lines)) => Err(format!("`{path}` has {lines} lines")),
        Some(Found::Nothing(before, after)) => {
            let near: Vec<String> = before.into_iter().chain(after).map(|l| l.to_string()).collect();
            let near =
                if near.is_empty() { String::new() } else { format!("; the nearest are at {}", near.join(" and ")) };
            Err(format!("there is no statement of a workflow at this place of `{path}`{near}"))
        }
        Some(Found::Statement(_)) => Ok(()),
    }
}

/// How bad it is with `--strict`.
fn stricter(severity: Severity) -> Severity {
    match severity {
        Severity::Error | Severity::Warning => Severity::Error,
        Severity::Advice => Severity::Warning,
    }
}
