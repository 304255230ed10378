//! Texts with marked places, and files beside them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use matterix_editor::{Analysis, Index};
use matterix_ir::FileId;
use matterix_lang::{Loader, Session};

/// Files by the names of their modules, then those of a folder.
#[derive(Default)]
pub struct Files {
    /// Texts by module; other files by name.
    pub texts: BTreeMap<String, String>,
    /// Where others lie.
    pub folder: Option<PathBuf>,
}

impl Loader for Files {
    fn load(&self, _: FileId, module: &str) -> Option<(String, String)> {
        let name = format!("{}.mtx", module.replace("::", "/"));
        let known = self.texts.get(module).cloned();
        let text = known.or_else(|| std::fs::read_to_string(self.folder.as_ref()?.join(&name)).ok())?;
        Some((name, text))
    }

    fn bytes(&self, _: FileId, path: &str) -> Result<Vec<u8>, String> {
        if let Some(text) = self.texts.get(path) {
            return Ok(text.clone().into_bytes());
        }
        let folder = self.folder.as_ref().ok_or("no such file")?;
        std::fs::read(folder.join(path)).map_err(|e| e.to_string())
    }

    fn file(&self, from: FileId, path: &str) -> Result<String, String> {
        String::from_utf8(self.bytes(from, path)?).map_err(|e| e.to_string())
    }
}

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All examples: path and text.
pub fn examples() -> Vec<(PathBuf, String)> {
    let mut out = Vec::new();
    let mut todo = vec![root().join("examples")];
    while let Some(folder) = todo.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.flatten().map(|e| e.path()) {
            if path.is_dir() {
                todo.push(path);
            } else if path.extension().is_some_and(|e| e == "mtx") {
                out.push((path.clone(), std::fs::read_to_string(&path).expect("readable")));
            }
        }
    }
    out.sort();
    out
}

/// The analysis of a text in a folder.
pub fn analysed(name: &str, text: &str, files: &Files) -> (Analysis, Index) {
    let analysis = Analysis::of(name, text, files, &mut Session::default());
    let index = Index::of(&analysis);
    (analysis, index)
}

/// The files beside an example.
pub fn beside(path: &Path) -> Files {
    Files { texts: BTreeMap::new(), folder: path.parent().map(Path::to_path_buf) }
}

/// A text with places marked `$0`, `$1`, ...: the text without them and the places.
pub fn marked(text: &str) -> (String, Vec<usize>) {
    let mut out = String::new();
    let mut places: BTreeMap<u32, usize> = BTreeMap::new();
    let mut rest = text;
    while let Some(at) = rest.find('$') {
        let Some(digit) = rest[at + 1..].chars().next().and_then(|c| c.to_digit(10)) else { break };
        out.push_str(&rest[..at]);
        places.insert(digit, out.len());
        rest = &rest[at + 2..];
    }
    out.push_str(rest);
    (out, places.into_values().collect())
}
