//! What a module declares beside things and actions: functions, laws, substances, units.

use crate::ast::{Expr, ExprKind, Field, FieldValue, Item, ItemKind, Name, Param};

use super::markdown::{cell, code, line, prose, table};
use super::{Library, Module};

/// A field as it is written; nothing where there is none.
fn field(module: &Module, fields: &[Field], name: &str) -> String {
    let found = fields.iter().find(|f| f.key.text == name);
    found.map(|f| written(module, &f.value)).unwrap_or_default()
}

fn written(module: &Module, value: &FieldValue) -> String {
    match value {
        FieldValue::Expr(e) => plain(module, e),
        FieldValue::Species(terms) => {
            let of = |t: &crate::ast::Term| module.shown(t.span);
            terms.iter().map(of).collect::<Vec<_>>().join(" + ")
        }
        FieldValue::Fields(fields) => {
            let of = |f: &Field| module.shown(f.span);
            fields.iter().map(of).collect::<Vec<_>>().join(", ")
        }
        FieldValue::Literal(literal) => module.shown(literal.span),
    }
}

/// A value as it is written; a text without its quotes, a list without its brackets.
fn plain(module: &Module, e: &Expr) -> String {
    match &*e.kind {
        ExprKind::Text(text) => text.clone(),
        ExprKind::List(items) => items.iter().map(|i| plain(module, i)).collect::<Vec<_>>().join(", "),
        _ => module.shown(e.span),
    }
}

fn params(module: &Module, params: &[Param]) -> String {
    let shown = |p: &Param| {
        let ty = p.ty.as_ref().map(|t| format!(": {}", module.shown(t.span))).unwrap_or_default();
        let default = p.default.as_ref().map(|e| format!(" = {}", module.shown(e.span))).unwrap_or_default();
        format!("{}{ty}{default}", p.name.text)
    };
    params.iter().map(shown).collect::<Vec<_>>().join(", ")
}

/// Functions and relations.
pub fn functions(library: &Library, module: &Module) -> String {
    let mut rows = Vec::new();
    for item in &module.tree.items {
        match &item.kind {
            ItemKind::Fn { name, params: ps, result, body, .. } => rows.push(vec![
                code(&format!("{}({})", name.text, params(module, ps))),
                result.as_ref().map(|t| code(&module.shown(t.span))).unwrap_or_default(),
                result.as_ref().and_then(|t| library.measures.of_type(t)).unwrap_or_default(),
                body.as_ref().map(|e| code(&module.shown(e.span))).unwrap_or_default(),
                cell(&item.docs),
            ]),
            ItemKind::Relation { name, params: ps, symmetric, definition } => rows.push(vec![
                code(&format!("{}({})", name.text, params(module, ps))),
                if *symmetric { "symmetric relation" } else { "relation" }.to_string(),
                String::new(),
                definition.as_ref().map(|e| code(&module.shown(e.span))).unwrap_or_default(),
                cell(&item.docs),
            ]),
            _ => {}
        }
    }
    table(&["function", "gives", "unit", "is", ""], &rows)
}

/// Constants.
pub fn constants(module: &Module) -> String {
    let row = |item: &Item| match &item.kind {
        ItemKind::Const { name, value, .. } => {
            Some(vec![code(&name.text), code(&module.shown(value.span)), cell(&item.docs)])
        }
        _ => None,
    };
    table(&["constant", "value", ""], &module.tree.items.iter().filter_map(row).collect::<Vec<_>>())
}

/// Laws, events and hazards over combinations of things.
pub fn laws(module: &Module) -> String {
    let mut rows = Vec::new();
    for item in &module.tree.items {
        let (kind, name, ps, when) = match &item.kind {
            ItemKind::Process(p) => ("process", &p.name, &p.params, p.guard.as_ref()),
            ItemKind::Event(e) => ("event", &e.name, &e.params, Some(&e.when)),
            ItemKind::Hazard { grave, name, params, when, .. } => {
                (if *grave { "hazard" } else { "caution" }, name, params, Some(when))
            }
            _ => continue,
        };
        let when = when.map(|e| code(&module.shown(e.span))).unwrap_or_default();
        rows.push(vec![
            code(&format!("{}({})", name.text, params(module, ps))),
            kind.to_string(),
            when,
            cell(&item.docs),
        ]);
    }
    table(&["law", "is a", "while or when", ""], &rows)
}

