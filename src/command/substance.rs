//! `matterixc substance`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use matterix_ir::listing::joined;
use matterix_lang::catalogue::{Catalogue, Found, Part, Source, Stated, Substance};
use serde_json::{Value, json};

use crate::Exit;
use crate::args::{SubstanceArgs, SubstanceFormat};
use crate::files;
use crate::report::wrap;
use crate::terminal::{Stream, print, print_error};

/// Columns of a page, and of the names of its properties.
const WIDTH: usize = 99;
const NAMES: usize = 22;
/// Equilibria of one kind that a page shows unasked.
const SHOWN: usize = 6;

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
        SubstanceFormat::Human => pages(word, first, others, args.all),
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
fn pages(word: &str, first: &Found<'_>, others: &[Found<'_>], all: bool) -> String {
    let mut out = match first.substances.as_slice() {
        [one] => page(one, all),
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

fn page(s: &Substance, all: bool) -> String {
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
    let mut sources: BTreeSet<(&str, &str)> = BTreeSet::new();
    for stated in &s.stated {
        line(&stated.property, &format!("{}{}", value(stated), note(stated)));
        if let Some(Source { tag: Some(tag), text, .. }) = &stated.source {
            sources.insert((tag, text));
        }
    }
    let there = match &s.import {
        Some(import) => format!("`{import}`, or `{import}::{}`", s.name),
        None if s.module.starts_with("std::") => format!("no import needed: every file sees {}", s.module),
        None => format!("declared in {}", s.module),
    };
    line("to use it", &there);
    for group in s.equilibria.chunk_by(|a, b| a.kind == b.kind) {
        out += &format!("\n{}:\n", heading(group));
        let shown = if all { group.len() } else { SHOWN };
        for part in group.iter().take(shown) {
            out += &equilibrium(part);
            sources.extend(part.sources.iter().filter_map(|of| Some((of.tag.as_deref()?, of.text.as_str()))));
        }
        if let more @ 1.. = group.len().saturating_sub(shown) {
            out += &format!("  and {more} more: `--all` shows them\n");
        }
    }
    if !sources.is_empty() {
        out += "\nSources:\n";
        sources.iter().for_each(|(tag, text)| out += &wrapped("  ", &format!("[{tag}] {text}")));
    }
    out
}

/// What a group of equilibria is about: `Equilibria, acids and bases`.
fn heading(group: &[Part]) -> String {
    let kind = group.first().map_or("", |part| part.kind.name());
    format!("Equilibria, {kind}")
}

/// An equilibrium over two lines: what it is, and its numbers.
fn equilibrium(part: &Part) -> String {
    let of = part.ion.as_ref().map_or_else(String::new, |ion| format!(", of {ion}"));
    let mut numbers: Vec<String> = Vec::new();
    numbers.extend(part.constant.as_ref().map(|c| format!("{} {} at {}", c.symbol, c.value, c.at)));
    numbers.extend(part.enthalpy.as_ref().map(|enthalpy| format!("enthalpy {enthalpy}")));
    numbers.extend(part.valid.as_ref().map(|valid| format!("valid {valid}")));
    let sources: String = part.sources.iter().map(said).collect();
    let first = wrapped("  ", &format!("{} ({}{of})", part.equation, part.module));
    first + &wrapped("      ", &format!("{}{sources}", numbers.join(", ")))
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
    stated.source.as_ref().map_or_else(String::new, said)
}

/// A source behind its number.
fn said(source: &Source) -> String {
    match source {
        Source { tag: Some(tag), remark, .. } if remark.is_empty() => format!("  [{tag}]"),
        Source { tag: Some(tag), remark, .. } => format!("  [{tag}] {remark}"),
        Source { tag: None, text, .. } => format!("  ({text})"),
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
            let source = stated.source.as_ref().map(source);
            json!({ "property": stated.property, "value": stated.value, "source": source })
        })
        .collect();
    let equilibria: Vec<Value> = s.equilibria.iter().map(part).collect();
    json!({
        "name": s.name, "aliases": s.aliases, "about": s.about, "module": s.module, "use": s.import, "formula": s.formula,
        "molar_mass": s.molar_mass.map(|mass| mass * 1e3), "cas": s.cas, "smiles": s.smiles, "properties": properties,
        "equilibria": equilibria,
    })
}

fn source(of: &Source) -> Value {
    json!({ "tag": of.tag, "text": of.text, "remark": of.remark })
}

fn part(part: &Part) -> Value {
    let constant = part.constant.as_ref().map(|c| json!({ "symbol": c.symbol, "value": c.value, "at": c.at }));
    let sources: Vec<Value> = part.sources.iter().map(source).collect();
    json!({
        "name": part.name, "equation": part.equation, "module": part.module, "kind": part.kind.name(), "ion": part.ion,
        "constant": constant, "enthalpy": part.enthalpy, "valid": part.valid, "sources": sources,
    })
}
