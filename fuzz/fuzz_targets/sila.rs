//! Any text as a feature, any bytes as its messages, any text as a call.
#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_sila_wire::text::{call, value};
use matterix_sila_wire::{Raw, decode, encode};
use prost::Message;

const PLATE: &str = include_str!("../../tests/deploy/hotplate.sila.xml");

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(feature) = matterix_sila::read(&text) {
        let again = matterix_sila::read(&matterix_sila::write(&feature));
        assert_eq!(again.as_ref(), Ok(&feature));
    }
    let _ = call(&text);
    let Ok(plate) = matterix_sila::read(PLATE) else { return };
    let elements = plate.commands.iter().flat_map(|c| [&c.parameters, &c.responses, &c.intermediate]);
    for elements in elements {
        for element in elements {
            let _ = value(&plate, &element.ty, &text);
        }
        let Ok(raw) = Raw::decode(bytes) else { continue };
        if let Ok(values) = decode(&plate, elements, &raw) {
            assert!(encode(&plate, elements, &values).is_ok());
        }
    }
});
