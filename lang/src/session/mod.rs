//! What earlier checks have worked out and may hold for the next one: trees, files that assets come from, verdicts. A check with an empty
//! session is a check like any other, so that what an editor shows is what the command says.

mod closure;
mod files;
mod foreseen;
mod items;
mod verdicts;

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::{Diagnostic, FileId, Sources};

use crate::names::Module;
use crate::syntax::{self, Memo};
use crate::{ast, library};

pub use foreseen::Foreseen;

pub(crate) use closure::Words;
pub(crate) use files::{features, imported, tables};
pub(crate) use verdicts::{CachedAnalysis, Environment, Snapshot, TaskKey, number};

/// How many packages are remembered: those that are worked on at the same time.
const MOST: usize = 8;

/// What is remembered from check to check.
#[derive(Debug, Default)]
pub struct Session {
    /// The library's modules, where the file that is checked comes first.
    pub(crate) library: Vec<Arc<Module>>,
    /// Those of them that are read only where a file imports them.
    apart: Vec<Arc<Module>>,
    /// By the name of the file that is checked; the last one was checked last.
    packages: Vec<(String, Package)>,
    /// Modules whose assets come from files.
    imported: Vec<files::Imported>,
    /// A figure of the files that modules of the check under way name.
    pub(crate) beside: u64,
}

/// A file with what it imports.
#[derive(Debug, Default)]
pub(crate) struct Package {
    /// Texts by their names.
    texts: BTreeMap<String, Text>,
    /// What was judged of it.
    pub(crate) earlier: Option<Snapshot>,
    /// What was found to get where.
    pub(crate) foreseen: Foreseen,
}

#[derive(Debug, Default)]
struct Text {
    memo: Memo,
    /// The text, the module that was made of it, and what was wrong with it.
    read: Option<(String, Arc<Module>, Vec<Diagnostic>)>,
    /// Whether the check that is under way has asked for it.
    asked: bool,
}

impl Session {
    /// What is remembered of a package, which is now the one checked last.
    pub(crate) fn package(&mut self, name: &str) -> &mut Package {
        let known = self.packages.iter().position(|(of, _)| of == name);
        let package = known.map_or_else(|| (name.to_string(), Package::default()), |at| self.packages.remove(at));
        if self.packages.len() >= MOST {
            self.packages.remove(0);
        }
        let last = self.packages.len();
        self.packages.push(package);
        &mut self.packages[last].1
    }

    /// What checks of a file have found to get where, for another session.
    pub fn foreseen(&mut self, name: &str) -> &Foreseen {
        &self.package(name).foreseen
    }

    /// Begins the next check of a file with what another session has found. It is no more than an expectation: what comes of the
    /// check does not depend on it.
    pub fn foresee(&mut self, name: &str, foreseen: Foreseen) {
        self.package(name).foreseen = foreseen;
    }

    /// What is wrong with a text by itself, before anything else of it is looked at. A check of it under this name does not read it again.
    pub fn syntax(&mut self, name: &str, text: &str) -> Vec<Diagnostic> {
        let mut sources = Sources::default();
        let file = sources.add(name, text);
        self.module(&sources, name, "", file).1
    }

    /// A file as a module, with what is wrong with its text.
    pub(crate) fn module(
        &mut self,
        sources: &Sources,
        package: &str,
        name: &str,
        file: FileId,
    ) -> (Arc<Module>, Vec<Diagnostic>) {
        let Some(source) = sources.get(file) else {
            let tree = ast::File { version: None, docs: Vec::new(), items: Vec::new() };
            return (Arc::new(Module { name: name.to_string(), file, tree, header: 0 }), Vec::new());
        };
        let text = self.package(package).texts.entry(source.name.clone()).or_default();
        text.asked = true;
        if let Some((known, module, found)) = &text.read
            && *known == source.text
            && module.file == file
            && module.name == name
        {
            return (module.clone(), found.clone());
        }
        let (tree, found) = syntax::parse_again(file, &source.text, &mut text.memo);
        let header = syntax::header_end(&source.text);
        let module = Arc::new(Module { name: name.to_string(), file, tree, header });
        text.read = Some((source.text.clone(), module.clone(), found.clone()));
        (module, found)
    }

    /// A module of the library that stands apart, read now that a file imports it.
    pub(crate) fn apart(&mut self, index: usize, file: FileId) -> (Arc<Module>, Vec<Diagnostic>) {
        let name = library::MODULES[index].name;
        if let Some(known) = self.apart.iter().find(|module| module.name == name && module.file == file) {
            return (known.clone(), Vec::new());
        }
        let (tree, found) = library::read(index, file);
        let module = Arc::new(Module { name: name.to_string(), file, tree, header: 0 });
        self.apart.retain(|known| known.name != name);
        self.apart.push(module.clone());
        (module, found)
    }

    /// Forgets the texts that a package does not import any more.
    pub(crate) fn tidy(&mut self, package: &str) {
        let texts = &mut self.package(package).texts;
        texts.retain(|_, text| std::mem::take(&mut text.asked));
    }
}
