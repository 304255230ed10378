//! The whole front end: from a file to a program.

use std::collections::BTreeSet;
use std::sync::Arc;

use matterix_ir::inventory::Inventory;
use matterix_ir::model::{Content, Domain, Load, Mixture, Model, Observable, Pace, State};
use matterix_ir::points::Points;
use matterix_ir::program::PROGRAM_VERSION;
use matterix_ir::scene::{Frame, Instance as SceneInstance, InstanceId, Scene};
use matterix_ir::script::Wiring;
use matterix_ir::{Diagnostic, FileId, Leaves, NodeId, Op, Program, Severity, Sources, Span, Unit, codes};

use crate::ast::{Expr, Item, ItemKind, MemberKind, Name, Role};
use crate::calibration::{self, Calibration};
use crate::check as checks;

use crate::declare::Tables;
use crate::declare::Type;
use crate::elaborate::hazards::dangers;
use crate::escapes::unhandled;
use crate::eval::lab::choices::Choice;
use crate::eval::lab::geometry::Geometry;
use crate::eval::lab::given::VALID;
use crate::eval::lab::reach::Reach;
use crate::eval::lab::{Elaborator, ExtensiveKey};
use crate::eval::{Num, Value};
use crate::fixpoint::{self, Purpose, Settled};
use crate::labs;
use crate::load::load;
use crate::loader::Loader;
use crate::lower::Wires;
use crate::names::{DeclId, Module, Names, imports, item_name};
use crate::near;
use crate::program_points::Questions;
use crate::semantic_index::{Around as Declared, Resolutions, SemanticIndex};
use crate::session::{self, CachedAnalysis, Environment, Package, Session, Snapshot, TaskKey, Words};
use crate::stop::stopped;
use crate::study::{self, Many};
use crate::supposed;
use crate::task::{self, Given, Task};

/// What a compilation is asked for.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Which workflow; may be left out where the file has one.
    pub workflow: Option<String>,
    /// Values of parameters as text: `("target", "40 degC")`.
    pub set: Vec<(String, String)>,
    /// Which lab, for a workflow that runs in any.
    pub lab: Option<String>,
    /// What is asked of drivers.
    pub wires: Wires,
    /// What was measured of things of the lab.
    pub measured: Calibration,
}

/// A test, ready to run.
#[derive(Clone, Debug)]
pub struct Test {
    /// Its name.
    pub name: String,
    /// Where its name stands.
    pub span: Span,
    /// What is run; none where it has an error.
    pub program: Option<Program>,
    /// What was found in it.
    pub diagnostics: Vec<Diagnostic>,
}

/// What a check saw.
#[derive(Debug, Default)]
pub struct Examined {
    /// The library's modules, then those of the package.
    pub modules: Vec<Arc<Module>>,
    /// Each finding once, in the order of the text.
    pub findings: Vec<Diagnostic>,
    /// What is known at every statement, where that was asked for: one per workflow that could be followed.
    pub points: Vec<Points>,
    /// What names and expressions mean, where that was asked for.
    pub meanings: SemanticIndex,
}

/// Checks a file: everything it declares, and every workflow in its lab.
pub fn check(sources: &mut Sources, file: FileId, loader: &dyn Loader) -> Vec<Diagnostic> {
    let asked = Asked { wanted: Wanted::Findings, motions: &|_| Vec::new(), stop: &|| false };
    whole(examine(sources, file, loader, &asked, &mut Session::default()), file).findings
}

/// Checks a file; of a workflow without an error, what stands where in its lab and what robots with joints do is looked at by
/// `motions` as well. What a session knows from earlier checks of this kind is not worked out again.
pub fn check_and(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    motions: &(dyn Fn(&Program) -> Vec<Diagnostic> + Sync),
    session: &mut Session,
) -> Vec<Diagnostic> {
    let asked = Asked { wanted: Wanted::Motions, motions, stop: &|| false };
    whole(examine(sources, file, loader, &asked, session), file).findings
}

/// Checks a file as [`check`] does, and says what is known at every statement of its workflows, in the order of the text.
/// A workflow with mistakes that keep it from being followed is left out.
pub fn contents(sources: &mut Sources, file: FileId, loader: &dyn Loader) -> (Vec<Diagnostic>, Vec<Points>) {
    let seen = whole(examined(sources, file, loader, &mut Session::default(), &|| false), file);
    (seen.findings, seen.points)
}

/// Checks a file as [`contents`] does, and gives the trees as well. What a session knows from earlier checks is not worked out
/// again. Nothing where `stop` says, on the way, that the check is of no use any more; what was found until then the session keeps.
pub fn examined(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    session: &mut Session,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Examined> {
    examine(sources, file, loader, &Asked { wanted: Wanted::Contents, motions: &|_| Vec::new(), stop }, session)
}

/// What a check saw; of one that was stopped, that it was: no finding would say that nothing is wrong.
fn whole(seen: Option<Examined>, file: FileId) -> Examined {
    let given_up = || vec![stopped(Span::new(file, 0, 0))];
    seen.unwrap_or_else(|| Examined { findings: given_up(), ..Examined::default() })
}

/// What is asked of a check.
struct Asked<'c> {
    wanted: Wanted,
    /// Looks at what robots do.
    motions: &'c (dyn Fn(&Program) -> Vec<Diagnostic> + Sync),
    /// Whether it is of no use any more.
    stop: &'c (dyn Fn() -> bool + Sync),
}

