//! The tool `explain`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Task;
use crate::command::explanation;
use crate::mcp::answer::Answer;
use crate::mcp::desk::Desk;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Explain {
    /// A code such as `unit-mismatch`, or a family such as `U1`; without it all codes are listed.
    code: Option<String>,
}

/// What is known of a code.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Explained {
    /// The page, in Markdown: what it means, an example with the mistake, the same mended.
    page: String,
}

impl Task for Explain {
    const NAME: &'static str = "explain";
    const TITLE: &'static str = "Explain a code";
    const ABOUT: &'static str =
        "Explains the code of a finding: its meaning, an example with the mistake, and the fixed example.";
    type Data = Explained;

    fn perform(self, _: &Desk, _: &Arc<AtomicBool>) -> Result<Answer, String> {
        let page = explanation(self.code.as_deref())
            .map_err(|help| format!("unknown diagnostic code `{}`; {help}", self.code.unwrap_or_default()))?;
        Answer::new(page.clone(), Explained { page })
    }
}
