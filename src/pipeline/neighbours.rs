//! Modules on disk: next to the file that was named on the command line.

use std::path::{Path, PathBuf};

use matterix_ir::FileId;
use matterix_lang::Loader;

use crate::files;

/// Bytes of the largest data file that is read; definitions of labware have some ten thousand.
const LARGEST: u64 = 16 << 20;

/// Loads `sn1` from `sn1.mtx` and `parts::racks` from `parts/racks.mtx` in one folder.
pub(super) struct Neighbours {
    dir: PathBuf,
}

impl Neighbours {
    /// The modules in a folder.
    pub(super) fn of(dir: &Path) -> Self {
        Neighbours { dir: dir.to_path_buf() }
    }
}

impl Loader for Neighbours {
    fn load(&self, _: FileId, module: &str) -> Option<(String, String)> {
        let mut path = self.dir.clone();
        for part in module.split("::") {
            // A module path names files below the folder, never elsewhere.
            if part.is_empty() || !part.chars().all(|c| c.is_alphanumeric() || c == '_') {
                return None;
            }
            path.push(part);
        }
        path.set_extension("mtx");
        let text = std::fs::read_to_string(&path).ok()?;
        Some((path.display().to_string(), text))
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        let path = self.dir.join(path);
        match std::fs::metadata(&path) {
            Ok(about) if about.is_dir() => Err("it is a directory".to_string()),
            Ok(about) if about.len() > LARGEST => Err(format!("it is larger than {} MiB", LARGEST >> 20)),
            Ok(_) => std::fs::read_to_string(&path).map_err(|e| files::reason(&e)),
            Err(e) => Err(files::reason(&e)),
        }
    }
}