/// Sources that comments name in brackets behind the values of an item.
fn sources(module: &Module, item: &Item) -> String {
    let text = module.text.get(item.span.start as usize..item.span.end as usize).unwrap_or_default();
    let mut out: Vec<&str> = Vec::new();
    for line in text.lines() {
        let Some((_, comment)) = line.split_once("//") else { continue };
        for piece in comment.split('[').skip(1) {
            let Some((source, _)) = piece.split_once(']') else { continue };
            if !out.contains(&source) {
                out.push(source);
            }
        }
    }
    out.join(", ")
}

/// Fields of a species that have a column of their own, or are no property.
const SHOWN: [&str; 7] = ["formula", "density", "molar_volume", "heat_capacity", "specific_heat", "same_as", "smiles"];

/// Species, each with its properties, other names after its own.
pub fn species(module: &Module) -> String {
    let other_names = |of: &Name| {
        let same = module.tree.items.iter().filter_map(|item| match &item.kind {
            ItemKind::Species { name, fields } if field(module, fields, "same_as") == of.text => Some(&name.text),
            _ => None,
        });
        same.map(|n| format!(", {}", code(n))).collect::<String>()
    };
    let mut rows = Vec::new();
    for item in &module.tree.items {
        let ItemKind::Species { name, fields } = &item.kind else { continue };
        if fields.iter().any(|f| f.key.text == "same_as") {
            continue;
        }
        let get = |name: &str| field(module, fields, name);
        let either = |a: &str, b: &str| if get(a).is_empty() { get(b) } else { get(a) };
        let rest: Vec<String> = fields
            .iter()
            .filter(|f| !SHOWN.contains(&f.key.text.as_str()))
            .map(|f| format!("{}: {}", f.key.text.replace('_', " "), written(module, &f.value)))
            .collect();
        rows.push(vec![
            format!("{}{}", code(&name.text), other_names(name)),
            either("formula", "smiles").replace('|', "\\|"),
            prose(&either("density", "molar_volume")),
            prose(&either("heat_capacity", "specific_heat")),
            prose(&rest.join("; ")).replace('|', "\\|"),
            sources(module, item),
        ]);
    }
    table(&["species", "formula", "density or volume", "heat capacity", "also", "source"], &rows)
}

/// The names of the species of a module on one line, with the import that brings them unless they are there in every file.
pub fn species_list(module: &Module, everywhere: bool) -> String {
    let names = module.tree.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Species { name, .. } => Some(name.text.as_str()),
        _ => None,
    });
    let names = names.collect::<Vec<_>>();
    let import = if everywhere { String::new() } else { format!("With `use {}`: ", module.name) };
    if names.is_empty() { String::new() } else { format!("{import}{}\n", super::markdown::codes(names)) }
}

/// Solutions and reactions.
pub fn chemistry(module: &Module) -> String {
    let row = |item: &Item| match &item.kind {
        ItemKind::Solution { name, .. } | ItemKind::Reaction { name, .. } => {
            Some(vec![code(&name.text), code(&module.shown(item.span)), cell(&item.docs)])
        }
        _ => None,
    };
    table(&["name", "as written", ""], &module.tree.items.iter().filter_map(row).collect::<Vec<_>>())
}

