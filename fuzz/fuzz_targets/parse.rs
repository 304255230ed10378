//! Any text becomes a tree, whose findings lie within the text.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_ir::Sources;

fuzz_target!(|text: &str| {
    let mut sources = Sources::default();
    let file = sources.add("fuzz.mtx", text);
    let (_, found) = matterix_lang::syntax::parse(file, text);
    for label in found.iter().flat_map(|d| &d.labels) {
        let span = label.span;
        assert!(span.start <= span.end && span.end as usize <= text.len(), "{span:?}");
    }
});
