//! The tool `format`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Task;
use crate::files;
use crate::mcp::answer::Answer;
use crate::mcp::desk::Desk;
use crate::mcp::found::{Findings, named, told};
use crate::pipeline;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Format {
    /// The file, from the folder of the server. Either this or `text`.
    path: Option<String>,
    /// A protocol that is in no file.
    text: Option<String>,
    /// Write the file; without it the new text is returned and nothing is written.
    #[serde(default)]
    write: bool,
}

/// A text in the one style.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Formatted {
    /// The text; null where it has mistakes of syntax.
    text: Option<String>,
    /// Whether it differs from what was given.
    changed: bool,
    /// Whether the file was written.
    written: bool,
    /// What keeps it from being formatted.
    #[serde(flatten)]
    left: Findings,
}

impl Task for Format {
    const NAME: &'static str = "format";
    const TITLE: &'static str = "Format a protocol";
    const ABOUT: &'static str = "Formats a protocol: blanks, indentation, empty lines. Returns the new text; writes the file only with `write: true`.";
    const WRITES: bool = true;
    type Data = Formatted;

    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String> {
        let input = desk.input(self.path.as_deref(), self.text.as_deref())?.until(stop);
        if self.write && self.path.is_none() {
            return Err("a `text` has no file to write; give its `path`".to_string());
        }
        let text = match pipeline::format(&input) {
            Ok(text) => text,
            Err((sources, found)) => {
                let (left, said) = told(&sources, &named(&sources, found));
                return Answer::new(said, Formatted { text: None, changed: false, written: false, left });
            }
        };
        let changed = text.as_bytes() != input.bytes;
        let written = self.write && changed;
        if let Some(path) = self.path.filter(|_| written) {
            files::replace(&desk.place(&path)?, &text)?;
        }
        let left = Findings { errors: 0, warnings: 0, findings: Vec::new() };
        let said = match (written, changed) {
            (true, _) => "formatted\n".to_string(),
            (false, true) => text.clone(),
            (false, false) => "it is already formatted\n".to_string(),
        };
        Answer::new(said, Formatted { text: Some(text), changed, written, left })
    }
}
