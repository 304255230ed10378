//! The grammars of editors know the words of this one. Whether they accept the same texts, `.ci/editors` looks at.

use std::collections::BTreeSet;
use std::path::Path;

type Result<T = ()> = std::result::Result<T, Box<dyn std::error::Error>>;

fn read(path: &str) -> Result<String> {
    Ok(std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path))?)
}

/// Whole words of a text.
fn words(text: &str) -> BTreeSet<&str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').filter(|word| !word.is_empty()).collect()
}

/// What stands between `from` and the next `to`.
fn between<'a>(text: &'a str, from: &str, to: &str) -> Result<&'a str> {
    let start = text.find(from).ok_or(format!("no `{from}`"))? + from.len();
    let length = text[start..].find(to).ok_or(format!("no `{to}` after `{from}`"))?;
    Ok(&text[start..start + length])
}

/// The words of the language, of which some are names elsewhere.
fn keywords(grammar: &str) -> BTreeSet<&str> {
    let rules = grammar.lines().filter(|line| line.starts_with("kw_"));
    let mut found: BTreeSet<&str> = rules.filter_map(|line| line.split('"').nth(1)).collect();
    for rule in ["label    = @{", "role     = @{", "wire_when = @{", "joint_way = @{"] {
        found.extend(between(grammar, rule, "}").into_iter().flat_map(|rule| rule.split('"').skip(1).step_by(2)));
    }
    found
}

#[test]
fn grammars_of_editors_know_every_word() -> Result {
    let grammar = read("grammar/mtx.pest")?;
    let keywords = keywords(&grammar);
    assert!(keywords.len() > 140, "{}", keywords.len());
    for path in ["editors/tree-sitter-mtx/grammar.js", "editors/vscode/syntaxes/mtx.tmLanguage.json"] {
        let text = read(path)?.replace("\\\\b", " ");
        let known = words(&text);
        let unknown: Vec<_> = keywords.iter().filter(|word| !known.contains(*word)).collect();
        assert!(unknown.is_empty(), "{path} lacks {unknown:?}");
    }
    Ok(())
}

#[test]
fn grammars_of_editors_reserve_the_same_words() -> Result {
    let grammar = read("grammar/mtx.pest")?;
    let reserved: BTreeSet<&str> =
        keywords(&grammar).into_iter().filter(|word| !matterix_syntax::is_name(word)).collect();
    let tree_sitter = read("editors/tree-sitter-mtx/grammar.js")?;
    assert_eq!(words(between(&tree_sitter, "const RESERVED = [", "];")?), reserved);
    // `max` is a name where it is called, which the scanner asks for itself.
    let scanner = read("editors/tree-sitter-mtx/src/scanner.c")?;
    let mut in_scanner = words(between(&scanner, "RESERVED[] =", ";")?);
    assert!(in_scanner.insert("max"));
    assert_eq!(in_scanner, reserved);
    Ok(())
}

#[test]
fn the_words_that_start_a_step_are_those_of_the_grammar() -> Result {
    let grammar = read("grammar/mtx.pest")?;
    let rules = words(between(&grammar, "step_word = _{", "}")?);
    let of_grammar: BTreeSet<&str> = rules.into_iter().map(|rule| rule.trim_end_matches('_')).collect();
    assert_eq!(matterix_syntax::STEP_WORDS.iter().copied().collect::<BTreeSet<_>>(), of_grammar);
    Ok(())
}
