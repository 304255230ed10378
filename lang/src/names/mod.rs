//! Modules, declarations and scopes: which item a name stands for.

pub mod imports;
mod kin;
mod mentioned;

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::{Diagnostic, FileId, Span, codes};

use crate::ast::{self, Item, ItemKind, Name};
use crate::chem::formula::Formula;
use crate::{library, near};

pub(crate) use mentioned::{bare, names_in, names_of};

/// A module: one file.
#[derive(Clone, Debug)]
pub struct Module {
    /// `std::thermal`, `sn1`; the file that is compiled has the empty name.
    pub name: String,
    /// Its file.
    pub file: FileId,
    /// Its tree.
    pub tree: ast::File,
    /// Where the line with the version of the language ends.
    pub header: usize,
}

impl Module {
    /// Whether it is part of the standard library.
    pub fn is_library(&self) -> bool {
        self.name.starts_with("std::")
    }
}

/// A declaration, by its index in [`Names`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DeclId(pub u32);

/// An item that has a name.
#[derive(Clone, Copy, Debug)]
pub struct Decl<'a> {
    /// Index of its module.
    pub module: usize,
    /// The item.
    pub item: &'a Item,
}

/// All declarations and what each module's text sees of them.
#[derive(Debug)]
pub struct Names<'a> {
    /// All modules.
    pub modules: &'a [Arc<Module>],
    /// All named items.
    pub decls: Vec<Decl<'a>>,
    /// What every module sees without an import.
    prelude: BTreeMap<Arc<str>, DeclId>,
    /// What each module sees besides.
    scopes: Vec<BTreeMap<Arc<str>, DeclId>>,
    own: Vec<BTreeMap<Arc<str>, DeclId>>,
}

/// Which modules the user's files import, directly or through others: data files of the others are not read.
pub(crate) fn used(modules: &[Arc<Module>]) -> Vec<bool> {
    let mut used: Vec<bool> = modules.iter().map(|m| !m.is_library()).collect();
    let mut todo: Vec<usize> = (0..modules.len()).filter(|i| used[*i]).collect();
    while let Some(index) = todo.pop() {
        for item in &modules[index].tree.items {
            let ItemKind::Use { path, names } = &item.kind else { continue };
            let candidates = module_candidates(path, names.is_some());
            let found = candidates.iter().find_map(|c| modules.iter().position(|m| m.name == *c));
            if let Some(found) = found.filter(|f| !std::mem::replace(&mut used[*f], true)) {
                todo.push(found);
            }
        }
    }
    used
}

/// Module paths a `use` may mean: with braces the path, without them the path or the path less its last segment.
pub(crate) fn module_candidates(path: &ast::Path, braces: bool) -> Vec<String> {
    let join = |n: usize| path.segments[..n].iter().map(|s| s.text.as_str()).collect::<Vec<_>>().join("::");
    let n = path.segments.len();
    if braces || n == 1 { vec![join(n)] } else { vec![join(n - 1), join(n)] }
}

/// The name an item is found by: its own, or the words of a skill's verb.
pub fn item_name(item: &Item) -> Option<(String, Span)> {
    let of = |n: &Name| Some((n.text.clone(), n.span));
    match &item.kind {
        ItemKind::Species { name, .. }
        | ItemKind::Solution { name, .. }
        | ItemKind::Reaction { name, .. }
        | ItemKind::Equilibrium { name, .. }
        | ItemKind::Interaction { name, .. }
        | ItemKind::ReactiveGroup { name, .. }
        | ItemKind::Material { name, .. }
        | ItemKind::Hazard { name, .. }
        | ItemKind::Capability { name, .. }
        | ItemKind::Asset { name, .. }
        | ItemKind::Relation { name, .. }
        | ItemKind::Fn { name, .. }
        | ItemKind::Const { name, .. }
        | ItemKind::Table { name, .. }
        | ItemKind::Framing { name, .. }
        | ItemKind::Driver { name, .. }
        | ItemKind::Lab { name, .. }
        | ItemKind::Workflow { name, .. }
        | ItemKind::Study { name, .. }
        | ItemKind::Fit { name, .. }
        | ItemKind::Test { name, .. } => of(name),
        ItemKind::Process(p) => of(&p.name),
        ItemKind::Event(e) => of(&e.name),
        ItemKind::Skill { sig, .. } => Some((verb_text(&sig.verb), sig.span)),
        ItemKind::Error
        | ItemKind::Use { .. }
        | ItemKind::Dimension { .. }
        | ItemKind::Unit { .. }
        | ItemKind::Incompatible { .. }
        | ItemKind::Allow { .. }
        | ItemKind::Accept { .. } => None,
    }
}

