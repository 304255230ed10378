//! The standard library: its texts by module path, their trees built ahead, and its data files.

use matterix_ir::{Diagnostic, FileId};

use crate::{ast, syntax};

include!(concat!(env!("OUT_DIR"), "/modules.rs"));

/// A module of the library.
pub struct Module {
    /// `std::heating`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
    /// Its tree in postcard's format, with the spans that it has where the user's own file is the first; empty where its text has mistakes.
    tree: &'static [u8],
    /// The species, equilibria and constants that it declares, where it declares no laws but cautions and no module that every file reads
    /// imports it. It is read for files that do: the others do not pay for tables of substances.
    pub apart: &'static [&'static str],
}

/// What a module declares that is read only where a file imports it; nothing of any other.
pub fn apart(module: &str) -> &'static [&'static str] {
    MODULES.iter().find(|m| m.name == module).map_or(&[], |m| m.apart)
}

/// The tree of a module and what is wrong with its text. Reading the tree that was built ahead takes a tenth of the time of parsing.
pub fn read(index: usize, file: FileId) -> (ast::File, Vec<Diagnostic>) {
    let module = &MODULES[index];
    let ahead = || postcard::from_bytes(module.tree).ok();
    match (file.0 as usize == FIRST as usize + index).then(ahead).flatten() {
        Some(tree) => (tree, Vec::new()),
        None => syntax::parse(file, module.text),
    }
}

/// The modules that a tree imports, as it names them: of the prelude those that every file sees.
pub fn imported(tree: &ast::File) -> impl Iterator<Item = String> {
    tree.items.iter().filter_map(|item| match &item.kind {
        ast::ItemKind::Use { path, .. } => {
            Some(path.segments.iter().map(|s| s.text.as_str()).collect::<Vec<_>>().join("::"))
        }
        _ => None,
    })
}

/// The tree of a module, with spans in its text.
pub fn tree(index: usize) -> ast::File {
    read(index, FileId(FIRST + index as u32)).0
}

/// Whether a file is a module of the library, where the user's own file is the first.
pub fn is_module(file: FileId) -> bool {
    (FIRST..FIRST + MODULES.len() as u32).contains(&file.0)
}

macro_rules! files {
    ($($path:literal => $name:literal)*) => {
        /// Data files of the library with their texts.
        const FILES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../assets/", $path, $name)))),*];
    };
}

files! {
    "robots/flex/" => "flex.urdf"
    "robots/fr3/" => "fr3.urdf"
    "robots/franka_hand/" => "franka_hand.urdf"
    "robots/iiwa14/" => "iiwa14.urdf"
    "robots/iiwa7/" => "iiwa7.urdf"
    "robots/kmr_iiwa/" => "kmr_iiwa.urdf"
    "robots/ot2/" => "ot2.urdf"
    "robots/panda/" => "panda.urdf"
    "robots/plate_gripper/" => "plate_gripper.urdf"
    "robots/robotiq_2f85/" => "robotiq_2f85.urdf"
    "robots/ur3e/" => "ur3e.urdf"
    "robots/ur5e/" => "ur5e.urdf"
    "robots/xm540_w150/" => "xm540_w150.urdf"
}

/// The module that declares an asset type.
pub fn home_of(asset: &str) -> Option<&'static str> {
    let declares = |line: &str| {
        let rest = line.strip_prefix("asset ").and_then(|l| l.strip_prefix(asset));
        rest.is_some_and(|r| !r.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    };
    MODULES.iter().find(|m| m.text.lines().any(declares)).map(|m| m.name)
}

/// A data file of the library.
pub fn file(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_built_ahead_are_those_of_the_texts() {
        for (index, module) in MODULES.iter().enumerate() {
            let file = FileId(FIRST + index as u32);
            assert!(!module.tree.is_empty(), "{} has mistakes", module.name);
            assert_eq!(read(index, file), syntax::parse(file, module.text), "{}", module.name);
            let elsewhere = FileId(file.0 + 1);
            assert_eq!(read(index, elsewhere), syntax::parse(elsewhere, module.text), "{}", module.name);
        }
    }
}
