//! The index of names: what every name in a text stands for, and where else it stands.
//!
//! Two ways were compared. To resolve names in a tree apart from the evaluator can say something else than what was checked. So
//! the evaluator notes what it has found (`matterix_lang::meanings`), and the walk here takes that; where a text could not be
//! evaluated, it finds names by what is declared, and a test compares both.

mod collect;
mod def;
mod members;
mod settle;
mod walk;

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, OnceLock, RwLock};

use matterix_ir::{FileId, Sources, Span};
use matterix_lang::meanings::{Seen, Sort};
use matterix_lang::names::{DeclId, Module};
use matterix_lang::units::Dimension;
use matterix_lang::{Gathered, Meanings};

pub use def::{Def, DefId, Kind, Local, Meaning, Region, Use};
pub use members::Member;

use crate::Analysis;

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
    gathered: Arc<Gathered>,
    /// Dimensions in words, as far as they were asked for.
    described: RwLock<HashMap<(Dimension, bool), String>>,
}

/// The part of the library, which is the same for everyone.
static LIBRARY: OnceLock<Arc<Part>> = OnceLock::new();

impl Index {
    /// The index of an analysis.
    pub fn of(analysis: &Analysis) -> Index {
        let library = LIBRARY.get_or_init(|| Arc::new(Self::library(analysis)));
        let mut index = Index {
            library: library.clone(),
            own: Part { first: library.defs.len() as u32, ..Part::default() },
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
        let meanings = Arc::new(Gathered { around, ..Gathered::default() });
        Index::of(&Analysis { meanings, ..analysis.clone() })
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

    /// The unit or dimension of this name, without prefix.
    pub(crate) fn measure(&self, name: &str) -> Option<DefId> {
        self.own.measures.get(name).or_else(|| self.library.measures.get(name)).copied()
    }

    /// Names of a file in the order of its text.
    pub fn uses(&self, file: FileId) -> &[Use] {
        self.own.uses.get(&file).or_else(|| self.library.uses.get(&file)).map_or(&[], Vec::as_slice)
    }

    /// The name at a place, or just before it; the innermost one.
    pub fn at(&self, file: FileId, offset: usize) -> Option<Use> {
        let uses = self.uses(file);
        let from = uses.partition_point(|u| (u.span.start as usize) <= offset);
        let touching = uses[..from].iter().rev().take(8).filter(|u| (u.span.end as usize) >= offset);
        // A cursor between two names means the one that begins there.
        touching.min_by_key(|u| (u.span.end as usize == offset, u.span.len())).copied()
    }

    /// The declaration that the name at a place stands for.
    pub fn def_at(&self, file: FileId, offset: usize) -> Option<DefId> {
        match self.at(file, offset)?.meaning {
            Meaning::Def(def) => Some(def),
            _ => None,
        }
    }

    /// What was found of an expression.
    pub fn seen(&self, span: Span) -> Option<&Seen> {
        self.meanings.values.get(&span)
    }

    /// The innermost expression at a place that something was found of.
    pub fn seen_at(&self, file: FileId, offset: usize) -> Option<(Span, &Seen)> {
        let at = |s: &Span| s.file == file && s.start as usize <= offset && offset <= s.end as usize;
        let found = self.meanings.values.iter().filter(|(span, _)| at(span));
        found.min_by_key(|(span, _)| (span.len(), span.start)).map(|(span, seen)| (*span, seen))
    }

    /// What was found of the longest expression that ends where a declaration ends.
    pub(crate) fn seen_ending(&self, whole: Span) -> Option<&Seen> {
        let ends = |s: &Span| s.file == whole.file && s.end == whole.end && s.start >= whole.start;
        let found = self.meanings.values.iter().filter(|(span, _)| ends(span));
        found.max_by_key(|(span, _)| span.len()).map(|(_, seen)| seen)
    }

    /// All names of all files, in the order of files and texts.
    pub(crate) fn all_uses(&self) -> impl Iterator<Item = &Use> {
        self.library.uses.values().chain(self.own.uses.values()).flatten()
    }

    /// Whether some call of a function leaves a parameter to what has its name there.
    pub(crate) fn is_implicit(&self, def: DefId) -> bool {
        self.own.implicit.contains(&def) || self.library.implicit.contains(&def)
    }

    /// A kind with everything that it extends and everything that extends it.
    pub(crate) fn family(&self, kind: DeclId) -> Vec<DeclId> {
        let around = &self.gathered.around.ancestors;
        let below = around.iter().filter(|(_, above)| above.contains(&kind)).map(|(id, _)| *id);
        let mut all: Vec<DeclId> = below.flat_map(|id| self.ancestors(id).to_vec()).collect();
        all.sort();
        all.dedup();
        all
    }

    /// Local declarations that belong to something, variables included.
    pub(crate) fn own_inside(&self, owner: DefId) -> Vec<DefId> {
        self.own_defs().filter(|(_, d)| d.owner == Some(owner)).map(|d| d.0).collect()
    }

    /// What a bare name stands for at a place, as far as what is declared tells.
    pub(crate) fn named_at(&self, file: FileId, offset: usize, name: &str) -> Option<DefId> {
        self.names_at(file, offset).into_iter().find(|d| self.def(*d).name == name)
    }

    /// All that can be named at a place, what goes before other things first.
    pub(crate) fn names_at(&self, file: FileId, offset: usize) -> Vec<DefId> {
        let mut out: Vec<DefId> = self.locals(file, offset).collect();
        if let Some(region) = self.region(file, offset) {
            if let Some(kind) = region.this.and_then(|k| self.decl_of(k)) {
                out.extend(self.members_of(&[kind]));
            }
            let mut labs = region.labs.clone();
            out.extend(labs.iter().flat_map(|l| &self.def(*l).inside));
            for _ in 0..4 {
                labs = labs
                    .iter()
                    .flat_map(|l| &self.def(*l).inside)
                    .map(|d| self.def(*d))
                    .filter(|d| d.kind == Kind::Included)
                    .flat_map(|d| d.words.clone())
                    .collect();
                out.extend(
                    labs.iter().flat_map(|l| &self.def(*l).inside).filter(|d| self.def(**d).kind == Kind::Setting),
                );
            }
        }
        if let Some(module) = self.module_of(file) {
            out.extend(self.visible(module).map(|v| v.1));
        }
        out
    }

    /// Everything that each lab holds, with its kinds, by full name.
    pub(crate) fn labs_built(&self) -> impl Iterator<Item = &BTreeMap<String, Vec<DeclId>>> {
        self.meanings.things.values()
    }

    /// Everything that was found of expressions.
    pub(crate) fn all_seen(&self) -> impl Iterator<Item = &Seen> {
        self.meanings.values.values()
    }

    /// Names of all modules.
    pub(crate) fn module_names(&self) -> impl Iterator<Item = &str> {
        self.modules.iter().map(|m| m.name.as_str()).filter(|n| !n.is_empty())
    }

    /// What a module declares by name.
    pub(crate) fn declared_in(&self, module: &str) -> Vec<DefId> {
        let Some(module) = self.modules.iter().find(|m| m.name == module) else { return Vec::new() };
        let part = if self.is_library(module.file) { &*self.library } else { &self.own };
        part.decls.iter().copied().filter(|d| self.def(*d).span.file == module.file).collect()
    }

    /// A module by its number.
    pub(crate) fn module_at(&self, module: u32) -> Option<&Module> {
        self.modules.get(module as usize).map(|m| &**m)
    }

    /// The file of a module.
    pub(crate) fn module_file(&self, module: u32) -> Option<FileId> {
        self.module_at(module).map(|m| m.file)
    }

    /// The setting of a lab with this name, if one has it.
    pub(crate) fn setting(&self, name: &str) -> Option<DefId> {
        self.own.settings.get(name).or_else(|| self.library.settings.get(name)).copied()
    }

    /// A dimension in words.
    pub(crate) fn described(&self, dimension: &Dimension, point: bool) -> String {
        let key = (dimension.clone(), point);
        if let Some(known) = self.described.read().ok().and_then(|known| known.get(&key).cloned()) {
            return known;
        }
        let words = self.units().describe(dimension, point);
        if let Ok(mut known) = self.described.write() {
            known.insert(key, words.clone());
        }
        words
    }

    /// All dimensions and units.
    pub fn units(&self) -> &matterix_lang::units::Units {
        &self.gathered.around.units
    }

    /// The text of a span.
    pub fn text(&self, span: Span) -> &str {
        self.sources.slice(span)
    }

    /// All texts.
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// Whether a file is part of the standard library.
    pub fn is_library(&self, file: FileId) -> bool {
        matterix_lang::library::is_module(file)
    }

    /// The files of the package.
    pub fn own_files(&self) -> impl Iterator<Item = FileId> + '_ {
        self.modules.iter().filter(|m| !m.is_library()).map(|m| m.file)
    }

    /// The file under a name, as the sources have it.
    pub fn file(&self, name: &str) -> Option<FileId> {
        let files = (0..).map(FileId).map_while(|id| Some((id, self.sources.get(id)?)));
        let mut files = files.filter(|(_, s)| s.name == name);
        files.next().map(|f| f.0)
    }

    /// The name of the module that a file is.
    pub fn module_name(&self, file: FileId) -> &str {
        self.modules.iter().find(|m| m.file == file).map_or("", |m| &m.name)
    }

    /// Local names that are seen at a place, innermost first.
    pub(crate) fn locals(&self, file: FileId, offset: usize) -> impl Iterator<Item = DefId> + '_ {
        let part = if self.is_library(file) { &*self.library } else { &self.own };
        let all = part.locals.get(&file).map_or(&[][..], Vec::as_slice);
        let at = offset as u32;
        all.iter().rev().filter(move |l| l.span.start <= at && at <= l.span.end).map(|l| l.def)
    }

