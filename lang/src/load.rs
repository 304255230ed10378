//! A file and all that it imports, read and parsed; the library comes first.

use std::sync::Arc;

use matterix_ir::{Diagnostic, FileId, Sources, codes};

use crate::ast::{File, ItemKind};
use crate::declare::units::declare;
use crate::loader::Loader;
use crate::names::{Module, Names, module_candidates, used as used_in};
use crate::parallel::STACK;
use crate::session::{self, Session};
use crate::{import, library, sheet};

/// Parses the root file and everything it imports; the library comes first.
///
/// What the session knows of texts that have not changed is taken from there.
pub fn load(
    sources: &mut Sources,
    root: FileId,
    loader: &dyn Loader,
    session: &mut Session,
) -> (Vec<Arc<Module>>, Vec<Diagnostic>) {
    let package = sources.get(root).map_or_else(String::new, |source| source.name.clone());
    let (mut modules, mut diagnostics, first) = library(sources, root, &package, session);
    session.beside = 0;
    let mut queue = vec![(String::new(), root)];
    let mut parsed = Some(first);
    while let Some((name, file)) = queue.pop() {
        let (module, found) = parsed.take().unwrap_or_else(|| session.module(sources, &package, &name, file));
        diagnostics.extend(found);
        for item in &module.tree.items {
            let ItemKind::Use { path, names } = &item.kind else { continue };
            let known = |m: &str, modules: &[Arc<Module>], queue: &[(String, FileId)]| {
                modules.iter().any(|x| x.name == m) || queue.iter().any(|x| x.0 == m)
            };
            if path.segments[0].text == "std" {
                continue;
            }
            let found = module_candidates(path, names.is_some()).into_iter().find_map(|module| {
                if known(&module, &modules, &queue) || module == name {
                    return Some(None);
                }
                loader.load(file, &module).map(|(display, text)| Some((module, sources.add(display, text))))
            });
            match found {
                Some(Some(new)) => queue.push(new),
                Some(None) => {}
                None => {
                    let module = module_candidates(path, names.is_some()).swap_remove(0);
                    diagnostics.push(
                        Diagnostic::error(
                            codes::UNKNOWN_MODULE,
                            path.span,
                            format!("unknown module `{module}`"),
                            "imported here",
                        )
                        .help(format!("a module is a file in the same folder: `{}.mtx`", module.replace("::", "/"))),
                    );
                }
            }
        }
        modules.push(module);
    }
    session.tidy(&package);
    let mut used = used_in(&modules);
    // One that is read may import others.
    while let Some(index) = (0..library::MODULES.len()).find(|index| used[*index] && is_unread(*index, &modules)) {
        let (read, found) = session.apart(index, modules[index].file);
        modules[index] = read;
        diagnostics.extend(found);
        used = used_in(&modules);
    }
    for (module, _) in modules.iter_mut().zip(used).filter(|(module, used)| *used && import::reads(&module.tree)) {
        let (made, found) = session::imported(session, module, loader);
        *module = made;
        diagnostics.extend(found);
    }
    if modules.iter().any(|m| import::has_features(&m.tree)) {
        let units = declare(&Names::new(&modules).0, &mut Vec::new());
        for module in modules.iter_mut().filter(|module| import::has_features(&module.tree)) {
            let module = Arc::make_mut(module);
            diagnostics.extend(session::features(session, module, &units, sources, loader));
        }
    }
    if modules.iter().any(|m| sheet::has_tables(&m.tree)) {
        let units = declare(&Names::new(&modules).0, &mut Vec::new());
        for module in modules.iter_mut().filter(|module| sheet::has_tables(&module.tree)) {
            diagnostics.extend(session::tables(session, Arc::make_mut(module), &units, sources, loader));
        }
    }
    (modules, diagnostics)
}

/// Whether a module of the library is one that is read only where it is imported, and has not been read yet.
fn is_unread(index: usize, modules: &[Arc<Module>]) -> bool {
    !library::MODULES[index].apart.is_empty() && modules[index].tree.items.is_empty()
}

/// A module with what is wrong with its text.
type Read = (Arc<Module>, Vec<Diagnostic>);

/// The library's modules and their findings, and the module of the root file, which is parsed meanwhile.
fn library(
    sources: &mut Sources,
    root: FileId,
    package: &str,
    session: &mut Session,
) -> (Vec<Arc<Module>>, Vec<Diagnostic>, Read) {
    let files: Vec<FileId> = library::MODULES.iter().map(|module| sources.add(module.name, module.text)).collect();
    if session.library.iter().map(|module| module.file).eq(files.iter().copied()) {
        let first = session.module(sources, package, "", root);
        return (session.library.clone(), Vec::new(), first);
    }
    let tree = |(index, file): (usize, &FileId)| match library::MODULES[index].apart {
        [] => library::read(index, *file),
        _ => (File { version: None, docs: Vec::new(), items: Vec::new() }, Vec::new()),
    };
    let read = || -> Vec<_> { files.iter().enumerate().map(tree).collect() };
    let (trees, first) = std::thread::scope(|scope| {
        let reading = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, read);
        let first = session.module(sources, package, "", root);
        // Where there is no thread to be had, this one does the work.
        (reading.ok().and_then(|reading| reading.join().ok()).unwrap_or_else(read), first)
    });
    let mut diagnostics = Vec::new();
    let module = |((module, file), (tree, found)): ((&library::Module, FileId), _)| {
        diagnostics.extend(found);
        Arc::new(Module { name: module.name.to_string(), file, tree, header: 0 })
    };
    let modules: Vec<Arc<Module>> = library::MODULES.iter().zip(files.iter().copied()).zip(trees).map(module).collect();
    if diagnostics.is_empty() {
        session.library.clone_from(&modules);
    }
    (modules, diagnostics, first)
}
