//! The import of a name that a file uses and does not import.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::{Diagnostic, Edit, FileId, Fix, Label, Missing, Span};

use super::kin::of_name;
use super::{Module, Names};
use crate::ast::{ItemKind, Name, Path};
use crate::syntax;

/// An import that is missing, and how it is added to the file.
pub struct Import {
    /// The module with the name: `std::heating`.
    module: String,
    /// As it stands after `use`.
    pub(super) path: String,
    /// How a file that is not of the library lets it be added.
    pub(super) missing: Option<Missing>,
}

impl Import {
    /// A finding with where the name is declared and the correction that imports it.
    pub fn offered(self, d: Diagnostic) -> Diagnostic {
        let Import { module, path, missing } = self;
        let d = d.help(format!("it is declared in `{module}`: add `use {path}`"));
        let Some(missing) = missing else { return d };
        let fix = fix(&[&missing]);
        Diagnostic { fixes: vec![fix], missing: Some(missing), ..d }
    }
}

impl Names<'_> {
    /// The import that a module lacks for a name which another one declares for what `fits`.
    pub fn import_of(&self, into: usize, name: &str, fits: impl Fn(&ItemKind) -> bool) -> Option<Import> {
        let unread = || of_name(&Name { text: name.to_string(), span: Span::default() });
        let all = self
            .declaring(name)
            .filter(|(_, id)| id.map_or_else(|| fits(&unread()), |id| fits(&self.decl(id).item.kind)));
        let mut all = all.map(|(module, _)| module).filter(|module| !module.name.is_empty());
        let module = all.next()?.name.clone();
        let only = all.next().is_none();
        // A verb of several words comes with its module.
        let name = syntax::is_name(name).then(|| name.to_string());
        let path = name.as_ref().map_or_else(|| module.clone(), |name| format!("{module}::{name}"));
        let reader = self.modules.get(into).filter(|module| !module.is_library());
        let missing = reader.map(|reader| {
            let list = listed(reader, &module).map(|last| Span { start: last.span.end, ..last.span });
            Missing { module: module.clone(), name, below: below(reader), list, only }
        });
        Some(Import { module, path, missing })
    }
}

/// The correction that adds all of these imports of one file.
pub(super) fn fix(all: &[&Missing]) -> Fix {
    let mut modules: BTreeMap<&str, Vec<&Missing>> = BTreeMap::new();
    for missing in all {
        modules.entry(&missing.module).or_default().push(missing);
    }
    let (mut lines, mut edits, mut titles) = (String::new(), Vec::new(), Vec::new());
    for (module, of_it) in &modules {
        let names: BTreeSet<&str> = of_it.iter().filter_map(|m| m.name.as_deref()).collect();
        let names: Vec<&str> = names.into_iter().collect();
        let path = match names.as_slice() {
            // All of the module is wanted by one of them.
            _ if of_it.iter().any(|m| m.name.is_none()) => module.to_string(),
            [one] => format!("{module}::{one}"),
            several => format!("{module}::{{{}}}", several.join(", ")),
        };
        let list = of_it.iter().find_map(|m| m.list).filter(|_| of_it.iter().all(|m| m.name.is_some()));
        match list {
            Some(at) => edits.push(Edit { span: at, text: format!(", {}", names.join(", ")) }),
            None => lines += &format!("\nuse {path}"),
        }
        titles.push(format!("`use {path}`"));
    }
    if let Some(first) = all.first().filter(|_| !lines.is_empty()) {
        edits.push(Edit { span: first.below, text: lines });
    }
    edits.sort_by_key(|edit| edit.span.start);
    Fix { title: format!("add {}", titles.join(" and ")), edits, sure: all.iter().all(|m| m.only), asks: false }
}

/// All imports that a file lacks as one finding, at the first place that needs one: one mistake, one correction.
pub fn joined(findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut first: BTreeMap<FileId, usize> = BTreeMap::new();
    let mut out: Vec<Diagnostic> = Vec::new();
    let mut others: BTreeMap<usize, Vec<Diagnostic>> = BTreeMap::new();
    for d in findings {
        let Some(file) = d.missing.as_ref().map(|missing| missing.below.file) else {
            out.push(d);
            continue;
        };
        match first.get(&file) {
            Some(at) => others.entry(*at).or_default().push(d),
            None => {
                first.insert(file, out.len());
                out.push(d);
            }
        }
    }
    for (at, others) in others {
        if let Some(d) = out.get_mut(at) {
            join(d, others);
        }
    }
    out
}

/// Adds what else is not imported to the first finding about that.
fn join(d: &mut Diagnostic, others: Vec<Diagnostic>) {
    let all: Vec<&Missing> = d.missing.iter().chain(others.iter().filter_map(|o| o.missing.as_ref())).collect();
    let mut names: Vec<String> = Vec::new();
    for missing in &all {
        let name = missing.name.as_ref().unwrap_or(&missing.module);
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    let fix = fix(&all);
    if let ([before @ .., last], true) = (names.as_slice(), names.len() > 1) {
        let before: Vec<String> = before.iter().map(|name| format!("`{name}`")).collect();
        d.headline = format!("{} and `{last}` are not imported", before.join(", "));
        d.help = vec![fix.title.clone()];
        if let Some(label) = d.labels.first_mut() {
            label.text = "the first of them".to_string();
        }
    }
    let mut said: BTreeSet<&Option<String>> = d.missing.iter().map(|missing| &missing.name).collect();
    for other in &others {
        let Some(missing) = &other.missing else { continue };
        if said.insert(&missing.name) {
            let name = missing.name.as_ref().unwrap_or(&missing.module);
            d.labels.push(Label { span: other.span(), text: format!("`{name}` is needed here"), primary: false });
        }
    }
    d.fixes = vec![fix];
}

impl Names<'_> {
    /// The correction of an import whose name only another module declares, where it imports nothing else.
    pub(super) fn with_import(&self, d: Diagnostic, path: &Path, list: Option<&[Name]>, name: &str) -> Diagnostic {
        let mut all = self.declaring(name).map(|(module, _)| &module.name).filter(|module| !module.is_empty());
        let (Some(from), None) = (all.next(), all.next()) else { return d };
        let text = match list {
            None => format!("{from}::{name}"),
            Some([_]) => from.clone(),
            Some(_) => return d,
        };
        d.fix(format!("import it from `{from}`"), path.span, text)
    }
}

/// The last name that a file imports in braces from a module.
fn listed<'m>(reader: &'m Module, from: &str) -> Option<&'m Name> {
    let is = |path: &Path| path.segments.iter().map(|s| s.text.as_str()).eq(from.split("::"));
    reader.tree.items.iter().rev().find_map(|item| match &item.kind {
        ItemKind::Use { path, names: Some(names) } if is(path) => names.last(),
        _ => None,
    })
}

/// Below the imports of a file, or below its version where it has none.
fn below(reader: &Module) -> Span {
    let last = reader.tree.items.iter().rfind(|item| matches!(item.kind, ItemKind::Use { .. }));
    let end = last.map_or(reader.header, |item| item.span.end as usize);
    Span::new(reader.file, end, end)
}
