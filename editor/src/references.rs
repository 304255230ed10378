//! Where a name is declared, and where else it stands.

use matterix_ir::{FileId, Span};

use crate::Index;
use crate::index::{Def, DefId, Kind, Meaning};

/// A declaration apart from an index: the name of its file, and where its name stands there.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key {
    /// Name of the file.
    pub file: String,
    /// First byte of the name.
    pub start: u32,
    /// One past its last byte.
    pub end: u32,
}

/// A place in a file, apart from an index.
pub type Place = Key;

impl Index {
    /// A place apart from this index.
    pub fn place(&self, span: Span) -> Place {
        let file = self.sources().get(span.file).map_or_else(String::new, |s| s.name.clone());
        Place { file, start: span.start, end: span.end }
    }

    /// A declaration apart from this index.
    pub fn key(&self, def: DefId) -> Key {
        self.place(self.def(def).span)
    }

    /// The declaration in this index.
    pub fn find(&self, key: &Key) -> Option<DefId> {
        let files = (0..).map(FileId).map_while(|id| Some((id, self.sources().get(id)?)));
        let mut files = files.filter(|(_, s)| s.name == key.file);
        files.find_map(|(file, _)| self.declared_at(Span { file, start: key.start, end: key.end }))
    }

    /// Where what stands at a place is declared: several places for a failure, none for what the language knows itself.
    pub fn definition(&self, file: FileId, offset: usize) -> Vec<Span> {
        match self.at(file, offset).map(|u| u.meaning) {
            Some(Meaning::Def(def)) => match self.def(def).kind {
                Kind::Failure => self.failure_places(&self.def(def).name),
                _ => vec![self.def(def).span],
            },
            Some(Meaning::Module(module)) => self.module_file(module).map(|f| Span::new(f, 0, 0)).into_iter().collect(),
            _ => Vec::new(),
        }
    }

    /// Where the type of what stands at a place is declared: its capabilities or its asset.
    pub fn type_definition(&self, file: FileId, offset: usize) -> Vec<Span> {
        let seen = self.at(file, offset).and_then(|u| self.seen(u.span)).map(|s| s.sort.clone());
        let sort = seen.or_else(|| self.def_at(file, offset).map(|d| self.def(d).sort.clone()));
        match sort {
            Some(matterix_lang::semantic_index::Sort::Thing(kinds, _)) => {
                kinds.iter().filter_map(|k| self.of_decl(*k)).map(|d| self.def(d).span).collect()
            }
            _ => Vec::new(),
        }
    }

    /// All places of this index where a declaration is named, in the order of files and texts.
    pub fn references(&self, def: DefId) -> Vec<Span> {
        let names = |m: &Meaning| *m == Meaning::Def(def);
        self.all_uses().filter(|u| names(&u.meaning)).map(|u| u.span).collect()
    }

    /// The places of one file where what stands at a place is named.
    pub fn highlights(&self, file: FileId, offset: usize) -> Vec<Span> {
        match self.at(file, offset) {
            Some(found) if matches!(found.meaning, Meaning::Def(_)) => {
                self.uses(file).iter().filter(|u| u.meaning == found.meaning).map(|u| u.span).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// All places where what stands at a place is named, in everything that was analysed; each once. `declared` says whether the
/// place of its declaration is one of them.
pub fn references(all: &[&Index], at: &Index, file: FileId, offset: usize, declared: bool) -> Vec<Place> {
    let Some(def) = at.def_at(file, offset) else { return Vec::new() };
    let key = at.key(def);
    let mut out: Vec<Place> = Vec::new();
    for index in std::iter::once(&at).chain(all) {
        let Some(def) = index.find(&key) else { continue };
        out.extend(index.references(def).into_iter().map(|span| index.place(span)));
    }
    out.sort();
    out.dedup();
    out.retain(|place| declared || *place != key);
    out
}

/// What a search for symbols found.
#[derive(Clone, Debug)]
pub struct Symbol {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// What it belongs to.
    pub within: String,
    /// Where.
    pub place: Place,
}

impl Index {
    /// Declarations of the package whose name has the letters of a query in their order.
    pub fn symbols(&self, query: &str) -> Vec<Symbol> {
        let wanted =
            |d: &Def| !matches!(d.kind, Kind::Variable | Kind::Parameter | Kind::Option | Kind::Word | Kind::Job);
        let found =
            self.own_defs().filter(|(_, d)| wanted(d) && !self.is_library(d.span.file) && holds(&d.name, query));
        found
            .map(|(_, d)| Symbol {
                name: d.name.clone(),
                kind: d.kind,
                within: d.owner.map_or_else(|| self.module_name(d.span.file).to_string(), |o| self.def(o).name.clone()),
                place: self.place(d.span),
            })
            .collect()
    }
}

/// Whether a name has the letters of a query, in their order, whatever their case.
fn holds(name: &str, query: &str) -> bool {
    let mut letters = name.chars().flat_map(char::to_lowercase);
    query.chars().flat_map(char::to_lowercase).filter(|c| !c.is_whitespace()).all(|c| letters.any(|l| l == c))
}
