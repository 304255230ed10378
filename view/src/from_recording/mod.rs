//! A `recording.mcap` as a document. What the file holds is described in `docs/recording.md`.

mod scene;
mod story;
mod tables;

use std::fmt;

pub use matterix_recording::is_recording;
use matterix_recording::{Topic, list, number, text};

use crate::document::{DOCUMENT_VERSION, Document, Source};

/// Why a file cannot be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingError(String);

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for RecordingError {}

/// Reads a whole recording.
pub fn from_recording(file: &[u8]) -> Result<Document, RecordingError> {
    let recording = matterix_recording::read(file).map_err(|damaged| RecordingError(damaged.0))?;
    let mut document = Document { version: DOCUMENT_VERSION, ..Document::default() };
    for (name, value) in recording.facts {
        match name.as_str() {
            "workflow" => document.workflow = value,
            "lab" => document.lab = value,
            _ => document.facts.push((name.strip_prefix("argument ").unwrap_or(&name).to_owned(), value)),
        }
    }
    let texts: Vec<Source> = recording.texts.into_iter().map(|(name, text)| Source { name, text }).collect();
    let mut topics = recording.topics;
    // By name, whatever the order in which they were declared.
    topics.sort_by(|a, b| a.name.cmp(&b.name));
    document.duration = Some(recording.end);
    let owners = scene::read(&topics, &mut document);
    tables::read(&topics, &owners, &mut document);
    story::read(&topics, &texts, &mut document);
    if document.bodies.is_empty() && document.plan.is_empty() {
        return Err(RecordingError(
            "this MCAP file has no `/scene` and no `/plan`: it is not the recording of a run".to_owned(),
        ));
    }
    Ok(document)
}
