//! `matterixc deploy`.

use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use matterix_hardware::binding;
use matterix_hardware::calibration::{self, Calibrated};
use matterix_hardware::deploy::{
    Answer, Binding, Carrier, Control, Entry, Exposed, Gate, Journal, JournalError, Kept, Mode, is_unused,
};
use matterix_hardware::world::Machine;
use matterix_ir::quantity::show_number;
use matterix_ir::{Diagnostic, FileId, Program};

use super::run::Findings;
use crate::args::{Color, DeployArgs, DeployMode, RunFidelity, RunFormat};
use crate::panel::{Board, Panel, Watcher};
use crate::pipeline::{self, Calibration, Choices, DeployPlan, Gauged, Input, Options, Wires};
use crate::progress::{Kind, Progress};
use crate::reads::Account;
use crate::record::{About, Bound, Folder, Gauge, Taken};
use crate::terminal::{Stream, print, step_aside};
use crate::{Exit, cancel, files, keys};

/// Devices that are left as they are when a person cannot wait.
pub(super) static EXPOSED: Exposed = Exposed::new();

/// What people say meanwhile.
pub(super) static CONTROL: Control = Control::new(&cancel::ASKED, keys::show);

/// The number of the question that is put before the plan begins.
const BEFORE: u64 = u64::MAX;

/// How often it is looked whether that has been answered.
const LOOK: Duration = Duration::from_millis(10);

/// Compiles, looks whether devices can do it, and lets them do it.
pub fn deploy(args: &DeployArgs, color: Color) -> Exit {
    super::or_complain(attempt(args, color))
}

