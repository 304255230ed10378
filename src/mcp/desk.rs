//! The folder that a server works in, and what it remembers while it runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use matterix_runtime::motion::Store;

use crate::files;
use crate::pipeline::Input;

/// Bytes remembered of earlier checks.
const MOST: usize = 64 << 20;

/// What calls share.
pub struct Desk {
    root: PathBuf,
    kept: Mutex<BTreeMap<String, Vec<u8>>>,
}

impl Desk {
    /// Over a folder, which becomes the current one, so that findings name files as the client does.
    pub fn of(root: &Path) -> Result<Self, String> {
        let failed = |e: std::io::Error| format!("cannot serve `{}`: {}", root.display(), files::reason(&e));
        let whole = root.canonicalize().map_err(failed)?;
        std::env::set_current_dir(&whole).map_err(failed)?;
        Ok(Desk { root: whole, kept: Mutex::default() })
    }

    /// A file of the folder by its path from there, links followed.
    pub fn place(&self, path: &str) -> Result<PathBuf, String> {
        let outside = || format!("`{path}` is outside the folder of the server; paths are relative to it");
        let asked = self.root.join(path);
        // Whether something is there is not told of what is elsewhere.
        if !files::lies_in(&asked, &self.root) {
            return Err(outside());
        }
        let whole = asked.canonicalize().map_err(|e| format!("cannot read `{path}`: {}", files::reason(&e)))?;
        match whole.strip_prefix(&self.root) {
            Ok(own) if own.as_os_str().is_empty() => Ok(PathBuf::from(".")),
            Ok(own) => Ok(own.to_path_buf()),
            Err(_) => Err(outside()),
        }
    }

    /// A file, or a text that stands for one in the folder itself.
    pub fn input(&self, path: Option<&str>, text: Option<&str>) -> Result<Input, String> {
        let input = match (path, text) {
            (Some(path), None) => {
                let place = self.place(path)?;
                let bytes = files::read(&place)?;
                Input::file(&place, bytes)
            }
            (None, Some(text)) => Input::typed(text.as_bytes().to_vec()),
            _ => return Err("give either `path` or `text`".to_string()),
        };
        Ok(input.within(&self.root))
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<String, Vec<u8>>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ways of robots are remembered while the server runs, not on disk.
impl Store for Desk {
    fn load(&self, name: &str) -> Option<Vec<u8>> {
        self.kept().get(name).cloned()
    }

    fn save(&self, name: &str, bytes: &[u8]) {
        let mut kept = self.kept();
        kept.insert(name.to_string(), bytes.to_vec());
        let size: usize = kept.values().map(Vec::len).sum();
        if size > MOST {
            kept.clear();
        }
    }
}
