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
mod taken;

pub mod mcap;
pub mod parquet;
pub mod plot;
pub mod report;
pub mod table;

use std::io::Write;
use std::path::{Path, PathBuf};

pub use files::RecordError;
pub use folder::{Folder, give_up};
pub use recording::{EventMark, Expectation, Level, LogLine, ProcessMark, ReadingMark, Recording, StepMark};
pub use report::{REPORT_SCHEMA, Report, human};
pub use run::{Failure, Place, Run, RunInfo, Status};
pub use sampler::Sampler;
pub use series::{ERROR, Series};
pub use taken::{Record, RecordedValue, Taken};

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

const RECORDING: &str = "recording.mcap";
const STATES: &str = "states.parquet";
const RECORDS: &str = "records.parquet";
const STATES_CSV: &str = "states.csv";
const RECORDS_CSV: &str = "records.csv";
const PLOT: &str = "plot.svg";
const REPORT: &str = "report.json";

/// Names of all files that a run may leave behind; the last one is written last.
const NAMES: &[&str] = &[RECORDING, STATES, RECORDS, STATES_CSV, RECORDS_CSV, PLOT, REPORT];

/// Writes the files of a run into `dir`, which is made if need be, all or none; gives their paths.
pub fn write_all(dir: &Path, run: &Run<'_>, report: &Report, outputs: Outputs) -> Result<Vec<PathBuf>, RecordError> {
    let mut folder = Folder::begin(dir, NAMES)?;
    let to = &folder;
    // The recording and the tables are the large ones: they are made side by side.
    let recording =
        || outputs.recording.then(|| to.write(RECORDING, |out| mcap::write(run, out, to.staging()))).transpose();
    let states = || outputs.tables.then(|| to.write(STATES, |out| parquet::states(run, out))).transpose();
    let (recording, states) = rayon::join(recording, states);
    for name in [recording?, states?].into_iter().flatten() {
        folder.whole(name);
    }
    let is_recorded = !run.recording.values.is_empty();
    if outputs.tables && is_recorded {
        folder.add(RECORDS, |out| parquet::records(run, out))?;
    }
    if outputs.csv {
        folder.add(STATES_CSV, |out| table::states(run, out))?;
    }
    if outputs.csv && is_recorded {
        folder.add(RECORDS_CSV, |out| table::records(run, out))?;
    }
    if outputs.plot {
        folder.add(PLOT, |out| plot::page(run).map_err(|e| e.to_string()).and_then(|page| put(out, &page)))?;
    }
    folder.add(REPORT, |out| report.json().map_err(|e| e.to_string()).and_then(|json| put(out, &json)))?;
    folder.finish()
}

fn put(out: &mut impl Write, text: &str) -> Result<(), String> {
    out.write_all(text.as_bytes()).map_err(|e| e.to_string())
}