fn attempt(args: &DeployArgs, color: Color) -> Result<Exit, String> {
    if args.mode != DeployMode::Dry {
        step_aside()?;
    }
    let (text, read) = Account::of(|| files::read(&args.subject.file));
    let input = Input::file(&args.subject.file, text?);
    let bindings = String::from_utf8(files::read(&args.bind)?)
        .map_err(|_| format!("`{}` is not UTF-8 text", args.bind.display()))?;
    if args.mode != DeployMode::Dry && args.journal.is_none() && args.record.is_none() {
        let how = "add `--journal FILE` or `--record FOLDER`";
        return Err(format!("a deployment needs a journal of the sent messages: {how}"));
    }
    if args.resume && args.mode == DeployMode::Dry {
        return Err("a dry run cannot be resumed".to_string());
    }
    if args.view && args.mode == DeployMode::Dry {
        return Err("a dry run is too short for a page: use `--view` with another `--mode`".to_string());
    }
    let mut findings = Findings::new(RunFormat::Human, color);
    let measured = measured(args, &bindings);
    let options = Options { wires: Wires::Called, measured: measured.clone(), ..args.subject.options() };
    let ((mut sources, program, diagnostics), imported) = Account::of(|| pipeline::compile(&input, &options));
    let is_wrong = diagnostics.iter().any(Diagnostic::is_error);
    findings.show(&sources, diagnostics);
    let Some(program) = program.filter(|_| !is_wrong) else {
        findings.end();
        return Ok(Exit::Findings);
    };
    let cancel = cancel::on_interrupt()?;
    if args.mode == DeployMode::SimFirst && !args.resume {
        let mut progress = Progress::new(&program.plan, Kind::Quiet);
        let choices = Choices::plain(args.seed, RunFidelity::Process);
        let ran = pipeline::run(&program, &sources, &choices, cancel, &mut progress);
        let (passed, end) = (ran.passed, ran.end_time());
        findings.show(&sources, ran.diagnostics.clone());
        if !passed {
            findings.end();
            print(Stream::Err, "the simulation did not pass: nothing was sent\n");
            return Ok(Exit::Findings);
        }
        print(Stream::Err, &format!("the simulation passed in {} s of lab time\n", show_number(end)));
    }
    let file = sources.add(args.bind.display().to_string(), bindings.clone());
    let mode = match args.mode {
        DeployMode::Dry => Mode::Dry,
        DeployMode::Shadow => Mode::Shadow,
        DeployMode::Real | DeployMode::SimFirst => Mode::Real,
    };
    let who = keys::person();
    if args.yes || mode == Mode::Dry {
        CONTROL.answer_all(Answer { yes: true, who: format!("{who}, by `--yes`") });
    }
    if mode != Mode::Dry {
        keys::heed_signals(&CONTROL).map_err(|e| format!("cannot listen for signals: {e}"))?;
        let others_may_answer = args.yes || args.view;
        if !keys::listen(&CONTROL, others_may_answer) && !others_may_answer {
            CONTROL.answer_all(Answer::of_nobody());
        }
    }
    let about = about(args, &program, (file, &bindings), &measured);
    let (board, panel) = panel(args, &program, &about)?;
    if mode != Mode::Dry && !args.resume && !stands(&measured) {
        findings.end();
        print(Stream::Err, "the calibration was not confirmed: nothing was sent\n");
        return Ok(Exit::Findings);
    }
    let record = recorded(args, &[read, imported], &bindings)?;
    let mut journal = match &record {
        Some((folder, _)) => journal(Some(&folder.journal()), args)?,
        None => journal(args.journal.as_deref(), args)?,
    };
    if panel.is_some() {
        shown(&mut journal, &board);
    }
    let mut watcher = Watcher::new(board, &program.plan);
    let plan = DeployPlan {
        bindings: (file, &bindings),
        mode,
        speed: args.speed,
        seed: args.seed,
        trace: args.trace,
        journal,
        control: &CONTROL,
        who: &who,
        world: Rc::new(Machine::new()),
        exposed: &EXPOSED,
        beside: &mut watcher,
    };
    cancel::last_words(left_exposed);
    if args.speed != 1.0 && mode != Mode::Dry {
        let speed = show_number(args.speed);
        print(Stream::Err, &format!("lab time runs {speed} times as fast as the clock: only for emulators\n"));
    }
    let deployed = pipeline::deploy(&program, &sources, plan);
    if let (Some(path), false) = (&args.journal, args.resume) {
        forget_empty(path);
    }
    if let (Some((folder, _)), false) = (&record, args.resume) {
        folder.forget_unused();
    }
    let deployed = match deployed? {
        Ok(deployed) => deployed,
        Err(found) => {
            findings.show(&sources, found);
            findings.end();
            return Ok(Exit::Findings);
        }
    };
    let sealed = record
        .filter(|_| deployed.execution.is_some())
        .map(|(folder, main)| folder.seal(About { main, ..about }, &deployed));
    drop(panel);
    findings.show(&sources, deployed.diagnostics);
    findings.end();
    let stopped = match CONTROL.stopped_by().as_deref() {
        Some(Answer::NOBODY) => "was stopped because nobody could confirm (run it on a terminal, or with `--yes`),",
        _ => "was stopped by a person",
    };
    if let Some(end) = deployed.end {
        let [judged, met, unseen] = deployed.counts;
        let how = match (deployed.stopped, deployed.passed) {
            (true, _) => stopped,
            (false, true) => "passed",
            (false, false) => "did not pass",
        };
        let seen = format!("{judged} expectations: {met} met, {unseen} not observed");
        print(Stream::Err, &format!("the deployment {how} after {} s; {seen}\n", show_number(end)));
    } else if deployed.stopped {
        print(Stream::Err, &format!("the deployment {stopped} before it started\n"));
    }
    // After the verdict: that stands whatever becomes of the record.
    let sealed = sealed.transpose().map_err(|why| format!("{why}; the record is not sealed"))?;
    if let Some(digest) = sealed {
        print(Stream::Err, &format!("the record is sealed: {digest}\n"));
    }
    Ok(if deployed.passed { Exit::Fine } else { Exit::Findings })
}

/// What is shown of a deployment, and the page that shows it where one is asked for.
fn panel(args: &DeployArgs, program: &Program, about: &About) -> Result<(Arc<Board>, Option<Panel>), String> {
    let told = program.drivers.iter().flat_map(|driver| &driver.told);
    let file = args.subject.file.display().to_string();
    let board = Arc::new(Board::new(told, file, args.subject.workflow.clone(), args.speed, &about.devices));
    if !args.view {
        return Ok((board, None));
    }
    let panel = Panel::open(Arc::clone(&board), &CONTROL, &EXPOSED, args.port)
        .map_err(|e| format!("cannot serve the page on port {}: {}", args.port, files::reason(&e)))?;
    print(Stream::Err, &format!("the page of this deployment: {}\n", panel.url()));
    Ok((board, Some(panel)))
}

/// Puts on the board what a journal says and what is written from here on.
fn shown(journal: &mut Kept, board: &Arc<Board>) {
    let reader = Arc::clone(board);
    match journal {
        Kept::Left(journal, before) => {
            before.iter().for_each(|entry| board.take(entry));
            journal.show_to(Box::new(move |entry| reader.take(entry)));
        }
        Kept::New(journal) => journal.show_to(Box::new(move |entry| reader.take(entry))),
        Kept::Not | Kept::Damaged(_) => {}
    }
}

