//! The texts that a client has open, as it last said they are.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::{TextDocumentContentChangeEvent, Uri};
use matterix_editor::Analysis;

use super::lines::{Encoding, Lines};
use super::uris;

/// A text that is open.
#[derive(Debug)]
pub struct Document {
    /// Its address, as the client writes it.
    pub uri: Uri,
    /// Where it lies; none for a text that was never saved.
    pub path: Option<PathBuf>,
    /// The client's number of this state of it.
    pub version: i32,
    /// The text.
    pub text: Arc<str>,
    /// Its lines.
    pub lines: Lines,
    /// Counts what its findings depend on: its own text and those it imports.
    pub stamp: u64,
    /// The last check, and the stamp it was made of.
    pub judged: Option<(u64, Arc<Analysis>)>,
    /// Files that the last check asked for, there or not.
    pub asked: Vec<PathBuf>,
}

impl Document {
    /// What the text is called in findings.
    pub fn name(&self) -> String {
        self.path.as_ref().map_or_else(|| self.uri.as_str().to_string(), |path| path.display().to_string())
    }

    /// The folder of its neighbours.
    pub fn folder(&self) -> Option<&Path> {
        self.path.as_deref().and_then(Path::parent)
    }

    /// The last check, where it is one of the text as it is.
    pub fn current(&self) -> Option<&Arc<Analysis>> {
        self.judged.as_ref().filter(|(stamp, _)| *stamp == self.stamp).map(|(_, analysis)| analysis)
    }

    /// The last check, of whichever text.
    pub fn last(&self) -> Option<&Arc<Analysis>> {
        self.judged.as_ref().map(|(_, analysis)| analysis)
    }

    fn set(&mut self, text: &str, encoding: Encoding) {
        self.text = text.into();
        self.lines = Lines::of(text, encoding);
    }
}

/// All open texts, by address.
#[derive(Debug, Default)]
pub struct Documents {
    all: BTreeMap<String, Document>,
    encoding: Encoding,
    /// How often anything has changed.
    changes: u64,
}

impl Documents {
    /// None yet.
    pub fn new(encoding: Encoding) -> Documents {
        Documents { all: BTreeMap::new(), encoding, changes: 0 }
    }

    /// The document under an address.
    pub fn get(&self, uri: &Uri) -> Option<&Document> {
        self.all.get(uri.as_str())
    }

    /// The same, to change it.
    pub fn get_mut(&mut self, uri: &str) -> Option<&mut Document> {
        self.all.get_mut(uri)
    }

    /// All of them, by address.
    pub fn iter(&self) -> impl Iterator<Item = &Document> {
        self.all.values()
    }

    /// The document that lies at a path.
    pub fn at(&self, path: &Path) -> Option<&Document> {
        self.iter().find(|document| document.path.as_deref() == Some(path))
    }

    /// Texts by their paths.
    pub fn texts(&self) -> BTreeMap<PathBuf, Arc<str>> {
        self.iter().filter_map(|document| Some((document.path.clone()?, document.text.clone()))).collect()
    }

    /// How often anything has changed.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Takes a text in.
    pub fn open(&mut self, uri: Uri, version: i32, text: &str) {
        let path = uris::path(&uri);
        let mut document = Document {
            path,
            version,
            text: Arc::default(),
            lines: Lines::default(),
            stamp: 0,
            judged: None,
            asked: Vec::new(),
            uri,
        };
        document.set(text, self.encoding);
        let (uri, path) = (document.uri.as_str().to_string(), document.path.clone());
        self.all.insert(uri.clone(), document);
        self.changed(Some(&uri), path.as_deref());
    }

    /// Changes a text, piece by piece in the order given. A change of a text that is not open says nothing.
    pub fn edit(&mut self, uri: &Uri, version: i32, edits: Vec<TextDocumentContentChangeEvent>) {
        let encoding = self.encoding;
        let Some(document) = self.all.get_mut(uri.as_str()) else { return };
        document.version = version;
        for edit in edits {
            match edit.range {
                None => document.set(&edit.text, encoding),
                Some(range) => {
                    let (start, end) = document.lines.bytes(&document.text, range);
                    let before = document.text.get(..start).unwrap_or_default();
                    let after = document.text.get(end..).unwrap_or_default();
                    let text = [before, &edit.text, after].concat();
                    document.set(&text, encoding);
                }
            }
        }
        let path = document.path.clone();
        self.changed(Some(uri.as_str()), path.as_deref());
    }

    /// Lets a text go: from now on the one on the disk counts.
    pub fn close(&mut self, uri: &Uri) -> Option<Document> {
        let closed = self.all.remove(uri.as_str())?;
        self.changed(None, closed.path.as_deref());
        Some(closed)
    }

    /// Notes that a text has changed: what has asked for it is to be checked anew, as it is itself.
    pub fn changed(&mut self, uri: Option<&str>, path: Option<&Path>) {
        self.changes += 1;
        for (key, document) in &mut self.all {
            let asks = path.is_some_and(|path| document.asked.iter().any(|asked| asked == path));
            if asks || uri == Some(key) {
                document.stamp = self.changes;
            }
        }
    }
}
