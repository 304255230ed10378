//! A `recording.mcap` as topics of JSON messages. What they hold is described in `docs/recording.md`.

use std::collections::BTreeMap;
use std::fmt;

use mcap::records::{Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult, parse_record};
use serde_json::Value;

/// The first bytes of every such file.
const MAGIC: &[u8] = b"\x89MCAP";

/// More than LZ4 can make of one byte.
const EXPANSION: u64 = 256;

/// Whether a file is a recording, by its first bytes.
pub fn is_recording(file: &[u8]) -> bool {
    file.starts_with(MAGIC)
}

/// What a file holds.
#[derive(Debug, Default)]
pub struct Recording {
    /// In the order in which they were declared.
    pub topics: Vec<Topic>,
    /// Attached files, by name.
    pub texts: Vec<(String, String)>,
    /// What the run says of itself, by name.
    pub facts: BTreeMap<String, String>,
    /// Time of the last message, s.
    pub end: f64,
}

/// A topic with its messages in the order of the file: time in s, and content.
#[derive(Debug)]
pub struct Topic {
    /// As in `/tf`.
    pub name: String,
    /// What the file says of it: `unit FIELD`.
    pub metadata: BTreeMap<String, String>,
    /// Times in s.
    pub messages: Vec<(f64, Value)>,
}

/// What is wrong with a file, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damaged(pub String);

impl fmt::Display for Damaged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Damaged {}

/// Reads all records.
pub fn read(file: &[u8]) -> Result<Recording, Damaged> {
    if !is_recording(file) {
        return Err(Damaged("this is not an MCAP file".to_owned()));
    }
    let damaged = |e: McapError| Damaged(format!("the recording is damaged: {e}"));
    let options = LinearReaderOptions::default()
        .with_record_length_limit(largest(file).map_err(damaged)?)
        .with_validate_chunk_crcs(true);
    let mut content = Recording::default();
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
                    .map_err(|e| Damaged(format!("a message of `{}` is damaged: {e}", topic.name)))?;
                let time = header.log_time as f64 * 1e-9;
                content.end = content.end.max(time);
                topic.messages.push((time, message));
            }
            Record::Attachment { header, data, .. } => {
                content.texts.push((header.name, String::from_utf8_lossy(&data).into_owned()));
            }
            Record::Metadata(Metadata { name, metadata }) if name == "matterix.run" => content.facts.extend(metadata),
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

impl Topic {
    /// The unit of a field; empty where there is none.
    pub fn unit(&self, field: &str) -> &str {
        self.metadata.get(&format!("unit {field}")).map_or("", String::as_str)
    }
}

/// The text under a key; empty where there is none.
pub fn text<'a>(of: &'a Value, key: &str) -> &'a str {
    of.get(key).and_then(Value::as_str).unwrap_or("")
}

/// The number under a key; 0 where there is none.
pub fn number(of: &Value, key: &str) -> f64 {
    of.get(key).and_then(Value::as_f64).unwrap_or(0.0)
}

/// The entries of the list under a key; none where there is none.
pub fn list<'a>(of: &'a Value, key: &str) -> &'a [Value] {
    of.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}
