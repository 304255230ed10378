//! The tool `plan`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use matterix_ir::{Diagnostic, Sources};
use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::Task;
use super::arguments::{bytes, options};
use crate::mcp::answer::{Answer, bounded, pruned};
use crate::mcp::desk::Desk;
use crate::mcp::found::{Findings, judged, named, told};
use crate::pipeline::{self, Search};

/// Columns of the chart.
const WIDTH: usize = 100;
/// Seconds of the search for a shorter schedule, where the call does not say.
const SEARCH: u64 = 10;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Plan {
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
    /// Where all randomness of the search starts; 0 if not given.
    #[serde(default)]
    seed: u64,
    /// How many seconds to look for a shorter schedule, 1 to 600; 10 if not given.
    #[schemars(range(min = 1, max = 600))]
    search: Option<u64>,
    /// The most that the answer may take, as text and as data; 60000 if not given.
    #[schemars(range(min = 1_000, max = 4_194_304))]
    bytes: Option<usize>,
}

/// A schedule.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Planned {
    /// The schedule as `plan --format json` writes it (resource `mtx://schedule`); null where there is none.
    schedule: Option<Map<String, Value>>,
    /// Members of the schedule that are left out because they are large: ask for more `bytes`.
    left_out: Vec<String>,
    /// What keeps it from being scheduled.
    #[serde(flatten)]
    findings: Findings,
}

impl Task for Plan {
    const NAME: &'static str = "plan";
    const TITLE: &'static str = "Schedule a workflow";
    const ABOUT: &'static str = "Finds the order in which the claiming blocks of a workflow take turns, so that it ends early: which step uses which instance when, and the total time.";
    type Data = Planned;

    /// What is not search takes time too.
    fn limit(&self) -> Option<u64> {
        Some(self.search.map_or(SEARCH + 50, |s| s.saturating_add(50).min(super::MOST_SECONDS)))
    }

    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String> {
        let bytes = bytes(self.bytes)?;
        let seconds = self.search.unwrap_or(SEARCH);
        if !(1..=super::MOST_SECONDS).contains(&seconds) {
            return Err(format!("`search` must be from 1 to {}", super::MOST_SECONDS));
        }
        let input = desk.input(self.path.as_deref(), self.text.as_deref())?.until(stop);
        let (sources, program, mut found) = pipeline::compile(&input, &options(self.workflow, self.lab, self.set));
        let wrong = found.iter().any(Diagnostic::is_error);
        let Some(program) = program.filter(|_| !wrong) else { return unplanned(&sources, found) };
        let search = Search::Clock { time: Duration::from_secs(seconds), seed: self.seed };
        let schedule = match pipeline::schedule(&program, search, stop) {
            Ok(schedule) => schedule,
            Err(why) => {
                found.push(*why);
                return unplanned(&sources, found);
            }
        };
        let (findings, said) = told(&sources, &judged(named(&sources, found), false));
        let json = pipeline::schedule_json(&schedule)?;
        let object: Map<String, Value> =
            serde_json::from_str(&json).map_err(|e| format!("the schedule cannot be written: {e}"))?;
        let (schedule_json, left_out) = pruned(object, bytes);
        let text = format!("{}\n{said}", pipeline::chart(&schedule, WIDTH));
        Answer::new(bounded(text, bytes), Planned { schedule: Some(schedule_json), left_out, findings })
    }
}

fn unplanned(sources: &Sources, found: Vec<Diagnostic>) -> Result<Answer, String> {
    let (findings, said) = told(sources, &judged(named(sources, found), false));
    let text = format!("no schedule: the protocol has errors:\n{said}");
    Answer::new(text, Planned { schedule: None, left_out: Vec::new(), findings })
}
