//! `matterixc new`.

use std::fs;

use crate::harness::{folder, matterixc_in, names, write};

const PROJECT: [&str; 3] = [".gitignore", "README.md", "warm.mtx"];

#[test]
fn a_new_folder() {
    let dir = folder("new");
    let ended = matterixc_in(&dir, &["new", "deep/bench"]);
    assert_eq!((ended.code, ended.err.as_str()), (0, ""));
    assert!(ended.out.contains("created `deep/bench`"), "{}", ended.out);
    assert_eq!(names(&dir.join("deep/bench")), PROJECT);
    assert_eq!(names(&dir.join("deep")), ["bench"]);
}

#[test]
fn an_empty_folder_is_filled() {
    let dir = folder("new_empty");
    fs::create_dir(dir.join("bench")).expect("a folder can be created");
    assert_eq!(matterixc_in(&dir, &["new", "bench"]).code, 0);
    assert_eq!(names(&dir.join("bench")), PROJECT);
    assert_eq!(names(&dir), ["bench"]);
}

#[test]
fn a_folder_with_something_in_it_is_left_alone() {
    let dir = folder("new_full");
    write(&dir, "thesis.txt", "do not lose");
    let ended = matterixc_in(&dir, &["new", "."]);
    assert_eq!((ended.code, ended.out.as_str()), (2, ""));
    assert_eq!(ended.err, "error: `.` already exists and is not empty\n");
    assert_eq!(names(&dir), ["thesis.txt"]);
}

#[test]
fn a_file_in_the_way_is_left_alone() {
    let dir = folder("new_file");
    write(&dir, "bench", "a file");
    for path in ["bench", "bench/inside"] {
        let ended = matterixc_in(&dir, &["new", path]);
        assert_eq!((ended.code, ended.out.as_str()), (2, ""), "{path}");
        assert!(ended.err.starts_with(&format!("error: cannot create `{path}`: ")), "{}", ended.err);
    }
    assert_eq!(names(&dir), ["bench"]);
}
