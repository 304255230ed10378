//! Modules on disk: next to the file that was named on the command line.

use std::path::{Path, PathBuf};

use matterix_ir::FileId;
use matterix_lang::{Loader, Stop};

use crate::files;

/// Bytes of the largest mesh that is read.
const LARGEST_MESH: u64 = 64 << 20;

/// Loads `sn1` from `sn1.mtx` and `parts::racks` from `parts/racks.mtx` in one folder.
pub struct Neighbours {
    dir: PathBuf,
    root: Option<PathBuf>,
    stop: Stop,
}

impl Neighbours {
    /// The modules in a folder.
    pub fn of(dir: &Path) -> Self {
        Neighbours { dir: dir.to_path_buf(), root: None, stop: Stop::default() }
    }

    /// The same, nothing of which is read outside of a folder that is given by its whole path.
    pub fn within(self, root: Option<&Path>) -> Self {
        Neighbours { root: root.map(Path::to_path_buf), ..self }
    }

    /// The same for what may be stopped.
    pub fn until(self, stop: &Stop) -> Self {
        Neighbours { stop: stop.clone(), ..self }
    }

    /// What a file holds, where it may be read; links lead to where they lead.
    fn contents(&self, path: &Path, largest: u64) -> Result<Vec<u8>, String> {
        if self.root.as_ref().is_some_and(|root| !files::lies_in(path, root)) {
            return Err("it is outside the allowed folder".to_string());
        }
        files::contents(path, largest)
    }

    /// The file that a module is; none where its name cannot be one.
    pub fn path(&self, module: &str) -> Option<PathBuf> {
        let mut path = self.dir.clone();
        for part in module.split("::") {
            // A module path names files below the folder, never elsewhere.
            if part.is_empty() || !part.chars().all(|c| c.is_alphanumeric() || c == '_') {
                return None;
            }
            path.push(part);
        }
        path.set_extension("mtx");
        Some(path)
    }
}

impl Loader for Neighbours {
    fn load(&self, _: FileId, module: &str) -> Option<(String, String)> {
        let path = self.path(module)?;
        let text = String::from_utf8(self.contents(&path, files::LARGEST_TEXT).ok()?).ok()?;
        Some((path.display().to_string(), text))
    }

    fn bytes(&self, _: FileId, path: &str) -> Result<Vec<u8>, String> {
        self.contents(&self.dir.join(path), LARGEST_MESH)
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        let bytes = self.contents(&self.dir.join(path), files::LARGEST_TEXT)?;
        String::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_string())
    }

    fn stop(&self) -> Stop {
        self.stop.clone()
    }
}
