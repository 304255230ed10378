//! `matterixc explain`.

use crate::harness::matterixc;

#[test]
fn a_code_is_explained_by_its_page() {
    for given in ["syntax", "SYNTAX", "error[syntax]", "[syntax]"] {
        let ended = matterixc(&["explain", given]);
        assert_eq!(ended.code, 0, "{given}");
        assert!(ended.out.starts_with("# syntax\n"), "{}", ended.out);
    }
}

#[test]
fn every_code_is_listed_under_its_family() {
    let ended = matterixc(&["explain"]);
    assert_eq!(ended.code, 0);
    for code in matterix_ir::codes::ALL {
        let line = ended.out.lines().find(|l| l.split_whitespace().next() == Some(code.name));
        assert!(line.is_some_and(|l| l.ends_with(code.summary)), "{}", code.name);
    }
    let family = matterixc(&["explain", "p0"]);
    assert_eq!(family.code, 0);
    assert!(family.out.starts_with("P0\n") && family.out.contains("  syntax"), "{}", family.out);
}

#[test]
fn an_unknown_code_is_a_usage_error_with_a_suggestion() {
    let ended = matterixc(&["explain", "syntx"]);
    assert_eq!((ended.code, ended.out.as_str()), (2, ""));
    assert_eq!(ended.err, "error: there is no diagnostic code `syntx`\nhelp: did you mean `syntax`?\n");
    let ended = matterixc(&["explain", "zzzzzzzzzzzzzzzz"]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.ends_with("help: `matterixc explain` lists all codes\n"), "{}", ended.err);
}
