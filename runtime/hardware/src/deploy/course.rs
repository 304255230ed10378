//! A program on devices from its bindings to what is left safe.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use matterix_ir::plan::Plan;
use matterix_ir::quantity::show_number;
use matterix_ir::{Diagnostic, Program, Severity, Sources, Span, codes};
use matterix_runtime::backend::{Prepared, Sim};
use matterix_runtime::exec::{self, Execution, FailureTrace, Limits, Listener, RunStatus, Tee, Verdict};
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Engine, Options};
use matterix_runtime::run::Screen;

use super::Trace;
use super::control::Control;
use super::device::{Binding, Carrier, Device};
use super::exposed::Exposed;
use super::hardware::{Hardware, Mode, Settings, Unreached};
use super::identity::first_said;
use super::journal::{Entry, Journal, VERSION, digest};
use super::moved::{mixed_up, places};
use super::preflight::preflight;
use crate::binding;
use crate::link::DeviceError;
use crate::world::World;

/// How a journal ends that was not gone on with.
pub const REFUSED: &str = "refused";

/// What a deployment is given beside a program.
pub struct Course<'p> {
    /// Where devices are.
    pub bindings: Vec<Binding>,
    /// What is done with devices.
    pub mode: Mode,
    /// Seconds of lab time per second.
    pub speed: f64,
    /// Where the noise of the twin starts.
    pub seed: u64,
    /// Told of every frame.
    pub trace: Box<Trace<'p>>,
    /// The journal.
    pub journal: Kept,
    /// What people say meanwhile.
    pub control: &'p Control,
    /// Who carries it out.
    pub who: &'p str,
    /// Clocks and ports.
    pub world: Rc<dyn World>,
    /// Kept up to date with what is told to devices.
    pub exposed: &'p Exposed,
}

/// The journal of a deployment.
pub enum Kept {
    /// None is kept.
    Not,
    /// A new one.
    New(Journal),
    /// One that an earlier process has left, and what it says.
    Left(Journal, Vec<Entry>),
    /// One that an earlier process has left, and that is not as it was written: why.
    Damaged(String),
}

/// How a deployment ended.
pub struct Ending {
    /// What was found before or went wrong after.
    pub diagnostics: Vec<Diagnostic>,
    /// Whether it came to its end with all expectations met or not observed.
    pub passed: bool,
    /// Whether a person ended it early.
    pub stopped: bool,
    /// The same in a word, as the journal has it.
    pub status: &'static str,
    /// s of lab time; nothing where it did not begin.
    pub end: Option<f64>,
    /// Expectations that were judged, met and not observed.
    pub counts: [usize; 3],
    /// What came of the plan, where it began.
    pub execution: Option<Execution>,
    /// Digest of the states of the twin at the end.
    pub states: String,
}

impl Ending {
    fn not_begun(diagnostics: Vec<Diagnostic>) -> Self {
        let (passed, stopped, end, execution) = (false, false, None, None);
        Ending {
            diagnostics,
            passed,
            stopped,
            status: "not begun",
            end,
            counts: [0; 3],
            execution,
            states: String::new(),
        }
    }
}

/// Why a journal is not gone on with.
enum Unfit {
    /// Nothing is left to be done.
    Over(Diagnostic),
    /// What it is about may still be on.
    Unknown(Diagnostic),
}

