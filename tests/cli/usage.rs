//! Arguments, help, versions, and readers that go away.

use std::io::Read;
use std::process::Stdio;

use crate::harness::{command, matterixc};

#[test]
fn nothing_typed_shows_help_and_is_a_usage_error() {
    let ended = matterixc(&[]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("Usage: matterixc"), "{}", ended.err);
}

#[test]
fn help_names_every_command_and_the_exit_status() {
    let ended = matterixc(&["--help"]);
    assert_eq!((ended.code, ended.err.as_str()), (0, ""));
    for word in ["check", "fmt", "run", "explain", "new", "version", "Exit status"] {
        assert!(ended.out.contains(word), "{word} is not in\n{}", ended.out);
    }
}

#[test]
fn what_is_not_an_argument_is_a_usage_error() {
    let wrong: &[&[&str]] = &[
        &["chek"],
        &["check"],
        &["check", "--format", "xml", "a.mtx"],
        &["run"],
        &["run", "a.mtx", "--set", "target"],
        &["run", "a.mtx", "--set", "=40 degC"],
        &["run", "a.mtx", "--seed", "soon"],
        &["run", "a.mtx", "--fidelity", "exact"],
        &["run", "a.mtx", "b.mtx"],
        &["fmt"],
        &["fmt", "--check", "--stdout", "a.mtx"],
        &["new"],
    ];
    for args in wrong {
        let ended = matterixc(args);
        assert_eq!((ended.code, ended.out.as_str()), (2, ""), "{args:?}");
        assert!(ended.err.starts_with("error: "), "{args:?}: {}", ended.err);
    }
}

#[test]
fn versions() {
    let ended = matterixc(&["version"]);
    let expected = format!("matterixc {} (mtx 1, program 1)\n", env!("CARGO_PKG_VERSION"));
    assert_eq!((ended.code, ended.out), (0, expected));
    assert_eq!(matterixc(&["--version"]).out, format!("matterixc {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_reader_that_goes_away_does_no_harm() {
    for args in [["explain", "--index"], ["explain", "syntax"], ["--help", "--color=never"], ["explain", "--help"]] {
        let mut child = command().args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        drop(child.stdout.take());
        let mut err = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut err).expect("text");
        assert_eq!(child.wait().expect("it ends").code(), Some(0), "{args:?}");
        assert_eq!(err, "", "{args:?}");
    }
}
