//! `matterixc substance`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use matterix_ir::listing::joined;
use matterix_lang::catalogue::{Catalogue, Found, Source, Stated, Substance};
use serde_json::{Value, json};

use crate::Exit;
use crate::args::{SubstanceArgs, SubstanceFormat};
use crate::files;
use crate::report::wrap;
use crate::terminal::{Stream, print, print_error};

/// Columns of a page, and of the names of its properties.
const WIDTH: usize = 99;
const NAMES: usize = 22;

/// Prints what is known of a substance and where each number comes from.
pub fn substance(args: &SubstanceArgs) -> Exit {
    super::or_complain(attempt(args))
}

fn attempt(args: &SubstanceArgs) -> Result<Exit, String> {
    let read =
        |path: &PathBuf| Ok((path.display().to_string(), String::from_utf8_lossy(&files::read(path)?).into_owned()));
    let own = args.file.iter().map(read).collect::<Result<Vec<_>, String>>()?;
    let catalogue = Catalogue::read(&own);
    let word = args.name.trim();
    let found = catalogue.find(word);
    let Some((first, others)) = found.split_first() else {
        print_error(&format!("unknown substance `{word}`"));
        let near: Vec<String> = catalogue.near(word).iter().map(|name| format!("`{name}`")).collect();
        let help = match near.as_slice() {
            [] => "give a name, a formula, a CAS number or a SMILES; `--file` also searches your own file".to_string(),
            all => format!("did you mean {}?", joined(all, "or")),
        };
        print(Stream::Err, &format!("help: {help}\n"));
        return Ok(Exit::Findings);
    };
    let text = match args.format {
        SubstanceFormat::Human => pages(word, first, others),
        SubstanceFormat::Json => {
            let substances: Vec<Value> = first.substances.iter().map(|s| object(s)).collect();
            let answer = json!({ "asked": word, "by": first.by, "substances": substances });
            serde_json::to_string_pretty(&answer).map_err(|e| format!("cannot write the answer: {e}"))? + "\n"
        }
    };
    print(Stream::Out, &text);
    Ok(Exit::Fine)
}

/// The page of the one that is meant, or a list of those that may be; and what else the word stands for.
fn pages(word: &str, first: &Found<'_>, others: &[Found<'_>]) -> String {
    let mut out = match first.substances.as_slice() {
        [one] => page(one),
        several => format!("{} substances have the {} `{word}`:\n{}", several.len(), first.by, list(several)),
    };
    for group in others {
        out += &format!("\nAs a {} `{word}` is:\n{}", group.by, list(&group.substances));
    }
    out
}

fn list(substances: &[&Substance]) -> String {
    let width = substances.iter().map(|s| s.name.len()).max().unwrap_or(0);
    substances.iter().map(|s| format!("  {:width$}  {} ({})\n", s.name, s.title(), s.module)).collect()
}

fn page(s: &Substance) -> String {
    let mut out = format!("{}\n{}", s.name, wrapped("  ", &s.about));
    let mut line = |name: &str, value: &str| out += &format!("  {:NAMES$}{value}\n", words(name));
    if !s.aliases.is_empty() {
        line("also_called", &s.aliases.join(", "));
    }
    for (name, value) in [("formula", &s.formula), ("CAS", &s.cas), ("SMILES", &s.smiles)] {
        if let Some(value) = value {
            line(name, value);
        }
        if let (Some(mass), "formula") = (s.molar_mass, name) {
            line("molar mass", &format!("{:.3} g/mol", mass * 1e3));
        }
    }
    let mut tags: BTreeMap<&str, &str> = BTreeMap::new();
    for stated in &s.stated {
        line(&stated.property, &format!("{}{}", value(stated), note(stated)));
        if let Some(Source { tag: Some(tag), text, .. }) = &stated.source {
            tags.insert(tag, text);
        }
    }
    for (index, part) in s.equilibria.iter().enumerate() {
        let heading = if index == 0 { "equilibria" } else { "" };
        line(heading, &format!("{}: {} ({})", part.name, part.equation, part.module));
    }
    let there = match &s.import {
        Some(import) => format!("`{import}`, or `{import}::{}`", s.name),
        None if s.module.starts_with("std::") => format!("no import needed: every file sees {}", s.module),
        None => format!("declared in {}", s.module),
    };
    line("to use it", &there);
    if !tags.is_empty() {
        out += "\nSources:\n";
        tags.iter().for_each(|(tag, text)| out += &wrapped("  ", &format!("[{tag}] {text}")));
    }
    out
}

/// `boiling_point` as words.
fn words(property: &str) -> String {
    property.replace('_', " ")
}

/// A value without the quotation marks and brackets of the language.
fn value(stated: &Stated) -> String {
    stated.value.chars().filter(|c| !matches!(c, '"' | '[' | ']')).collect()
}

fn note(stated: &Stated) -> String {
    match &stated.source {
        None => String::new(),
        Some(Source { tag: Some(tag), remark, .. }) if remark.is_empty() => format!("  [{tag}]"),
        Some(Source { tag: Some(tag), remark, .. }) => format!("  [{tag}] {remark}"),
        Some(Source { tag: None, text, .. }) => format!("  ({text})"),
    }
}

/// A text over lines, each behind an indent, the later ones further in.
fn wrapped(indent: &str, text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let lines = wrap(&words.join(" "), WIDTH, indent.len(), indent.len() + 2);
    let line = |(i, line): (usize, String)| {
        format!("{}\n", format!("{indent}{}{line}", if i == 0 { "" } else { "  " }).trim_end())
    };
    lines.into_iter().enumerate().map(line).collect()
}

fn object(s: &Substance) -> Value {
    let properties: Vec<Value> = s
        .stated
        .iter()
        .map(|stated| {
            let source =
                stated.source.as_ref().map(|of| json!({ "tag": of.tag, "text": of.text, "remark": of.remark }));
            json!({ "property": stated.property, "value": stated.value, "source": source })
        })
        .collect();
    let equilibria: Vec<Value> = s
        .equilibria
        .iter()
        .map(|part| json!({ "name": part.name, "equation": part.equation, "module": part.module }))
        .collect();
    json!({
        "name": s.name, "aliases": s.aliases, "about": s.about, "module": s.module, "use": s.import, "formula": s.formula,
        "molar_mass": s.molar_mass.map(|mass| mass * 1e3), "cas": s.cas, "smiles": s.smiles, "properties": properties,
        "equilibria": equilibria,
    })
}