/// Carries a program out; `out` hears of what the executor does.
pub fn carry_out(
    program: &Program,
    sources: &Sources,
    course: Course<'_>,
    out: &mut dyn Listener,
) -> Result<Ending, String> {
    let Course { bindings, mode, speed, seed, trace, journal, control, who, world, exposed } = course;
    if mode == Mode::Shadow
        && let Some(d) = unmeasured(program, &bindings)
    {
        return Ok(Ending::not_begun(vec![d]));
    }
    let digest = digest(program, &binding::canonical(program, &bindings))?;
    let devices: Result<Vec<Device<'_>>, String> = bindings.into_iter().map(|b| Device::new(program, b)).collect();
    let at = program.plan.span();
    let (journal, before, unfit) = match journal {
        Kept::Not => (Journal::none(), None, None),
        Kept::New(journal) => (journal, None, None),
        Kept::Left(journal, before) => {
            let unfit = match journal.is_shut() {
                true => Some(refused(at, "the devices of this journal were made safe when it could not be resumed")),
                false => unfit(at, &before, &digest, (speed, seed)).or_else(|| {
                    let devices = devices.as_deref().unwrap_or_default();
                    let why = mixed_up(&places(&before), &first_said(&before), devices)?;
                    Some(refused(at, &format!("{why}: they cannot be distinguished")))
                }),
            };
            let unfit = unfit.filter(|_| mode != Mode::Replay);
            (journal, Some(before), unfit)
        }
        Kept::Damaged(why) => (Journal::none(), None, Some(refused(at, &why))),
    };
    let prepared = Prepared::new(program);
    let params = program.model.params.iter().map(|p| p.value).collect();
    let engine = Engine::new(&prepared.model, params, program.plan.locals.len(), Options::default());
    let mut screen = Screen::new(program);
    let engine = match engine.and_then(|mut engine| engine.start(&mut screen).map(|()| engine)) {
        Ok(engine) => engine,
        Err(fault) => return Ok(Ending::not_begun(vec![of_fault(&program.plan, fault)])),
    };
    let mut twin = Sim::new(engine, &prepared, seed);
    twin.engine().attend(screen.conditions());
    let ended = AtomicBool::new(false);
    let settings = Settings { mode, speed, control, ended: &ended, world, exposed };
    let mut hardware = Hardware::new(program, sources, twin, devices?, settings, journal, trace);
    if let Some(unfit) = unfit {
        return Ok(Ending::not_begun(made_safe(hardware, unfit)));
    }
    if let Some(ending) = ready(&mut hardware, program, before, &digest, (seed, who, exposed)) {
        return Ok(ending);
    }
    let limits = Limits { cancel: Some(&ended), ..Limits::default() };
    let mut heard = Tee(&mut screen, out);
    match unbroken(|| exec::execute(&program.plan, &program.scene, &mut hardware, limits, &mut heard)) {
        Ok(execution) => Ok(concluded(hardware, execution, screen, (control, exposed))),
        Err(why) => {
            let mut found = vec![broken(at, &why)];
            found.extend(secured(&mut hardware, exposed));
            // The journal says what happened as far as it goes, and what was found says the rest.
            let _ = unbroken(|| hardware.end_journal("failed"));
            Ok(Ending::not_begun(found))
        }
    }
}

/// Comes to where the plan begins, or goes on; how it ended where it does not come so far.
fn ready(
    hardware: &mut Hardware<'_, '_>,
    program: &Program,
    before: Option<Vec<Entry>>,
    digest: &str,
    (seed, who, exposed): (u64, &str, &Exposed),
) -> Option<Ending> {
    let found = {
        let (observed, devices) = hardware.view();
        preflight(program, devices, observed)
    };
    if !found.is_empty() {
        return Some(Ending::not_begun(found));
    }
    let goes_on = before.is_some();
    let is_open = before.iter().flatten().any(|e| matches!(e, Entry::Opened { .. } | Entry::Starting { .. }));
    if let Some(before) = before.filter(|_| is_open) {
        hardware.follow_journal(before, who);
    }
    let unreached = hardware.connect();
    if !unreached.is_empty() {
        return Some(Ending::not_begun(unreached.iter().map(|u| not_reached(u, goes_on)).collect()));
    }
    let untellable = hardware.untellable();
    if !goes_on && !untellable.is_empty() {
        return Some(Ending::not_begun(untellable));
    }
    if !goes_on && let Err(fault) = hardware.begin_journal(digest, seed, who) {
        return Some(Ending::not_begun(vec![of_fault(&program.plan, fault)]));
    }
    // One that was cut off before anything of the plan was begun opens its lines as a new one does.
    if !is_open && let Err(failed) = hardware.open() {
        let mut found = vec![not_opened(&program.plan, failed)];
        found.extend(secured(hardware, exposed));
        return Some(Ending { stopped: hardware.is_stopped(), ..Ending::not_begun(found) });
    }
    None
}

/// What is found after a plan has ended, with devices left safe where it did not end well.
fn concluded(
    mut hardware: Hardware<'_, '_>,
    execution: Execution,
    screen: Screen<'_>,
    (control, exposed): (&Control, &Exposed),
) -> Ending {
    if let Some(unreached) = hardware.unreached() {
        return Ending::not_begun(vec![not_reached(unreached, true)]);
    }
    let well = matches!(execution.status, RunStatus::Passed | RunStatus::ExpectationFailed);
    let program = hardware.program;
    hardware.stop_late();
    let stopped = !well && control.is_stopped();
    let mut found = findings(&execution);
    found.extend(screen.into_found().into_iter().map(|f| f.diagnostic));
    found.extend(hardware.unhalted().iter().cloned().map(not_halted));
    if !well || !execution.unfinished.is_empty() || !hardware.unhalted().is_empty() {
        if hardware.journal().broken.is_some() {
            hardware.journal().shut();
        }
        found.extend(secured(&mut hardware, exposed));
        if hardware.is_refused() && !found.is_empty() {
            let why = found.remove(0);
            found.insert(0, meanwhile(why, &hardware));
        }
    }
    hardware.notice_hold_up();
    found.extend(held_up(program.plan.span(), &hardware.held_up));
    found.extend(hardware.close().err().map(|fault| of_fault(&program.plan, fault)));
    let status = match (well, stopped) {
        _ if hardware.is_refused() => REFUSED,
        (_, true) => "stopped by a person",
        (true, false) => "ended",
        (false, false) => "failed",
    };
    found.extend(hardware.end_journal(status).err().map(|fault| of_fault(&program.plan, fault)));
    let count = |wanted: &[Verdict]| execution.expectations.iter().filter(|e| wanted.contains(&e.verdict)).count();
    let counts = [execution.expectations.len(), count(&[Verdict::Passed]), count(&[Verdict::NotObserved])];
    let passed = execution.status == RunStatus::Passed && found.iter().all(|d| !d.is_error());
    let (end, states) = (Some(execution.end_time), hardware.states());
    Ending { diagnostics: found, passed, stopped, status, end, counts, execution: Some(execution), states }
}

