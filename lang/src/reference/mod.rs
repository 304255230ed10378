//! The reference of the standard library as pages of Markdown, written from its own texts: a page for each module, and an index.
//!
//! Types, values and conditions are shown as they are written; what a thing is for is what stands above it after `///`.

mod calls;
mod index;
mod markdown;
mod measures;
mod page;
mod tables;
mod things;

use std::collections::BTreeMap;

use matterix_ir::{FileId, Span};

use crate::ast::{self, ItemKind};
use crate::{library, syntax};
use measures::Measures;

/// A page in Markdown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page {
    /// Its file name without `.md`: `heating`; `README` is the index.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// All pages: the index, then those of the modules in order of their names.
pub fn pages() -> Vec<Page> {
    let library = Library::read();
    let index = ("README", index::page(&library));
    let modules = library.modules.iter().map(|m| (m.short(), page::page(&library, m)));
    let page = |(name, text): (&str, String)| Page { name: name.to_string(), text: library.relinked(&text) };
    std::iter::once(index).chain(modules).map(page).collect()
}

/// Every command and skill of the library with its form, by module, for a page that has everything in one place.
pub fn verbs() -> String {
    let library = Library::read();
    library.modules.iter().map(|module| calls::list(&library, module)).collect()
}

/// The dimensions of the library, each with its units, for a page that has everything in one place.
pub fn units() -> String {
    let library = Library::read();
    library.modules.iter().map(|module| measures::list(module, &library.measures)).collect()
}

/// The types of things that a lab can hold, by module, each with what it is.
pub fn assets() -> String {
    let library = Library::read();
    library.modules.iter().map(things::list).collect()
}

/// The species of the library, a line for each module that declares some.
pub fn species() -> String {
    let library = Library::read();
    let everywhere = library.prelude();
    let list = |m: &Module| tables::species_list(m, everywhere.iter().any(|name| name == m.name));
    library.modules.iter().map(list).collect()
}

/// The modules of the library with what several pages ask for.
struct Library {
    modules: Vec<Module>,
    /// Where a capability or an asset is declared: the short name of its module.
    homes: BTreeMap<String, &'static str>,
    measures: Measures,
}

/// A module with its tree.
struct Module {
    name: &'static str,
    text: &'static str,
    tree: ast::File,
}

impl Library {
    fn read() -> Library {
        let read =
            |m: &library::Module| Module { name: m.name, text: m.text, tree: syntax::parse(FileId(0), m.text).0 };
        let modules: Vec<Module> = library::MODULES.iter().map(read).collect();
        let mut homes = BTreeMap::new();
        for module in &modules {
            for item in &module.tree.items {
                if let ItemKind::Capability { name, .. } | ItemKind::Asset { name, .. } = &item.kind {
                    homes.insert(name.text.clone(), module.short());
                }
            }
        }
        let measures = Measures::of(modules.iter().map(|m| &m.tree));
        Library { modules, homes, measures }
    }

    /// A page whose links lead to pages of modules where they lead to the modules.
    fn relinked(&self, text: &str) -> String {
        let to =
            |text: String, m: &Module| text.replace(&format!("]({}.mtx)", m.short()), &format!("]({}.md)", m.short()));
        self.modules.iter().fold(text.to_string(), to)
    }

    /// The names that the prelude lists.
    fn prelude(&self) -> Vec<String> {
        let listed = self.modules.iter().find(|m| m.short() == "prelude");
        listed.into_iter().flat_map(|m| library::imported(&m.tree)).collect()
    }
}

impl Module {
    /// `heating` of `std::heating`.
    fn short(&self) -> &'static str {
        self.name.strip_prefix("std::").unwrap_or(self.name)
    }

    /// A piece of the module as written, on one line and without comments.
    fn shown(&self, span: Span) -> String {
        let text = self.text.get(span.start as usize..span.end as usize).unwrap_or_default();
        let lines = text.lines().map(|line| markdown::without_comment(line).trim()).filter(|line| !line.is_empty());
        lines.collect::<Vec<_>>().join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_has_a_page_and_every_page_a_title() {
        let pages = pages();
        assert_eq!(pages.len(), library::MODULES.len() + 1);
        for page in &pages {
            assert!(page.text.starts_with("# "), "{}", page.name);
            assert!(page.text.ends_with('\n') && !page.text.contains("\n\n\n"), "{}", page.name);
        }
    }

    #[test]
    fn a_page_says_what_a_command_asks_for() {
        let pages = pages();
        let thermal = pages.iter().find(|p| p.name == "thermal").expect("there is one");
        for wanted in [
            "### `Heater`",
            "`heat HEATER to T`",
            "| `to` | `t` | `Temperature` | degC |",
            "`t in limits`, else `out_of_range`: choose a set point in its range",
        ] {
            assert!(thermal.text.contains(wanted), "{wanted}\n{}", thermal.text);
        }
    }
}
