//! Any bytes where the journal of a deployment is to be gone on with: lines as they are on disk.
#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_hardware::deploy::Entry;

fuzz_target!(|bytes: &[u8]| {
    for line in bytes.split(|b| *b == b'\n') {
        if let Ok(entry) = serde_json::from_slice::<Entry>(line) {
            // What was read is written the same way.
            let text = serde_json::to_string(&entry).expect("an entry is an object");
            let again: Entry = serde_json::from_str(&text).expect("what was written is read");
            assert_eq!(serde_json::to_string(&again).expect("an object"), text);
        }
    }
});
