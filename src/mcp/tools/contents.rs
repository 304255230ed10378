//! The tool `contents`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use matterix_ir::Sources;
use matterix_ir::points::Points;
use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::Task;
use super::arguments::bytes;
use crate::mcp::answer::{Answer, bounded};
use crate::mcp::desk::Desk;
use crate::mcp::found::{Findings, judged, named, told};
use crate::pipeline;
use crate::report::points::{self, Found, Place};

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Contents {
    /// The file, from the folder of the server. Either this or `text`.
    path: Option<String>,
    /// A protocol that is in no file.
    text: Option<String>,
    /// Only what is known after the statement on this line, counted from 1, but all of it; without it what every statement changes.
    #[schemars(range(min = 1))]
    line: Option<usize>,
    /// With `line`, the innermost statement at this column, counted from 1.
    #[schemars(range(min = 1))]
    column: Option<usize>,
    /// The most that the answer may take, as text and as data; 60000 if not given.
    #[schemars(range(min = 1_000, max = 4_194_304))]
    bytes: Option<usize>,
    /// Give up after so many seconds, 1 to 600; 60 if not given.
    #[schemars(range(min = 1, max = 600))]
    seconds: Option<u64>,
}

/// What is known at the statements of a text.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Known {
    /// One entry per workflow, as `check --contents --format json` writes them (resource `mtx://contents`).
    #[schemars(with = "Vec<Map<String, Value>>")]
    workflows: Vec<Value>,
    /// Workflows whose entry would be too large: ask for a `line`, or for more `bytes`.
    left_out: Vec<String>,
    /// What is wrong with the text.
    #[serde(flatten)]
    findings: Findings,
}

impl Task for Contents {
    const NAME: &'static str = "contents";
    const TITLE: &'static str = "Show the known state at each statement";
    const ABOUT: &'static str = "Shows, without a run, the state that the checks know after each statement of a workflow: contents and temperatures of vessels, states of devices, tips, things in grippers, elapsed time. With `line`, everything that is known there. Use it to find the cause of a finding.";
    type Data = Known;

    fn limit(&self) -> Option<u64> {
        self.seconds
    }

    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String> {
        let bytes = bytes(self.bytes)?;
        let place = place(self.line, self.column)?;
        let input = desk.input(self.path.as_deref(), self.text.as_deref())?.until(stop);
        let (sources, found, known) = pipeline::contents(&input);
        let (findings, mut said) = told(&sources, &judged(named(&sources, found), false));
        let shown = chosen(&known, place, &sources)?;
        if shown.is_empty() {
            said += "no state is known: the file has no workflow, or none could be followed\n";
        }
        let (mut workflows, mut left_out, mut taken) = (Vec::new(), Vec::new(), 0);
        for (points, only) in shown {
            said += "\n";
            said += &match only {
                None => points::table(points, &sources),
                Some(index) => points::all(points, index, &sources),
            };
            let line = points::json(points, only, &sources);
            taken += line.len();
            let object: Value =
                serde_json::from_str(&line).map_err(|e| format!("the answer cannot be written: {e}"))?;
            match taken <= bytes {
                true => workflows.push(object["contents"].clone()),
                false => left_out.push(points.workflow.clone()),
            }
        }
        Answer::new(bounded(said, bytes), Known { workflows, left_out, findings })
    }
}

fn place(line: Option<usize>, column: Option<usize>) -> Result<Option<Place>, String> {
    let text = match (line, column) {
        (None, None) => return Ok(None),
        (Some(line), None) => line.to_string(),
        (Some(line), Some(column)) => format!("{line}:{column}"),
        (None, Some(_)) => return Err("`column` needs a `line`".to_string()),
    };
    text.parse().map(Some).map_err(|_| "`line` and `column` count from 1".to_string())
}

/// Workflows with the statement at a place, or all of each.
fn chosen<'p>(
    known: &'p [Points],
    place: Option<Place>,
    sources: &Sources,
) -> Result<Vec<(&'p Points, Option<usize>)>, String> {
    let Some(place) = place else { return Ok(known.iter().map(|p| (p, None)).collect()) };
    let (mut shown, mut missed) = (Vec::new(), None);
    for points in known {
        match points::find(points, place, sources) {
            Found::Statement(index) => shown.push((points, Some(index))),
            Found::NoLine(lines) => missed = missed.or(Some(format!("the text has {lines} lines"))),
            Found::Nothing(before, after) => {
                let near: Vec<String> = before.into_iter().chain(after).map(|l| l.to_string()).collect();
                let near = if near.is_empty() {
                    String::new()
                } else {
                    format!("; the nearest are at {}", near.join(" and "))
                };
                missed = missed.or(Some(format!("no statement of a workflow is at this place{near}")));
            }
        }
    }
    match missed {
        Some(missed) if shown.is_empty() => Err(missed),
        _ => Ok(shown),
    }
}
