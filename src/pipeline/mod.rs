//! Every call into the compiler and the runtime.

mod bill;
mod clean;
mod deploy;
mod emit;
mod emulate;
mod foreseen;
mod many;
mod mend;
mod neighbours;
mod plan;
mod reality;
mod run;
#[cfg(feature = "sila")]
mod serve;
mod view;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use matterix_ir::points::Points;
use matterix_ir::script::Wiring;
use matterix_ir::{Diagnostic, FileId, Program, Severity, Sources, Span, codes};
use matterix_lang::ast::ItemKind;
use matterix_lang::{Loader, Session, Stop};

use crate::args::Fidelity;
use matterix_runtime::motion::{Store, overlaps, preflight};

pub use bill::{Prices, bill};
pub use deploy::{Plan as DeployPlan, deploy};
pub use emit::{Emitted, Target, emit};
pub use emulate::{Line, emulate};
pub use many::{Asked, as_fit, as_study, fit, many, study};
pub use matterix_lang::{Calibration, Gauged, Options, Test, Wires};
pub use mend::{Fixes, Mended, Mending, correct, mend};
pub use neighbours::Neighbours;
pub use plan::{Search, chart, picture, schedule, schedule_json, turns};
pub use run::{Choices, Keep, run};
#[cfg(feature = "sila")]
pub use serve::{Service, serve};
pub use view::still;

/// The workflow of a lab that is asked for by itself.
const IDLE: &str = "nothing_of_its_own";

/// A text to compile, and where its neighbours are.
pub struct Input {
    /// As shown in findings: the path as typed.
    pub name: String,
    /// What was read.
    pub bytes: Vec<u8>,
    /// Folder of the modules it imports.
    dir: PathBuf,
    /// The folder outside of which nothing is read, where there is one.
    root: Option<PathBuf>,
    /// What may stop what is made of it.
    stop: Stop,
}

impl Input {
    /// What a file holds.
    pub fn file(path: &Path, bytes: Vec<u8>) -> Self {
        let dir = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Input { name: path.display().to_string(), bytes, dir, root: None, stop: Stop::default() }
    }

    /// What was typed or piped in; its neighbours are in the current folder.
    pub fn stdin(bytes: Vec<u8>) -> Self {
        Input { name: "<stdin>".to_string(), bytes, dir: PathBuf::new(), root: None, stop: Stop::default() }
    }

    /// What a client sent; its neighbours are in the current folder.
    pub fn typed(bytes: Vec<u8>) -> Self {
        Input { name: "<text>".to_string(), ..Input::stdin(bytes) }
    }

    /// The same with all that it imports taken from below a folder, given by its whole path without links.
    pub fn within(self, root: &Path) -> Self {
        Input { root: Some(root.to_path_buf()), ..self }
    }

    /// The same, worked on until a flag is set: a check or a compilation that was stopped says so.
    pub fn until(self, flag: &Arc<AtomicBool>) -> Self {
        Input { stop: Stop::when(flag), ..self }
    }

    /// Where a text has one lab, and no workflow or several: puts one that does nothing behind it, and names it. What offers a lab, or
    /// stands in for what is in it, asks for no workflow.
    pub fn idle(&mut self) -> Option<String> {
        let text = std::str::from_utf8(&self.bytes).ok()?;
        let (file, _) = matterix_lang::syntax::parse(Sources::default().add(&self.name, text), text);
        let workflows = file.items.iter().filter(|item| matches!(item.kind, ItemKind::Workflow { .. })).count();
        let mut labs = file.items.iter().filter_map(|item| match &item.kind {
            ItemKind::Lab { name, .. } => Some(name.text.as_str()),
            _ => None,
        });
        let (Some(lab), None) = (labs.next().filter(|_| workflows != 1), labs.next()) else { return None };
        let added = format!("\nworkflow {IDLE} in {lab} {{ wait 0 s }}\n");
        self.bytes.extend_from_slice(added.as_bytes());
        Some(IDLE.to_owned())
    }

    /// The text as the first file of a compilation; an error where it is not text.
    fn source(&self) -> (Sources, Result<FileId, Diagnostic>) {
        let mut sources = Sources::default();
        match std::str::from_utf8(&self.bytes) {
            Ok(text) => {
                let file = sources.add(&self.name, text);
                (sources, Ok(file))
            }
            Err(e) => {
                let file = sources.add(&self.name, String::from_utf8_lossy(&self.bytes));
                let place = Span::new(file, e.valid_up_to(), e.valid_up_to());
                let headline = "the file is not UTF-8 text";
                let found = Diagnostic::error(codes::SYNTAX, place, headline, "first invalid byte");
                (sources, Err(found.help("save the file in UTF-8")))
            }
        }
    }

    /// Whether a line begins like a test.
    pub fn mentions_tests(&self) -> bool {
        self.bytes.split(|b| *b == b'\n').any(|line| line.starts_with(b"test "))
    }

    fn neighbours(&self) -> Neighbours {
        Neighbours::of(&self.dir).within(self.root.as_deref()).until(&self.stop)
    }
}

/// Whether findings that are no more than advice are among those of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advice {
    /// They are.
    Given,
    /// They are not.
    LeftOut,
}

