//! Parses the standard library once, so that no check has to: its trees become part of the program.

use std::collections::BTreeSet;
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
    let imported: BTreeSet<String> = trees.iter().flat_map(|(tree, _)| imports(tree)).collect();
    for (path, (tree, found)) in files.iter().zip(trees) {
        let name =
            path.file_stem().and_then(|stem| stem.to_str()).ok_or_else(|| io::Error::other("a name that is text"))?;
        let apart = if imported.contains(name) { None } else { only_species(&tree) }.unwrap_or_default();
        let bytes = if found.is_empty() { postcard::to_stdvec(&tree).map_err(io::Error::other)? } else { Vec::new() };
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

/// The names that a module declares, where all of them are species.
fn only_species(tree: &File) -> Option<Vec<String>> {
    let names = tree.items.iter().map(|item| match &item.kind {
        ItemKind::Species { name, .. } => Some(name.text.clone()),
        _ => None,
    });
    names.collect()
}
