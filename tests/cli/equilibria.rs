//! Equilibria, from text to what a run makes of them.

use crate::harness::{matterixc, root};

#[test]
fn acids_bases_buffers_and_salts_are_those_of_the_textbook() {
    let file = root().join("tests/cases/equilibria.mtx");
    let ran = matterixc(&["run", file.to_str().expect("the path is text")]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}
