//! `matterixc run`.

use std::fs;
use std::path::Path;

use matterix_ir::Severity;

use crate::args::{Color, RunArgs, RunFormat};
use crate::pipeline::{self, Choices, Input};
use crate::progress::{Kind, Progress};
use crate::report::{Format, Reporter};
use crate::terminal::{self, Stream, complain, print};
use crate::{Exit, cancel, files};

/// Compiles, executes and reports; findings and progress go to standard error, the report to standard output.
pub fn run(args: &RunArgs, color: Color) -> Exit {
    match attempt(args, color) {
        Ok(exit) => exit,
        Err(message) => {
            complain(&message);
            Exit::Usage
        }
    }
}

/// The run; `Err` says in words what is wrong with usage or files.
fn attempt(args: &RunArgs, color: Color) -> Result<Exit, String> {
    let input = Input::file(&args.file, files::read(&args.file)?);
    if let Some(dir) = &args.out {
        create(dir)?;
    }
    let mut findings = Findings::new(args.format, color);
    let (sources, program, diagnostics) = pipeline::compile(&input, args.workflow.as_deref(), &args.set);
    let is_wrong = diagnostics.iter().any(|d| d.severity == Severity::Error);
    findings.show(&sources, diagnostics);
    let Some(program) = program.filter(|_| !is_wrong) else {
        findings.end();
        return Ok(Exit::Findings);
    };

    let cancel = cancel::on_interrupt()?;
    let mut progress = Progress::new(&program.plan, kind(args.format));
    let choices = Choices { seed: args.seed, fidelity: args.fidelity, dry: args.dry };
    let ran = pipeline::run(&program, &sources, &choices, cancel, &mut progress);
    progress.finish();

    findings.show(&sources, ran.diagnostics.clone());
    findings.end();
    match args.format {
        RunFormat::Human => print(Stream::Out, &ran.page()),
        RunFormat::Json => print(Stream::Out, &ran.json()?),
    }
    if let Some(dir) = &args.out {
        ran.write(dir)?;
    }
    Ok(if ran.passed { Exit::Fine } else { Exit::Findings })
}

/// Findings of compiler and run, on standard error.
struct Findings {
    reporter: Reporter,
}

impl Findings {
    fn new(format: RunFormat, color: Color) -> Self {
        let format = match format {
            RunFormat::Human => Format::Human,
            RunFormat::Json => Format::Json,
        };
        Findings { reporter: Reporter::new(format, terminal::look(Stream::Err, color)) }
    }

    fn show(&mut self, sources: &matterix_ir::Sources, diagnostics: Vec<matterix_ir::Diagnostic>) {
        print(Stream::Err, &self.reporter.render(sources, diagnostics));
    }

    fn end(&self) {
        if self.reporter.tally() != Default::default() {
            print(Stream::Err, &self.reporter.summary());
        }
    }
}

fn kind(format: RunFormat) -> Kind {
    match format {
        RunFormat::Json => Kind::Quiet,
        RunFormat::Human if terminal::is_terminal(Stream::Err) => Kind::Live,
        RunFormat::Human => Kind::Lines,
    }
}

fn create(dir: &Path) -> Result<(), String> {
    if dir.exists() && !dir.is_dir() {
        return Err(format!("`{}` is a file, not a directory", dir.display()));
    }
    fs::create_dir_all(dir).map_err(|e| format!("cannot create `{}`: {}", dir.display(), files::reason(&e)))
}