/// What the bindings say was measured of the lab.
fn measured(args: &DeployArgs, bindings: &str) -> Calibration {
    let gauged = |c: Calibrated| Gauged { thing: c.thing, field: c.field, value: c.value };
    let given = calibration::read(bindings).into_iter().map(gauged).collect();
    Calibration { name: args.bind.display().to_string(), text: bindings.to_owned(), given }
}

/// The folder of the record that is asked for, and the first file of the program in it.
fn recorded(args: &DeployArgs, read: &[Account], bindings: &str) -> Result<Option<(Folder, String)>, String> {
    let Some(dir) = args.record.as_ref().filter(|_| args.mode != DeployMode::Dry) else { return Ok(None) };
    let folder = if args.resume { Folder::open(dir)? } else { Folder::create(dir)? };
    let mut taken = Vec::new();
    for account in read {
        taken.extend(account.again()?.into_iter().map(|(path, bytes)| Taken { path, bytes }));
    }
    let main = folder.keep(&args.subject.file, &taken, bindings)?;
    Ok(Some((folder, main)))
}

/// What a record says of what a deployment is given.
fn about(args: &DeployArgs, program: &Program, (file, bindings): (FileId, &str), measured: &Calibration) -> About {
    let (bound, _) = binding::read(program, file, bindings);
    let driver = |index: usize| program.drivers.get(index).map(|d| d.name.clone());
    let device = |b: &Binding| {
        let (driver, place) = match &b.carrier {
            Carrier::Line { driver: index, place, .. } => (driver(*index), Some(place.to_string())),
            Carrier::Shared { driver: index, .. } => (driver(*index), None),
            Carrier::Hand => (None, None),
        };
        Bound { name: program.scene.get(b.instance).name.clone(), driver, place }
    };
    let value = |g: &Gauged| measured.text.get(g.value.clone()).unwrap_or_default().to_owned();
    let gauge = |g: &Gauged| Gauge { of: format!("{}.{}", g.thing.0, g.field.0), value: value(g) };
    About {
        tool: env!("CARGO_PKG_VERSION").to_owned(),
        main: String::new(),
        workflow: args.subject.workflow.clone(),
        lab: args.subject.lab.clone(),
        set: args.subject.set.clone(),
        mode: if args.mode == DeployMode::Shadow { "shadow" } else { "real" }.to_owned(),
        speed: args.speed,
        seed: args.seed,
        devices: bound.iter().map(device).collect(),
        calibration: measured.given.iter().map(gauge).collect(),
    }
}

/// The journal that is asked for.
fn journal(path: Option<&Path>, args: &DeployArgs) -> Result<Kept, String> {
    let Some(path) = path.filter(|_| args.mode != DeployMode::Dry) else { return Ok(Kept::Not) };
    if !args.resume {
        return Journal::create(path).map(Kept::New).map_err(|e| e.text().to_owned());
    }
    match Journal::reopen(path, args.vouch) {
        Ok((journal, before)) => {
            let gates = before.iter().rev().find_map(|entry| match entry {
                Entry::Gate { to, .. } => Some(*to),
                _ => None,
            });
            if gates.is_some_and(|to| to != Gate::Go) {
                print(Stream::Err, keys::STILL_PAUSED);
            }
            Ok(Kept::Left(journal, before))
        }
        Err(JournalError::Damaged(why)) => Ok(Kept::Damaged(why)),
        Err(other) => Err(other.text().to_owned()),
    }
}

/// Whether a person says that it is still so.
fn stands(measured: &Calibration) -> bool {
    let value = |g: &Gauged| measured.text.get(g.value.clone()).unwrap_or_default().to_owned();
    let all: Vec<String> =
        measured.given.iter().map(|g| format!("  {}.{}: {}\n", g.thing.0, g.field.0, value(g))).collect();
    if all.is_empty() {
        return true;
    }
    CONTROL.ask(BEFORE, &format!("calibration of `{}`:\n{}are these values still valid?", measured.name, all.concat()));
    while !CONTROL.is_stopped() {
        if let Some(answer) = CONTROL.answered(BEFORE) {
            return answer.yes;
        }
        std::thread::sleep(LOOK);
    }
    false
}

/// What is said where nothing more is done.
pub(super) fn left_exposed() -> String {
    let names = EXPOSED.names().iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
    match names.is_empty() {
        true => "ended at once: every device that received a command was made safe\n".to_owned(),
        false => format!("ended at once; not made safe: {names}: go and check now\n"),
    }
}

/// Removes a new journal into which nothing was written but its head: what was refused beforehand may be tried again with it.
pub(super) fn forget_empty(journal: &Path) {
    if is_unused(journal) {
        // It stays where it cannot be removed, which the next attempt says.
        let _ = std::fs::remove_file(journal);
    }
}
