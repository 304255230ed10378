//! Looks at files again whenever one of those that were read changes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use notify::{Event, RecursiveMode, Watcher};

use crate::reads::Account;
use crate::terminal::{self, Stream, paint, print};
use crate::{Exit, cancel};

/// How often Ctrl-C is looked for.
const PATIENCE: Duration = Duration::from_millis(100);
/// Editors write a file in several steps: how long nothing more may happen before it is read.
const QUIET: Duration = Duration::from_millis(40);
/// What empties a terminal.
const CLEAR: &str = "\x1b[2J\x1b[H";
/// What stands between one look and the next where there is no terminal to empty.
const BETWEEN: &str = "---\n";

type Changes = Receiver<notify::Result<Event>>;

/// Looks, prints, and looks again after each change, until Ctrl-C; ends as the last look did.
pub(super) fn watch(files: &[PathBuf], look: impl Fn(&[PathBuf]) -> (String, Exit)) -> Result<Exit, String> {
    let stop = cancel::on_interrupt_quietly()?;
    let (told, changes) = mpsc::channel();
    let mut watcher = notify::recommended_watcher(told).map_err(|e| format!("cannot watch files: {e}"))?;
    for folder in folders(files) {
        let watched = watcher.watch(&folder, RecursiveMode::Recursive);
        watched.map_err(|e| format!("cannot watch `{}`: {e}", folder.display()))?;
    }
    let mut first = true;
    loop {
        let ((found, exit), read) = Account::of(|| look(files));
        match (terminal::is_terminal(Stream::Out), first) {
            (true, _) => paint(Stream::Out, CLEAR),
            (false, false) => print(Stream::Out, BETWEEN),
            (false, true) => {}
        }
        paint(Stream::Out, &found);
        first = false;
        loop {
            if stop.load(Ordering::SeqCst) {
                return Ok(exit);
            }
            if !changed(&changes, &read, PATIENCE)? {
                continue;
            }
            while changed(&changes, &read, QUIET)? {}
            // A file that was only touched, or written as it was, says nothing new.
            if read.is_outdated() {
                break;
            }
        }
    }
}

/// The folders that the files and their neighbours are in.
fn folders(files: &[PathBuf]) -> BTreeSet<PathBuf> {
    let folder = |file: &PathBuf| match file.parent() {
        Some(folder) if folder != Path::new("") => folder.to_path_buf(),
        _ => PathBuf::from("."),
    };
    files.iter().map(folder).collect()
}

/// Whether one of the files that were read may have been written, made or removed within a time.
fn changed(changes: &Changes, read: &Account, within: Duration) -> Result<bool, String> {
    match changes.recv_timeout(within) {
        Ok(Ok(event)) => Ok(!event.kind.is_access() && event.paths.iter().any(|path| read.may_name(path))),
        Ok(Err(e)) => Err(format!("stopped watching files: {e}")),
        Err(RecvTimeoutError::Timeout) => Ok(false),
        Err(RecvTimeoutError::Disconnected) => Err("stopped watching files".to_owned()),
    }
}
