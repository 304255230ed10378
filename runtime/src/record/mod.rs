//! What a run leaves behind: a recording, tables, a page of plots and a report.
//!
//! [`Recording`] takes what the engine and the executor report; the writers read a finished [`Run`]. All output is a
//! function of the run alone: no clock, no order of hash maps.

pub(crate) mod column;
mod files;
mod folder;
mod frames;
mod history;
mod recording;
pub(crate) mod run;
mod sampler;
mod series;

pub mod mcap;
pub mod parquet;
pub mod plot;
pub mod report;
pub mod table;

use std::fmt::Display;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::thread;

pub use files::RecordError;
pub use folder::{Folder, give_up};
pub use recording::{
    EventMark, Expectation, Level, LogLine, ProcessMark, ReadingMark, RecordedValue, Recording, StepMark,
};
pub use report::{REPORT_SCHEMA, Report, human};
pub use run::{Failure, Place, Run, RunInfo, Status};
pub use sampler::Sampler;
pub use series::{ERROR, Series};

/// Which files [`write_all`] writes besides `report.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// `recording.mcap`.
    pub recording: bool,
    /// `states.parquet`, and `records.parquet` if anything was recorded.
    pub tables: bool,
    /// The same as CSV.
    pub csv: bool,
    /// `plot.svg`.
    pub plot: bool,
}

impl Outputs {
    /// All of them.
    pub const ALL: Outputs = Outputs { recording: true, tables: true, csv: true, plot: true };
}

/// Names of all files that a run may leave behind.
const NAMES: &[&str] =
    &["recording.mcap", "states.parquet", "records.parquet", "states.csv", "records.csv", "plot.svg", "report.json"];

/// Writes the files of a run into `dir`, which is made if need be, all or none; gives their paths.
pub fn write_all(dir: &Path, run: &Run<'_>, report: &Report, outputs: Outputs) -> Result<Vec<PathBuf>, RecordError> {
    let mut folder = Folder::begin(dir, NAMES)?;
    let mut put = |name: &'static str, bytes: Result<Vec<u8>, String>| {
        let bytes = bytes.map_err(|reason| RecordError::new(&dir.join(name), reason))?;
        folder.put(name, &bytes)
    };
    // The recording and the tables are the large ones: they are made side by side.
    let recording = || outputs.recording.then(|| mcap_bytes(run));
    let tables = || outputs.tables.then(|| bytes_of(|out| parquet::states(run, out)));
    let (recording, tables) = thread::scope(|scope| {
        let beside = thread::Builder::new().spawn_scoped(scope, recording);
        let tables = tables();
        // Where there is no thread to be had, this one does the work.
        let made = beside.ok().and_then(|thread| thread.join().ok());
        (made.unwrap_or_else(recording), tables)
    });
    if let Some(bytes) = recording {
        put("recording.mcap", bytes)?;
    }
    let is_recorded = !run.recording.values.is_empty();
    if let Some(bytes) = tables {
        put("states.parquet", bytes)?;
        if is_recorded {
            put("records.parquet", bytes_of(|out| parquet::records(run, out)))?;
        }
    }
    if outputs.csv {
        put("states.csv", bytes_of(|out| table::states(run, out)))?;
        if is_recorded {
            put("records.csv", bytes_of(|out| table::records(run, out)))?;
        }
    }
    if outputs.plot {
        put("plot.svg", plot::page(run).map(String::into_bytes).map_err(|e| e.to_string()))?;
    }
    put("report.json", report.json().map(String::into_bytes).map_err(|e| e.to_string()))?;
    folder.finish()
}

fn mcap_bytes(run: &Run<'_>) -> Result<Vec<u8>, String> {
    let mut out = Cursor::new(Vec::new());
    mcap::write(run, &mut out).map_err(|e| e.to_string())?;
    Ok(out.into_inner())
}

fn bytes_of<E: Display>(write: impl FnOnce(&mut Vec<u8>) -> Result<(), E>) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    write(&mut out).map_err(|e| e.to_string())?;
    Ok(out)
}