fn examine(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    asked: &Asked<'_>,
    session: &mut Session,
) -> Option<Examined> {
    let wanted = asked.wanted;
    let (modules, mut diagnostics) = load(sources, file, loader, session);
    let (names, found) = Names::new(&modules);
    diagnostics.extend(found);
    let (mut tables, found) = crate::elaborate::declared(&names);
    tables.stop = loader.stop();
    diagnostics.extend(found);
    let root = modules.len() - 1;
    let root = modules.iter().position(|m| m.file == file).unwrap_or(root);
    let mut seeing = (wanted == Wanted::Contents).then(Box::default);
    diagnostics.extend(checks::declarations_and(&tables, sources, root, &mut seeing));
    let mut meanings = SemanticIndex::default();
    let items = judged(&names, root);
    let (mut starts, mut uses) = (Vec::new(), Vec::new());
    let mut tasks = Vec::new();
    for item in items.iter().copied() {
        match labs::labs(&tables, sources, root, item, &[]) {
            Ok(labs) => {
                let given = |lab| Task { item, lab, given: task::given(&tables, item, &[]), supposed: None };
                tasks.extend(labs.into_iter().map(given));
            }
            Err(d) => diagnostics.push(*d),
        }
    }
    let found_all = !tasks.is_empty();
    for task in &tasks {
        diagnostics.extend(task::check_given(&tables, task.item, &task.given));
    }
    let mut points = Vec::new();
    let package = sources.get(file).map_or_else(String::new, |source| source.name.clone());
    let beside = session.beside;
    let package = session.package(&package);
    let judged = judge_anew(&tables, sources, (root, file), &tasks, asked, (package, beside))?;
    for (task, mut built) in tasks.iter().zip(judged) {
        if let Some(Many::Fit(fit)) = &mut built.many
            && let Err(d) = study::data::read(fit, &tables, sources, loader)
        {
            diagnostics.push(*d);
        }
        let item = names.decl(task.item).item;
        diagnostics.extend(built.findings.into_iter().map(|d| of_test(d, item)));
        meanings.pieces.extend(built.noted.take());
        diagnostics.extend(built.moved.into_iter().flatten());
        starts.extend(built.starts);
        // The statements of a test, a study or a fit of a workflow are the workflow's.
        let kind = &names.decl(task.item).item.kind;
        let tests = matches!(kind, ItemKind::Test { lab: None, .. }) || many(kind);
        points.extend(built.points.filter(|_| !tests));
        uses.extend(built.uses);
    }
    if found_all && starts.len() == tasks.len() {
        diagnostics.extend(checks::never_starts(&tables, root, &starts));
    }
    if found_all && uses.len() == tasks.len() {
        // Where something is wrong, what is missing may be why a thing is not used.
        let wrong = diagnostics.iter().any(Diagnostic::is_error);
        let idle = checks::things(sources, &uses);
        diagnostics.extend(idle.into_iter().filter(|d| !wrong || d.severity == Severity::Advice));
        diagnostics.extend(checks::reagents(&names, sources, root));
    }
    if items.is_empty() {
        for id in names.declared_by(root) {
            if matches!(names.decl(id).item.kind, ItemKind::Lab { .. }) {
                diagnostics.extend(checks::lab(&tables, id, &mut seeing));
            }
        }
    }
    let findings = finish(diagnostics, sources);
    if wanted == Wanted::Contents {
        meanings.pieces.splice(..0, Resolutions::of(seeing, &names));
        meanings.around = Declared::of(&tables);
        drop(tables);
        meanings.around.scopes = names.into_scopes();
    }
    Some(Examined { modules, findings, points, meanings })
}

/// Compiles one workflow of a file; no program where there is an error.
pub fn compile(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let (built, diagnostics) =
        compile_and(sources, file, loader, options, Wanted::Program(options.wires), |_, _, _| ());
    (built.map(|(program, _, ())| program), diagnostics)
}

/// Compiles one workflow of a file, with what the drivers of its devices say in one kind of file, such as `opentrons`.
pub fn script(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    options: &Options,
    transport: &'static str,
) -> (Option<(Program, Wiring)>, Vec<Diagnostic>) {
    let wanted = Wanted::Scripted(transport);
    let (built, diagnostics) = compile_and(sources, file, loader, options, wanted, |_, _, (tables, _)| {
        crate::import::texts(tables.names, "labware", loader)
    });
    let wired = built.map(|(program, wiring, files)| (program, Wiring { files, ..wiring.unwrap_or_default() }));
    (wired, diagnostics)
}

/// Compiles one workflow of a file and writes it as a protocol for people, in Markdown.
pub fn document(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    options: &Options,
) -> (Option<String>, Vec<Diagnostic>) {
    let (text, diagnostics) =
        compile_and(sources, file, loader, options, Wanted::Program(Wires::Off), |program, task, context| {
            crate::prose::protocol(context.0, context.1, program, task)
        });
    (text.map(|(_, _, text)| text), diagnostics)
}

/// A program, what drivers say where that is wanted, and what more was made of it.
type Made<T> = (Program, Option<Wiring>, T);

