//! What an index is asked: names at places, what is seen there, what was found of expressions.

use std::collections::BTreeMap;

use matterix_ir::{FileId, Sources, Span};
use matterix_lang::names::{DeclId, Module};
use matterix_lang::semantic_index::Seen;
use matterix_lang::units::Dimension;

use super::{DefId, Index, Kind, Meaning, Part, Region, Use};

impl Index {
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
