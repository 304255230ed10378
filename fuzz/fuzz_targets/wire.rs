//! Any bytes on a line: every framing takes them apart from both ends, and every pattern may be held against what comes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_hardware::codec::Codec;
use matterix_hardware::pattern::matched;
use matterix_hardware::template::found;
use matterix_ir::wire::{FRAMINGS, Pattern, Piece, Slot, Template};
use matterix_ir::{NodeId, Unit};

fuzz_target!(|bytes: &[u8]| {
    let plain = |text: &str| Slot::Plain(text.into());
    let slots = vec![plain("S "), Slot::Any, plain(" "), Slot::Number(Unit::one()), plain(" g")];
    let pattern = Pattern { slots, ..Pattern::default() };
    let number = Piece::Number { value: NodeId(0), unit: Unit::one(), digits: None };
    let word = Piece::Word(NodeId(0), vec!["on".into(), "off".into()]);
    let template = Template { pieces: vec![Piece::Plain("A".into()), number, word], ..Template::default() };
    for framing in FRAMINGS {
        let Ok(mut codec) = Codec::new(framing, Some("1")) else { continue };
        let mut buffer = bytes.to_vec();
        while let Some(reply) = codec.take_reply(&mut buffer) {
            if let Ok(reply) = reply {
                matched(&pattern, &reply.text);
                found(&template, &reply.text);
            }
        }
        let mut buffer = bytes.to_vec();
        while codec.take_request(&mut buffer).is_some() {}
    }
});
