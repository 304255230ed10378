//! Commands and skills: how they are called, what they take, need, do and may fail with.

use crate::ast::{Clause, ClauseKind, ItemKind, MemberKind, Name, Param, Refusal, Sig, TextPart};

use super::markdown::{cell, code, line, table};
use super::{Library, Module};

/// How a command of a device, or a skill where there is none, is called, with names of parameters in capitals.
pub fn form(library: &Library, sig: &Sig, clauses: &[Clause], device: Option<&str>) -> String {
    let group = |params: &[Param]| match params {
        [one] => capitals(&one.name.text),
        several => {
            format!("({})", several.iter().map(|p| capitals(&p.name.text)).collect::<Vec<_>>().join(", "))
        }
    };
    let device = device.map(capitals);
    let behind = device.is_some() && (!sig.params.is_empty() || stands_behind(library, sig));
    let mut out = verb(&sig.verb);
    if !sig.params.is_empty() {
        out += &format!(" {}", group(&sig.params));
    } else if let Some(device) = device.as_ref().filter(|_| !behind) {
        out += &format!(" {device}");
    }
    for (label, params) in &sig.labelled {
        out += &format!(" {} {}", label.text, group(params));
    }
    if let Some(device) = device.filter(|_| behind) {
        out += &format!(" by {device}");
    }
    let must: Vec<String> = options(clauses)
        .filter(|p| p.default.is_none())
        .map(|p| format!("{}: {}", p.name.text, capitals(&p.name.text)))
        .collect();
    if must.is_empty() { out } else { format!("{out} {{ {} }}", must.join(", ")) }
}

/// A name as it stands for a value: `SolidDispenser` is SOLID_DISPENSER.
fn capitals(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_uppercase() && out.ends_with(|last: char| !last.is_numeric() && last != '_') {
            out.push('_');
        }
        out.extend(c.to_uppercase());
    }
    out
}

/// Whether the device of a command that may be its object stands after `by` where the library calls it, or has to: a verb
/// that begins with `return` is one only before a preposition.
fn stands_behind(library: &Library, sig: &Sig) -> bool {
    let verb = verb(&sig.verb);
    let first = sig.labelled.first().map(|(label, _)| label.text.as_str());
    let called: Vec<String> = first.into_iter().chain(["by"]).map(|label| format!("{verb} {label} ")).collect();
    // What comments say in passing is no call.
    let calls = |text: &str| {
        let mut lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        lines.any(|line| called.iter().any(|c| line.contains(c)))
    };
    sig.verb.first().is_some_and(|w| w.text == "return") || library.modules.iter().any(|m| calls(m.text))
}

/// The words of a verb.
pub fn verb(words: &[Name]) -> String {
    words.iter().map(|w| w.text.as_str()).collect::<Vec<_>>().join(" ")
}

fn options(clauses: &[Clause]) -> impl Iterator<Item = &Param> {
    clauses.iter().filter_map(|c| match &c.kind {
        ClauseKind::Option(param) => Some(param),
        _ => None,
    })
}

/// All that is known of a command or a skill, below its heading; beside its documentation stands the device that a command is of.
pub fn body(
    library: &Library,
    module: &Module,
    member: (&[String], Option<&str>),
    sig: &Sig,
    clauses: &[Clause],
) -> String {
    let (docs, device) = member;
    let mut out = String::new();
    let about = if docs.is_empty() { in_words(clauses, device) } else { line(docs) };
    if !about.is_empty() {
        out += &format!("{about}\n\n");
    }
    out += &table(&["", "parameter", "type", "unit", "default"], &parameters(library, module, sig, clauses));
    let facts = facts(module, sig, clauses);
    if !facts.is_empty() {
        out += &format!("{}\n\n", facts.join("\n"));
    }
    out
}

/// What a person is told to do, where nothing else describes it.
fn in_words(clauses: &[Clause], device: Option<&str>) -> String {
    let device = device.map(capitals);
    let mut out = String::new();
    for clause in clauses {
        let ClauseKind::Says { text, when: None } = &clause.kind else { continue };
        for part in &text.parts {
            match part {
                TextPart::Plain(plain) => out += plain,
                TextPart::Value { value, .. } => match &*value.kind {
                    crate::ast::ExprKind::Name(name) if name.text == "self" => out += device.as_deref().unwrap_or("it"),
                    crate::ast::ExprKind::Name(name) => out += &capitals(&name.text),
                    _ => out += "...",
                },
            }
        }
    }
    let mut letters = out.chars();
    match letters.next() {
        Some(first) => format!("{}{}.", first.to_uppercase(), letters.as_str()),
        None => out,
    }
}

