//! The page of a module: what it is about, then what it declares, by kind.

use crate::ast::ItemKind;

use super::markdown::paragraphs;
use super::{Library, Module, calls, tables, things};

/// The page of a module.
pub fn page(library: &Library, module: &Module) -> String {
    let mut out = format!("# `{}`\n\n", module.name);
    out += &paragraphs(&module.tree.docs);
    let listed = library.prelude();
    let short = module.short();
    out += &if short == "prelude" {
        format!(
            "{}\n\n",
            listed
                .iter()
                .map(|m| format!("[`{m}`]({}.md)", m.trim_start_matches("std::")))
                .collect::<Vec<_>>()
                .join(", ")
        )
    } else if listed.iter().any(|m| m == module.name) {
        format!(
            "In the [prelude](prelude.md): its names are there without `use`. Source: [stdlib/{short}.mtx](../../stdlib/{short}.mtx).\n\n"
        )
    } else {
        format!("By name: `use {}::NAME`. Source: [stdlib/{short}.mtx](../../stdlib/{short}.mtx).\n\n", module.name)
    };
    let skills = |primitive: bool| {
        let mut text = String::new();
        for item in &module.tree.items {
            match &item.kind {
                ItemKind::Skill { external, sig, clauses, .. } if *external == primitive => {
                    text += &format!("### `{}`\n\n", calls::form(library, sig, clauses, None));
                    text += &calls::body(library, module, (&item.docs, None), sig, clauses);
                }
                _ => {}
            }
        }
        text
    };
    let each = |one: fn(&Library, &Module, &crate::ast::Item) -> String| {
        module.tree.items.iter().map(|item| one(library, module, item)).collect::<String>()
    };
    let sections = [
        ("Capabilities", each(things::capability)),
        ("Assets", each(things::asset)),
        ("Skills", skills(false)),
        ("Primitive skills", skills(true)),
        ("Functions and relations", tables::functions(library, module)),
        ("Constants", tables::constants(module)),
        ("Laws", tables::laws(module)),
        ("Species", tables::species(module)),
        ("Solutions and reactions", tables::chemistry(module)),
        ("Groups and materials", tables::groups(module)),
        ("Incompatible pairs", tables::pairs(module)),
        ("Dimensions", tables::dimensions(library, module)),
        ("Units", tables::units(module)),
        ("Drivers", tables::drivers(module)),
    ];
    for (title, text) in sections.iter().filter(|(_, text)| !text.is_empty()) {
        out += &format!("## {title}\n\n{text}");
    }
    format!("{}\n", out.trim_end())
}
