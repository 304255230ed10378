//! What a deployment did, read off its journal.

use std::collections::BTreeMap;

use matterix_hardware::deploy::{Ending, Entry, Gate};
use matterix_ir::Diagnostic;
use matterix_runtime::exec::Verdict;
use serde::{Deserialize, Serialize};

use super::moment;

/// What a deployment was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The version of the program that carried it out.
    pub tool: String,
    /// The file of the workflow, below the folder of the program.
    pub main: String,
    /// The workflow, where the file has several.
    pub workflow: Option<String>,
    /// The lab, for a workflow that runs in any.
    pub lab: Option<String>,
    /// Parameters that were given.
    pub set: Vec<(String, String)>,
    /// `real`, `shadow`.
    pub mode: String,
    /// Seconds of lab time per second.
    pub speed: f64,
    /// Where the noise of the twin starts.
    pub seed: u64,
    /// Devices.
    pub devices: Vec<Bound>,
    /// What was measured of things.
    pub calibration: Vec<Gauge>,
}

/// A device as it was bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// Its name.
    pub name: String,
    /// Its driver; none where a person did it.
    pub driver: Option<String>,
    /// Where it was.
    pub place: Option<String>,
}

/// What was measured of a thing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gauge {
    /// `plate.offset_x`.
    pub of: String,
    /// As written.
    pub value: String,
}

/// What a deployment did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What it was given.
    pub about: About,
    /// In a word.
    pub status: String,
    /// Whether it came to its end with all expectations met or not observed.
    pub passed: bool,
    /// RFC 3339.
    pub begun: String,
    /// RFC 3339.
    pub ended: String,
    /// s.
    pub lab_time: f64,
    /// Digest of the plan and what it rests on.
    pub program: String,
    /// Processes that took part, and who began each.
    pub processes: Vec<Process>,
    /// What people were asked, and what they answered.
    pub questions: Vec<Question>,
    /// Who paused, stepped, went on or stopped.
    pub interventions: Vec<Intervention>,
    /// What was said to devices.
    pub commands: Vec<Command>,
    /// What devices told.
    pub readings: Vec<Reading>,
    /// Texts that devices told, such as serial numbers.
    pub texts: Vec<Text>,
    /// Questions that were put to a device once more.
    pub again: Vec<Again>,
    /// When the process stood still that carried it out.
    pub held_up: Vec<HeldUp>,
    /// How far the lab was behind the clock; none where it kept up.
    pub behind: Option<Behind>,
    /// Expectations.
    pub expectations: Vec<Expectation>,
    /// What went wrong.
    pub faults: Vec<Fault>,
    /// What was made safe after it, or could not be.
    pub made_safe: Vec<MadeSafe>,
}

/// A process.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Process {
    /// Its number on the machine.
    pub pid: u32,
    /// Who began it.
    pub who: String,
    /// RFC 3339.
    pub at: String,
    /// s.
    pub lab_time: f64,
}

/// A question.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Question {
    /// As it was put.
    pub text: String,
    /// RFC 3339.
    pub asked: String,
    /// s.
    pub lab_time: f64,
    /// Yes or no; none where nobody answered.
    pub yes: Option<bool>,
    /// Who answered.
    pub who: Option<String>,
    /// RFC 3339.
    pub answered: Option<String>,
}

/// What a person did beside answering.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Intervention {
    /// `pause`, `step`, `go`, `stop`.
    pub what: String,
    /// Who.
    pub who: String,
    /// RFC 3339.
    pub at: String,
    /// s.
    pub lab_time: f64,
}

/// What was said to a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Command {
    /// s.
    pub lab_time: f64,
    /// The step.
    pub step: String,
    /// `FILE:LINE:COLUMN`.
    pub at: String,
    /// The device.
    pub device: String,
    /// What was sent.
    pub sends: Vec<String>,
    /// `done`, what failed, or `unknown`.
    pub outcome: String,
}

/// What a device told of a quantity, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reading {
    /// Which.
    pub name: String,
    /// How often.
    pub count: u64,
    /// The first value.
    pub first: f64,
    /// The last.
    pub last: f64,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
}

/// A text that a device told.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Text {
    /// s.
    pub lab_time: f64,
    /// The device.
    pub device: String,
    /// What its driver calls it.
    pub name: String,
    /// As it was told.
    pub text: String,
}

