//! Arguments that several tools take.

use std::collections::BTreeMap;

use crate::pipeline::Options;

use crate::mcp::answer::{BYTES, MOST_BYTES};

/// A workflow with what it is given from outside, as the compiler takes it.
pub fn options(workflow: Option<String>, lab: Option<String>, set: BTreeMap<String, String>) -> Options {
    Options { workflow, lab, set: set.into_iter().collect(), ..Options::default() }
}

/// How many bytes an answer may take.
pub fn bytes(asked: Option<usize>) -> Result<usize, String> {
    match asked.unwrap_or(BYTES) {
        bytes if (1_000..=MOST_BYTES).contains(&bytes) => Ok(bytes),
        _ => Err(format!("`bytes` must be from 1000 to {MOST_BYTES}")),
    }
}