/// Compiles one workflow of a file; where that succeeds, `then` makes something more of it.
fn compile_and<T>(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    options: &Options,
    wanted: Wanted,
    then: impl for<'a> FnOnce(&Program, &Task<'a>, (&'a Tables<'a>, &Sources)) -> T,
) -> (Option<Made<T>>, Vec<Diagnostic>) {
    let (mut modules, mut diagnostics) = load(sources, file, loader, &mut Session::default());
    let root = modules.iter().position(|m| m.file == file).unwrap_or(0);
    if let Some(module) = modules.get_mut(root) {
        diagnostics.extend(calibration::put(&options.measured, module, sources));
    }
    let set = typed_values(sources, options, &mut diagnostics);
    let (names, found) = Names::new(&modules);
    diagnostics.extend(found);
    let (mut tables, found) = crate::elaborate::declared(&names);
    tables.stop = loader.stop();
    diagnostics.extend(found);
    diagnostics.extend(checks::declarations(&tables, sources, root));
    let Some(item) = choose_workflow(&names, root, file, options, &mut diagnostics) else {
        return (None, finish(diagnostics, sources));
    };
    let Some(task) = task_of(&tables, sources, (root, item), &set, options, &mut diagnostics) else {
        return (None, finish(diagnostics, sources));
    };
    let built = build(&tables, sources, &task, wanted, None, &|| false).unwrap_or_default();
    diagnostics.extend(built.findings);
    // A reaction may be meant for another workflow of the file: `check` looks at them all.
    if runnable(&names, root).len() == 1 {
        diagnostics.extend(checks::never_starts(&tables, root, built.starts.as_slice()));
    }
    let diagnostics = finish(diagnostics, sources);
    let failed = diagnostics.iter().any(Diagnostic::is_error);
    let program = built.program.filter(|_| !failed);
    let more = program.map(|program| {
        let more = then(&program, &task, (&tables, sources));
        (program, built.wiring, more)
    });
    (more, diagnostics)
}

/// An item of the root module with what it is given and its lab; none where that is not clear, which is said.
fn task_of<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    (root, item): (usize, DeclId),
    set: &'a [(Name, Expr)],
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Task<'a>> {
    let given: Vec<Given<'_>> = set.iter().map(|(name, value)| Given { name, value, module: root }).collect();
    diagnostics.extend(task::check_given(tables, item, &given));
    match labs::lab(tables, sources, root, item, &given, options.lab.as_deref()) {
        Ok(lab) => Some(Task { item, lab, given, supposed: None }),
        Err(d) => {
            diagnostics.push(*d);
            None
        }
    }
}

/// A study or a fit of a file with the program that all its runs execute.
pub struct Compiled {
    /// The workflow in its lab.
    pub program: Program,
    /// What is asked of it.
    pub many: Many,
}

/// Compiles a study of a file, or a fit where `fits`; `options.workflow` names it and may be left out where the file has
/// one. Nothing where there is an error.
pub fn many_runs(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    options: &Options,
    fits: bool,
) -> (Option<Compiled>, Vec<Diagnostic>) {
    let (modules, mut diagnostics) = load(sources, file, loader, &mut Session::default());
    let root = modules.iter().position(|m| m.file == file).unwrap_or(0);
    let set = typed_values(sources, options, &mut diagnostics);
    let (names, found) = Names::new(&modules);
    diagnostics.extend(found);
    let (mut tables, found) = crate::elaborate::declared(&names);
    tables.stop = loader.stop();
    diagnostics.extend(found);
    diagnostics.extend(checks::declarations(&tables, sources, root));
    let choice = study::choose(&names, root, file, options.workflow.as_deref(), fits);
    let item = match choice {
        Ok(item) => item,
        Err(d) => {
            diagnostics.push(*d);
            return (None, finish(diagnostics, sources));
        }
    };
    let Some(task) = task_of(&tables, sources, (root, item), &set, options, &mut diagnostics) else {
        return (None, finish(diagnostics, sources));
    };
    let wanted = Wanted::Program(Wires::default());
    let mut built = build(&tables, sources, &task, wanted, None, &|| false).unwrap_or_default();
    diagnostics.extend(built.findings);
    if let Some(Many::Fit(fit)) = &mut built.many
        && let Err(d) = study::data::read(fit, &tables, sources, loader)
    {
        diagnostics.push(*d);
    }
    let diagnostics = finish(diagnostics, sources);
    let failed = diagnostics.iter().any(Diagnostic::is_error);
    let compiled = built.program.zip(built.many).filter(|_| !failed);
    (compiled.map(|(program, many)| Compiled { program, many }), diagnostics)
}

/// Compiles the tests of a file whose names hold `wanted`, in the order of the text; what is wrong with the file beside
/// them is returned apart.
pub fn tests(sources: &mut Sources, file: FileId, loader: &dyn Loader, wanted: &str) -> (Vec<Test>, Vec<Diagnostic>) {
    let (modules, mut diagnostics) = load(sources, file, loader, &mut Session::default());
    let root = modules.iter().position(|m| m.file == file).unwrap_or(0);
    let (names, found) = Names::new(&modules);
    diagnostics.extend(found);
    let (mut tables, found) = crate::elaborate::declared(&names);
    tables.stop = loader.stop();
    diagnostics.extend(found);
    let mut tests = Vec::new();
    for item in names.declared_by(root) {
        let ItemKind::Test { name, .. } = &names.decl(item).item.kind else { continue };
        if !name.text.contains(wanted) {
            continue;
        }
        let given = task::given(&tables, item, &[]);
        let mut found = task::check_given(&tables, item, &given);
        let mut program = None;
        match labs::lab(&tables, sources, root, item, &given, None) {
            Ok(lab) => {
                let (task, wanted) = (Task { item, lab, given, supposed: None }, Wanted::Program(Wires::Off));
                let built = build(&tables, sources, &task, wanted, None, &|| false).unwrap_or_default();
                found.extend(built.findings);
                program = built.program;
            }
            Err(d) => found.push(*d),
        }
        let diagnostics = finish(found, sources);
        let failed = diagnostics.iter().any(Diagnostic::is_error);
        let program = program.filter(|_| !failed);
        tests.push(Test { name: name.text.clone(), span: name.span, program, diagnostics });
    }
    if !tests.is_empty() {
        diagnostics.extend(checks::declarations(&tables, sources, root));
    }
    (tests, finish(diagnostics, sources))
}

