//! Where names stand: texts with an index of their names, and places of an index as the protocol has them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::{Location, Position, Range, Uri};
use matterix_editor::references::Place;
use matterix_editor::{Analysis, Drift, Index};
use matterix_ir::{FileId, Span};
use matterix_lang::Session;

use crate::files;
use crate::lsp::documents::Document;
use crate::lsp::judge::Texts;
use crate::lsp::lines::Lines;
use crate::lsp::publish::address;
use crate::lsp::server::Server;

/// A text with an index that knows its names: its own, or for a text of the library any.
pub struct Named<'s> {
    /// The text.
    pub document: &'s Document,
    /// The index.
    pub index: Arc<Index>,
    /// The text in the index.
    pub file: FileId,
    /// How the text has changed since.
    drift: Drift,
}

impl<'s> Named<'s> {
    /// What is known of names in the text under an address.
    pub fn of(server: &'s Server, uri: &Uri) -> Option<Named<'s>> {
        let document = server.documents.get(uri)?;
        let (index, file) = match server.shelf.module_at(uri) {
            Some(module) => {
                let analysis = server.documents.iter().find_map(Document::last).cloned();
                let index = analysis.map_or_else(|| server.library(), |analysis| analysis.index());
                let file = index.file(module.name)?;
                (index, file)
            }
            None => {
                let analysis = document.last()?;
                (analysis.index(), analysis.root)
            }
        };
        let drift = Drift::between(index.sources().get(file).map_or("", |s| &s.text), &document.text);
        Some(Named { document, index, file, drift })
    }

    /// The same for the text as it is: where it has changed since the last check, it is checked again.
    pub fn now(server: &'s Server, uri: &Uri) -> Option<Named<'s>> {
        let named = Named::of(server, uri)?;
        if named.drift.is_none() {
            return Some(named);
        }
        let document = named.document;
        let open = server.documents.texts();
        let texts = Texts::new(document.folder(), &open);
        let analysis = Analysis::of(&document.name(), &document.text, &texts, &mut Session::default());
        let drift = Drift::between(&document.text, &document.text);
        Some(Named { document, file: analysis.root, index: analysis.index(), drift })
    }

    /// The place of a position in the index.
    pub fn offset(&self, position: Position) -> usize {
        self.drift.back(self.document.lines.offset(&self.document.text, position))
    }

    /// The range of a span of the index in the text as it is.
    pub fn range(&self, span: Span) -> Range {
        let (start, end) = (self.drift.forward(span.start as usize), self.drift.forward(span.end as usize));
        self.document.lines.range(&self.document.text, start, end)
    }
}

/// Where a place of an index stands in the protocol's terms, in the text as it is.
pub fn location(server: &Server, index: &Index, place: &Place) -> Option<Location> {
    let uri = address(&place.file, &server.documents, &server.shelf)?;
    let text = &index.sources().get(index.file(&place.file)?)?.text;
    let (start, end) = (place.start as usize, place.end as usize);
    let range = match server.documents.get(&uri) {
        Some(document) => {
            let drift = Drift::between(text, &document.text);
            document.lines.range(&document.text, drift.forward(start), drift.forward(end))
        }
        None => Lines::of(text, server.client.encoding).range(text, start, end),
    };
    Some(Location { uri, range })
}

/// The place of a span as the protocol has it.
pub fn locate(server: &Server, index: &Index, span: Span) -> Option<Location> {
    location(server, index, &index.place(span))
}

/// Where the places of several indexes stand; those that stand nowhere are left out.
pub fn locations(server: &Server, all: &[&Index], places: &[Place]) -> Vec<Location> {
    let of = |place: &Place| all.iter().find_map(|index| location(server, index, place));
    places.iter().filter_map(of).collect()
}

/// The indexes of all open texts.
pub fn open(server: &Server) -> Vec<Arc<Index>> {
    server.documents.iter().filter_map(|d| d.last().map(|a| a.index())).collect()
}

/// The most files on the disk that are read to find a name.
const MOST_FILES: usize = 500;

/// How far above a file others may lie that import it.
const ABOVE: usize = 3;

/// The indexes of all texts that may name what a file declares: the open ones, and files beside and above it that hold the word.
pub fn around(server: &Server, of: &Place, word: &str) -> Vec<Arc<Index>> {
    let texts = server.documents.texts();
    let mut all = open(server);
    let mut session = Session::default();
    let module = Path::new(&of.file).file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    for path in files_around(Path::new(&of.file)) {
        if texts.contains_key(&path) {
            continue;
        }
        let Ok(bytes) = files::contents(&path, files::LARGEST_TEXT) else { continue };
        let Ok(text) = String::from_utf8(bytes) else { continue };
        // What names it imports the module that declares it.
        if text.contains(word) && text.contains(module) {
            let beside = Texts::new(path.parent(), &texts);
            let analysis = Analysis::of(&path.display().to_string(), &text, &beside, &mut session);
            all.push(analysis.index());
        }
    }
    all
}

fn files_around(file: &Path) -> Vec<PathBuf> {
    let mut out: BTreeMap<PathBuf, ()> = BTreeMap::new();
    for folder in file.ancestors().skip(1).take(ABOVE).filter(|f| f.is_absolute()) {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        let texts = entries.filter(|p| p.extension().is_some_and(|e| e == "mtx")).take(MOST_FILES);
        out.extend(texts.map(|p| (p, ())));
    }
    out.into_keys().take(MOST_FILES).collect()
}
