//! `matterixc run`.

use std::collections::HashSet;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use matterix_ir::{Diagnostic, Program, Span};
use matterix_runtime::exec::Turn;
use matterix_runtime::record::Folder;

use crate::args::{Color, RunArgs, RunFormat};
use crate::cache;
use crate::pipeline::{self, Choices, Input, Keep, Options, Search};
use crate::progress::{Kind, Progress};
use crate::report::{Format, Reporter};
use crate::terminal::{self, Stream, paint, print};
use crate::{Exit, cancel, files, tips};

/// Compiles, executes and reports; findings and progress go to standard error, the report to standard output.
pub fn run(args: &RunArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

/// The run; `Err` says in words what is wrong with usage or files.
fn attempt(args: &RunArgs, color: Color) -> Result<Exit, String> {
    let reality = &args.reality;
    reality.agrees(args.dry)?;
    let input = Input::file(&args.subject.file, files::read(&args.subject.file)?);
    if let Some(dir) = &args.out {
        is_writable(dir)?;
    }
    let mut findings = Findings::new(args.format, color);
    let kept = args.tips.as_deref().map(tips::read).transpose()?.unwrap_or_default();
    let options = Options { measured: kept.clone(), ..args.subject.options() };
    let (sources, program, diagnostics) = pipeline::compile(&input, &options);
    let is_wrong = diagnostics.iter().any(Diagnostic::is_error);
    findings.show(&sources, diagnostics);
    let Some(mut program) = program.filter(|_| !is_wrong) else {
        findings.end();
        return Ok(Exit::Findings);
    };
    if args.tips.is_some() {
        tips::agrees(&kept, &program)?;
    }
    let drawn = reality.draw(&mut program, args.seed)?;
    let found = match reality.moves() && !args.dry {
        true => pipeline::motions(&program, &*cache::of(args.no_cache)),
        false => pipeline::standing(&program),
    };
    let is_wrong = found.iter().any(Diagnostic::is_error);
    findings.show(&sources, found);
    if is_wrong {
        findings.end();
        return Ok(Exit::Findings);
    }
    let cancel = cancel::on_interrupt()?;
    let turns = match turns(args, &program, cancel)? {
        Ok(turns) => turns,
        Err(found) => {
            findings.show(&sources, vec![*found]);
            findings.end();
            return Ok(Exit::Findings);
        }
    };
    let mut progress = Progress::new(&program.plan, kind(args.format));
    let keep = if args.out.is_some() { Keep::Curves } else { Keep::Ends };
    let choices = Choices { dry: args.dry, turns, keep, ..drawn };
    let ran = pipeline::run(&program, &sources, &choices, cancel, &mut progress);
    progress.finish();

    findings.show(&sources, ran.diagnostics.clone());
    findings.end();
    match args.format {
        RunFormat::Human => print(Stream::Out, &ran.page()),
        RunFormat::Json => print(Stream::Out, &ran.json()?),
    }
    if let Some(dir) = &args.out {
        ran.write(dir, args.csv)?;
    }
    if let Some(path) = args.tips.as_deref().filter(|_| ran.passed) {
        tips::write(path, &program, &ran.states)?;
    }
    Ok(if ran.passed { Exit::Fine } else { Exit::Findings })
}

/// The turns of claims, from a schedule in a file or one made now; none without `--plan`.
fn turns(args: &RunArgs, program: &Program, cancel: &AtomicBool) -> Result<Result<Vec<Turn>, Box<Diagnostic>>, String> {
    match &args.plan {
        None => Ok(Ok(Vec::new())),
        Some(None) => match pipeline::schedule(program, Search::Fixed { seed: args.seed }, cancel) {
            Ok(schedule) => schedule.turns(program).map(Ok),
            Err(found) => Ok(Err(found)),
        },
        Some(Some(path)) => {
            let bytes = files::read(path)?;
            let text = String::from_utf8(bytes).map_err(|_| format!("`{}` is not text", path.display()))?;
            pipeline::turns(path, &text, program).map(Ok)
        }
    }
}

/// Findings of compiler and run, on standard error.
pub(super) struct Findings {
    reporter: Reporter,
    /// What was shown: a run finds again what the check has found.
    shown: HashSet<(Span, String)>,
}

impl Findings {
    pub(super) fn new(format: RunFormat, color: Color) -> Self {
        let format = match format {
            RunFormat::Human => Format::Human,
            RunFormat::Json => Format::Json,
        };
        let reporter = Reporter::new(format, terminal::look(Stream::Err, color));
        Findings { reporter, shown: HashSet::new() }
    }

    pub(super) fn show(&mut self, sources: &matterix_ir::Sources, diagnostics: Vec<Diagnostic>) {
        let new = |d: &Diagnostic| !self.shown.contains(&(d.span(), d.headline.clone()));
        let new: Vec<Diagnostic> = diagnostics.into_iter().filter(new).collect();
        self.shown.extend(new.iter().map(|d| (d.span(), d.headline.clone())));
        paint(Stream::Err, &self.reporter.render(sources, new));
    }

    pub(super) fn end(&self) {
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

/// Whether the files of a run can be written there, before it is run.
pub(super) fn is_writable(dir: &Path) -> Result<(), String> {
    if dir.exists() && !dir.is_dir() {
        return Err(format!("`{}` is a file, not a directory", dir.display()));
    }
    Folder::check(dir).map_err(|e| e.to_string())
}