/// Findings of a file and of where its labs put things; at the fidelity `motion` also those in the way of robots, whose ways
/// are kept in a store, as is which files had none, or nothing but advice.
pub fn check(input: &Input, fidelity: Fidelity, advice: Advice, store: &dyn Store) -> (Sources, Vec<Diagnostic>) {
    let (mut sources, file) = input.source();
    let file = match file {
        Ok(file) => file,
        Err(found) => return (sources, vec![found]),
    };
    let neighbours = input.neighbours();
    let entry = clean::Entry::of(&input.bytes, fidelity, advice, store);
    if entry.as_ref().is_some_and(|entry| entry.is_clean(&neighbours)) {
        return (sources, Vec::new());
    }
    let read = clean::Noted::new(&neighbours);
    let mut session = Session::default();
    let foreseen = foreseen::Entry::of(input, store, &mut session);
    let found = match fidelity {
        Fidelity::Process => matterix_lang::check_and(&mut sources, file, &read, &overlaps, &mut session),
        Fidelity::Motion => {
            matterix_lang::check_and(&mut sources, file, &read, &|program| preflight(program, store), &mut session)
        }
    };
    if let Some(entry) = foreseen {
        entry.keep(input, &mut session);
    }
    // To give all trees back takes a while, which nobody waits for.
    let _ = std::thread::Builder::new().spawn(|| drop(session));
    let found = match advice {
        Advice::Given => found,
        Advice::LeftOut => without_advice(found),
    };
    if let Some(entry) = entry.filter(|_| found.is_empty()) {
        entry.keep(read);
    }
    (sources, found)
}

/// Findings of a text with those in the way of robots; its neighbours come from a loader. What the session knows from earlier checks of
/// this kind is not looked at again.
pub fn check_text(
    name: &str,
    text: &str,
    loader: &dyn Loader,
    store: &dyn Store,
    session: &mut Session,
) -> Vec<Diagnostic> {
    let mut sources = Sources::default();
    let file = sources.add(name, text);
    matterix_lang::check_and(&mut sources, file, loader, &|program| preflight(program, store), session)
}

/// What would go wrong with the motions of a program.
pub fn motions(program: &Program, store: &dyn Store) -> Vec<Diagnostic> {
    preflight(program, store)
}

/// What of a program stands in one place before anything moves.
pub fn standing(program: &Program) -> Vec<Diagnostic> {
    overlaps(program)
}

/// Findings of a file, and what is known at every statement of its workflows.
pub fn contents(input: &Input) -> (Sources, Vec<Diagnostic>, Vec<Points>) {
    let (mut sources, file) = input.source();
    let (found, points) = match file {
        Ok(file) => matterix_lang::contents(&mut sources, file, &input.neighbours()),
        Err(found) => (vec![found], Vec::new()),
    };
    (sources, found, points)
}

/// Findings of what is to be done, not looked through: advice is for `check`.
fn without_advice(mut found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    found.retain(|d| d.severity != Severity::Advice);
    found
}

/// A file as a program, with findings; no program where there is an error.
pub fn compile(input: &Input, options: &Options) -> (Sources, Option<Program>, Vec<Diagnostic>) {
    let (mut sources, file) = input.source();
    let (program, found) = match file {
        Ok(file) => matterix_lang::compile(&mut sources, file, &input.neighbours(), options),
        Err(found) => (None, vec![found]),
    };
    (sources, program, without_advice(found))
}

/// A file as a program, with what drivers over a wire say; none of both where there is an error.
pub fn wire(
    input: &Input,
    options: &Options,
    transport: &'static str,
) -> (Sources, Option<(Program, Wiring)>, Vec<Diagnostic>) {
    let (mut sources, file) = input.source();
    let (wired, found) = match file {
        Ok(file) => matterix_lang::script(&mut sources, file, &input.neighbours(), options, transport),
        Err(found) => (None, vec![found]),
    };
    (sources, wired, without_advice(found))
}

/// A workflow of a file as a protocol for people, with findings; no text where there is an error.
pub fn document(input: &Input, options: &Options) -> (Sources, Option<String>, Vec<Diagnostic>) {
    let (mut sources, file) = input.source();
    let (text, found) = match file {
        Ok(file) => matterix_lang::document(&mut sources, file, &input.neighbours(), options),
        Err(found) => (None, vec![found]),
    };
    (sources, text, without_advice(found))
}

/// The tests of a file whose names hold `wanted`, with what is wrong with the file beside them.
pub fn tests(input: &Input, wanted: &str) -> (Sources, Vec<Test>, Vec<Diagnostic>) {
    let (mut sources, file) = input.source();
    let (tests, found) = match file {
        Ok(file) => matterix_lang::tests(&mut sources, file, &input.neighbours(), wanted),
        Err(found) => (Vec::new(), vec![found]),
    };
    (sources, tests, found)
}

/// A file in the one style, or why it has none.
pub fn format(input: &Input) -> Result<String, (Sources, Vec<Diagnostic>)> {
    let (sources, file) = input.source();
    let formatted = file.map_err(|found| vec![found]).and_then(|file| {
        let text = sources.get(file).map_or("", |s| s.text.as_str());
        matterix_lang::fmt::format(file, text)
    });
    formatted.map_err(|found| (sources, found))
}
