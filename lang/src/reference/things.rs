//! Capabilities and assets: members, defaults, and what concrete types say of themselves.

use crate::ast::{AssetLine, Delay, Item, ItemKind, Member, MemberKind, Path, Role};

use super::calls;
use super::markdown::{cell, code, line, paragraphs, table};
use super::{Library, Module};
use crate::eval::lab::free::Bound;

/// Names of capabilities or assets, with links to where they are declared.
fn linked(library: &Library, module: &Module, paths: &[Path]) -> String {
    let link = |path: &Path| {
        let name = path.segments.last().map_or("", |s| s.text.as_str());
        let anchor = name.to_lowercase();
        match library.homes.get(name) {
            Some(home) if *home == module.short() => format!("[`{name}`](#{anchor})"),
            Some(home) => format!("[`{name}`]({home}.md#{anchor})"),
            None => format!("`{name}`"),
        }
    };
    paths.iter().map(link).collect::<Vec<_>>().join(", ")
}

/// A capability with its members, commands and laws.
pub fn capability(library: &Library, module: &Module, item: &Item) -> String {
    let ItemKind::Capability { name, extends, members, .. } = &item.kind else { return String::new() };
    let mut out = format!("### `{}`\n\n{}", name.text, paragraphs(&item.docs));
    if !extends.is_empty() {
        out += &format!("Is also {}.\n\n", linked(library, module, extends));
    }
    let rows: Vec<Vec<String>> = members.iter().filter_map(|m| value(library, module, m)).collect();
    out += &table(&["member", "is", "type", "unit", "value", ""], &rows);
    for member in members {
        match &member.kind {
            MemberKind::Process(p) => {
                let when = p.guard.as_ref().map(|e| format!(" while `{}`", module.shown(e.span))).unwrap_or_default();
                out += &told(&format!("Process `{}`{when}", p.name.text), &member.docs);
            }
            MemberKind::Event(e) => {
                let when = module.shown(e.when.span);
                let how = |d: &Delay| {
                    let word = if d.sustained { "for" } else { "after" };
                    format!(" {word} `{}`", module.shown(d.time.span))
                };
                let delay = e.delay.as_ref().map(how).unwrap_or_default();
                out += &told(&format!("Event `{}` when `{when}`{delay}", e.name.text), &member.docs);
            }
            MemberKind::Limit { at_end, cond, refusal } => {
                let how = if *at_end { "At the end" } else { "Always" };
                let named = refusal.as_ref().map(|r| format!(", else `{}`", r.failure.text)).unwrap_or_default();
                out += &told(&format!("{how} `{}`{named}", module.shown(cond.span)), &member.docs);
            }
            _ => {}
        }
    }
    for member in members {
        if let MemberKind::Command { sig, clauses } = &member.kind {
            out += &format!("#### `{}`\n\n", calls::form(library, sig, clauses, Some(&name.text)));
            out += &calls::body(library, module, (&member.docs, Some(&name.text)), sig, clauses);
        }
    }
    out
}

/// A sentence and what is documented of it, as a paragraph.
fn told(what: &str, docs: &[String]) -> String {
    let docs = line(docs);
    if docs.is_empty() { format!("{what}.\n\n") } else { format!("{what}: {docs}\n\n") }
}

/// The row of a member that has a value, or is a view or a frame.
fn value(library: &Library, module: &Module, member: &Member) -> Option<Vec<String>> {
    let shown = |span| code(&module.shown(span));
    Some(match &member.kind {
        MemberKind::Value { role, name, ty, per, value, options } => {
            let role = match role {
                Role::Param => "parameter",
                Role::State => "state",
                Role::Derived => "derived",
                Role::Reading => "reading",
                Role::Flow => "flow",
                Role::Extensive => "extensive",
                Role::Part => "part",
            };
            let per = per.as_ref().map(|p| format!(" per {}", p.text)).unwrap_or_default();
            let of = shown(ty.span);
            let mut about = cell(&member.docs);
            let bounds = options.iter().filter(|o| Bound::WORDS.contains(&o.name.text.as_str()));
            for bound in bounds {
                let words = bound.name.text.replace('_', " ");
                let space = if about.is_empty() { "" } else { " " };
                about += &format!("{space}({words} {})", module.shown(bound.value.span));
            }
            vec![
                code(&name.text),
                role.to_string(),
                format!("{of}{per}"),
                library.measures.of_type(ty).unwrap_or_default(),
                value.as_ref().map(|e| shown(e.span)).unwrap_or_default(),
                about,
            ]
        }
        MemberKind::View { param, ty, value } => vec![
            code(&format!("[{}]", param.name.text)),
            "view".to_string(),
            shown(ty.span),
            library.measures.of_type(ty).unwrap_or_default(),
            shown(value.span),
            cell(&member.docs),
        ],
        MemberKind::Frame { name, at } => {
            let at = at.as_ref().map(|a| shown(a.position.span)).unwrap_or_default();
            vec![code(&name.text), "frame".to_string(), String::new(), String::new(), at, cell(&member.docs)]
        }
        _ => return None,
    })
}

/// An asset with what it gives to its parameters.
pub fn asset(library: &Library, module: &Module, item: &Item) -> String {
    let ItemKind::Asset { name, extends, source, lines } = &item.kind else { return String::new() };
    let mut out = format!("### `{}`\n\n{}", name.text, paragraphs(&item.docs));
    if !extends.is_empty() {
        out += &format!("Is {}.\n\n", linked(library, module, extends));
    }
    if let Some((kind, file)) = source {
        out += &format!("From {} `{}`.\n\n", kind.text, file.text);
    }
    let mut rows = Vec::new();
    let mut frames = Vec::new();
    for line in lines {
        match line {
            AssetLine::Field(f) => {
                let text = module.shown(f.span);
                let value = text.split_once(':').map_or("", |(_, value)| value.trim());
                rows.push(vec![code(&f.key.text), code(value)]);
            }
            AssetLine::Part { name, literal } => rows.push(vec![code(&name.text), code(&module.shown(literal.span))]),
            AssetLine::Grid(grid) => {
                let to = grid.to.as_ref().map(|to| format!(" .. {}", to.text)).unwrap_or_default();
                let places = format!("{}[{}{to}]", grid.name.text, grid.from.text);
                rows.push(vec![code(&places), code(&module.shown(grid.literal.span))]);
            }
            AssetLine::Frame { name, .. } => frames.push(name.text.as_str()),
            AssetLine::Joint(joint) => {
                rows.push(vec![
                    code(&format!("joint {}", joint.name.text)),
                    code(&format!("by {}", module.shown(joint.by.span))),
                ]);
            }
            _ => {}
        }
    }
    out += &table(&["field", "value"], &rows);
    if !frames.is_empty() {
        out += &format!("Frames: {}.\n\n", super::markdown::codes(frames));
    }
    out
}

/// The assets of a module, each with what it is, as a line of a list.
pub fn list(module: &Module) -> String {
    let mut all = Vec::new();
    for item in &module.tree.items {
        let ItemKind::Asset { name, extends, .. } = &item.kind else { continue };
        let is: Vec<&str> = extends.iter().filter_map(|p| p.segments.last()).map(|s| s.text.as_str()).collect();
        all.push(if is.is_empty() {
            format!("`{}`", name.text)
        } else {
            format!("`{}` ({})", name.text, is.join(", "))
        });
    }
    if all.is_empty() { String::new() } else { format!("- `{}`: {}\n", module.name, all.join(", ")) }
}
