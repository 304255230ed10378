//! The index of names: what every name in a text stands for, and where else it stands.
//!
//! Two ways were compared. To resolve names in a tree apart from the evaluator can say something else than what was checked. So
//! the evaluator notes what it has found (`matterix_lang::semantic_index`), and the walk here takes that; where a text could not be
//! evaluated, it finds names by what is declared, and a test compares both.

mod ask;
mod collect;
mod def;
mod members;
mod settle;
mod views;
mod walk;

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, LazyLock, RwLock};

use matterix_ir::{FileId, Sources, Span};
use matterix_lang::ast::{Item, ItemKind};
use matterix_lang::names::{DeclId, Module};
use matterix_lang::units::Dimension;
use matterix_lang::{Meanings, SemanticIndex};

pub use def::{Def, DefId, Kind, Local, Meaning, Region, Use};
pub use members::Member;

use crate::Analysis;
use crate::references::Place;

/// What a set of modules declares and names.
#[derive(Clone, Debug, Default)]
pub(crate) struct Part {
    /// Number of the first declaration.
    first: u32,
    defs: Vec<Def>,
    /// Declarations by where their name stands; skills and commands by their call form, too.
    by_span: HashMap<Span, DefId>,
    /// Declarations by their number in the compiler.
    decls: Vec<DefId>,
    /// Commands and skills by the words of their verb.
    verbs: BTreeMap<String, Vec<DefId>>,
    /// Failures by name, and all places that declare them.
    failures: BTreeMap<String, (DefId, Vec<Span>)>,
    /// Settings of labs by name.
    settings: BTreeMap<String, DefId>,
    /// Units and dimensions by name.
    measures: BTreeMap<String, DefId>,
    /// Names in the order of the text.
    uses: BTreeMap<FileId, Vec<Use>>,
    /// Members that assets get from files.
    given: BTreeMap<DefId, Vec<DefId>>,
    /// Members that count amounts per species.
    per_species: Vec<DefId>,
    /// Parameters of functions that some call leaves to what has their name there.
    implicit: std::collections::BTreeSet<DefId>,
    locals: BTreeMap<FileId, Vec<Local>>,
    regions: BTreeMap<FileId, Vec<Region>>,
    /// Calls of skills and commands: where, in which item, and what.
    pub(crate) calls: Vec<(Span, Option<DefId>, DefId)>,
}

/// The index of one analysis.
#[derive(Debug)]
pub struct Index {
    library: Arc<Part>,
    own: Part,
    modules: Vec<Arc<Module>>,
    sources: Arc<Sources>,
    meanings: Meanings,
    gathered: Arc<SemanticIndex>,
    /// Dimensions in words, as far as they were asked for.
    described: RwLock<HashMap<(Dimension, bool), String>>,
}

/// So many parts of the library are kept.
const MOST: usize = 8;

/// The part of the library, which is the same for all that read the same modules of it, by which these are.
static LIBRARY: RwLock<Vec<(Vec<bool>, Arc<Part>)>> = RwLock::new(Vec::new());

impl Index {
    /// The index of an analysis.
    pub fn of(analysis: &Analysis) -> Index {
        let library = Self::library_of(analysis);
        let mut index = Index {
            own: Part { first: library.defs.len() as u32, ..Part::default() },
            library,
            modules: analysis.modules.clone(),
            sources: Arc::new(analysis.sources.clone()),
            meanings: analysis.meanings.joined(),
            gathered: analysis.meanings.clone(),
            described: RwLock::default(),
        };
        index.fill(|module| !module.is_library());
        index
    }

    /// The index as it is where nothing could be evaluated: from what is declared alone.
    pub fn declared(analysis: &Analysis) -> Index {
        let around = analysis.meanings.around.clone();
        let meanings = Arc::new(SemanticIndex { around, ..SemanticIndex::default() });
        Index::of(&Analysis { meanings, ..analysis.clone() })
    }

    /// The part of the library; made once for all that read the same modules.
    fn library_of(analysis: &Analysis) -> Arc<Part> {
        let read = |module: &Arc<Module>| module.is_library() && !module.tree.items.is_empty();
        let key: Vec<bool> = analysis.modules.iter().map(read).collect();
        let find = |all: &[(Vec<bool>, Arc<Part>)]| all.iter().find(|(k, _)| *k == key).map(|(_, part)| part.clone());
        if let Some(known) = LIBRARY.read().ok().and_then(|all| find(&all)) {
            return known;
        }
        let made = Arc::new(Self::library(analysis));
        let Ok(mut all) = LIBRARY.write() else { return made };
        if let Some(known) = find(&all) {
            return known;
        }
        if all.len() == MOST {
            all.remove(0);
        }
        all.push((key, made.clone()));
        made
    }

    fn library(analysis: &Analysis) -> Part {
        let mut index = Index {
            library: Arc::default(),
            own: Part::default(),
            modules: analysis.modules.clone(),
            sources: Arc::new(analysis.sources.clone()),
            meanings: Meanings::default(),
            gathered: analysis.meanings.clone(),
            described: RwLock::default(),
        };
        index.fill(Module::is_library);
        index.own
    }

