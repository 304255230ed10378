//! Arguments that several tools take.

use rmcp::schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

use crate::args;
use crate::pipeline::Options;

use crate::mcp::answer::{BYTES, MOST_BYTES};

/// How closely the motions of robots are looked at.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(crate = "rmcp::schemars", inline)]
pub enum Fidelity {
    /// Motions take their declared time.
    Process,
    /// Robots move through space, around what stands there.
    Motion,
}

impl From<Fidelity> for args::Fidelity {
    fn from(fidelity: Fidelity) -> Self {
        match fidelity {
            Fidelity::Process => args::Fidelity::Process,
            Fidelity::Motion => args::Fidelity::Motion,
        }
    }
}

/// A workflow with what it is given from outside, as the compiler takes it.
pub fn options(workflow: Option<String>, lab: Option<String>, set: BTreeMap<String, String>) -> Options {
    Options { workflow, lab, set: set.into_iter().collect(), ..Options::default() }
}

/// How many bytes an answer may take.
pub fn bytes(asked: Option<usize>) -> Result<usize, String> {
    match asked.unwrap_or(BYTES) {
        bytes if (1_000..=MOST_BYTES).contains(&bytes) => Ok(bytes),
        _ => Err(format!("`bytes` goes from 1000 to {MOST_BYTES}")),
    }
}