fn parameters(library: &Library, module: &Module, sig: &Sig, clauses: &[Clause]) -> Vec<Vec<String>> {
    let row = |place: String, p: &Param| {
        let ty = p.ty.as_ref();
        vec![
            place,
            code(&p.name.text),
            ty.map(|t| code(&module.shown(t.span))).unwrap_or_default(),
            ty.and_then(|t| library.measures.of_type(t)).unwrap_or_default(),
            p.default.as_ref().map(|e| code(&module.shown(e.span))).unwrap_or_default(),
        ]
    };
    let mut rows: Vec<Vec<String>> = sig.params.iter().map(|p| row(String::new(), p)).collect();
    for (label, params) in &sig.labelled {
        rows.extend(params.iter().map(|p| row(code(&label.text), p)));
    }
    rows.extend(options(clauses).map(|p| row("option".to_string(), p)));
    rows
}

fn refused(refusal: Option<&Refusal>) -> String {
    match refusal {
        Some(Refusal { failure, help: Some(help), .. }) => format!(", else `{}`: {help}", failure.text),
        Some(Refusal { failure, help: None, .. }) => format!(", else `{}`", failure.text),
        None => String::new(),
    }
}

fn facts(module: &Module, sig: &Sig, clauses: &[Clause]) -> Vec<String> {
    let shown = |span| format!("`{}`", module.shown(span));
    let mut out = Vec::new();
    if let Some(result) = &sig.result {
        out.push(format!("- gives: {}", shown(result.span)));
    }
    for clause in clauses {
        match &clause.kind {
            ClauseKind::Needs { cond, refusal } => {
                out.push(format!("- needs {}{}", shown(cond.span), refused(refusal.as_ref())));
            }
            ClauseKind::Presumes { ever, cond, refusal } => {
                let ever = if *ever { "at some moment before " } else { "" };
                out.push(format!("- presumes {ever}{}{}", shown(cond.span), refused(refusal.as_ref())));
            }
            ClauseKind::Warns { cond, refusal } => {
                out.push(format!("- warns unless {}{}", shown(cond.span), refused(refusal.as_ref())));
            }
            ClauseKind::While(cond) => out.push(format!("- as long as {}, else `broken`", shown(cond.span))),
            ClauseKind::Until(cond) => out.push(format!("- lasts until {}", shown(cond.span))),
            ClauseKind::Takes { nominal, bounds } => {
                let bounds = bounds.as_ref().map(|b| format!(" in {}", shown(b.span))).unwrap_or_default();
                out.push(format!("- takes {}{bounds}", shown(nominal.span)));
            }
            ClauseKind::Fails(names) => {
                let names: Vec<String> = names.iter().map(|n| format!("`{}`", n.text)).collect();
                out.push(format!("- may fail with {}", names.join(", ")));
            }
            ClauseKind::Effect(_) => {
                let text = module.shown(clause.span);
                out.push(format!("- effect: `{}`", text.strip_prefix("effect ").unwrap_or(&text)));
            }
            _ => {}
        }
    }
    out
}

/// The commands and skills of a module with their forms and what they are for, as rows of a table.
pub fn list(library: &Library, module: &Module) -> String {
    let row = |docs: &[String], sig: &Sig, clauses: &[Clause], device: Option<&str>| {
        let form = form(library, sig, clauses, device);
        let about = if docs.is_empty() { in_words(clauses, device).replace('|', "\\|") } else { cell(docs) };
        format!("| `{form}` | {about} |\n")
    };
    let mut rows = String::new();
    for item in &module.tree.items {
        match &item.kind {
            ItemKind::Capability { name, members, .. } => {
                for member in members {
                    if let MemberKind::Command { sig, clauses } = &member.kind {
                        rows += &row(&member.docs, sig, clauses, Some(&name.text));
                    }
                }
            }
            ItemKind::Skill { sig, clauses, .. } => rows += &row(&item.docs, sig, clauses, None),
            _ => {}
        }
    }
    if rows.is_empty() { rows } else { format!("| `{}` | |\n| --- | --- |\n{rows}\n", module.name) }
}
