//! What kept the files of a run from being written.

use std::fmt;
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
    /// With the reason as the library below words it, without the number of the system's error.
    pub(super) fn new(path: &Path, reason: impl fmt::Display) -> Self {
        let reason = reason.to_string();
        let words = reason.split(" (os error").next().unwrap_or_default();
        RecordError { path: path.to_owned(), reason: words.to_lowercase() }
    }
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot write `{}`: {}", self.path.display(), self.reason)
    }
}

impl std::error::Error for RecordError {}
