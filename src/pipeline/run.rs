//! A program on the digital twin: executed, followed, recorded and reported.

use std::borrow::Cow;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use matterix_ir::plan::{Condition, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Label, Program, Severity, Sources, Unit};
use matterix_runtime::contact::{Really, Sighting};
use matterix_runtime::exec::{
    self, ExpectationResult, FailureTrace, Limits, Listener, RunStatus, StepState, Turn, Verdict,
};
use matterix_runtime::motion::{Burden, Moment, Moved, Unseen};
use matterix_runtime::process::{Engine, Observer, Options};
use matterix_runtime::record::{self, Level, Outputs, Recording, Report, Run, RunInfo, Sampler};
use matterix_runtime::run::{Fidelity, Outcome, RunOptions};

use crate::args;
use crate::progress::Progress;

/// Version of the language that programs are written in, as in `mtx 1`.
const LANGUAGE: u32 = 1;

/// What is kept of the curves of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Both ends of each, for the report.
    Ends,
    /// What files have.
    Curves,
}

impl Keep {
    fn error(self) -> f64 {
        match self {
            Keep::Ends => f64::INFINITY,
            Keep::Curves => record::ERROR,
        }
    }
}

/// What a run may choose.
pub struct Choices {
    /// Where all randomness starts.
    pub seed: u64,
    /// How closely motions are simulated.
    pub fidelity: args::RunFidelity,
    /// Steps without what they cause.
    pub dry: bool,
    /// The turns of claims, where a schedule is followed.
    pub turns: Vec<Turn>,
    /// What stands away from the place it was given.
    pub moved: Vec<Moved>,
    /// What stands away from where robots take it to be.
    pub unseen: Unseen,
    /// How strong and how rough things really are.
    pub really: Really,
    /// What is kept of curves: files can be written of [`Keep::Curves`] only.
    pub keep: Keep,
}

impl Choices {
    /// Things where they are said to be, no turns, and no more kept than how it ends.
    pub fn plain(seed: u64, fidelity: args::RunFidelity) -> Self {
        let (turns, moved, unseen) = (Vec::new(), Vec::new(), Unseen::default());
        Choices { seed, fidelity, dry: false, turns, moved, unseen, really: Really::default(), keep: Keep::Ends }
    }

    fn fidelity(&self) -> Fidelity {
        match self.fidelity {
            _ if self.dry => Fidelity::Dry,
            args::RunFidelity::Process => Fidelity::Process,
            args::RunFidelity::Motion => Fidelity::Motion,
            args::RunFidelity::Contact => Fidelity::Contact,
        }
    }
}

/// Executes a program until it ends or `cancel` is set.
pub fn run<'a>(
    program: &'a Program,
    sources: &'a Sources,
    choices: &Choices,
    cancel: &AtomicBool,
    progress: &mut Progress<'_>,
) -> Ran<'a> {
    let fidelity = choices.fidelity();
    let limits = Limits { cancel: Some(cancel), turns: &choices.turns, ..Limits::default() };
    let process = Options { curves: choices.keep == Keep::Curves, ..Options::default() };
    let unseen = choices.unseen.clone();
    let (seed, really) = (choices.seed, choices.really);
    let options = RunOptions { seed, fidelity, limits, process, unseen, really, ..RunOptions::default() };
    let recording = Recording::within(program, choices.keep.error());
    let mut follower = Follower { recording, sampler: Sampler::new(&program.model), progress };
    let moved = choices.moved.iter().map(|moved| (moved, "stands", "its place"));
    let unseen = choices.unseen.moved().iter().map(|moved| (moved, "really stands", "its assumed place"));
    for (moved, stands, from) in moved.chain(unseen) {
        let instance = program.scene.get(moved.thing);
        let [x, y] = moved.shift.map(|m| m * 1e3);
        let text = format!(
            "`{}` {stands} ({x:.1}, {y:.1}) mm from {from}, turned by {:.1} deg",
            instance.name,
            moved.turn.to_degrees()
        );
        follower.recording.log(0.0, Level::Info, text, Some(instance.span));
    }
    let outcome = matterix_runtime::run::run(program, &options, &mut follower);
    let mut recording = follower.recording;
    recording.reach(outcome.end_time);
    let info = info(&outcome, choices);
    let program = match choices.unseen.is_nothing() {
        true => Cow::Borrowed(program),
        false => Cow::Owned(choices.unseen.in_program(program)),
    };
    let report = Report::new(&Run { program: &program, recording: &recording, sources, info: &info });
    let passed = outcome.status == RunStatus::Passed;
    let diagnostics = findings(&outcome, sources);
    Ran { program, sources, recording, info, report, diagnostics, passed, states: outcome.states }
}

/// A finished run.
pub struct Ran<'a> {
    /// With things where they really are.
    program: Cow<'a, Program>,
    sources: &'a Sources,
    recording: Recording,
    info: RunInfo,
    report: Report,
    /// What ended it, what else failed on the way, and expectations that did not hold and what is left on, each on its line of the source.
    pub diagnostics: Vec<Diagnostic>,
    /// Whether it came to its end and every expectation held.
    pub passed: bool,
    /// States at the end, by index, SI.
    pub states: Vec<Option<f64>>,
}