/// A question that was put to a device once more.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Again {
    /// s.
    pub lab_time: f64,
    /// The device.
    pub device: String,
    /// Why.
    pub why: String,
}

/// A time in which the process stood still.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldUp {
    /// s.
    pub lab_time: f64,
    /// By the clock, s.
    pub seconds: f64,
}

/// Times that the lab went over at once, because it was behind the clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Behind {
    /// How many.
    pub count: u64,
    /// All together, s.
    pub total: f64,
    /// The longest, s.
    pub longest: f64,
    /// When the longest began, s.
    pub at: f64,
}

/// An expectation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Expectation {
    /// As written.
    pub text: String,
    /// s.
    pub lab_time: f64,
    /// How it was judged.
    pub verdict: Verdict,
}

/// What went wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// s.
    pub lab_time: f64,
    /// The code.
    pub code: String,
    /// In words.
    pub text: String,
}

/// A device after a deployment that did not end well.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MadeSafe {
    /// Its name.
    pub device: String,
    /// Why it could not be made safe.
    pub trouble: Option<String>,
}

/// Where rows of a report are that later entries are about.
#[derive(Debug, Default)]
struct Rows {
    /// By number of the operation.
    commands: BTreeMap<u64, usize>,
    /// By number of the question.
    asked: BTreeMap<u64, usize>,
    /// By name.
    readings: BTreeMap<String, usize>,
}

impl Report {
    /// Of a journal and of what came of the plan.
    pub fn of(about: About, entries: &[Entry], ending: &Ending) -> Report {
        let mut report = Report::empty(about, ending.passed);
        let mut rows = Rows::default();
        for entry in entries {
            report.take(entry, &mut rows);
        }
        if report.ended.is_empty() {
            report.break_off(entries, ending);
        }
        let all = ending.execution.iter().flat_map(|e| &e.expectations);
        report.expectations =
            all.map(|e| Expectation { text: e.text.clone(), lab_time: e.time, verdict: e.verdict }).collect();
        report
    }

    /// The journal has no end, as it could not be written any more: what is known of it besides.
    fn break_off(&mut self, entries: &[Entry], ending: &Ending) {
        self.ended = "unknown".to_owned();
        self.lab_time = ending.end.unwrap_or_default().max(entries.last().map_or(0.0, Entry::time));
        let wrong = ending.diagnostics.iter().filter(|d| d.is_error());
        let fault =
            |d: &Diagnostic| Fault { lab_time: self.lab_time, code: d.code.name.to_owned(), text: d.headline.clone() };
        self.faults.extend(wrong.map(fault).collect::<Vec<_>>());
    }

    fn empty(about: About, passed: bool) -> Report {
        Report {
            about,
            status: "not ended".to_owned(),
            passed,
            begun: String::new(),
            ended: String::new(),
            lab_time: 0.0,
            program: String::new(),
            processes: Vec::new(),
            questions: Vec::new(),
            interventions: Vec::new(),
            commands: Vec::new(),
            readings: Vec::new(),
            texts: Vec::new(),
            again: Vec::new(),
            held_up: Vec::new(),
            behind: None,
            expectations: Vec::new(),
            faults: Vec::new(),
            made_safe: Vec::new(),
        }
    }

