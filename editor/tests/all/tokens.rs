//! Every name of every example and of the library stands for something.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use matterix_editor::index::{Index, Meaning};
use matterix_ir::FileId;

use crate::support::{analysed, beside, examples};

/// Words of the grammar, wherever it takes one: no names where they stand as such.
fn words() -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../grammar/mtx.pest");
    let grammar = std::fs::read_to_string(path).expect("the grammar");
    let is_word = |text: &&str| text.len() > 1 && text.bytes().all(|b| b.is_ascii_lowercase() || b == b'_');
    let rules = grammar.lines().filter(|line| !line.starts_with("//"));
    let words: BTreeSet<String> =
        rules.flat_map(|rule| rule.split('"').skip(1).step_by(2).filter(is_word).map(str::to_string)).collect();
    assert!(words.len() > 140, "{}", words.len());
    words
}

/// The identifiers of a text, outside comments and texts in quotes.
pub fn identifiers(text: &str) -> Vec<(usize, &str)> {
    let bytes = text.as_bytes();
    let mut out = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            b'/' if bytes.get(at + 1) == Some(&b'/') => {
                at += text[at..].find('\n').unwrap_or(text.len() - at);
            }
            b'"' => {
                at += 1;
                while at < bytes.len() && bytes[at] != b'"' && bytes[at] != b'\n' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at += 1;
            }
            b if b.is_ascii_digit() => {
                while at < bytes.len()
                    && (bytes[at].is_ascii_alphanumeric() || bytes[at] == b'.' && bytes[at + 1] != b'.')
                {
                    at += 1;
                }
            }
            b if b.is_ascii_alphabetic() || b == b'_' => {
                let start = at;
                while at < bytes.len() && (bytes[at].is_ascii_alphanumeric() || bytes[at] == b'_') {
                    at += 1;
                }
                out.push((start, &text[start..at]));
            }
            _ => at += 1,
        }
    }
    out
}

fn unresolved(index: &Index, file: FileId, text: &str, found: &mut BTreeMap<String, usize>) -> (usize, usize) {
    let (mut all, mut known) = (0, 0);
    let words = words();
    for (at, word) in identifiers(text) {
        let uses = index.uses(file);
        // The prefix of a unit is no name.
        let covering = uses.iter().find(|u| (u.span.start as usize) < at + word.len() && at < u.span.end as usize);
        match covering.map(|u| u.meaning) {
            Some(Meaning::Unknown) => {
                *found.entry(format!("{word}: unknown in {}", line(text, at))).or_default() += 1;
            }
            Some(_) => known += 1,
            None if words.contains(word) => continue,
            None => *found.entry(format!("{word}: not looked at in {}", line(text, at))).or_default() += 1,
        }
        all += 1;
    }
    (all, known)
}

fn line(text: &str, at: usize) -> &str {
    let start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    text[start..].lines().next().unwrap_or_default().trim()
}

#[test]
fn every_name_of_the_library_stands_for_something() {
    // Modules that are read only where a file imports them too.
    let apart = matterix_lang::library::MODULES.iter().filter(|m| !m.apart.is_empty());
    let text = apart.fold("mtx 1\n".to_string(), |text, m| text + "use " + m.name + "\n");
    let (analysis, index) = analysed("a.mtx", &text, &crate::support::Files::default());
    let mut found = BTreeMap::new();
    let (mut all, mut known) = (0, 0);
    for module in analysis.modules.iter().filter(|m| m.is_library()) {
        let (a, k) = unresolved(&index, module.file, analysis.text(module.file), &mut found);
        (all, known) = (all + a, known + k);
    }
    println!("{known} of {all}");
    let list: Vec<String> = found.keys().cloned().collect();
    assert!(found.is_empty(), "{} of {all} names stand for nothing:\n{}", all - known, list.join("\n"));
}

#[test]
fn every_name_of_the_examples_stands_for_something() {
    let mut found = BTreeMap::new();
    let (mut all, mut known) = (0, 0);
    for (path, text) in examples() {
        let (analysis, index) = analysed(&path.display().to_string(), &text, &beside(&path));
        let (a, k) = unresolved(&index, analysis.root, &text, &mut found);
        (all, known) = (all + a, known + k);
    }
    println!("{known} of {all}");
    let list: Vec<String> = found.keys().cloned().collect();
    assert!(found.is_empty(), "{} of {all} names stand for nothing:\n{}", all - known, list.join("\n"));
}
