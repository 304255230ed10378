//! A walk through a module that finds what each name stands for.

mod calls;
mod chemistry;
mod drivers;
mod exprs;
mod items;
mod labs;
mod laws;
mod many;
mod steps;
mod things;
mod types;

use matterix_ir::{FileId, Span};
use matterix_lang::ast::{Name, Param};
use matterix_lang::names::Module;
use matterix_lang::semantic_index::Sort;

use super::collect::bare;
use super::{DefId, Index, Kind, Local, Meaning, Region, Use};

/// What an expression was found to be.
#[derive(Clone, Debug)]
pub(super) struct Found {
    sort: Sort,
    /// What is declared that it names, for the words that it may be.
    def: Option<DefId>,
}

impl Found {
    fn nothing() -> Found {
        Found { sort: Sort::Any, def: None }
    }

    fn of(sort: Sort) -> Found {
        Found { sort, def: None }
    }
}

/// A walk in progress.
struct Walk<'i> {
    index: &'i mut Index,
    /// The module.
    at: usize,
    /// Local names, innermost last.
    scope: Vec<(String, DefId)>,
    /// Labs whose things are seen.
    labs: Vec<DefId>,
    /// The kind whose members are seen without a dot.
    this: Option<DefId>,
    /// The item.
    item: Option<DefId>,
    /// Where the block ends.
    end: u32,
    file: FileId,
}

impl Index {
    /// Walks through a module.
    pub(super) fn walk(&mut self, at: usize, module: &Module) {
        let file = module.file;
        let items = module.tree.items.iter();
        let mut walk =
            Walk { index: self, at, scope: Vec::new(), labs: Vec::new(), this: None, item: None, end: 0, file };
        items.for_each(|item| walk.item(item));
    }
}

impl Walk<'_> {
    /// Notes what a name stands for.
    fn note(&mut self, span: Span, meaning: Meaning) {
        if !span.is_empty() {
            self.index.own.uses.entry(span.file).or_default().push(Use { span, meaning });
        }
    }

    fn known(&mut self, span: Span, def: DefId) {
        self.note(span, Meaning::Def(def));
    }

    fn language(&mut self, span: Span, what: &'static str) {
        self.note(span, Meaning::Language(what));
    }

    fn maybe(&mut self, span: Span, def: Option<DefId>) {
        self.note(span, def.map_or(Meaning::Unknown, Meaning::Def));
    }

    /// The place where a declaration has its name.
    fn declares(&mut self, span: Span) -> Option<DefId> {
        let id = self.index.declared_at(span);
        self.maybe(span, id);
        id
    }

    /// Adds a local name that is seen from here to the end of the block.
    fn bind(&mut self, kind: Kind, name: &Name, whole: Span, found: &Found) -> DefId {
        let words = found.def.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
        let owner = self.item;
        // Where a text is looked at twice, it declares once.
        let known = self.index.declared_at(name.span).filter(|d| self.index.def(*d).kind == kind);
        let id = known.unwrap_or_else(|| self.index.add(bare(&name.text, kind, name.span, whole)));
        if let Some(def) = self.index.own_mut(id) {
            def.owner = owner;
            def.sort = found.sort.clone();
            def.words = if matches!(found.sort, Sort::Word(_)) { words } else { Vec::new() };
        }
        self.known(name.span, id);
        self.enter(&name.text, id, name.span.start);
        id
    }

    /// Makes a declaration seen from here to the end of the block.
    fn enter(&mut self, name: &str, id: DefId, from: u32) {
        self.scope.push((name.to_string(), id));
        let span = Span { file: self.file, start: from, end: self.end.max(from) };
        self.index.own.locals.entry(self.file).or_default().push(Local { span, def: id });
    }

    /// Does something in a block of its own; steps that it names stay.
    fn inside(&mut self, block: Span, does: impl FnOnce(&mut Self)) {
        let depth = self.scope.len();
        let end = std::mem::replace(&mut self.end, block.end);
        does(self);
        self.end = end;
        let inner = self.scope.split_off(depth);
        for (name, id) in inner {
            if self.index.def(id).kind == Kind::Step {
                self.enter(&name, id, block.end);
            }
        }
    }

    /// The parameters of an item, as local names; the conditions of their types may name them.
    fn enter_params<'p>(&mut self, params: impl Iterator<Item = &'p Param> + Clone) {
        for name in params.clone().map(|p| &p.name) {
            if let Some(id) = self.declares(name.span) {
                let from = name.span.start;
                self.enter(&name.text, id, from);
            }
        }
        self.exprs(params.filter_map(|p| p.ty.as_ref()?.condition.as_ref()));
    }

    /// What a text sees beside the names of its module.
    fn region(&mut self, span: Span) {
        let region = Region { span, labs: self.labs.clone(), this: self.this, item: self.item };
        self.index.own.regions.entry(span.file).or_default().push(region);
    }
}