    fn take(&mut self, entry: &Entry, rows: &mut Rows) {
        match entry {
            Entry::Begin { digest, wall, pid, who, .. } => {
                (self.begun, self.program) = (moment(*wall), digest.clone());
                self.processes.push(Process { pid: *pid, who: who.clone(), at: moment(*wall), lab_time: 0.0 });
            }
            Entry::Resumed { t, wall, pid, who } => {
                self.processes.push(Process { pid: *pid, who: who.clone(), at: moment(*wall), lab_time: *t });
            }
            Entry::Asked { t, ticket, text, wall, .. } => {
                rows.asked.insert(*ticket, self.questions.len());
                let (yes, who, answered) = (None, None, None);
                self.questions.push(Question {
                    text: text.clone(),
                    asked: moment(*wall),
                    lab_time: *t,
                    yes,
                    who,
                    answered,
                });
            }
            Entry::Answered { ticket, yes, who, wall, .. } => {
                let question = rows.asked.get(ticket).and_then(|i| self.questions.get_mut(*i));
                if let Some(question) = question {
                    (question.yes, question.who) = (Some(*yes), Some(who.clone()));
                    question.answered = Some(moment(*wall));
                }
            }
            Entry::Gate { t, to, who, wall } => {
                let what = match to {
                    Gate::Go => "go",
                    Gate::Pause => "pause",
                    Gate::Step => "step",
                };
                self.intervened(what, who, *wall, *t);
            }
            Entry::Stop { t, who, wall } => self.intervened("stop", who, *wall, *t),
            Entry::Starting { t, ticket, label, span, device, sends, .. } => {
                rows.commands.insert(*ticket, self.commands.len());
                self.commands.push(Command {
                    lab_time: *t,
                    step: label.clone(),
                    at: span.clone(),
                    device: device.clone(),
                    sends: sends.clone(),
                    outcome: "unknown".to_owned(),
                });
            }
            Entry::Started { ticket, .. } => self.came_to(rows.commands.get(ticket), "done".to_owned()),
            Entry::Ended { ticket, failed: Some((name, text)), .. } => {
                self.came_to(rows.commands.get(ticket), format!("{name}: {text}"));
            }
            Entry::Told { name, value, .. } | Entry::ReadBack { name, value, .. } => self.told(name, *value, rows),
            Entry::Kept { t, device, word, text } => {
                let (device, name, text) = (device.clone(), word.clone(), text.clone());
                self.texts.push(Text { lab_time: *t, device, name, text });
            }
            Entry::Again { t, device, why } => {
                self.again.push(Again { lab_time: *t, device: device.clone(), why: why.clone() });
            }
            Entry::Leap { t, to } | Entry::Late { t, to, .. } => self.leapt(*t, to - t),
            Entry::HeldUp { t, seconds } => self.held_up.push(HeldUp { lab_time: *t, seconds: *seconds }),
            Entry::Fault { t, code, text, .. } => {
                self.faults.push(Fault { lab_time: *t, code: code.clone(), text: text.clone() });
            }
            Entry::Safe { device, trouble, .. } => {
                self.made_safe.push(MadeSafe { device: device.clone(), trouble: trouble.clone() });
            }
            Entry::End { t, status, wall, .. } => {
                (self.status, self.ended, self.lab_time) = (status.clone(), moment(*wall), *t);
            }
            Entry::Ended { .. }
            | Entry::Bound { .. }
            | Entry::Looked { .. }
            | Entry::Opened { .. }
            | Entry::Clock { .. }
            | Entry::Out { .. }
            | Entry::Back { .. } => {}
        }
    }

    fn intervened(&mut self, what: &str, who: &str, wall: f64, lab_time: f64) {
        let (what, who, at) = (what.to_owned(), who.to_owned(), moment(wall));
        self.interventions.push(Intervention { what, who, at, lab_time });
    }

    fn came_to(&mut self, command: Option<&usize>, outcome: String) {
        if let Some(command) = command.and_then(|i| self.commands.get_mut(*i)) {
            command.outcome = outcome;
        }
    }

    fn leapt(&mut self, at: f64, took: f64) {
        let behind = self.behind.get_or_insert(Behind { count: 0, total: 0.0, longest: 0.0, at });
        behind.count += 1;
        behind.total += took;
        if took > behind.longest {
            (behind.longest, behind.at) = (took, at);
        }
    }

    fn told(&mut self, name: &str, value: f64, rows: &mut Rows) {
        if let Some(r) = rows.readings.get(name).and_then(|at| self.readings.get_mut(*at)) {
            r.count += 1;
            (r.last, r.least, r.greatest) = (value, r.least.min(value), r.greatest.max(value));
            return;
        }
        rows.readings.insert(name.to_owned(), self.readings.len());
        let name = name.to_owned();
        self.readings.push(Reading { name, count: 1, first: value, last: value, least: value, greatest: value });
    }

    /// As JSON.
    pub fn json(&self) -> Result<String, String> {
        let text = serde_json::to_string_pretty(self).map_err(|e| format!("cannot write the report: {e}"))?;
        Ok(text + "\n")
    }
}
