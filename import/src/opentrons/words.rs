//! Names and numbers as the language writes them.

use std::collections::BTreeSet;

use matterix_lang::syntax::is_name;

/// A name of words: small letters, digits and `_`, that no other thing has.
pub(super) fn name_of(words: &str, otherwise: &str, taken: &mut BTreeSet<String>) -> String {
    let mut plain = String::new();
    for c in words.chars() {
        match c {
            c if c.is_ascii_alphanumeric() => plain.push(c.to_ascii_lowercase()),
            _ if plain.ends_with('_') || plain.is_empty() => {}
            _ => plain.push('_'),
        }
    }
    let plain = plain.trim_matches('_');
    let fits = |name: &str| is_name(name) && name.starts_with(|c: char| c.is_ascii_alphabetic());
    let base = match () {
        () if fits(plain) && plain.len() <= 40 => plain.to_owned(),
        () => otherwise.to_owned(),
    };
    unique(&base, taken)
}

/// A name of an asset, in words that begin with capitals, that no other thing has.
pub(super) fn asset_name(load_name: &str, taken: &mut BTreeSet<String>) -> String {
    let mut out = String::new();
    for word in load_name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()) {
        let mut letters = word.chars();
        out.extend(letters.next().map(|c| c.to_ascii_uppercase()));
        out.push_str(letters.as_str());
    }
    if !out.starts_with(|c: char| c.is_ascii_alphabetic()) {
        out.insert_str(0, "Labware");
    }
    unique(&out, taken)
}

fn unique(base: &str, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|n| format!("{base}_{n}"));
    let name = std::iter::once(base.to_owned()).chain(numbered).find(|name| !taken.contains(name)).unwrap_or_default();
    taken.insert(name.clone());
    name
}

/// A number without the dust of binary fractions: 13 digits.
pub(super) fn number(value: f64) -> String {
    let plain: f64 = format!("{value:.12e}").parse().unwrap_or(value);
    // What rounding left of nothing.
    if plain.abs() < 1e-9 { "0".to_owned() } else { plain.to_string() }
}

/// ` { a, b }`; nothing of none.
pub(super) fn braced(all: &[String]) -> String {
    if all.is_empty() { String::new() } else { format!(" {{ {} }}", all.join(", ")) }
}

/// A text as a literal; what stands in braces there is no value.
pub(super) fn text(words: &str) -> String {
    let line = words.split_whitespace().collect::<Vec<_>>().join(" ");
    format!("\"{}\"", line.replace('\\', "\\\\").replace('"', "\\\"").replace('{', "{{").replace('}', "}}"))
}