/// The words of a verb, joined by blanks.
pub fn verb_text(words: &[Name]) -> String {
    words.iter().map(|w| w.text.as_str()).collect::<Vec<_>>().join(" ")
}

impl<'a> Names<'a> {
    /// Collects the declarations of all modules and resolves their imports.
    pub fn new(modules: &'a [Arc<Module>]) -> (Self, Vec<Diagnostic>) {
        let mut names =
            Names { modules, decls: Vec::new(), prelude: BTreeMap::new(), scopes: Vec::new(), own: Vec::new() };
        let mut diagnostics = Vec::new();
        for (index, module) in modules.iter().enumerate() {
            let own = names.collect(index, module, &mut diagnostics);
            names.own.push(own);
        }
        names.prelude = names.prelude();
        for (index, module) in modules.iter().enumerate() {
            let mut scope = BTreeMap::new();
            names.import(module, &mut scope, &mut diagnostics);
            scope.extend(names.own[index].iter().map(|(k, v)| (k.clone(), *v)));
            names.scopes.push(scope);
        }
        (names, diagnostics)
    }

    fn collect(
        &mut self,
        index: usize,
        module: &'a Module,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> BTreeMap<Arc<str>, DeclId> {
        let mut own: BTreeMap<Arc<str>, DeclId> = BTreeMap::new();
        for item in &module.tree.items {
            let Some((name, span)) = item_name(item) else { continue };
            let id = DeclId(self.decls.len() as u32);
            self.decls.push(Decl { module: index, item });
            if let Some(first) = own.insert(name.as_str().into(), id) {
                let first_span = item_name(self.decl(first).item).map_or(span, |n| n.1);
                own.insert(name.as_str().into(), first);
                diagnostics.push(
                    Diagnostic::error(
                        codes::DUPLICATE_NAME,
                        span,
                        format!("`{name}` is declared twice"),
                        "declared again here",
                    )
                    .because(first_span, "first declared here")
                    .help("give one of them another name"),
                );
            }
        }
        own
    }

    fn module_index(&self, name: &str) -> Option<usize> {
        self.modules.iter().position(|m| m.name == name)
    }

    fn prelude(&self) -> BTreeMap<Arc<str>, DeclId> {
        let mut scope = BTreeMap::new();
        let Some(prelude) = self.module_index("std::prelude") else { return scope };
        for name in library::imported(&self.modules[prelude].tree) {
            if let Some(module) = self.module_index(&name) {
                scope.extend(self.own[module].iter().map(|(k, v)| (k.clone(), *v)));
            }
        }
        scope
    }

