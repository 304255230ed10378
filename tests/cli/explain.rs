//! `matterixc explain`.

use crate::harness::{folder, matterixc, root, write};

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
    assert_eq!(ended.err, "error: unknown diagnostic code `syntx`\nhelp: did you mean `syntax`?\n");
    let ended = matterixc(&["explain", "zzzzzzzzzzzzzzzz"]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("help: `matterixc explain` lists all codes; "), "{}", ended.err);
}

#[test]
fn names_of_failures_are_explained_those_of_a_file_with_it() {
    let page = matterixc(&["explain", "left_in_tip"]);
    assert!(page.code == 0 && page.out.starts_with("# left-in-tip\n"), "{}", page.out);
    let text = "mtx 1\nhazard hot(p: Heater) when p.target > 60 degC \"less\"\n";
    let file = write(&folder("explain"), "hot.mtx", text);
    let own = matterixc(&["explain", "hot", &file]);
    assert!(own.code == 0 && own.out.contains("Line 2, a hazard"), "{}{}", own.out, own.err);
    let none = matterixc(&["explain", "cold", &file]);
    assert_eq!((none.code, none.out.as_str()), (2, ""));
    assert!(none.err.contains("these files declare no `cold`"), "{}", none.err);
}

#[test]
fn every_failure_of_the_library_has_a_page() {
    for file in std::fs::read_dir(root().join("stdlib")).expect("the folder is there") {
        let path = file.expect("it can be read").path();
        if path.extension().is_none_or(|ext| ext != "mtx") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("it is text");
        // A name after `else` stands before its help, except where something ends: that is `unfinished`.
        for (line, name) in
            text.lines().filter_map(|l| Some((l, l.split(" else ").nth(1).or(l.trim().strip_prefix("else "))?)))
        {
            let mut words = name.split_whitespace();
            let (Some(name), Some(help)) = (words.next(), words.next()) else { continue };
            // `need` is the failure of a need that has no name of its own.
            let named = name != "need" && !name.starts_with("left_");
            if help.starts_with('"') && named || name == "left_in_tip" {
                let code = name.replace('_', "-");
                assert!(matterix_ir::codes::find(&code).is_some(), "{}: `{name}` has no page: {line}", path.display());
            }
        }
    }
}
