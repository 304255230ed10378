//! Modules whose assets come from files: they are made again where one of the files has changed.

use std::cell::RefCell;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use matterix_ir::{Diagnostic, FileId, Sources};
use rustc_hash::FxHasher;

use super::Session;
use crate::import;
use crate::loader::Loader;
use crate::names::Module;
use crate::sheet;
use crate::units::Units;

/// So many modules are kept.
const MOST: usize = 32;

/// A module as it was before and after its files were read.
#[derive(Debug)]
pub(super) struct Imported {
    before: Arc<Module>,
    after: Arc<Module>,
    found: Vec<Diagnostic>,
    asked: Vec<Asked>,
}

/// A file that was asked for, with a figure of what came.
#[derive(Debug, Hash)]
struct Asked {
    path: String,
    as_text: bool,
    came: u64,
}

/// A module with the lines that its files give, and what is wrong with those.
pub(crate) fn imported(
    session: &mut Session,
    module: &Arc<Module>,
    loader: &dyn Loader,
) -> (Arc<Module>, Vec<Diagnostic>) {
    let file = module.file;
    let holds = |known: &Imported| {
        Arc::ptr_eq(&known.before, module) && known.asked.iter().all(|asked| asked.came == again(asked, file, loader))
    };
    if let Some(known) = session.imported.iter().find(|known| holds(known)) {
        session.beside = figure(&(session.beside, &known.asked));
        return (known.after.clone(), known.found.clone());
    }
    let noting = Noting { loader, asked: RefCell::default() };
    let mut made = Module::clone(module);
    let found = import::import(&mut made.tree, file, &noting);
    let after = Arc::new(made);
    let known = Imported {
        before: module.clone(),
        after: after.clone(),
        found: found.clone(),
        asked: noting.asked.into_inner(),
    };
    session.beside = figure(&(session.beside, &known.asked));
    session.imported.retain(|old| !Arc::ptr_eq(&old.before, module));
    if session.imported.len() >= MOST {
        session.imported.remove(0);
    }
    session.imported.push(known);
    (after, found)
}

/// Writes out what a module takes from files of features; what is wrong with those.
pub(crate) fn features(
    session: &mut Session,
    module: &mut Module,
    units: &Units,
    sources: &mut Sources,
    loader: &dyn Loader,
) -> Vec<Diagnostic> {
    noted(session, loader, |noting| import::features(&mut module.tree, module.file, units, sources, noting))
}

/// Reads the tables of a module; what is wrong with those.
pub(crate) fn tables(
    session: &mut Session,
    module: &mut Module,
    units: &Units,
    sources: &mut Sources,
    loader: &dyn Loader,
) -> Vec<Diagnostic> {
    noted(session, loader, |noting| sheet::read(&mut module.tree, module.file, units, sources, noting))
}

/// Takes note of the files that something asks for: what a session knows rests on them.
fn noted<R>(session: &mut Session, loader: &dyn Loader, work: impl FnOnce(&dyn Loader) -> R) -> R {
    let noting = Noting { loader, asked: RefCell::default() };
    let result = work(&noting);
    session.beside = figure(&(session.beside, noting.asked.into_inner()));
    result
}

fn again(asked: &Asked, from: FileId, loader: &dyn Loader) -> u64 {
    match asked.as_text {
        true => figure(&loader.file(from, &asked.path)),
        false => figure(&loader.bytes(from, &asked.path)),
    }
}

fn figure(came: &impl Hash) -> u64 {
    let mut hasher = FxHasher::default();
    came.hash(&mut hasher);
    hasher.finish()
}

/// Notes what is asked for.
struct Noting<'l> {
    loader: &'l dyn Loader,
    asked: RefCell<Vec<Asked>>,
}

impl Noting<'_> {
    fn note(&self, path: &str, as_text: bool, came: &impl Hash) {
        self.asked.borrow_mut().push(Asked { path: path.to_string(), as_text, came: figure(came) });
    }
}

impl Loader for Noting<'_> {
    fn load(&self, from: FileId, module: &str) -> Option<(String, String)> {
        self.loader.load(from, module)
    }

    fn bytes(&self, from: FileId, path: &str) -> Result<Vec<u8>, String> {
        let came = self.loader.bytes(from, path);
        self.note(path, false, &came);
        came
    }

    fn file(&self, from: FileId, path: &str) -> Result<String, String> {
        let came = self.loader.file(from, path);
        self.note(path, true, &came);
        came
    }
}
