//! A `recording.mcap` as a document. What the file holds is described in `docs/recording.md`.

mod file;
mod scene;
mod story;
mod tables;

use std::collections::BTreeMap;
use std::fmt;

use serde_json::Value;

use crate::document::{DOCUMENT_VERSION, Document};

/// Why a file cannot be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingError(String);

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for RecordingError {}

/// The first bytes of every such file.
const MAGIC: &[u8] = b"\x89MCAP";

/// Whether a file is one, by its first bytes.
pub fn is_recording(file: &[u8]) -> bool {
    file.starts_with(MAGIC)
}

/// A topic with its messages in the order of the file: time in s, and content.
struct Topic {
    name: String,
    /// What the file says of it: `unit FIELD`.
    metadata: BTreeMap<String, String>,
    messages: Vec<(f64, Value)>,
}

impl Topic {
    /// The unit of a field; empty where there is none.
    fn unit(&self, field: &str) -> &str {
        self.metadata.get(&format!("unit {field}")).map_or("", String::as_str)
    }
}

/// Reads a whole recording.
pub fn from_recording(file: &[u8]) -> Result<Document, RecordingError> {
    if !is_recording(file) {
        return Err(RecordingError("this is not an MCAP file".to_owned()));
    }
    let mut document = Document { version: DOCUMENT_VERSION, ..Document::default() };
    let file::Content { mut topics, texts, end } = file::read(file, &mut document)?;
    // By name, whatever the order in which they were declared.
    topics.sort_by(|a, b| a.name.cmp(&b.name));
    document.duration = Some(end);
    let owners = scene::read(&topics, &mut document);
    tables::read(&topics, &owners, &mut document);
    story::read(&topics, &texts, &mut document);
    if document.bodies.is_empty() && document.plan.is_empty() {
        return Err(RecordingError("this MCAP file has no `/scene` and no `/plan`: it is not of a run".to_owned()));
    }
    Ok(document)
}

/// The text under a key; empty where there is none.
fn text<'a>(of: &'a Value, key: &str) -> &'a str {
    of.get(key).and_then(Value::as_str).unwrap_or("")
}

/// The number under a key; 0 where there is none.
fn number(of: &Value, key: &str) -> f64 {
    of.get(key).and_then(Value::as_f64).unwrap_or(0.0)
}

/// The entries of the list under a key.
fn list<'a>(of: &'a Value, key: &str) -> &'a [Value] {
    of.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}
