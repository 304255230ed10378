//! The import of a name that a file uses and does not import.

use matterix_ir::{Diagnostic, Span};

use super::{Module, Names};
use crate::ast::{ItemKind, Name, Path};
use crate::syntax;

/// An import that is missing, and how it is added to the file.
pub struct Import {
    /// The module with the name: `std::heating`.
    module: String,
    /// As it stands after `use`.
    path: String,
    /// Where a file lets it be added, with the text; none in a file of the library.
    edit: Option<(Span, String)>,
    /// No other module declares the name.
    only: bool,
}

impl Import {
    /// A finding with where the name is declared and the correction that imports it.
    pub fn offered(self, d: Diagnostic) -> Diagnostic {
        let Import { module, path, edit, only } = self;
        let d = d.help(format!("it is declared in `{module}`: add `use {path}`"));
        let title = format!("add `use {path}`");
        match edit {
            Some((at, text)) if only => d.fix(title, at, text),
            Some((at, text)) => d.guess(title, at, text),
            None => d,
        }
    }
}

impl Names<'_> {
    /// The import that a module lacks for a name which another one declares for what `fits`.
    pub fn import_of(&self, into: usize, name: &str, fits: impl Fn(&ItemKind) -> bool) -> Option<Import> {
        let all = self.declaring(name).filter(|(_, id)| fits(&self.decl(*id).item.kind));
        let mut all = all.map(|(module, _)| module).filter(|module| !module.name.is_empty());
        let from = all.next()?.name.clone();
        let only = all.next().is_none();
        // A verb of several words comes with its module.
        let path = if syntax::is_name(name) { format!("{from}::{name}") } else { from.clone() };
        let reader = self.modules.get(into).filter(|module| !module.is_library());
        let edit = reader.map(|reader| {
            listed(reader, &from).filter(|_| path != from).map_or_else(
                || (below(reader), format!("\nuse {path}")),
                |last| (Span { start: last.span.end, ..last.span }, format!(", {name}")),
            )
        });
        Some(Import { module: from, path, edit, only })
    }
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