/// What a test finds in the workflow that it runs, with its name: the workflow itself may be right.
fn of_test(d: Diagnostic, item: &Item) -> Diagnostic {
    let at = d.span();
    let own = at.file == item.span.file && (item.span.start..=item.span.end).contains(&at.start);
    match &item.kind {
        ItemKind::Test { name, lab: None, .. } if !own => d.because(name.span, "in this test"),
        _ => d,
    }
}

/// The workflows and tests that a module declares.
fn runnable(names: &Names<'_>, module: usize) -> Vec<DeclId> {
    let is_run = |id: &DeclId| matches!(names.decl(*id).item.kind, ItemKind::Workflow { .. } | ItemKind::Test { .. });
    names.declared_by(module).filter(is_run).collect()
}

/// What is judged of a module: what can be run, once or many times.
fn judged(names: &Names<'_>, module: usize) -> Vec<DeclId> {
    let is_judged = |id: &DeclId| {
        let kind = &names.decl(*id).item.kind;
        matches!(kind, ItemKind::Workflow { .. } | ItemKind::Test { .. }) || many(kind)
    };
    names.declared_by(module).filter(is_judged).collect()
}

/// Whether an item is many runs of a workflow.
fn many(kind: &ItemKind) -> bool {
    matches!(kind, ItemKind::Study { .. } | ItemKind::Fit { .. })
}

/// Each finding once, in the order of the text, without those that only follow from others.
fn finish(mut diagnostics: Vec<Diagnostic>, sources: &Sources) -> Vec<Diagnostic> {
    let mut out: Vec<Diagnostic> = Vec::new();
    diagnostics.sort_by_key(Diagnostic::span);
    for d in diagnostics {
        let same = |o: &Diagnostic| o.code == d.code && o.span() == d.span() && o.headline == d.headline;
        if !out.iter().rev().take(64).any(same) {
            out.push(d);
        }
    }
    checks::without_consequences(imports::joined(out), sources)
}

/// The values of `--set name=value`, each read as it was typed.
fn typed_values(sources: &mut Sources, options: &Options, diagnostics: &mut Vec<Diagnostic>) -> Vec<(Name, Expr)> {
    let mut out = Vec::new();
    for (name, value) in &options.set {
        let text = format!("{name}={value}");
        let file = sources.add("--set", text.clone());
        let (value, found) = crate::syntax::parse_value(file, &text, name.len() + 1);
        diagnostics.extend(found);
        out.push((Name { text: name.clone(), span: Span::new(file, 0, name.len()) }, value));
    }
    out
}