    /// What can be named at a place beside the names of its module.
    pub(crate) fn region(&self, file: FileId, offset: usize) -> Option<&Region> {
        let part = if self.is_library(file) { &*self.library } else { &self.own };
        let at = offset as u32;
        let all = part.regions.get(&file)?;
        all.iter().filter(|r| r.span.start <= at && at <= r.span.end).min_by_key(|r| r.span.len())
    }

    /// Calls of skills and commands in the package and the library.
    pub(crate) fn calls(&self) -> impl Iterator<Item = &(Span, Option<DefId>, DefId)> {
        self.own.calls.iter().chain(&self.library.calls)
    }

    /// All places that declare a failure.
    pub(crate) fn failure_places(&self, name: &str) -> Vec<Span> {
        let of = |part: &Part| part.failures.get(name).map(|f| f.1.clone()).unwrap_or_default();
        let mut all = of(&self.own);
        all.extend(of(&self.library));
        all
    }

    /// The kinds of things of a lab by their full names, as they were built.
    pub(crate) fn built(&self, full: &str) -> Option<&Vec<DeclId>> {
        self.meanings.things.values().find_map(|lab| lab.get(full))
    }

    /// A kind with everything it extends, most derived first.
    pub(crate) fn ancestors(&self, kind: DeclId) -> &[DeclId] {
        self.gathered.around.ancestors.get(&kind).map_or(&[], Vec::as_slice)
    }
}

/// What stands where there is no declaration.
static NOTHING: Def = Def {
    name: String::new(),
    kind: Kind::Variable,
    span: Span { file: FileId(0), start: 0, end: 0 },
    whole: Span { file: FileId(0), start: 0, end: 0 },
    head: Span { file: FileId(0), start: 0, end: 0 },
    docs: Vec::new(),
    sort: Sort::Any,
    words: Vec::new(),
    owner: None,
    inside: Vec::new(),
    label: None,
};
