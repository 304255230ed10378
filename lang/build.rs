//! Parses the standard library once, so that no check has to: its trees become part of the program.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs, io};

use matterix_ir::FileId;
use matterix_syntax::ast::{File, ItemKind};

/// The file that the first module is where the user's own comes first.
const FIRST: u32 = 1;

fn main() -> io::Result<()> {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stdlib");
    let out = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo names the folder to write to"))?;
    println!("cargo:rerun-if-changed={}", library.display());
    let mut files = fs::read_dir(&library)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    files.retain(|path| path.extension().is_some_and(|ext| ext == "mtx"));
    files.sort();
    let mut modules = format!(
        "const FIRST: u32 = {FIRST};\n\n/// Every module, in order of name.\npub const MODULES: &[Module] = &[\n"
    );
    let mut trees = Vec::new();
    for (path, file) in files.iter().zip(FIRST..) {
        trees.push(matterix_syntax::parse(FileId(file), &fs::read_to_string(path)?));
    }
    let names = files.iter().map(|path| path.file_stem().and_then(|stem| stem.to_str()));
    let names = names.collect::<Option<Vec<_>>>().ok_or_else(|| io::Error::other("a name that is text"))?;
    let mut tables: BTreeMap<&str, Vec<String>> =
        names.iter().zip(&trees).filter_map(|(name, (tree, _))| Some((*name, only_matter(tree)?))).collect();
    // What a module that every file reads imports is read for every file.
    loop {
        let others = names.iter().zip(&trees).filter(|(name, _)| !tables.contains_key(*name));
        let imported: BTreeSet<String> = others.flat_map(|(_, (tree, _))| imports(tree)).collect();
        let before = tables.len();
        tables.retain(|name, _| !imported.contains(*name));
        if tables.len() == before {
            break;
        }
    }
    for ((path, name), (tree, found)) in files.iter().zip(&names).zip(&trees) {
        let apart = tables.get(name).cloned().unwrap_or_default();
        let bytes = if found.is_empty() { postcard::to_stdvec(tree).map_err(io::Error::other)? } else { Vec::new() };
        let ahead = Path::new(&out).join(name).with_extension("tree");
        fs::write(&ahead, bytes)?;
        let text = format!("include_str!({path:?}), tree: include_bytes!({ahead:?}), apart: &{apart:?}");
        writeln!(modules, "    Module {{ name: \"std::{name}\", text: {text} }},").map_err(io::Error::other)?;
    }
    modules.push_str("];\n");
    fs::write(Path::new(&out).join("modules.rs"), modules)
}

/// The second segments of what a module imports: `species` of `use std::species`.
fn imports(tree: &File) -> Vec<String> {
    let paths = tree.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Use { path, .. } => path.segments.get(1),
        _ => None,
    });
    paths.map(|name| name.text.clone()).collect()
}

/// The names that a module declares, where it has nothing but species, equilibria, interactions, constants, functions, cautions and
/// imports; the prelude, which only imports, is none.
fn only_matter(tree: &File) -> Option<Vec<String>> {
    let names = tree.items.iter().map(|item| match &item.kind {
        ItemKind::Species { name, .. }
        | ItemKind::Equilibrium { name, .. }
        | ItemKind::Interaction { name, .. }
        | ItemKind::Fn { name, .. }
        | ItemKind::Const { name, .. } => Some(Some(name.text.clone())),
        ItemKind::Hazard { .. } | ItemKind::Use { .. } => Some(None),
        _ => None,
    });
    let names: Vec<String> = names.collect::<Option<Vec<_>>>()?.into_iter().flatten().collect();
    (!names.is_empty()).then_some(names)
}
