//! The page for programs: the parts of it that follow from the grammar, the library and the registry of codes.

use std::fs;

use matterix_ir::codes;
use matterix_lang::reference;

use super::ebnf::Grammar;
use super::up_to_date;
use crate::harness::root;

const PAGE: &str = "docs/for-programs.md";

/// The page stays short enough to be read whole.
const LINES: usize = 1650;

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The parts of the page by the name of their marks.
fn parts() -> Vec<(&'static str, String)> {
    let (rules, recovery) = (read("grammar/mtx.pest"), read("grammar/recovery.pest"));
    let grammar = Grammar::read(&[&rules, &recovery]);
    let fenced = |kind: &str, text: &str| format!("```{kind}\n{}\n```\n", text.trim_end());
    let table = |heads: &str, rows: &str| format!("{heads}\n{}", rows.trim_end().to_string() + "\n");
    let words: Vec<String> = grammar.words("reserved").iter().map(|w| format!("`{w}`")).collect();
    let found: String =
        codes::ALL.iter().map(|c| format!("| `{}` | {} |\n", c.name, c.summary.replace('|', "\\|"))).collect();
    let schema = root().join("docs/findings.schema.json");
    let schema = fs::read_to_string(schema).map(|text| fenced("json", &text)).unwrap_or_default();
    vec![
        ("grammar", fenced("ebnf", &grammar.show(&rules))),
        ("reserved", format!("{}.\n", words.join(", "))),
        ("units", table("| dimension | units |\n| --- | --- |", &reference::units())),
        ("verbs", reference::verbs()),
        ("things", reference::assets()),
        ("species", reference::species()),
        ("schema", schema),
        ("codes", table("| code | means |\n| --- | --- |", &found)),
    ]
}

/// A page with these parts between their marks.
fn filled(page: &str, parts: &[(&str, String)]) -> String {
    let mut out = page.to_string();
    for (name, text) in parts {
        let (begin, end) = (format!("<!-- begin {name} -->\n"), format!("<!-- end {name} -->\n"));
        let (above, rest) = out.split_once(&begin).unwrap_or_else(|| panic!("{PAGE} has no mark {begin}"));
        let (_, below) = rest.split_once(&end).unwrap_or_else(|| panic!("{PAGE} has no mark {end}"));
        let text = if text.is_empty() { String::new() } else { format!("\n{}\n\n", text.trim_end()) };
        out = format!("{above}{begin}{text}{end}{below}");
    }
    out
}

#[test]
fn the_page_for_programs_is_up_to_date_and_short() {
    let page = read(PAGE);
    let filled = filled(&page, &parts());
    up_to_date(PAGE, &filled);
    let lines = filled.lines().count();
    assert!(lines < LINES, "{PAGE} has {lines} lines");
}
