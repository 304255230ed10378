//! The tool `run`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::{Diagnostic, Sources};
use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::Task;
use super::arguments::{bytes, options};
use crate::args::{Reality, RunFidelity, perturbation, really};
use crate::mcp::answer::{Answer, bounded, pruned};
use crate::mcp::desk::Desk;
use crate::mcp::found::{Findings, judged, named, told};
use crate::pipeline;
use crate::progress::{Kind, Progress};

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Run {
    /// The file, from the folder of the server. Either this or `text`.
    path: Option<String>,
    /// A protocol that is in no file.
    text: Option<String>,
    /// The workflow, where there are several.
    workflow: Option<String>,
    /// The lab, for a workflow that runs in any.
    lab: Option<String>,
    /// Parameters of the workflow, as written in the language: `{"target": "40 degC"}`.
    #[serde(default)]
    set: BTreeMap<String, String>,
    /// Where all randomness of the run starts; 0 if not given.
    #[serde(default)]
    seed: u64,
    /// How closely motions are simulated; `process` if not given.
    fidelity: Option<RunFidelity>,
    /// Moves what can be gripped and stands freely by up to so much each way, as the seed has it: `20mm,10deg`.
    perturb: Option<String>,
    /// Lets the same things really be so far from where robots take them to be: `2mm,1deg`, with `motion` or `contact`.
    unseen: Option<String>,
    /// Lets friction and the force of grips really be such a share of what is said: `friction=0.2,grip=0.5`, with `contact`.
    really: Option<String>,
    /// Only these members of the report, as `expectations` or `contents`; all that fit if not given.
    members: Option<Vec<String>>,
    /// The most that the answer may take, as text and as data; 60000 if not given.
    #[schemars(range(min = 1_000, max = 4_194_304))]
    bytes: Option<usize>,
    /// Stop after so many seconds, 1 to 600; 60 if not given.
    #[schemars(range(min = 1, max = 600))]
    seconds: Option<u64>,
}

/// How a run ended.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Ended {
    /// Whether it came to its end and every expectation held.
    passed: bool,
    /// The contents of `report.json` (resource `mtx://report`); null where the protocol has errors and was not run.
    report: Option<Map<String, Value>>,
    /// Members of the report that are left out because they are large: ask for them with `members`, or for more `bytes`.
    left_out: Vec<String>,
    /// What is wrong with the protocol, or what went wrong.
    #[serde(flatten)]
    findings: Findings,
}

impl Task for Run {
    const NAME: &'static str = "run";
    const TITLE: &'static str = "Run on the digital twin";
    const ABOUT: &'static str = "Simulates a workflow on the digital twin (no device is used) and judges its expectations. Returns the report: status, expectations with measured values, contents at the end, failures and their places.";
    type Data = Ended;

    fn limit(&self) -> Option<u64> {
        self.seconds
    }

    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String> {
        let bytes = bytes(self.bytes)?;
        let input = desk.input(self.path.as_deref(), self.text.as_deref())?.until(stop);
        let reality = self.reality()?;
        let (sources, program, mut found) = pipeline::compile(&input, &options(self.workflow, self.lab, self.set));
        let Some(mut program) = program.filter(|_| !is_wrong(&found)) else { return unrun(&sources, found) };
        let choices = reality.draw(&mut program, self.seed)?;
        found.extend(reality.look(&program, desk));
        if is_wrong(&found) {
            return unrun(&sources, found);
        }
        let mut progress = Progress::new(&program.plan, Kind::Quiet);
        let ran = pipeline::run(&program, &sources, &choices, stop, &mut progress);
        found.extend(ran.diagnostics.iter().cloned());
        let (findings, said) = told(&sources, &judged(named(&sources, found), false));
        let mut text = format!("{}\n{said}", ran.page());
        if stop.load(Ordering::SeqCst) {
            text = format!("the run was stopped at its time limit; `seconds` may be up to 600\n{text}");
        }
        let (report, left_out) = pruned(members(&ran.json()?, self.members.as_deref())?, bytes);
        if !left_out.is_empty() {
            text += &format!("members of the report that are too large to send: {}\n", left_out.join(", "));
        }
        Answer::new(bounded(text, bytes), Ended { passed: ran.passed, report: Some(report), left_out, findings })
    }
}

impl Run {
    /// How closely it is simulated and how the lab really is, as a command line has it.
    fn reality(&self) -> Result<Reality, String> {
        let read = |name: &str, why: String| format!("`{name}`: {why}");
        let moved = |name: &str, text: &Option<String>| {
            text.as_deref().map(perturbation).transpose().map_err(|why| read(name, why))
        };
        let reality = Reality {
            fidelity: self.fidelity.unwrap_or(RunFidelity::Process),
            perturb: moved("perturb", &self.perturb)?,
            unseen: moved("unseen", &self.unseen)?,
            really: self.really.as_deref().map(really).transpose().map_err(|why| read("really", why))?,
        };
        reality.agrees(false)?;
        Ok(reality)
    }
}

fn is_wrong(found: &[Diagnostic]) -> bool {
    found.iter().any(Diagnostic::is_error)
}

fn unrun(sources: &Sources, found: Vec<Diagnostic>) -> Result<Answer, String> {
    let (findings, said) = told(sources, &judged(named(sources, found), false));
    let text = format!("the protocol was not run because it has errors:\n{said}");
    Answer::new(text, Ended { passed: false, report: None, left_out: Vec::new(), findings })
}

/// The members of a report that are asked for.
fn members(report: &str, wanted: Option<&[String]>) -> Result<Map<String, Value>, String> {
    let report: Map<String, Value> =
        serde_json::from_str(report).map_err(|e| format!("the report cannot be written: {e}"))?;
    let Some(wanted) = wanted else { return Ok(report) };
    if let Some(unknown) = wanted.iter().find(|w| !report.contains_key(*w)) {
        let names: Vec<&str> = report.keys().map(String::as_str).collect();
        return Err(format!("a report has no member `{unknown}`; use {}", names.join(", ")));
    }
    Ok(report.into_iter().filter(|(name, _)| wanted.contains(name)).collect())
}
