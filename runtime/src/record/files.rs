//! Files that are there whole or not at all.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A file of a run could not be written.
#[derive(Debug)]
pub struct RecordError {
    /// Which.
    pub path: PathBuf,
    /// Why, in words.
    pub reason: String,
}

impl RecordError {
    /// With the reason as the library below words it.
    pub(super) fn new(path: &Path, reason: impl fmt::Display) -> Self {
        RecordError { path: path.to_owned(), reason: reason.to_string() }
    }
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot write `{}`: {}", self.path.display(), self.reason)
    }
}

impl std::error::Error for RecordError {}

/// Writes beside the target, then renames, so that a reader never sees half a file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), RecordError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let partial = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
    let written: io::Result<()> = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path));
    written.map_err(|e| {
        // The partial file may not exist; the first error is the one to report.
        let _ = fs::remove_file(&partial);
        RecordError::new(path, e)
    })
}
