//! `lang/syntax/tests/trees/recovery.txt`: texts with mistakes, each followed by what is said about it.
//!
//! A line `// error COLUMN: HEADLINE` is about the nearest line above that is no such line; every finding has one.

use matterix_ir::FileId;
use matterix_syntax::parse;

const CASES: &str = include_str!("../trees/recovery.txt");

/// Findings of a text as marker lines, by the number of the line that they are about.
fn markers(text: &str) -> Vec<(usize, String)> {
    let (_, found) = parse(FileId(0), text);
    let mut markers = Vec::new();
    for finding in found {
        let before = &text[..finding.span().start as usize];
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        markers.push((before.matches('\n').count(), format!("// error {column}: {}", finding.headline)));
    }
    markers
}

fn is_marker(line: &str) -> bool {
    line.starts_with("// error ")
}

/// The case as it should be written.
fn annotated(case: &str) -> String {
    let plain: Vec<&str> = case.lines().filter(|line| !is_marker(line)).collect();
    let text = plain.join("\n") + "\n";
    let markers = markers(&text);
    let mut all = String::new();
    for (number, line) in plain.iter().enumerate() {
        all.push_str(line);
        all.push('\n');
        for (_, marker) in markers.iter().filter(|(at, _)| *at == number) {
            all.push_str(marker);
            all.push('\n');
        }
    }
    for (_, marker) in markers.iter().filter(|(at, _)| *at >= plain.len()) {
        all.push_str(marker);
        all.push('\n');
    }
    all
}

#[test]
fn every_mistake_has_its_message() {
    let mut wrong = String::new();
    let mut count = 0;
    for case in CASES.split("=== ").skip(1) {
        let (title, body) = case.split_once('\n').expect("a case has a title line");
        let actual = annotated(body);
        count += 1;
        if actual.trim_end() != body.trim_end() {
            wrong.push_str(&format!("=== {title}\n{actual}"));
        }
    }
    assert!(count >= 30, "{count} cases");
    assert!(wrong.is_empty(), "these cases read now:\n{wrong}");
}

/// Headlines with one-based lines and columns.
fn places(text: &str) -> Vec<(usize, usize, String)> {
    let mut sources = matterix_ir::Sources::default();
    let file = sources.add("test.mtx", text);
    let (_, found) = parse(file, text);
    found.into_iter().map(|f| (sources.line_column(f.span()).0, sources.line_column(f.span()).1, f.headline)).collect()
}

#[test]
fn line_ends_of_windows_and_a_byte_order_mark_change_nothing() {
    for case in CASES.split("=== ").skip(1) {
        let (title, body) = case.split_once('\n').expect("a case has a title line");
        let plain: String = body.lines().filter(|l| !is_marker(l)).flat_map(|l| [l, "\n"]).collect();
        let mut expected = places(&plain);
        assert_eq!(places(&plain.replace('\n', "\r\n")), expected, "{title}");
        // The mark is a character of the first line.
        expected.iter_mut().filter(|p| p.0 == 1).for_each(|p| p.1 += 1);
        assert_eq!(places(&format!("\u{feff}{plain}")), expected, "{title}");
    }
}