/// That a shadow has nothing to go by: no device that tells something has a tolerance.
fn unmeasured(program: &Program, bindings: &[Binding]) -> Option<Diagnostic> {
    let is_measured = bindings.iter().any(|b| !b.tolerances.is_empty());
    let telling = bindings.iter().find_map(|b| match &b.carrier {
        Carrier::Line { driver, .. } => program.drivers[*driver].told.first().map(|told| (b, told)),
        _ => None,
    });
    let at = telling.map(|(b, _)| b).or(bindings.first()).filter(|_| !is_measured)?.at;
    let d = Diagnostic::error(codes::BINDING, at, "no device is compared with the twin", "no device has a `tolerance`");
    Some(match telling {
        Some((_, told)) => {
            let member = told.name.rsplit('.').next().unwrap_or(&told.name);
            d.help(format!(
                "give the allowed difference from the twin: `tolerance = {{ {member} = \"2 {}\" }}`",
                told.difference.symbol
            ))
        }
        None => d.help("none of these devices reports anything: choose another mode"),
    })
}

/// Why a journal is of another deployment, or of one that has ended.
fn unfit(at: Span, before: &[Entry], digest: &str, (speed, seed): (f64, u64)) -> Option<Unfit> {
    let this = env!("CARGO_PKG_VERSION");
    match (before.first(), before.last()) {
        (_, Some(Entry::End { .. })) => {
            let d = mismatch(at, "the deployment of this journal has already ended");
            Some(Unfit::Over(d.help("start again with a new journal")))
        }
        (Some(Entry::Begin { version, tool, digest: of, speed: paced, seed: from, .. }), _) => match () {
            () if *version != VERSION || tool != this => Some(refused(
                at,
                &format!("the journal was written by version {tool} of this program, but this is {this}"),
            )),
            () if of != digest => Some(refused(at, "the journal belongs to another program or other bindings")),
            () if *paced != speed => Some(refused(at, "the journal belongs to a deployment at another speed")),
            () if *from != seed => Some(refused(at, "the journal belongs to a deployment with another seed")),
            () => None,
        },
        _ => Some(refused(at, "the journal contains no deployment")),
    }
}

fn mismatch(at: Span, headline: &str) -> Diagnostic {
    Diagnostic::error(codes::JOURNAL_MISMATCH, at, headline, "cannot be resumed")
}

/// That a journal is not gone on with, though what it is about may still be on.
fn refused(at: Span, why: &str) -> Unfit {
    Unfit::Unknown(mismatch(at, why).help("check what the devices did, then start again with a new journal"))
}

/// What an earlier process has left on is made safe, as it is not known what that was.
fn made_safe(mut hardware: Hardware<'_, '_>, unfit: Unfit) -> Vec<Diagnostic> {
    let unfit = match unfit {
        Unfit::Over(d) => return vec![d],
        Unfit::Unknown(d) if !hardware.abandon() => return vec![d],
        Unfit::Unknown(d) => d,
    };
    hardware.journal().shut();
    let left = hardware.secure();
    std::iter::once(meanwhile(unfit, &hardware)).chain(left.into_iter().map(unsafe_left)).collect()
}

/// Why a journal is not gone on with, and which devices were made safe.
fn meanwhile(why: Diagnostic, hardware: &Hardware<'_, '_>) -> Diagnostic {
    let names = hardware.secured().join(", ");
    if names.is_empty() { why } else { why.help(format!("these devices were made safe: {names}")) }
}

/// A fault as a finding.
pub fn of_fault(plan: &Plan, fault: Fault) -> Diagnostic {
    exec::diagnostic(&FailureTrace::of_fault(plan, fault))
}

