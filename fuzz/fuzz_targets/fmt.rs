//! What can be formatted parses again, and formatting it once more changes nothing.

#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_ir::Sources;

fuzz_target!(|text: &str| {
    let mut sources = Sources::default();
    let file = sources.add("fuzz.mtx", text);
    let Ok(once) = matterix_lang::fmt::format(file, text) else { return };
    match matterix_lang::fmt::format(file, &once) {
        Ok(twice) => assert_eq!(once, twice),
        Err(found) => panic!("formatted, it does not parse: {found:?}\n{once}"),
    }
});