impl Ran<'_> {
    /// When it ended, s of lab time.
    pub fn end_time(&self) -> f64 {
        self.recording.end
    }

    /// The report to read.
    pub fn page(&self) -> String {
        record::human(&self.report)
    }

    /// The contents of `report.json`.
    pub fn json(&self) -> Result<String, String> {
        self.report.json().map_err(|e| format!("cannot write the report: {e}"))
    }

    /// Writes recording, tables, plots and report into a folder; tables in CSV too where they are wanted.
    pub fn write(&self, dir: &Path, csv: bool) -> Result<(), String> {
        let run = Run { program: &self.program, recording: &self.recording, sources: self.sources, info: &self.info };
        record::write_all(dir, &run, &self.report, Outputs { csv, ..Outputs::ALL })
            .map(|_| ())
            .map_err(|e| e.to_string())
    }
}

/// Hands on what happens to the recording and to whoever watches.
struct Follower<'a, 'p> {
    recording: Recording,
    sampler: Sampler,
    progress: &'a mut Progress<'p>,
}

impl Observer for Follower<'_, '_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.sampler.sample(&mut self.recording, time, engine, changed);
        self.progress.moved(time);
    }

    fn begun(&mut self, time: f64, engine: &Engine<'_>) {
        self.sampler.begin(&mut self.recording, time, engine);
    }

    fn curve(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.sampler.sample(&mut self.recording, time, engine, changed);
    }

    fn event(&mut self, time: f64, event: usize) {
        self.recording.event(time, event);
    }

    fn process(&mut self, time: f64, process: usize, running: bool) {
        self.recording.process(time, process, running);
    }
}

impl Listener for Follower<'_, '_> {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.recording.step(time, step, state);
        match state {
            StepState::Running => self.progress.started(step, time),
            _ => self.progress.ended(step, time),
        }
    }

    fn travels(&mut self, moments: &[Moment]) {
        self.recording.travels(moments);
    }

    fn sightings(&mut self, sightings: &[Sighting]) {
        self.recording.sightings(sightings);
    }

    fn burdened(&mut self, time: f64, item: InstanceId, burden: Burden) {
        self.recording.burdened(time, item, burden);
    }

    fn expectation(&mut self, result: &ExpectationResult) {
        if result.verdict == Verdict::NotObserved {
            let text = format!("not observed: {}", result.text);
            self.recording.log(result.time, Level::Warning, text, Some(result.span));
            return;
        }
        self.recording.expectation(record::Expectation {
            time: result.time,
            text: result.text.clone(),
            span: result.span,
            passed: result.verdict == Verdict::Passed,
            measured: result.compared.clone(),
        });
    }

    fn failure(&mut self, failure: &FailureTrace) {
        let text = format!("{}: {}", failure.name, failure.text);
        self.recording.log(failure.time, Level::Error, text, Some(failure.span));
    }

    fn assumed(&mut self, time: f64, _: StepId, condition: &Condition) {
        let text = format!("assumed true: {}", condition.text);
        self.recording.log(time, Level::Warning, text, Some(condition.span));
    }

    fn record(&mut self, time: f64, _: StepId, name: &str, values: &[f64], _: &Unit) {
        self.recording.value(time, name, values);
    }

    fn note(&mut self, time: f64, _: StepId, text: &str) {
        self.recording.log(time, Level::Info, text, None);
    }

    fn ask(&mut self, time: f64, _: StepId, text: &str) {
        self.recording.log(time, Level::Info, format!("asked: {text}"), None);
    }
}

fn info(outcome: &Outcome, choices: &Choices) -> RunInfo {
    let failure = outcome.failure.as_ref().map(|f| record::Failure {
        name: f.name.clone(),
        text: f.text.clone(),
        time: f.time,
        span: Some(f.span).filter(|s| !s.is_empty()),
        trace: f.steps.iter().map(|s| s.step).collect(),
    });
    let status = match outcome.status {
        RunStatus::Passed => record::Status::Passed,
        RunStatus::ExpectationFailed => record::Status::Missed,
        RunStatus::Failed | RunStatus::Fault => record::Status::Failed,
        RunStatus::Cancelled => record::Status::Cancelled,
    };
    RunInfo {
        language: LANGUAGE,
        seed: choices.seed,
        fidelity: choices.fidelity(),
        status,
        failure,
        findings: outcome.findings.clone(),
        ..RunInfo::default()
    }
}

/// What ended the run is an error, and so are an expectation that did not hold and what is left on; what else failed is a warning.
pub(super) fn findings(outcome: &Outcome, sources: &Sources) -> Vec<Diagnostic> {
    let missed = outcome.expectations.iter().filter(|e| e.verdict == Verdict::Failed);
    let mut found: Vec<Diagnostic> = missed.map(exec::expectation_diagnostic).collect();
    found.extend(outcome.failure.iter().chain(&outcome.unfinished).map(exec::diagnostic));
    found.extend(outcome.findings.iter().map(|f| f.diagnostic.clone()));
    let others = outcome.suppressed.iter().map(exec::diagnostic);
    found.extend(others.map(|d| Diagnostic { severity: Severity::Warning, ..d }));
    found.into_iter().map(|d| led_by_the_user(d, sources)).collect()
}

/// A fault inside the library is shown at the user's own line first, then where the library stands.
pub(super) fn led_by_the_user(mut d: Diagnostic, sources: &Sources) -> Diagnostic {
    let library = |l: &Label| sources.get(l.span.file).is_some_and(|f| f.name.contains("::"));
    if !d.labels.iter().any(|l| l.primary && library(l)) {
        return d;
    }
    let Some(own) = d.labels.iter().position(|l| !library(l)) else { return d };
    for (i, label) in d.labels.iter_mut().enumerate() {
        label.primary = i == own;
    }
    let own = d.labels.remove(own);
    d.labels.insert(0, own);
    d
}
