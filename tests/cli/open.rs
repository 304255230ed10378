//! Protocols with known defects: whatever is said of them, a check of each comes to its end.

use std::fs;

use crate::harness::{matterixc, root};

#[test]
fn every_open_defect_is_checked_to_the_end() {
    let entries = fs::read_dir(root().join("tests/open")).expect("the folder is there");
    let paths = entries.map(|e| e.expect("it can be read").path());
    for path in paths.filter(|p| p.extension().is_some_and(|e| e == "mtx")) {
        let ended = matterixc(&["check", "--format", "concise", path.to_str().expect("text")]);
        assert!((0..=1).contains(&ended.code), "{}: {} {}", path.display(), ended.code, ended.err);
    }
}