fn choose_workflow(
    names: &Names<'_>,
    root: usize,
    file: FileId,
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<DeclId> {
    let all: Vec<(String, DeclId, Span)> = names
        .declared_by(root)
        .filter_map(|id| match &names.decl(id).item.kind {
            ItemKind::Workflow { name, .. } => Some((name.text.clone(), id, name.span)),
            _ => None,
        })
        .collect();
    let top = Span::new(file, 0, 0);
    match (&options.workflow, all.as_slice()) {
        (Some(wanted), _) => {
            if let Some((_, id, _)) = all.iter().find(|w| w.0 == *wanted) {
                return Some(*id);
            }
            let near = near::nearest(wanted, all.iter().map(|w| &w.0));
            let list: Vec<String> = all.iter().map(|w| format!("`{}`", w.0)).collect();
            let mut d = Diagnostic::error(
                codes::NO_WORKFLOW,
                top,
                format!("this file has no workflow `{wanted}`"),
                "given with `--workflow`",
            );
            d.help.extend(near::question(&near));
            if near.is_empty() && !list.is_empty() {
                d = d.help(format!("it has {}", list.join(", ")));
            }
            diagnostics.push(d);
            None
        }
        (None, [(_, id, _)]) => Some(*id),
        (None, []) => {
            let d = Diagnostic::error(codes::NO_WORKFLOW, top, "this file has no workflow", "nothing to run");
            diagnostics.push(d.help("add `workflow NAME in LAB { ... }`"));
            None
        }
        (None, many) => {
            let list: Vec<String> = many.iter().map(|w| format!("`{}`", w.0)).collect();
            let mut d = Diagnostic::error(
                codes::NO_WORKFLOW,
                many[0].2,
                format!("this file has {} workflows: choose one", many.len()),
                "one of them",
            );
            for w in &many[1..] {
                d = d.because(w.2, "another");
            }
            diagnostics.push(d.help(format!("choose with `--workflow`: {}", list.join(", "))));
            None
        }
    }
}

/// What a workflow is built for, beside its findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    /// Nothing more.
    Findings,
    /// To be run.
    Program(Wires),
    /// The same, with what drivers for files of this kind say.
    Scripted(&'static str),
    /// What is known at every statement.
    Contents,
    /// A program too, where there is something to see in space: robots with joints, or things with places.
    Motions,
}

/// One workflow, built.
#[derive(Default)]
struct Built {
    program: Option<Program>,
    wiring: Option<Wiring>,
    points: Option<Points>,
    noted: Option<Resolutions>,
    findings: Vec<Diagnostic>,
    starts: Option<checks::Starts>,
    uses: Option<checks::Uses>,
    many: Option<Many>,
    /// Truth values and words among the parameters that have only their default.
    choices: Vec<Choice>,
    /// What can get where, where that was found anew.
    reach: Option<Reach>,
    /// What looking at motions has found, where that was asked for.
    moved: Option<Vec<Diagnostic>>,
}

impl From<CachedAnalysis> for Built {
    fn from(known: CachedAnalysis) -> Built {
        let CachedAnalysis { findings, points, noted, starts, uses, many, moved } = known;
        Built { findings, points, noted, starts, uses, many, moved, ..Built::default() }
    }
}

impl Built {
    /// What is kept of it.
    fn verdict(&self) -> CachedAnalysis {
        let Built { findings, points, noted, starts, uses, many, moved, .. } = self;
        CachedAnalysis {
            findings: findings.clone(),
            points: points.clone(),
            noted: noted.clone(),
            starts: starts.clone(),
            uses: uses.clone(),
            many: many.clone(),
            moved: moved.clone(),
        }
    }
}

/// Verdicts of the tasks of a package, in their order; those that hold on are taken from its earlier check. Nothing where the check
/// is of no use any more.
fn judge_anew<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    (root, file): (usize, FileId),
    tasks: &[Task<'a>],
    asked: &Asked<'_>,
    (package, beside): (&mut Package, u64),
) -> Option<Vec<Built>> {
    let names = tables.names;
    let of = Environment { beside, failures: tables.failures(), moved: asked.wanted == Wanted::Motions };
    let mut now = Snapshot::of(names, sources, root, of);
    let about: Vec<Option<TaskKey>> = tasks.iter().map(|task| about(tables, root, task)).collect();
    let matched = package.earlier.as_ref().and_then(|earlier| earlier.matched(&now, file));
    let known: Vec<Option<(CachedAnalysis, Words)>> = about
        .iter()
        .map(|about| {
            let known = matched.as_ref()?.verdict(about.as_ref()?)?;
            Some(known).filter(|(v, _)| v.uses.as_ref().is_none_or(|uses| uses.hold(tables, sources)))
        })
        .collect();
    let open: Vec<&Task<'a>> = tasks.iter().zip(&known).filter(|(_, v)| v.is_none()).map(|(t, _)| t).collect();
    let anew = |(about, known): (&Option<TaskKey>, &Option<_>)| about.clone().filter(|_| known.is_none());
    let anew: Vec<TaskKey> = about.iter().zip(&known).filter_map(anew).collect();
    let mut words = now.words(file, &anew).into_iter();
    // Tasks do not depend on each other, so all processors share them.
    let foreseen = std::mem::take(&mut package.foreseen);
    let mut judged = crate::parallel::map(&open, |task| {
        // A processor that is free for it makes the draft.
        let free = 2 * open.len() <= crate::parallel::processors();
        let foreseen = foreseen.of(names, task).filter(|reach| free && reach.is_of(tables));
        judge(tables, sources, task, asked, (foreseen, free))
    })
    .into_iter();
    let mut all = Vec::with_capacity(tasks.len());
    let mut broken_off = false;
    for ((about, known), task) in about.into_iter().zip(known).zip(tasks) {
        let (built, words) = match known {
            Some((verdict, words)) => (Some(Built::from(verdict)), Some(words)),
            None => (judged.next().flatten(), about.as_ref().and_then(|_| words.next())),
        };
        let reach = built.as_ref().and_then(|built| built.reach.clone());
        package.foreseen.keep(names, task, reach.or_else(|| foreseen.of(names, task).cloned()));
        let Some(built) = built else {
            broken_off = true;
            continue;
        };
        if let (Some(about), Some(words)) = (about, words) {
            now.keep(about, words, built.verdict());
        }
        all.push(built);
    }
    package.earlier = Some(now);
    (!broken_off).then_some(all)
}

/// Judges a task, what robots do in it too where that is asked for; other values of its parameters at the same time where processors are `free`.
fn judge<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    task: &Task<'a>,
    asked: &Asked<'_>,
    (foreseen, free): (Option<&Reach>, bool),
) -> Option<Built> {
    let stop = || (asked.stop)() || tables.stop.asked();
    let mut built = build(tables, sources, task, asked.wanted, foreseen, &stop)?;
    let item = tables.names.decl(task.item).item;
    // What is wrong with the defaults is mended first.
    if let (ItemKind::Workflow { name, .. }, true) = (&item.kind, built.findings.iter().all(|d| !d.is_error())) {
        let usual = built.reach.clone();
        let supposing = |choice: &Choice| {
            let task = Task { supposed: Some(choice.clone()), ..task.clone() };
            build(tables, sources, &task, Wanted::Findings, usual.as_ref(), &stop).map(|built| built.findings)
        };
        let found = supposed::found(&built.choices, name.span, &built.findings, free, supposing)?;
        built.findings.extend(found);
    }
    if asked.wanted == Wanted::Motions {
        let fine = built.findings.iter().all(|d| !d.is_error());
        // What robots do is looked at for the workflow itself.
        let looked_at = built.program.take().filter(|_| fine && !many(&tables.names.decl(task.item).item.kind));
        built.moved = Some(looked_at.iter().flat_map(asked.motions).collect());
    }
    Some(built)
}

