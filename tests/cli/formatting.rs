//! `matterixc fmt`, on texts that are in the one style.

use std::fs;

use crate::harness::{folder, matterixc_in, matterixc_with, names, write};

const STYLED: &str = "mtx 1\n";

#[test]
fn standard_input_goes_to_standard_output() {
    let ended = matterixc_with(&["fmt", "-"], STYLED.as_bytes());
    assert_eq!((ended.code, ended.out.as_str(), ended.err.as_str()), (0, STYLED, ""));
}

#[test]
fn standard_input_that_is_not_text_is_a_finding() {
    let ended = matterixc_with(&["fmt", "-"], b"\xff");
    assert_eq!((ended.code, ended.out.as_str()), (1, ""));
    assert!(ended.err.contains("<stdin>:1:1"), "{}", ended.err);
}

#[test]
fn a_styled_file_is_not_touched() {
    let dir = folder("fmt_styled");
    write(&dir, "a.mtx", STYLED);
    let before = fs::metadata(dir.join("a.mtx")).and_then(|m| m.modified()).expect("the file is there");
    for args in [["fmt", "a.mtx", "--check"], ["fmt", "a.mtx", "--color=never"]] {
        let ended = matterixc_in(&dir, &args);
        assert_eq!((ended.code, ended.out.as_str(), ended.err.as_str()), (0, "", ""));
    }
    let after = fs::metadata(dir.join("a.mtx")).and_then(|m| m.modified()).expect("the file is there");
    assert_eq!(before, after);
    assert_eq!(names(&dir), ["a.mtx"]);
}

#[test]
fn the_styled_text_can_go_to_standard_output() {
    let dir = folder("fmt_stdout");
    write(&dir, "a.mtx", STYLED);
    let ended = matterixc_in(&dir, &["fmt", "a.mtx", "--stdout"]);
    assert_eq!((ended.code, ended.out.as_str()), (0, STYLED));
}

#[test]
fn a_step_behind_a_brace_gets_its_separator() {
    let dir = folder("fmt_beside");
    let text = "mtx 1\n\ntest t { run go { t: 1 min }  expect elapsed < 2 min }\n\
        workflow w in b { step a { wait 1 s } wait 3 s; if 1 == 1 { wait 1 s } for x in [1 s] { wait x } }\n";
    write(&dir, "a.mtx", text);
    let styled = "mtx 1\n\ntest t { run go { t: 1 min }; expect elapsed < 2 min }\n\
        workflow w in b { step a { wait 1 s }; wait 3 s; if 1 == 1 { wait 1 s }; for x in [1 s] { wait x } }\n";
    assert_eq!(matterixc_in(&dir, &["fmt", "a.mtx", "--stdout"]).out, styled);
    write(&dir, "a.mtx", styled);
    assert_eq!(matterixc_in(&dir, &["fmt", "a.mtx", "--stdout"]).out, styled);
    // A step that does not end with a brace ends with its line.
    write(&dir, "a.mtx", "mtx 1\n\nworkflow w in b { wait 5 s expect 1 == 1 }\n");
    let ended = matterixc_in(&dir, &["fmt", "a.mtx"]);
    assert_eq!(ended.code, 1);
    assert!(
        ended.err.contains("`expect` is not expected after `s`") || ended.out.contains("`expect` is not expected"),
        "{}",
        ended.err
    );
}
