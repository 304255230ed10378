//! `matterixc check`.

use matterix_ir::Severity;

use crate::Exit;
use crate::args::{CheckArgs, Color};
use crate::files;
use crate::pipeline::{self, Input};
use crate::report::{Format, Reporter};
use crate::terminal::{self, Stream, complain, print};

/// Reports on every file that can be read; findings go to standard output.
pub fn check(args: &CheckArgs, color: Color) -> Exit {
    let mut reporter = Reporter::new(args.format, terminal::look(Stream::Out, color));
    let mut exit = Exit::Fine;
    for path in &args.files {
        let bytes = match files::read(path) {
            Ok(bytes) => bytes,
            Err(message) => {
                complain(&message);
                exit = Exit::Usage;
                continue;
            }
        };
        let (sources, mut diagnostics) = pipeline::check(&Input::file(path, bytes));
        if args.strict {
            diagnostics.iter_mut().for_each(|d| d.severity = Severity::Error);
        }
        print(Stream::Out, &reporter.render(&sources, diagnostics));
    }
    if exit == Exit::Fine || reporter.tally() != Default::default() || args.format != Format::Human {
        print(Stream::Out, &reporter.summary());
    }
    if reporter.tally().errors > 0 { exit.max(Exit::Findings) } else { exit }
}