/// What the verdict of a task is about; none where it has no place in the root file.
fn about(tables: &Tables<'_>, root: usize, task: &Task<'_>) -> Option<TaskKey> {
    let names = tables.names;
    let runs = task::workflow_of(tables, task.item).ok().filter(|run| *run != task.item);
    // What it runs may stand in another file, where its name leads to it.
    let runs = runs.filter(|run| names.decl(*run).module == root).and_then(|run| session::number(names, run));
    let lab = names.decl(task.lab);
    let (lab_name, _) = item_name(lab.item)?;
    Some(TaskKey { item: session::number(names, task.item)?, runs, lab: (lab.module, lab_name) })
}

/// Elaborates the lab, lowers the workflow and checks both. A program comes of it only where it is wanted, nothing where `stop` says that
/// it is of no use any more.
fn build<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    task: &Task<'a>,
    wanted: Wanted,
    foreseen: Option<&Reach>,
    stop: &dyn Fn() -> bool,
) -> Option<Built> {
    let (to_run, wires) = match wanted {
        Wanted::Program(wires) => (true, wires),
        Wanted::Scripted(_) => (true, Wires::Off),
        _ => (false, Wires::Off),
    };
    let transport = if let Wanted::Scripted(transport) = wanted { Some(transport) } else { None };
    let purpose = Purpose { to_run, wires, transport, meanings: wanted == Wanted::Contents };
    let lab = task.lab;
    let settled = fixpoint::settled(tables, sources, task, purpose, foreseen, stop)?;
    let Settled { lab: mut elaborator, plan, wiring, events, reach } = settled;
    let (derivatives, balances) = elaborator.close();
    // A look at motions asks for neither what is recorded nor what is used up.
    let told = matches!(wanted, Wanted::Program(_) | Wanted::Scripted(_) | Wanted::Contents);
    let observables = if told { observables(&mut elaborator) } else { Vec::new() };
    let mut starts = checks::starts(&elaborator, lab);
    checks::model(&mut elaborator);
    elaborator.judge_conservation(&events, &plan);
    let questions = (wanted == Wanted::Contents).then(|| Questions::of(&mut elaborator, properties(&observables)));
    let asked = questions.as_ref().map(|q| q.nodes.as_slice());
    let checks::Judged { windows, seen, hazards } = match tables.lacks_equilibria {
        // What would be said of amounts follows from a mistake that is reported already.
        true => checks::Judged::default(),
        false => checks::plan(&mut elaborator, sources, &plan, &derivatives, &events, asked),
    };
    starts.windows = windows;
    let points = questions.and_then(|q| q.answered(&elaborator, sources, &plan, seen));
    let starts = Some(starts);
    let many = study::resolve(&mut elaborator, task);
    elaborator.note_things(lab);
    let choices = std::mem::take(&mut elaborator.choices);
    let noted = Resolutions::of(elaborator.meanings.take(), tables.names);
    let mut uses = None;
    if !to_run {
        let item = tables.names.decl(task.item).item;
        if let ItemKind::Workflow { name, .. } = &item.kind {
            elaborator.diagnostics.extend(unhandled(&plan, name.span, item.span));
            elaborator.diagnostics.extend(checks::beyond(&plan, item.span));
            // A step that is wrong is not in the plan.
            if !elaborator.diagnostics.iter().any(Diagnostic::is_error) {
                elaborator.diagnostics.extend(checks::idle(&plan, item.span, &elaborator, &events));
            }
        }
        uses = checks::uses(&elaborator, sources, lab, &plan);
        if wanted != Wanted::Motions || !(elaborator.has_robots() || elaborator.has_places()) {
            let findings = elaborator.diagnostics;
            let reach = Some(reach);
            return Some(Built {
                wiring,
                points,
                noted,
                findings,
                starts,
                uses,
                many,
                choices,
                reach,
                ..Built::default()
            });
        }
    }
    let temperatures = elaborator.temperatures(&events, &plan);
    let mixtures = mixtures(&elaborator, &observables);
    let scene = scene(&mut elaborator, lab);
    let workflow = task::workflow_of(tables, task.item).unwrap_or(task.item);
    let inventory = if told {
        crate::inventory::inventory(&mut elaborator, sources, &mixtures, workflow)
    } else {
        Inventory::default()
    };
    let (incompatible, dangers) = match told {
        true => {
            let held = elaborator.instances.iter().flat_map(|i| &i.contents);
            let brought = held.map(|(s, _)| *s).collect();
            (
                crate::declare::compatibility::watched(tables, &mixtures, &brought),
                dangers(hazards.as_deref().unwrap_or_default()),
            )
        }
        false => (Vec::new(), Vec::new()),
    };
    let (flows, places) = (elaborator.told_flows(), elaborator.told_places());
    let (loads, paces) = in_hand(&mut elaborator);
    let model = Model {
        flows,
        places,
        params: elaborator.params,
        states: elaborator.states,
        derivatives,
        processes: elaborator
            .processes
            .iter()
            .map(|p| matterix_ir::model::Process { name: p.name.clone(), guard: p.guard, span: p.span })
            .collect(),
        events,
        readings: elaborator.readings,
        species: tables.species.iter().map(|(_, s)| species(s)).collect(),
        mixtures,
        loads,
        paces,
        observables: observables.into_iter().map(|o| o.2).collect(),
        balances,
        temperatures,
        incompatible,
        dangers,
        graph: elaborator.graph,
    };
    let files = (0..).map_while(|i| sources.get(FileId(i))).map(|s| s.name.clone()).collect();
    let (drivers, offers) = (elaborator.drivers, elaborator.offers);
    let program = Program { version: PROGRAM_VERSION, files, scene, model, plan, inventory, drivers, offers };
    let findings = elaborator.diagnostics;
    let program = Some(program);
    let reach = Some(reach);
    Some(Built { program, wiring, points, noted, findings, starts, uses, many, choices, reach, moved: None })
}

