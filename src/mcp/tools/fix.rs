//! The tool `fix`.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::Fix;
use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Task;
use crate::args::Fidelity;
use crate::files;
use crate::mcp::answer::Answer;
use crate::mcp::desk::Desk;
use crate::mcp::found::{Findings, judged, named, told};
use crate::pipeline::{self, Advice, Fixes, Input, Mended, Mending};

/// Which corrections are made.
#[derive(Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(crate = "rmcp::schemars", inline)]
pub enum Which {
    /// Those that leave no doubt what was meant.
    Sure,
    /// What was probably meant as well: names that are near, brackets. To be read afterwards. Of corrections that exclude each
    /// other, as of a label and its recipe, none is made: give the `id` of one.
    All,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct FixTask {
    /// The file, from the folder of the server. Either this or `text`.
    path: Option<String>,
    /// A protocol that is in no file.
    text: Option<String>,
    /// Corrections of the last `check` of this very text by their `id`, which do not overlap. Either this or `which`.
    ids: Option<Vec<String>>,
    /// All corrections of a kind, again and again until none is left.
    which: Option<Which>,
    /// Write the file; without it the new text is returned and nothing is written.
    #[serde(default)]
    write: bool,
    /// As for `check`; the same gives the same findings.
    fidelity: Option<Fidelity>,
    /// Give up after so many seconds, 1 to 600; 60 if not given.
    #[schemars(range(min = 1, max = 600))]
    seconds: Option<u64>,
}

/// A correction that was made.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Done {
    /// Line, as it was then, from 1.
    line: usize,
    /// Column, from 1.
    column: usize,
    /// What was done.
    title: String,
}

/// A text after its corrections.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Fixed {
    /// What was done, in this order.
    applied: Vec<Done>,
    /// Whether the file was written.
    written: bool,
    /// The text as it is now.
    text: String,
    /// What is still to be mended, with corrections of the new text.
    #[serde(flatten)]
    left: Findings,
}

impl Task for FixTask {
    const NAME: &'static str = "fix";
    const TITLE: &'static str = "Apply fixes";
    const ABOUT: &'static str = "Applies fixes that `check` offers: chosen ones by their ids, or `which: sure` (safe ones only) or `which: all` (guesses too, to be read afterwards). Returns the new text and its remaining findings; writes the file only with `write: true`.";
    const WRITES: bool = true;
    type Data = Fixed;

    fn limit(&self) -> Option<u64> {
        self.seconds
    }

    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String> {
        let input = desk.input(self.path.as_deref(), self.text.as_deref())?.until(stop);
        if self.write && self.path.is_none() {
            return Err("a `text` has no file to write; give its `path`".to_string());
        }
        let fidelity = self.fidelity.unwrap_or(Fidelity::Motion);
        let Mending { input: mended, done, sources, found } = match (&self.ids, self.which) {
            (Some(ids), None) => chosen(input, ids, fidelity, desk)?,
            (None, Some(Which::Sure)) => pipeline::mend(input, Fixes::Sure, fidelity, desk),
            (None, Some(Which::All)) => pipeline::mend(input, Fixes::All, fidelity, desk),
            _ => return Err("give either `ids` or `which`".to_string()),
        };
        if stop.load(Ordering::SeqCst) {
            return Err("the time ran out before all fixes were checked; nothing was written".to_string());
        }
        let (left, found) = told(&sources, &judged(named(&sources, found), false));
        let text = String::from_utf8(mended.bytes).map_err(|_| "the file is not text in UTF-8".to_string())?;
        let written = self.write && !done.is_empty();
        if let Some(path) = self.path.filter(|_| written) {
            files::replace(&desk.place(&path)?, &text)?;
        }
        let applied: Vec<Done> =
            done.into_iter().map(|Mended { at: (line, column), title }| Done { line, column, title }).collect();
        let mut said: String =
            applied.iter().map(|d| format!("{}:{}: fixed: {}\n", d.line, d.column, d.title)).collect();
        if said.is_empty() {
            said = "nothing was changed\n".to_string();
        }
        let mut answer = Answer::new(said + "\n" + &found, Fixed { applied, written, text: text.clone(), left })?;
        if !written {
            answer.texts.push(text);
        }
        Ok(answer)
    }
}

/// A text after the corrections that have these names.
fn chosen(input: Input, ids: &[String], fidelity: Fidelity, desk: &Desk) -> Result<Mending, String> {
    let (sources, found) = pipeline::check(&input, fidelity, Advice::Given, desk);
    let found = named(&sources, found);
    let offered: Vec<(&String, &Fix)> = found.iter().flat_map(|n| n.ids.iter().zip(&n.diagnostic.fixes)).collect();
    let mut fixes = Vec::new();
    let asked: BTreeSet<&String> = ids.iter().collect();
    for id in asked {
        let Some((_, fix)) = offered.iter().find(|(name, _)| *name == id) else {
            return Err(format!("this text has no fix `{id}` now; `check` lists the available ones"));
        };
        fixes.push(*fix);
    }
    let (input, done) = pipeline::correct(input, &sources, &fixes)?;
    let (sources, found) = pipeline::check(&input, fidelity, Advice::Given, desk);
    Ok(Mending { input, done, sources, found })
}
