//! Any bytes from a server or to one, and any text where a driver has a message: all of it is taken apart from both ends.
#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_hardware::codec::{Codec, Request};
use matterix_ir::message;
use matterix_ir::wire::{JSON, Pattern, Piece, Slot, Template};
use matterix_ir::{NodeId, Unit};

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    let (written, line) = text.split_once('\n').unwrap_or((&text, ""));
    let _ = (message::request(written), message::answer(written));
    let plain = |text: &str| Slot::Plain(text.into());
    let patterns = [
        vec![plain(written)],
        vec![plain("201 /data/id=<run> /data/volume="), Slot::Number(Unit::one())],
        vec![plain(written), Slot::Any],
        vec![plain("/errors/0/id="), Slot::Any],
    ];
    let number = Piece::Number { value: NodeId(0), unit: Unit::one(), digits: None };
    let word = Piece::Word(NodeId(0), vec!["left".into(), "right".into(), "left".into()]);
    let templates = [
        vec![Piece::Plain(written.into())],
        vec![Piece::Plain("POST /runs/<run> /data/volume=".into()), number.clone(), Piece::Plain(" /mount=".into()), word],
        vec![Piece::Plain(written.into()), number],
    ];
    let Ok(mut codec) = Codec::new(JSON, None) else { return };
    for slots in patterns {
        let pattern = Pattern { slots, ..Pattern::default() };
        let reply = codec.rendered(&pattern, |_| "1".into());
        codec.answer(&matterix_hardware::codec::Reply::of(reply));
        codec.matched(&pattern, line);
        codec.shown_reply(Some(&pattern), line);
        codec.asked(&pattern, line);
        let mut buffer = bytes.to_vec();
        while let Some(reply) = codec.take_reply(&mut buffer) {
            if let Ok(reply) = reply {
                codec.matched(&pattern, &reply.text);
                codec.shown_reply(Some(&pattern), &reply.text);
            }
        }
    }
    let sent = codec.ask(written);
    for pieces in templates {
        let template = Template { pieces, ..Template::default() };
        codec.found(&template, line);
        for bytes in [bytes.to_vec(), sent.clone()] {
            let mut buffer = bytes;
            while let Some(request) = codec.take_request(&mut buffer) {
                if let Ok(Request::Says(words)) = request {
                    words.iter().for_each(|word| drop(codec.found(&template, word)));
                }
            }
        }
    }
});
