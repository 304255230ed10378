//! The files of `tests/spec` are read without findings and stand in the one style.

use std::path::PathBuf;

use matterix_ir::FileId;
use matterix_syntax::fmt::format;
use matterix_syntax::{dump, parse};

/// Paths and texts of the specification.
pub fn spec_files() -> Vec<(PathBuf, String)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/spec");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| entry.expect("it is readable").path())
        .collect();
    files.retain(|path| path.extension().is_some_and(|ext| ext == "mtx"));
    files.sort();
    files.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).expect("the file is text"))).collect()
}

#[test]
fn spec_files_are_read_and_formatted() {
    let files = spec_files();
    assert!(files.len() >= 8);
    for (path, text) in files {
        let (tree, found) = parse(FileId(0), &text);
        assert_eq!(found, [], "{}", path.display());
        assert!(!tree.docs.is_empty(), "{} says what it shows", path.display());
        let formatted = format(FileId(0), &text).expect("a file without mistakes is formatted");
        assert_eq!(formatted, text, "{}", path.display());
        assert_eq!(dump(&parse(FileId(0), &formatted).0), dump(&tree));
    }
}
