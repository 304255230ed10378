//! The index of the library: its modules, and every name with the module that declares it.

use std::collections::BTreeMap;

use crate::ast::{Item, ItemKind, MemberKind};

use super::markdown::{cell, code, table};
use super::{Library, Module, calls};

/// The index.
pub fn page(library: &Library) -> String {
    let listed = library.prelude();
    let rows: Vec<Vec<String>> = library
        .modules
        .iter()
        .map(|m| {
            let first: Vec<String> = m.tree.docs.iter().take_while(|l| !l.trim().is_empty()).cloned().collect();
            let about = cell(&first);
            let prelude = if listed.iter().any(|l| l == m.name) { "yes" } else { "" };
            vec![format!("[`{}`]({}.md)", m.name, m.short()), prelude.to_string(), first_sentence(&about).to_string()]
        })
        .collect();
    let mut out = "# The standard library, module by module\n\n".to_string();
    out += "Generated from the texts of the library (`MATTERIX_UPDATE=1 cargo test --test cli book`): types, values and conditions are those\n\
            that run. [library.md](../library.md) is the overview, with sources and remarks.\n\n";
    out += "A call replaces names in capitals; the device of a command may also come after `by`. A listed unit is an example: every other\n\
            unit of the same dimension is allowed.\n\n";
    out += &table(&["module", "in the prelude", "is about"], &rows);
    out += "## Names\n\n";
    let mut names: BTreeMap<(String, String), (&'static str, &Module)> = BTreeMap::new();
    for module in &library.modules {
        for item in &module.tree.items {
            for (name, kind) in declared(item) {
                names.insert((name.to_lowercase(), name), (kind, module));
            }
        }
    }
    let rows: Vec<Vec<String>> = names
        .iter()
        .map(|((_, name), (kind, m))| {
            vec![code(name), (*kind).to_string(), format!("[`{}`]({}.md)", m.name, m.short())]
        })
        .collect();
    out += &table(&["name", "is", "declared in"], &rows);
    format!("{}\n", out.trim_end())
}

/// Up to the first full stop or colon that ends a clause.
fn first_sentence(text: &str) -> &str {
    text.find(". ").map_or(text.trim_end_matches('.'), |at| &text[..at])
}

/// The names that an item declares, with what they are; species, dimensions and units have tables of their own.
fn declared(item: &Item) -> Vec<(String, &'static str)> {
    match &item.kind {
        ItemKind::Capability { name, members, .. } => {
            let commands = members.iter().filter_map(|m| match &m.kind {
                MemberKind::Command { sig, .. } => Some((calls::verb(&sig.verb), "command")),
                _ => None,
            });
            std::iter::once((name.text.clone(), "capability")).chain(commands).collect()
        }
        ItemKind::Asset { name, .. } => vec![(name.text.clone(), "asset")],
        ItemKind::Skill { sig, .. } => vec![(calls::verb(&sig.verb), "skill")],
        ItemKind::Fn { name, .. } => vec![(name.text.clone(), "function")],
        ItemKind::Relation { name, .. } => vec![(name.text.clone(), "relation")],
        ItemKind::Const { name, .. } => vec![(name.text.clone(), "constant")],
        ItemKind::Hazard { name, .. } => vec![(name.text.clone(), "hazard")],
        ItemKind::ReactiveGroup { name, .. } => vec![(name.text.clone(), "reactive group")],
        ItemKind::Material { name, .. } => vec![(name.text.clone(), "material")],
        ItemKind::Framing { name, .. } => vec![(name.text.clone(), "framing")],
        ItemKind::Driver { name, .. } => vec![(name.text.clone(), "driver")],
        _ => Vec::new(),
    }
}
