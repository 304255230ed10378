//! See `request` in `runtime/hardware/tests/decoders/any.rs`.
#![no_main]

#[allow(dead_code)]
#[path = "../../runtime/hardware/tests/decoders/any.rs"]
mod any;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| any::request(bytes));