    fn import(&self, module: &Module, scope: &mut BTreeMap<Arc<str>, DeclId>, diagnostics: &mut Vec<Diagnostic>) {
        for item in &module.tree.items {
            let ItemKind::Use { path, names } = &item.kind else { continue };
            let candidates = module_candidates(path, names.is_some());
            let Some((position, from)) =
                candidates.iter().enumerate().find_map(|(i, c)| self.module_index(c).map(|m| (i, m)))
            else {
                if path.segments[0].text == "std" {
                    // `std` alone is no module: of `use std::NAME` the module is all of it.
                    let wanted = candidates.iter().find(|c| c.contains("::")).unwrap_or(&candidates[0]);
                    let near = near::nearest(wanted, self.modules.iter().map(|m| &m.name));
                    let headline = format!("unknown module `{wanted}`");
                    let d = Diagnostic::error(codes::UNKNOWN_MODULE, path.span, headline, "imported here");
                    // What is imported from the module stays as it is.
                    let end = path.segments.get(wanted.matches("::").count()).map_or(path.span.end, |s| s.span.end);
                    diagnostics.push(near::proposed(d, &near, Span { end, ..path.span }));
                }
                continue;
            };
            let last = path.segments.last().into_iter().collect::<Vec<_>>();
            let wanted: Vec<&Name> = match names {
                Some(list) => list.iter().collect(),
                None if position == 0 && candidates.len() > 1 => last,
                None => {
                    scope.extend(self.own[from].iter().map(|(k, v)| (k.clone(), *v)));
                    continue;
                }
            };
            for name in wanted {
                match self.own[from].get(name.text.as_str()) {
                    Some(&id) => {
                        scope.insert(name.text.as_str().into(), id);
                    }
                    None => {
                        let d = self.not_in_module(name, from);
                        diagnostics.push(self.with_import(d, path, names.as_deref(), &name.text));
                    }
                }
            }
        }
    }

    fn not_in_module(&self, name: &Name, module: usize) -> Diagnostic {
        let from = &self.modules[module].name;
        let mut d = Diagnostic::about(
            from,
            codes::UNKNOWN_NAME,
            name.span,
            format!("`{from}` declares no `{}`", name.text),
            "not found",
        );
        if let Some(other) = self.declared_in(&name.text) {
            return d.help(format!("`{}` is declared in `{other}`", name.text));
        }
        let near = kin::near_species(&name.text, self.own[module].keys().map(|name| &**name));
        if let Some(kin) = kin::in_module(&name.text, from) {
            return near::proposed(d, &[kin], name.span);
        }
        d = near::proposed(d, &near, name.span);
        d
    }

    /// What is wrong with a name that is written with its module: the module is not there or declares no such name.
    pub fn scoped(&self, module: usize, path: &ast::Path) -> Option<Diagnostic> {
        let (name, front) = path.segments.split_last().filter(|(_, front)| !front.is_empty())?;
        if self.lookup(module, &name.text).is_some() {
            return None;
        }
        let front = front.iter().map(|s| s.text.as_str()).collect::<Vec<_>>().join("::");
        if let Some(from) = self.module_index(&front) {
            let declared = self.declaring(&name.text).any(|(module, _)| module.name == front);
            return (!declared).then(|| self.not_in_module(name, from));
        }
        let near = near::nearest(&front, self.modules.iter().map(|m| &m.name));
        let headline = format!("the module `{front}` is not imported");
        let mut d = Diagnostic::about(&front, codes::UNKNOWN_NAME, path.span, headline, "no such name here");
        d.help.extend(near::question(&near));
        Some(d.help(format!("import it: `use {front}`")))
    }