/// A device that was not there before anything was said to any: nothing need be made safe, and a journal stays as it is.
pub fn not_reached(unreached: &Unreached, goes_on: bool) -> Diagnostic {
    let Unreached { device, at, trouble } = unreached;
    let what = match trouble {
        DeviceError::Lost(_) | DeviceError::Silent(_) => "cannot be reached",
        DeviceError::Unsaid(_) => "cannot be addressed",
        DeviceError::Mistaken(_) => "is another device",
        DeviceError::Garbled(_) | DeviceError::Refused { .. } => "is another kind of device than bound",
    };
    let headline = format!("`{device}` {what}: {}", trouble.text());
    let d = Diagnostic::error(trouble.code(), *at, headline, "bound here");
    d.help(if goes_on {
        "nothing was sent to any device; resume the journal with `--resume` when the device is back"
    } else {
        "nothing was sent to any device"
    })
}

/// What went wrong when drivers said what they say first, with the place where the device is bound.
pub fn not_opened(plan: &Plan, (fault, at): (Fault, Option<Span>)) -> Diagnostic {
    let found = of_fault(plan, fault);
    match at {
        Some(at) => found.because(at, "bound here"),
        None => found,
    }
}

/// What comes of something that may break down: an error in this program leaves no device as it is.
fn unbroken<T>(act: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(act)).map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason is given".to_owned())
    })
}

fn broken(at: Span, why: &str) -> Diagnostic {
    let headline = format!("this program failed: {why}");
    Diagnostic::error(codes::RUN_FAILED, at, headline, "a bug in matterixc, not in the workflow")
}

/// Makes devices safe; what could not be.
fn secured(hardware: &mut Hardware<'_, '_>, exposed: &Exposed) -> Vec<Diagnostic> {
    let at = hardware.program.plan.span();
    match unbroken(|| hardware.secure()) {
        Ok(left) => left.into_iter().map(unsafe_left).collect(),
        Err(why) => {
            let all = exposed.names().into_iter().map(|name| unsafe_left((at, format!("`{name}`"))));
            std::iter::once(broken(at, &why)).chain(all).collect()
        }
    }
}

/// That a device did not break off what it did, whatever made it safe afterwards.
fn not_halted((at, why): (Span, String)) -> Diagnostic {
    let headline = format!("a device did not stop on command: {why}");
    Diagnostic::error(codes::DEVICE_REFUSED, at, headline, "bound here")
}

/// That this process stood still while a plan was carried out, where it did: a wait may have lasted longer than it says.
fn held_up(at: Span, times: &[(f64, f64)]) -> Option<Diagnostic> {
    let (from, longest) = times.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let more = if times.len() > 1 { format!(", the longest of {} times", times.len()) } else { String::new() };
    let (from, longest) = (show_number(from), show_number((longest * 10.0).round() / 10.0));
    let headline =
        format!("this program was paused for {longest} s at {from} s of lab time{more}: steps due then were late");
    let d = Diagnostic::error(codes::DIVERGED, at, headline, "a step took longer than planned");
    Some(d.help("it was stopped, or this computer was asleep or busy: the journal lists the times"))
}

/// That a device may be hot or moving: where it is bound, and why.
pub fn unsafe_left((at, why): (Span, String)) -> Diagnostic {
    let headline = format!("a device could not be made safe: {why}");
    Diagnostic::error(codes::DEVICE_LOST, at, headline, "may be hot or moving").help("go and check it now")
}

fn findings(execution: &Execution) -> Vec<Diagnostic> {
    let missed = execution.expectations.iter().filter(|e| e.verdict == Verdict::Failed);
    let mut found: Vec<Diagnostic> = missed.map(exec::expectation_diagnostic).collect();
    found.extend(execution.failure.iter().chain(&execution.unfinished).map(exec::diagnostic));
    // That nothing more was said after it was refused to go on follows from that.
    let others = execution.suppressed.iter().filter(|trace| trace.code != codes::JOURNAL_MISMATCH);
    let others = others.map(exec::diagnostic);
    found.extend(others.map(|d| Diagnostic { severity: Severity::Warning, ..d }));
    found
}

#[cfg(test)]
mod tests {
    use super::unbroken;

    #[test]
    fn what_breaks_down_says_why_and_takes_nothing_with_it() {
        assert_eq!(unbroken(|| 7), Ok(7));
        assert_eq!(unbroken(|| -> u8 { panic!("index {} of {}", 3, 2) }), Err("index 3 of 2".to_owned()));
        assert_eq!(unbroken(|| -> u8 { std::panic::panic_any(1.5) }), Err("no reason is given".to_owned()));
    }
}
