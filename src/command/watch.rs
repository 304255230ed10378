//! Looks at files again whenever something in their folders changes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use notify::{Event, RecursiveMode, Watcher};

use crate::terminal::{self, Stream, print};
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
    let mut watcher = notify::recommended_watcher(told).map_err(|e| format!("files cannot be watched: {e}"))?;
    for folder in folders(files) {
        let watched = watcher.watch(&folder, RecursiveMode::Recursive);
        watched.map_err(|e| format!("`{}` cannot be watched: {e}", folder.display()))?;
    }
    let mut first = true;
    loop {
        let (found, exit) = look(files);
        match (terminal::is_terminal(Stream::Out), first) {
            (true, _) => print(Stream::Out, CLEAR),
            (false, false) => print(Stream::Out, BETWEEN),
            (false, true) => {}
        }
        print(Stream::Out, &found);
        first = false;
        while !changed(&changes, PATIENCE)? {
            if stop.load(Ordering::SeqCst) {
                return Ok(exit);
            }
        }
        while changed(&changes, QUIET)? {}
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

/// Whether something was written, made or removed within a time.
fn changed(changes: &Changes, within: Duration) -> Result<bool, String> {
    match changes.recv_timeout(within) {
        Ok(Ok(event)) => Ok(!event.kind.is_access() && event.paths.iter().any(|p| !is_hidden(p))),
        Ok(Err(e)) => Err(format!("files cannot be watched any more: {e}")),
        Err(RecvTimeoutError::Timeout) => Ok(false),
        Err(RecvTimeoutError::Disconnected) => Err("files cannot be watched any more".to_owned()),
    }
}

/// What editors and version control keep for themselves.
fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}