/// Classes of substances and materials.
pub fn groups(module: &Module) -> String {
    let mut rows = Vec::new();
    for item in &module.tree.items {
        let (ItemKind::ReactiveGroup { name, fields } | ItemKind::Material { name, fields }) = &item.kind else {
            continue;
        };
        let members = field(module, fields, "members");
        let members = if members.is_empty() { field(module, fields, "smarts") } else { members };
        rows.push(vec![
            code(&name.text),
            if item.docs.is_empty() { field(module, fields, "title") } else { cell(&item.docs) },
            code(&members),
            field(module, fields, "above"),
            field(module, fields, "friction"),
            field(module, fields, "source"),
        ]);
    }
    table(&["name", "is", "members", "from", "friction", "source"], &rows)
}

/// Pairs that must not meet, and pairs that may.
pub fn pairs(module: &Module) -> String {
    let mut rows = Vec::new();
    for item in &module.tree.items {
        match &item.kind {
            ItemKind::Incompatible { a, b, fields } => rows.push(vec![
                code(&a.text),
                code(&b.text),
                field(module, fields, "consequence"),
                field(module, fields, "above"),
                field(module, fields, "source"),
                cell(&item.docs),
            ]),
            ItemKind::Allow { a, b, reason } => rows.push(vec![
                code(&a.text),
                code(&b.text),
                "allowed".to_string(),
                String::new(),
                reason.clone(),
                cell(&item.docs),
            ]),
            ItemKind::Accept { name, reason } => rows.push(vec![
                code(&name.text),
                String::new(),
                "allowed".to_string(),
                String::new(),
                reason.clone(),
                cell(&item.docs),
            ]),
            _ => {}
        }
    }
    table(&["one", "the other", "consequence", "from", "source", ""], &rows)
}

/// Dimensions.
pub fn dimensions(library: &Library, module: &Module) -> String {
    let row = |item: &Item| match &item.kind {
        ItemKind::Dimension { name, point, definition } => {
            let is = definition.as_ref().map(|e| module.shown(e.span)).unwrap_or_default();
            let is = if *point { format!("point {is}") } else { is };
            let unit = library.measures.unit(&name.text).map(|u| code(&u)).unwrap_or_default();
            Some(vec![code(&name.text), code(&is), unit, cell(&item.docs)])
        }
        _ => None,
    };
    table(&["dimension", "is", "a unit", ""], &module.tree.items.iter().filter_map(row).collect::<Vec<_>>())
}

/// Units.
pub fn units(module: &Module) -> String {
    let row = |item: &Item| match &item.kind {
        ItemKind::Unit { name, dimension, definition, origin, prefixes, aliases } => {
            let also: String = aliases.iter().map(|a| format!(", {}", code(&a.text))).collect();
            let zero = origin.as_ref().map(|e| format!(", zero at {}", module.shown(e.span))).unwrap_or_default();
            let size = definition.as_ref().map_or("base".to_string(), |e| module.shown(e.span));
            Some(vec![
                format!("{}{also}", code(&name.text)),
                dimension.as_ref().map(|d| code(&d.text)).unwrap_or_default(),
                format!("{size}{zero}"),
                if *prefixes { "yes" } else { "" }.to_string(),
                cell(&item.docs),
            ])
        }
        _ => None,
    };
    table(
        &["unit", "dimension", "size", "SI prefixes", ""],
        &module.tree.items.iter().filter_map(row).collect::<Vec<_>>(),
    )
}

/// Drivers, each with its lines as they are written.
pub fn drivers(module: &Module) -> String {
    let mut out = String::new();
    for item in &module.tree.items {
        let ItemKind::Driver { name, device, transport, wires, .. } = &item.kind else { continue };
        let device = device.segments.last().map_or("", |s| s.text.as_str());
        out += &format!("### `{}` for `{device}` over `{}`\n\n", name.text, transport.text);
        let docs = line(&item.docs);
        if !docs.is_empty() {
            out += &format!("{docs}\n\n");
        }
        let rows: Vec<Vec<String>> = wires.iter().map(|w| vec![code(&module.shown(w.span))]).collect();
        out += &table(&["its lines"], &rows);
    }
    out
}
