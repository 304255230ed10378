//! What earlier checks have found out, in the user's folder for such things; everything in it may be deleted at any time.

use std::fs;
use std::path::PathBuf;
use std::time::SystemTime;

use etcetera::{BaseStrategy, choose_base_strategy};
use matterix_runtime::motion::{Nowhere, Store};

use crate::files;

/// How much is kept, bytes.
const MOST: u64 = 64 << 20;
/// How the files in it end.
const ENDING: &str = "found";

/// The cache; nothing is kept where it is not wanted, or where the system has no place for it.
pub fn of(unwanted: bool) -> Box<dyn Store> {
    match folder().filter(|_| !unwanted) {
        Some(folder) => Box::new(Cache { folder }),
        None => Box::new(Nowhere),
    }
}

/// `$XDG_CACHE_HOME/matterixc`, `~/.cache/matterixc`, or what Windows has for it.
pub fn folder() -> Option<PathBuf> {
    let base = choose_base_strategy().ok()?.cache_dir();
    Some(base.join(env!("CARGO_PKG_NAME"))).filter(|folder| folder.is_absolute())
}

struct Cache {
    folder: PathBuf,
}

impl Cache {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.{ENDING}"))
    }

    /// Makes room by removing what was written the longest ago.
    fn tidy(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let mut kept: Vec<(SystemTime, u64, PathBuf)> = entries
            .flatten()
            .filter(|e| e.path().extension().is_some_and(|end| end == ENDING))
            .filter_map(|e| e.metadata().ok().and_then(|m| Some((m.modified().ok()?, m.len(), e.path()))))
            .collect();
        let mut size: u64 = kept.iter().map(|k| k.1).sum();
        kept.sort();
        for (_, length, path) in kept {
            if size <= MOST {
                break;
            }
            if fs::remove_file(path).is_ok() {
                size -= length;
            }
        }
    }
}

impl Store for Cache {
    fn load(&self, name: &str) -> Option<Vec<u8>> {
        let path = self.path(name);
        let length = fs::metadata(&path).ok()?.len();
        if length > MOST { None } else { fs::read(path).ok() }
    }

    /// A cache that cannot be written is done without.
    fn save(&self, name: &str, bytes: &[u8]) {
        let Ok(text) = std::str::from_utf8(bytes) else { return };
        if bytes.len() as u64 <= MOST && fs::create_dir_all(&self.folder).is_ok() {
            let _ = files::write(&self.path(name), text);
            self.tidy();
        }
    }
}
