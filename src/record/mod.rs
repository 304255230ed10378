//! The record of a deployment: one folder with all that it rested on and all that was done, for people who sign it and programs that
//! check it.

mod folder;
mod page;
mod report;
mod verify;

pub use folder::{Folder, Taken};
pub use report::{About, Bound, Gauge};
pub use verify::verify;

/// The file that says what the others hold.
pub const MANIFEST: &str = "record.json";
/// The journal.
pub const JOURNAL: &str = "journal.jsonl";
/// What was done, for programs.
const REPORT: &str = "report.json";
/// The same for people.
const PAGE: &str = "report.md";
/// Where devices were.
const BINDINGS: &str = "bindings.toml";
/// The folder of the program's text, with what it imports.
const PROGRAM: &str = "program";

/// Version of the form.
const VERSION: u32 = 1;

/// A moment in UTC, as RFC 3339 writes it; s since 1970.
fn moment(wall: f64) -> String {
    let millis = chrono::DateTime::from_timestamp_millis((wall * 1e3).round() as i64);
    millis.map_or_else(|| format!("{wall} s"), |m| m.to_rfc3339_opts(chrono::SecondsFormat::Millis, true))
}
