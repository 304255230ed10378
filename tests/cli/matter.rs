//! Which quantities of each species are matter, and what becomes of the others.

use crate::harness::{folder, matterixc, pass_cases, root, run_case};

#[test]
fn what_is_no_matter_begins_as_declared_and_goes_along() {
    pass_cases("tags.mtx", &["travel", "written", "labelled", "reacted"]);
}

#[test]
fn balances_count_matter_only() {
    let (_, text) = run_case("tags.mtx", "travel", &[]);
    let line = text.lines().find(|l| l.trim_start().starts_with("mass ")).unwrap_or_default();
    let sum: Vec<&str> = line.split_whitespace().collect();
    // 100, 50, 50 and 50, and 101 g.
    assert_eq!(sum.get(1..3), Some(["351", "351"].as_slice()), "{text}");
    assert!(!text.lines().any(|l| l.trim_start().starts_with("tag ")), "{text}");
}

#[test]
fn what_goes_along_is_shown_and_recorded() {
    let file = root().join("tests/cases/tags.mtx");
    let known = matterixc(&["check", file.to_str().expect("text"), "--contents"]);
    assert_eq!(known.code, 0, "{}{}", known.out, known.err);
    assert!(known.out.contains("tag[water] 0.5 mmol"), "{}", known.out);
    assert!(!known.out.contains("enthalpy"), "{}", known.out);
    let dir = folder("tags");
    let out = dir.join("out");
    let (code, text) = run_case("tags.mtx", "travel", &["--csv", "--out", out.to_str().expect("text")]);
    assert_eq!(code, 0, "{text}");
    let table = std::fs::read_to_string(out.join("states.csv")).expect("the table");
    let header: Vec<&str> = table.lines().next().unwrap_or_default().split(',').collect();
    let column = header.iter().position(|name| *name == "b.contents.tag[water] [mmol]");
    let last = table.lines().last().and_then(|row| row.split(',').nth(column?)).and_then(|v| v.parse::<f64>().ok());
    assert!(last.is_some_and(|v| (v - 5.5).abs() < 1e-9), "{header:?} {last:?}");
}
