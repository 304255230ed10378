//! The trees of the files of `tests/spec`, as they stand in `lang/syntax/tests/trees/*.tree`.

use std::path::PathBuf;

use matterix_ir::FileId;
use matterix_syntax::{dump, parse};

use crate::spec::spec_files;

#[test]
fn spec_files_have_their_trees() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/trees");
    for (path, text) in spec_files() {
        let tree = dump(&parse(FileId(0), &text).0);
        let golden = folder.join(path.file_name().expect("a file has a name")).with_extension("tree");
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::write(&golden, &tree).expect("the folder is writable");
        }
        let expected =
            std::fs::read_to_string(&golden).expect("there is a tree for each file; UPDATE_GOLDEN=1 writes them");
        assert_eq!(tree, expected, "{}", golden.display());
    }
}