    /// The declaration.
    pub fn decl(&self, id: DeclId) -> Decl<'a> {
        self.decls[id.0 as usize]
    }

    /// What `name` stands for in a module.
    pub fn lookup(&self, module: usize, name: &str) -> Option<DeclId> {
        self.scopes[module].get(name).or_else(|| self.prelude.get(name)).copied()
    }

    /// What `name` of the library stands for where an import hides what every module sees.
    pub fn hidden(&self, module: usize, name: &str) -> Option<DeclId> {
        let shown = self.lookup(module, name)?;
        let library = self.modules[self.decl(shown).module].is_library();
        self.prelude.get(name).copied().filter(|id| library && *id != shown)
    }

    /// What the names that each module sees stand for.
    pub fn into_scopes(self) -> Vec<BTreeMap<Arc<str>, DeclId>> {
        let Names { scopes, prelude, .. } = self;
        let whole = |scope: BTreeMap<Arc<str>, DeclId>| {
            let mut all = prelude.clone();
            all.extend(scope);
            all
        };
        scopes.into_iter().map(whole).collect()
    }

    /// Everything a module sees, in order of name.
    pub fn visible(&self, module: usize) -> impl Iterator<Item = (&str, DeclId)> {
        let scope = &self.scopes[module];
        let shared = self.prelude.iter().filter(|(name, _)| !scope.contains_key(*name));
        let mut all: Vec<(&str, DeclId)> = scope.iter().chain(shared).map(|(k, v)| (&**k, *v)).collect();
        all.sort_unstable_by(|a, b| a.0.cmp(b.0));
        all.into_iter()
    }

    /// The declarations of a kind in the modules that the user's files use, directly or through others.
    pub fn in_use(&self, is: fn(&ItemKind) -> bool) -> impl Iterator<Item = &Decl<'a>> {
        let all = self.decls.iter().filter(move |decl| is(&decl.item.kind));
        // A file without any pays nothing for the question.
        let used = if all.clone().next().is_some() { used(self.modules) } else { Vec::new() };
        all.filter(move |decl| used.get(decl.module) == Some(&true))
    }

    /// What a module itself declares, in the order of its text.
    pub fn declared_by(&self, module: usize) -> impl Iterator<Item = DeclId> + '_ {
        self.decls.iter().enumerate().filter(move |(_, d)| d.module == module).map(|(i, _)| DeclId(i as u32))
    }

    /// The library module that declares a name, for help.
    pub fn declared_in(&self, name: &str) -> Option<&str> {
        self.declaring(name).next().map(|(module, _)| module.name.as_str())
    }

    /// The modules that declare a name, with what they declare; a module that was not read declares a species.
    fn declaring(&self, name: &str) -> impl Iterator<Item = (&Module, Option<DeclId>)> {
        let all = self.modules.iter().zip(&self.own);
        all.filter_map(move |(module, own)| match own.get(name) {
            Some(id) => Some((&**module, Some(*id))),
            None if own.is_empty() => library::apart(&module.name).contains(&name).then_some((&**module, None)),
            None => None,
        })
    }

    /// The item of a kind, called `what`, that a path names as a module sees it.
    pub fn find(
        &self,
        module: usize,
        path: &ast::Path,
        what: &str,
        fits: impl Fn(&ItemKind) -> bool,
    ) -> Result<DeclId, Box<Diagnostic>> {
        let Some(word) = path.segments.last() else {
            return Err(Box::new(Diagnostic::error(codes::SYNTAX, path.span, format!("a {what} is missing"), "here")));
        };
        match self.lookup(module, &word.text) {
            Some(id) if fits(&self.decl(id).item.kind) => Ok(id),
            _ => Err(Box::new(self.unknown(module, word, what, fits))),
        }
    }

    /// A name that nothing visible has, with suggestions among what `fits`.
    pub fn unknown(&self, module: usize, name: &Name, what: &str, fits: impl Fn(&ItemKind) -> bool) -> Diagnostic {
        let candidates = self.visible(module).filter(|(_, id)| fits(&self.decl(*id).item.kind)).map(|(n, _)| n);
        let d = near::unknown(name, format!("unknown {what} `{}`", name.text), "not declared");
        if let Some(import) = self.import_of(module, &name.text, &fits) {
            return import.offered(d);
        }
        if !fits(&kin::of_name(name)) {
            return near::proposed(d, &near::nearest(&name.text, candidates), name.span);
        }
        let near = kin::near_species(&name.text, candidates);
        self.with_kin(module, name, d).unwrap_or_else(|d| match near.is_empty() {
            true => {
                let formula = match name.text.chars().last() {
                    _ if Formula::parse(&name.text).is_ok() => name.text.as_str(),
                    Some('-') => "C7H5O2-",
                    Some('+') => "C7H7O2+",
                    _ => "C7H6O2",
                };
                let fields = format!("formula: \"{formula}\", molar_volume: 100 mL/mol, heat_capacity: 150 J/(mol*K)");
                d.help(format!("declare it, with numbers of its own: `species {} {{ {fields} }}`", name.text))
            }
            false => near::proposed(*d, &near, name.span),
        })
    }
}