/// How the things of a lab may be moved, and how fast its robots go; where no robot carries any, nothing is asked for.
fn in_hand(lab: &mut Elaborator<'_>) -> (Vec<Load>, Vec<Pace>) {
    if !lab.has_robots() {
        return (Vec::new(), Vec::new());
    }
    let all = (0..lab.instances.len() as u32).map(InstanceId);
    let (things, robots) = (all.clone(), all);
    (things.filter_map(|id| lab.load(id)).collect(), robots.filter_map(|id| lab.pace(id)).collect())
}

fn species(s: &crate::declare::species::SpeciesDef<'_>) -> matterix_ir::model::Species {
    matterix_ir::model::Species {
        name: s.name.clone(),
        formula: s.formula.as_ref().map(ToString::to_string).unwrap_or_default(),
        elements: s.formula.iter().flat_map(|f| f.elements.iter().map(|(e, n)| (e.to_string(), n.to_f64()))).collect(),
        charge: s.charge(),
        molar_mass: s.molar_mass,
        by_mass: s.by_mass,
        span: s.span,
    }
}

/// The observables that are no amounts of species, each with its instance and the condition under which its model holds.
fn properties(all: &[Observed]) -> impl Iterator<Item = (InstanceId, &Observable, Option<NodeId>)> {
    let conditions: BTreeSet<u32> = all.iter().filter_map(|o| o.2.valid).collect();
    let own = (0..).zip(all).filter(move |(i, o)| o.1.is_none() && !conditions.contains(i));
    own.map(|(_, (id, _, o))| (*id, o, o.valid.and_then(|i| all.get(i as usize)?.2.value.first().copied())))
}

/// What an observable is about: an instance and, for a concentration, the species.
type Observed = (InstanceId, Option<crate::declare::SpeciesId>, Observable);

/// Derived quantities that change in the run, and the concentrations of every mixture.
fn observables(lab: &mut Elaborator<'_>) -> Vec<Observed> {
    let mut out = Vec::new();
    for i in 0..lab.instances.len() as u32 {
        let id = InstanceId(i);
        for m in lab.derived_members(id) {
            let MemberKind::Value { role: Role::Derived, name, ty, options, .. } = &m.member.kind else { continue };
            if lab.is_hidden(id, m, options) {
                continue;
            }
            let ty = lab.resolve_type(ty, m.module);
            let v = lab.member_value(id, m, name.span);
            let value: Vec<_> = match &v {
                Value::Num(Num { node, .. }) => vec![*node],
                Value::Tuple(items) => items
                    .iter()
                    .filter_map(|i| match i {
                        Value::Num(n) => Some(n.node),
                        _ => None,
                    })
                    .collect(),
                _ => continue,
            };
            let changes = value.iter().any(|n| lab.graph.leaves(*n).meets(Leaves::STATE));
            if !changes {
                continue;
            }
            let unit = lab.declared_unit(options, &ty).unwrap_or_else(|| lab.type_unit(&ty));
            let name = format!("{}.{}", lab.instances[i as usize].name, name.text);
            let valid = lab.validity(id, m, options).map(|node| {
                let name = format!("{name}.{VALID}");
                out.push((id, None, Observable { name, value: vec![node], unit: Unit::one(), valid: None }));
                out.len() as u32 - 1
            });
            out.push((id, None, Observable { name, value, unit, valid }));
        }
        for s in lab.mixture_species(id) {
            out.extend(concentration(lab, id, s).map(|o| (id, Some(s), o)));
            out.extend(settled(lab, id, s).map(|o| (id, Some(s), o)));
        }
    }
    out
}

/// The amount of a species at equilibrium, under the name of its state, which holds what was put there and is called so.
fn settled(lab: &mut Elaborator<'_>, id: InstanceId, s: crate::declare::SpeciesId) -> Option<Observable> {
    let node = lab.settled_amount(id, s)?;
    let state = lab.amounts_in(id).find(|(other, _)| *other == s)?.1;
    let State { name, domain: Domain::Quantity(unit), .. } = &mut lab.states[state as usize] else { return None };
    let (shown, unit) = (name.clone(), unit.clone());
    name.push_str(".put");
    Some(Observable { name: shown, value: vec![node], unit, valid: None })
}

