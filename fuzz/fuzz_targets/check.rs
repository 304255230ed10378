//! Any text can be checked, and findings can be asked for their place in it.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_ir::Sources;
use matterix_lang::LibraryOnly;

fuzz_target!(|text: &str| {
    let mut sources = Sources::default();
    let file = sources.add("fuzz.mtx", text);
    let found = matterix_lang::check(&mut sources, file, &LibraryOnly);
    for label in found.iter().flat_map(|d| &d.labels) {
        sources.slice(label.span);
    }
});
