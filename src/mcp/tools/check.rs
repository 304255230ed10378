//! The tool `check`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rmcp::schemars::JsonSchema;
use serde::Deserialize;

use super::Task;
use crate::args::Fidelity;
use crate::mcp::answer::Answer;
use crate::mcp::desk::Desk;
use crate::mcp::found::{Findings, judged, named, told};
use crate::pipeline::{self, Advice};

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Check {
    /// The file, from the folder of the server. Either this or `text`.
    path: Option<String>,
    /// A protocol that is in no file; it imports modules from the folder of the server.
    text: Option<String>,
    /// `motion` (if not given) also looks for what is out of reach of robots and what they run into; `process` does not and is faster.
    fidelity: Option<Fidelity>,
    /// Take warnings for errors, and show advice as warnings.
    #[serde(default)]
    strict: bool,
    /// Give up after so many seconds, 1 to 600; 60 if not given.
    #[schemars(range(min = 1, max = 600))]
    seconds: Option<u64>,
}

impl Task for Check {
    const NAME: &'static str = "check";
    const TITLE: &'static str = "Check a protocol";
    const ABOUT: &'static str = "Finds faults in a protocol (.mtx) without running it: syntax, names, units, amounts, overflows, order of operations, tips, chemistry, motions. Each finding has a code, the places that led to it, help, and often fixes with an `id` for the tool `fix`. Call it after every change.";
    type Data = Findings;

    fn limit(&self) -> Option<u64> {
        self.seconds
    }

    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String> {
        let input = desk.input(self.path.as_deref(), self.text.as_deref())?.until(stop);
        let fidelity = self.fidelity.unwrap_or(Fidelity::Motion);
        let (sources, found) = pipeline::check(&input, fidelity, Advice::Given, desk);
        let found = judged(named(&sources, found), self.strict);
        let (data, text) = told(&sources, &found);
        Answer::new(text, data)
    }
}
