//! The cost of nesting, counted in rule calls. Alone in its process: the limit of calls holds for all of it.

#[path = "all/nested.rs"]
mod nested;

use std::num::NonZeroUsize;

use matterix_ir::FileId;
use matterix_syntax::parse;
use nested::nested;

/// Whether the text is read with at most so many rule calls.
fn is_read_with(calls: usize, text: &str) -> bool {
    pest::set_call_limit(NonZeroUsize::new(calls));
    parse(FileId(0), text).1.iter().all(|finding| finding.headline != "this file cannot be read")
}

/// The least number of rule calls with which the text is read.
fn calls(text: &str) -> usize {
    let (mut few, mut enough) = (0, 1);
    while !is_read_with(enough, text) {
        (few, enough) = (enough, enough * 2);
    }
    while enough - few > 1 {
        let middle = few + (enough - few) / 2;
        if is_read_with(middle, text) {
            enough = middle;
        } else {
            few = middle;
        }
    }
    enough
}

#[test]
fn nesting_costs_linear_rule_calls() {
    for ((what, shallow), (_, deep)) in nested(20).into_iter().zip(nested(200)) {
        let (shallow, deep) = (calls(&shallow), calls(&deep));
        assert!(deep <= 11 * shallow, "{what}: {shallow} calls at 20 levels, {deep} at 200");
    }
}