    /// Collects what some of the modules declare, then walks through them.
    fn fill(&mut self, wanted: impl Fn(&Module) -> bool) {
        let modules = self.modules.clone();
        let wanted: Vec<(usize, &Module)> =
            modules.iter().enumerate().map(|(i, m)| (i, &**m)).filter(|(_, m)| wanted(m)).collect();
        for (_, module) in &wanted {
            self.collect(module);
        }
        for (index, module) in &wanted {
            self.settle(*index, module);
        }
        for (index, module) in &wanted {
            self.walk(*index, module);
        }
        for uses in self.own.uses.values_mut() {
            uses.sort_by_key(|u| (u.span.start, u.span.end));
            uses.dedup_by_key(|u| u.span);
        }
    }

    /// A declaration.
    pub fn def(&self, id: DefId) -> &Def {
        let own = id.0.checked_sub(self.own.first).and_then(|at| self.own.defs.get(at as usize));
        own.or_else(|| self.library.defs.get(id.0 as usize)).unwrap_or(&NOTHING)
    }

    /// Every declaration, the library's first.
    pub fn defs(&self) -> impl Iterator<Item = (DefId, &Def)> {
        self.library.defs.iter().chain(&self.own.defs).enumerate().map(|(i, d)| (DefId(i as u32), d))
    }

    /// The declarations of the package.
    pub fn own_defs(&self) -> impl Iterator<Item = (DefId, &Def)> {
        self.own.defs.iter().enumerate().map(|(i, d)| (DefId(self.own.first + i as u32), d))
    }

    /// The declaration whose name stands there.
    pub(crate) fn declared_at(&self, span: Span) -> Option<DefId> {
        self.own.by_span.get(&span).or_else(|| self.library.by_span.get(&span)).copied()
    }

    /// The declaration with this number in the compiler.
    pub(crate) fn of_decl(&self, id: DeclId) -> Option<DefId> {
        let at = id.0 as usize;
        let library = self.library.decls.len();
        self.library.decls.get(at).or_else(|| self.own.decls.get(at.checked_sub(library)?)).copied()
    }

    /// The number in the compiler of a declaration.
    pub(crate) fn decl_of(&self, def: DefId) -> Option<DeclId> {
        let library = self.library.decls.len();
        let own = self.own.decls.binary_search(&def).ok().map(|i| i + library);
        own.or_else(|| self.library.decls.binary_search(&def).ok()).map(|i| DeclId(i as u32))
    }

    /// What a name of a module stands for.
    pub(crate) fn lookup(&self, module: usize, name: &str) -> Option<DefId> {
        self.gathered.around.scopes.get(module)?.get(name).and_then(|id| self.of_decl(*id))
    }

    /// The names that a module sees.
    pub(crate) fn visible(&self, module: usize) -> impl Iterator<Item = (&str, DefId)> {
        let scope = self.gathered.around.scopes.get(module).into_iter().flatten();
        scope.filter_map(|(name, id)| Some((&**name, self.of_decl(*id)?)))
    }

    /// The index of the module that a file is.
    pub(crate) fn module_of(&self, file: FileId) -> Option<usize> {
        self.modules.iter().position(|m| m.file == file)
    }

    /// Whether a place stands in a `use`.
    pub(crate) fn is_imported(&self, place: &Place) -> bool {
        let module = self.file(&place.file).and_then(|file| self.module_of(file));
        let items = module.and_then(|module| self.modules.get(module)).map_or(&[][..], |module| &module.tree.items);
        let here = |item: &&Item| (item.span.start..item.span.end).contains(&place.start);
        items.iter().find(here).is_some_and(|item| matches!(item.kind, ItemKind::Use { .. }))
    }

    /// Commands with this verb, and skills.
    pub(crate) fn verbs(&self, verb: &str) -> impl Iterator<Item = DefId> + '_ {
        let of = |part: &Part| part.verbs.get(verb).cloned().unwrap_or_default();
        of(&self.library).into_iter().chain(of(&self.own))
    }

    /// All verbs with what they may mean.
    pub(crate) fn all_verbs(&self) -> impl Iterator<Item = (&str, DefId)> {
        let all = self.library.verbs.iter().chain(&self.own.verbs);
        all.flat_map(|(verb, defs)| defs.iter().map(move |d| (verb.as_str(), *d)))
    }

    /// The failure of this name.
    pub(crate) fn failure(&self, name: &str) -> Option<DefId> {
        self.own.failures.get(name).or_else(|| self.library.failures.get(name)).map(|f| f.0)
    }

    /// The hazard or caution of this name: a run may fail with it.
    pub(crate) fn hazard(&self, name: &str) -> Option<DefId> {
        self.defs().find(|(_, d)| d.kind == Kind::Hazard && d.name == name).map(|(id, _)| id)
    }

    /// The unit or dimension of this name, without prefix.
    pub(crate) fn measure(&self, name: &str) -> Option<DefId> {
        self.own.measures.get(name).or_else(|| self.library.measures.get(name)).copied()
    }
}

/// What stands where there is no declaration.
static NOTHING: LazyLock<Def> = LazyLock::new(|| collect::bare("", Kind::Variable, Span::default(), Span::default()));
