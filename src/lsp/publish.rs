//! What the client was told of which text, and what has become different.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::rc::Rc;

use lsp_types::{PublishDiagnosticsParams, Range, Uri};
use matterix_editor::Analysis;
use matterix_ir::{Diagnostic, FileId, Span};

use super::capabilities::Client;
use super::documents::{Document, Documents};
use super::findings;
use super::lines::{Encoding, Lines};
use super::shelf::Shelf;

/// Findings of texts as the client knows them.
#[derive(Debug, Default)]
pub struct Published {
    /// What looking at the ways of robots has found, by the address of the text that was checked, with its stamp.
    moved: BTreeMap<String, (u64, Vec<Diagnostic>)>,
    /// Texts that were checked since the last news.
    fresh: BTreeSet<String>,
    /// What was told, by address.
    told: BTreeMap<String, (Option<i32>, Vec<lsp_types::Diagnostic>)>,
    /// The addresses that the findings of each checked text stand at.
    places: BTreeMap<String, BTreeMap<String, Vec<lsp_types::Diagnostic>>>,
}

impl Published {
    /// A text was checked.
    pub fn checked(&mut self, uri: &str, stamp: u64) {
        self.moved.retain(|of, (known, _)| of != uri || *known == stamp);
        self.fresh.insert(uri.to_string());
    }

    /// The ways of robots in a text were looked at: this is all that was found in it.
    pub fn moved(&mut self, uri: &str, stamp: u64, found: Vec<Diagnostic>) {
        self.moved.insert(uri.to_string(), (stamp, found));
        self.fresh.insert(uri.to_string());
    }

    /// This was told of a text, whatever was checked.
    pub fn told(&mut self, params: &PublishDiagnosticsParams) {
        self.told.insert(params.uri.as_str().to_string(), (None, params.diagnostics.clone()));
    }

    /// A text was closed: what its check found elsewhere goes too.
    pub fn forget(&mut self, uri: &str) {
        self.moved.remove(uri);
        self.places.remove(uri);
    }

    /// What is to be told: of each text whose findings have changed all of them.
    pub fn news(&mut self, documents: &Documents, shelf: &Shelf, client: &Client) -> Vec<PublishDiagnosticsParams> {
        for uri in std::mem::take(&mut self.fresh) {
            let Some(document) = documents.iter().find(|d| d.uri.as_str() == uri) else { continue };
            let moved = self.moved.get(&uri).filter(|(stamp, _)| *stamp == document.stamp);
            if let Some(placed) = placed(document, moved.map(|m| m.1.as_slice()), documents, shelf, client) {
                self.places.insert(uri, placed);
            }
        }
        let mut now: BTreeMap<&str, Vec<lsp_types::Diagnostic>> = BTreeMap::new();
        for (of, placed) in &self.places {
            let current = documents.iter().any(|d| d.uri.as_str() == of && d.current().is_some());
            if current {
                // That nothing is wrong is told too.
                now.entry(of).or_default();
            }
            for (at, found) in placed {
                // Of itself a text says the last that is known; elsewhere only what holds for the texts as they are.
                if current || at == of {
                    let there = now.entry(at).or_default();
                    found.iter().for_each(|d| {
                        if !there.contains(d) {
                            there.push(d.clone())
                        }
                    });
                }
            }
        }
        for at in self.told.keys() {
            now.entry(at).or_default();
        }
        let version = |at: &str| {
            let document = documents.iter().find(|d| d.uri.as_str() == at);
            document.map(|d| (d.version, d.current().is_some()))
        };
        let mut news = Vec::new();
        let mut told = BTreeMap::new();
        for (at, mut found) in now {
            found.sort_by_key(|d| (d.range.start, d.range.end));
            let known = self.told.get(at);
            let version = match version(at) {
                // While a text is being checked nothing new is known of it.
                Some((_, false)) => {
                    known.into_iter().for_each(|known| drop(told.insert(at.to_string(), known.clone())));
                    continue;
                }
                Some((version, true)) => Some(version),
                None => None,
            };
            let same = known.is_some_and(|(of, known)| *known == found && *of == version);
            if !same && let Ok(uri) = at.parse() {
                news.push(PublishDiagnosticsParams { uri, diagnostics: found.clone(), version });
            }
            if !found.is_empty() || version.is_some() {
                told.insert(at.to_string(), (version, found));
            }
        }
        self.told = told;
        news
    }
}

/// What is to be told of a text of which no more than its own mistakes is known yet.
pub fn read(document: &Document, found: &[Diagnostic], shelf: &Shelf) -> PublishDiagnosticsParams {
    let place = |span: Span| {
        let range = document.lines.range(&document.text, span.start as usize, span.end as usize);
        (span.file == FileId(0)).then(|| (document.uri.clone(), range))
    };
    let diagnostics = found.iter().map(|d| findings::diagnostic(d, &place, &|code| shelf.page(code))).collect();
    PublishDiagnosticsParams { uri: document.uri.clone(), diagnostics, version: None }
}

/// The findings of a text by the addresses they stand at.
fn placed(
    document: &Document,
    moved: Option<&[Diagnostic]>,
    documents: &Documents,
    shelf: &Shelf,
    client: &Client,
) -> Option<BTreeMap<String, Vec<lsp_types::Diagnostic>>> {
    let analysis = document.current()?;
    let places = Places::new(analysis, documents, shelf, client.encoding);
    let mut out: BTreeMap<String, Vec<lsp_types::Diagnostic>> = BTreeMap::new();
    for finding in moved.unwrap_or(&analysis.findings) {
        let (uri, _) = places.of(finding.span()).unwrap_or_else(|| (document.uri.clone(), Range::default()));
        let said = findings::diagnostic(finding, &|span| places.of(span), &|code| shelf.page(code));
        out.entry(uri.as_str().to_string()).or_default().push(said);
    }
    Some(out)
}

/// The address and the lines of a file, as far as it has an address.
type Known = Option<(Uri, Rc<Lines>)>;

/// Where the spans of a check stand in the protocol's terms.
pub struct Places<'s> {
    analysis: &'s Analysis,
    documents: &'s Documents,
    /// The texts that come with the command.
    pub shelf: &'s Shelf,
    encoding: Encoding,
    /// Addresses and lines of the files that were asked for.
    known: RefCell<BTreeMap<FileId, Known>>,
}

impl<'s> Places<'s> {
    /// Places of a check.
    pub fn new(analysis: &'s Analysis, documents: &'s Documents, shelf: &'s Shelf, encoding: Encoding) -> Self {
        Places { analysis, documents, shelf, encoding, known: RefCell::default() }
    }

    /// The address and range of a span.
    pub fn of(&self, span: Span) -> Option<(Uri, Range)> {
        let source = self.analysis.sources.get(span.file)?;
        let known = self
            .known
            .borrow_mut()
            .entry(span.file)
            .or_insert_with(|| {
                let uri = address(&source.name, self.documents, self.shelf)?;
                Some((uri, Rc::new(Lines::of(&source.text, self.encoding))))
            })
            .clone();
        let (uri, lines) = known?;
        Some((uri, lines.range(&source.text, span.start as usize, span.end as usize)))
    }
}

/// The address of the text under a name in the sources of a check.
pub fn address(name: &str, documents: &Documents, shelf: &Shelf) -> Option<Uri> {
    if name.starts_with("std::") {
        return shelf.module(name);
    }
    let path = Path::new(name);
    match documents.at(path) {
        Some(document) => Some(document.uri.clone()),
        None if path.is_absolute() => super::uris::of(path),
        None => documents.iter().find(|d| d.uri.as_str() == name).map(|d| d.uri.clone()),
    }
}
