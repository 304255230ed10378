//! Modules on disk: next to the file that was named on the command line.

use std::path::{Path, PathBuf};

use matterix_ir::FileId;
use matterix_lang::Loader;

use crate::files;

/// Bytes of the largest data file that is read; definitions of labware have some ten thousand.
const LARGEST: u64 = 16 << 20;

/// The same of meshes.
const LARGEST_MESH: u64 = 64 << 20;

/// Loads `sn1` from `sn1.mtx` and `parts::racks` from `parts/racks.mtx` in one folder.
pub(super) struct Neighbours {
    dir: PathBuf,
}

impl Neighbours {
    /// The modules in a folder.
    pub(super) fn of(dir: &Path) -> Self {
        Neighbours { dir: dir.to_path_buf() }
    }

    /// Where a data file is, if it is one of at most so many bytes.
    fn data(&self, path: &str, largest: u64) -> Result<PathBuf, String> {
        let path = self.dir.join(path);
        match std::fs::metadata(&path) {
            Ok(about) if about.is_dir() => Err("it is a directory".to_string()),
            Ok(about) if about.len() > largest => Err(format!("it is larger than {} MiB", largest >> 20)),
            Ok(_) => Ok(path),
            Err(e) => Err(files::reason(&e)),
        }
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

    fn bytes(&self, _: FileId, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.data(path, LARGEST_MESH)?).map_err(|e| files::reason(&e))
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.data(path, LARGEST)?).map_err(|e| files::reason(&e))
    }
}
