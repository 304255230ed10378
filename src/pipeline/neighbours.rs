//! Modules on disk: next to the file that was named on the command line.

use std::path::{Path, PathBuf};

use matterix_ir::FileId;
use matterix_lang::Loader;

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
}
