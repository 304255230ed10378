//! The recording as an MCAP file: JSON messages, JSON schemas, times in ns of the virtual clock from 0.
//!
//! Opens in Foxglove as it is: the bench uses `foxglove.SceneUpdate` and `foxglove.FrameTransforms`, the log
//! `foxglove.Log`; everything else is plain numbers that its plots, tables and state time lines take by field name.

mod bench;
mod bodies;
mod foxglove;
mod replay;
mod robots;
mod schema;
mod spool;
mod story;
mod tables;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapResult, WriteOptions};
use serde::Serialize;
use serde_json::Value;

use super::run::{Run, TOOL};
use spool::{Message, Spool};

/// Uncompressed size at which a chunk is closed, bytes: small enough that a viewer loads what it shows.
const CHUNK: u64 = 256 * 1024;

/// Writes the whole recording. The same run gives the same bytes. What is more than memory should hold waits for its turn in
/// `folder`, in files that are gone when this ends.
pub fn write<W: Write + Seek>(run: &Run<'_>, out: W, folder: &Path) -> McapResult<()> {
    let mut options = WriteOptions::new().compression(Some(Compression::Lz4)).library(TOOL);
    options = options.chunk_size(Some(CHUNK));
    let mut sink = Sink { writer: options.create(out)?, messages: Spool::new(folder) };
    sink.metadata(run)?;
    sink.sources(run)?;
    tables::write(run, &mut sink)?;
    story::write(run, &mut sink)?;
    bench::write(run, &mut sink)?;
    sink.finish()
}

/// Collects messages by topic and writes them in order of time.
struct Sink<W: Write + Seek> {
    writer: mcap::Writer<W>,
    messages: Spool,
}

impl<W: Write + Seek> Sink<W> {
    /// Declares a topic; its schema is a JSON schema with the name as title.
    fn channel(
        &mut self,
        topic: &str,
        name: &str,
        schema: &Value,
        units: &BTreeMap<String, String>,
    ) -> McapResult<u16> {
        let id = self.writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
        self.writer.add_channel(id, topic, "json", units)
    }

    /// Adds a message that serde can write.
    fn push(&mut self, channel: u16, time: f64, message: &impl Serialize) -> McapResult<()> {
        let data = serde_json::to_vec(message).map_err(std::io::Error::other)?;
        self.push_bytes(channel, time, data)
    }

    /// Adds a message that is JSON already.
    fn push_bytes(&mut self, channel: u16, time: f64, data: Vec<u8>) -> McapResult<()> {
        Ok(self.messages.push(Message { time: nanoseconds(time), channel, data })?)
    }

    fn metadata(&mut self, run: &Run<'_>) -> McapResult<()> {
        let plan = &run.program.plan;
        let mut entries: BTreeMap<String, String> = BTreeMap::new();
        let mut set = |key: &str, value: String| entries.insert(key.to_owned(), value);
        set("workflow", plan.workflow.clone());
        set("lab", run.program.scene.lab.clone());
        set("seed", run.info.seed.to_string());
        set("fidelity", run.info.fidelity.name().to_owned());
        set("language", run.info.language.to_string());
        set("tool", TOOL.to_owned());
        for (name, value) in &plan.arguments {
            set(&format!("argument {name}"), value.clone());
        }
        self.writer.write_metadata(&Metadata { name: "matterix.run".into(), metadata: entries })
    }

    /// The text of every source file that is known.
    fn sources(&mut self, run: &Run<'_>) -> McapResult<()> {
        for (i, name) in run.program.files.iter().enumerate() {
            let Some(source) = run.sources.get(matterix_ir::FileId(i as u32)) else { continue };
            self.writer.attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: name.clone(),
                media_type: "text/x-matterix".into(),
                data: Cow::Borrowed(source.text.as_bytes()),
            })?;
        }
        Ok(())
    }

    /// Writes all messages, those of one instant in the order in which they were added.
    fn finish(self) -> McapResult<()> {
        let Sink { mut writer, messages } = self;
        let mut sequences: BTreeMap<u16, u32> = BTreeMap::new();
        messages.drain(|message| {
            let next = sequences.entry(message.channel).or_default();
            let header = MessageHeader {
                channel_id: message.channel,
                sequence: *next,
                log_time: message.time,
                publish_time: message.time,
            };
            *next = next.wrapping_add(1);
            writer.write_to_known_channel(&header, &message.data)
        })?;
        writer.finish().map(|_| ())
    }
}

/// Seconds as whole nanoseconds; what is not a time from 0 on counts as 0.
fn nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}
