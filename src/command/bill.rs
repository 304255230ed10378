//! `matterixc bill`.

use std::path::Path;
use std::sync::atomic::Ordering;

use matterix_ir::{Diagnostic, Sources};

use crate::args::{BillArgs, BillFormat, Color};
use crate::pipeline::{self, Input, Prices};
use crate::report::{Format, Reporter};
use crate::terminal::{self, Stream, paint, print, print_error};
use crate::{Exit, cancel, files};

/// Compiles, executes once and prints what that uses up; findings go to standard error.
pub fn bill(args: &BillArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The bill; `Err` says in words what is wrong with usage or files.
fn attempt(args: &BillArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.subject.file, files::read(&args.subject.file)?);
    let prices = args.prices.as_deref().map(prices).transpose()?;
    let (sources, program, found) = pipeline::compile(&input, &args.subject.options());
    let wrong = found.iter().any(Diagnostic::is_error);
    let Some(program) = program.filter(|_| !wrong) else {
        show(&sources, found, color);
        return Ok(Exit::Findings);
    };
    let cancel = cancel::on_interrupt()?;
    let mut billed = pipeline::bill(&program, &sources, args.seed, args.runs, cancel);
    show(&sources, found.into_iter().chain(billed.diagnostics.clone()).collect(), color);
    if let Some(prices) = &prices {
        billed.price(prices);
    }
    let text = match args.format {
        BillFormat::Human => billed.page(),
        BillFormat::Json => billed.json()?,
        BillFormat::Csv => billed.csv()?,
    };
    print(Stream::Out, &text);
    if cancel.load(Ordering::SeqCst) && !billed.complete {
        print_error("stopped before the end of the run; the bill above covers the steps until then");
    }
    Ok(if billed.complete { Exit::Fine } else { Exit::Findings })
}

fn prices(path: &Path) -> Result<Prices, String> {
    let bytes = files::read(path)?;
    let text = String::from_utf8(bytes).map_err(|_| format!("`{}` is not UTF-8 text", path.display()))?;
    Prices::read(&text).map_err(|e| format!("cannot read the prices in `{}`: {e}", path.display()))
}

/// Findings on standard error, counted below.
pub(super) fn show(sources: &Sources, found: Vec<Diagnostic>, color: Color) {
    if found.is_empty() {
        return;
    }
    let mut reporter = Reporter::new(Format::Human, terminal::look(Stream::Err, color));
    let text = reporter.render(sources, found);
    paint(Stream::Err, &text);
    print(Stream::Err, &reporter.summary());
}