/// The library's first concentration of a species: per mass of mixture, or a mass fraction where counted by mass.
fn concentration(lab: &mut Elaborator<'_>, id: InstanceId, s: crate::declare::SpeciesId) -> Option<Observable> {
    let by_mass = lab.tables.species.get(s).by_mass;
    let views = lab.views(id);
    for (module, _, ty, value, _) in views {
        let ty = lab.resolve_type(ty, module);
        let Type::Quantity { dimension, .. } = &ty else { continue };
        let amount = lab.tables.units.named("Amount");
        if by_mass && amount.over(dimension).is_free_of(&amount) {
            continue;
        }
        let probe =
            Num { node: lab.graph.number(1.0), dimension: dimension.clone(), point: false, unit: None, literal: false };
        let Value::Num(n) = lab.concentration(id, s, &probe, value.span)? else { return None };
        let name = format!("{}[{}]", lab.instances[id.0 as usize].name, lab.tables.species.get(s).name);
        return Some(Observable { name, value: vec![n.node], unit: lab.type_unit(&ty), valid: None });
    }
    None
}

fn mixtures(lab: &Elaborator<'_>, observables: &[Observed]) -> Vec<Mixture> {
    let mut of: Vec<Vec<u32>> = vec![Vec::new(); lab.instances.len()];
    for (i, observed) in observables.iter().enumerate() {
        of[observed.0.0 as usize].push(i as u32);
    }
    let by_mixture = lab.extensive_by_mixture();
    let all = lab.mixtures.iter().zip(&by_mixture);
    all.map(|(id, states)| mixture(lab, *id, states, observables, &of[id.0 as usize])).collect()
}

/// A mixture with its extensive states, of all `observables` those at the places `of`.
fn mixture(
    lab: &Elaborator<'_>,
    id: InstanceId,
    states: &[(ExtensiveKey, u32)],
    observables: &[Observed],
    of: &[u32],
) -> Mixture {
    let mut extensive = Vec::new();
    let mut contents = Vec::new();
    for (key, state) in states {
        let name = match key.species {
            Some(s) => {
                if key.matter {
                    contents.push(Content { species: s.0, state: *state, settled: None });
                }
                format!("{}[{}#{}]", key.member, lab.tables.species.get(s).name, s.0)
            }
            None => key.member.clone(),
        };
        extensive.push((name, *state));
    }
    extensive.sort();
    contents.sort_by_key(|c: &Content| c.species);
    let species = |i: u32| observables[i as usize].1.map(|s| s.0);
    let conditions: BTreeSet<u32> = of.iter().filter_map(|i| observables[*i as usize].2.valid).collect();
    let properties = of.iter().copied().filter(|i| species(*i).is_none() && !conditions.contains(i)).collect();
    let is_settled = |i: &u32| {
        let Observable { value, .. } = &observables[*i as usize].2;
        value.first().is_some_and(|node| matches!(lab.graph.op(*node), Op::Solved(..)))
    };
    for content in &mut contents {
        content.settled = of.iter().copied().find(|i| species(*i) == Some(content.species) && is_settled(i));
    }
    let concentration = |c: &Content| of.iter().copied().find(|i| species(*i) == Some(c.species) && !is_settled(i));
    let concentrations = contents.iter().filter_map(concentration).collect();
    Mixture { instance: id, extensive, contents, properties, concentrations }
}

fn scene(lab: &mut Elaborator<'_>, decl: DeclId) -> Scene {
    let ItemKind::Lab { name, .. } = &lab.tables.names.decl(decl).item.kind else { return Scene::default() };
    let mut instances = Vec::new();
    for (i, placed) in lab.whereabouts().into_iter().enumerate() {
        let id = InstanceId(i as u32);
        let inst = &lab.instances[i];
        let capabilities = {
            let all = lab.ancestors_of(id);
            all.into_iter()
                .filter(|k| lab.tables.kinds.get(k).is_some_and(|kind| !kind.is_asset))
                .map(|k| lab.tables.kind_name(k).to_string())
                .collect()
        };
        let (name, owner, pose, at, span) = (inst.name.clone(), inst.owner, inst.pose, inst.at, inst.span);
        let support = inst.placed.first().map(|p| p.1);
        let on: Vec<Frame> = match owner {
            Some(owner) => {
                instances.get(owner.0 as usize).map(|o: &SceneInstance| o.frames.clone()).unwrap_or_default()
            }
            None => Vec::new(),
        };
        let (pose, link) = match lab.mounted(id, &on) {
            Some(frame) => (frame.pose.then(pose), frame.link),
            None => (pose, None),
        };
        let geometry = lab.geometry(id);
        let (inertial, friction) = (lab.inertial(id, &geometry), lab.friction(id));
        let force = lab.force(id);
        let stopover = lab.is_stopover(id);
        let Geometry { frames, shape, solids, room, moving, collision, visual, inside: _ } = geometry;
        instances.push(SceneInstance {
            name,
            kind: lab.kind_names(id),
            capabilities,
            owner,
            link,
            support,
            pose,
            placed,
            at,
            frames,
            shape,
            solids,
            collision,
            visual,
            inertial,
            friction,
            force,
            stopover,
            room,
            articulation: lab.articulation(id, moving).map(Box::new),
            span,
        });
    }
    Scene { lab: name.text.clone(), instances, carriers: lab.carriers(), frictions: lab.frictions() }
}
