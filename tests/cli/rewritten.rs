//! Public protocols for the OT-2, rewritten by hand: each file is as short and as strict as its folder says.

use std::fs;
use std::path::PathBuf;

use crate::harness::{matterixc, root};

/// The files of the folder.
fn files() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(root().join("examples/opentrons/protocols"))
        .expect("the folder of the protocols")
        .map(|entry| entry.expect("an entry of the folder").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "mtx"))
        .collect();
    found.sort();
    found
}

/// How many lines are neither blank nor comments.
fn lines(text: &str) -> usize {
    text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")).count()
}

/// What the head comment says: lines of Python, lines of the file.
fn figures(text: &str) -> Option<(usize, usize)> {
    let (python, rest) = text.split_once("Lines: ")?.1.split_once(" of Python, ")?;
    let (here, _) = rest.split_once(" here.")?;
    Some((python.parse().ok()?, here.parse().ok()?))
}

#[test]
fn rewritten_protocols_are_shorter_than_their_python_and_strict() {
    let files = files();
    assert!(files.len() >= 25, "{} files", files.len());
    let readme =
        fs::read_to_string(root().join("examples/opentrons/protocols/README.md")).expect("the table of the folder");
    for file in files {
        let path = file.to_str().expect("a path in Unicode");
        let name = file.file_stem().and_then(|name| name.to_str()).expect("a name in Unicode");
        let text = fs::read_to_string(&file).expect("a text");
        let (python, here) = figures(&text).unwrap_or_else(|| panic!("{name} does not say how long it is"));
        assert_eq!(lines(&text), here, "{name}");
        assert!(here < python, "{name}: {here} lines, and {python} of Python");
        let row = readme.lines().find(|line| line.starts_with(&format!("| [{name}]")));
        assert!(row.is_some_and(|row| row.ends_with(&format!("| {python} | {here} |"))), "{name}: {row:?}");
        for args in [&["check", "--strict", path][..], &["fmt", "--check", path]] {
            let ended = matterixc(args);
            assert_eq!(ended.code, 0, "{name}: {}{}", ended.out, ended.err);
        }
    }
}
