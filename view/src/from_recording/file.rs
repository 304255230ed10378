//! The records of an MCAP file, read without trusting what it claims of its lengths.

use std::collections::BTreeMap;

use mcap::records::{Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult, parse_record};

use super::{RecordingError, Topic};
use crate::document::{Document, Source};

/// More than LZ4 can make of one byte.
const EXPANSION: u64 = 256;

/// What a file holds.
#[derive(Default)]
pub(super) struct Content {
    /// In the order in which they were declared.
    pub(super) topics: Vec<Topic>,
    /// Attached files.
    pub(super) texts: Vec<Source>,
    /// Time of the last message, s.
    pub(super) end: f64,
}

/// Reads all records; what the run says of itself goes into the document.
pub(super) fn read(file: &[u8], document: &mut Document) -> Result<Content, RecordingError> {
    let damaged = |e: McapError| RecordingError(format!("the recording is damaged: {e}"));
    let options = LinearReaderOptions::default()
        .with_record_length_limit(largest(file).map_err(damaged)?)
        .with_validate_chunk_crcs(true);
    let mut content = Content::default();
    let mut by_channel: BTreeMap<u16, usize> = BTreeMap::new();
    let mut reader = LinearReader::new_with_options(options);
    let mut rest = file;
    while let Some(event) = reader.next_event() {
        let record = match event.map_err(damaged)? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (next, after) = rest.split_at(wanted.min(rest.len()));
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                rest = after;
                continue;
            }
            LinearReadEvent::Record { data, opcode } => parse_record(opcode, data).map_err(damaged)?,
        };
        match record {
            Record::Channel(channel) if channel.message_encoding == "json" => {
                by_channel.entry(channel.id).or_insert_with(|| {
                    let (name, metadata) = (channel.topic, channel.metadata);
                    content.topics.push(Topic { name, metadata, messages: Vec::new() });
                    content.topics.len() - 1
                });
            }
            Record::Message { header, data } => {
                let Some(topic) = by_channel.get(&header.channel_id).map(|&i| &mut content.topics[i]) else { continue };
                let message = serde_json::from_slice(&data)
                    .map_err(|e| RecordingError(format!("a message of `{}` is damaged: {e}", topic.name)))?;
                let time = header.log_time as f64 * 1e-9;
                content.end = content.end.max(time);
                topic.messages.push((time, message));
            }
            Record::Attachment { header, data, .. } => {
                let text = String::from_utf8_lossy(&data).into_owned();
                content.texts.push(Source { name: header.name, text });
            }
            Record::Metadata(Metadata { name, metadata }) if name == "matterix.run" => {
                for (name, value) in metadata {
                    match name.as_str() {
                        "workflow" => document.workflow = value,
                        "lab" => document.lab = value,
                        _ => document.facts.push((name.strip_prefix("argument ").unwrap_or(&name).to_owned(), value)),
                    }
                }
            }
            _ => {}
        }
    }
    Ok(content)
}

/// The length that no record has more than: that of the file, or of its largest chunk. A chunk that claims to be larger
/// than it can be is refused, since memory is set aside by what is claimed.
fn largest(file: &[u8]) -> McapResult<usize> {
    let mut largest = file.len();
    for record in mcap::read::LinearReader::new(file)? {
        if let Record::Chunk { header, data } = record? {
            let claimed = header.uncompressed_size;
            if claimed > EXPANSION * (data.len() as u64 + 1) {
                return Err(McapError::ChunkTooLarge(claimed));
            }
            largest = largest.max(usize::try_from(claimed).map_err(|_| McapError::ChunkTooLarge(claimed))?);
        }
    }
    Ok(largest)
}
