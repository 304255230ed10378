//! What decoders do with bytes nobody has seen before: they end, do not panic, and read back what they wrote. The fuzz targets
//! `wire`, `http`, `request` and `journal` are these functions, too.

use matterix_hardware::codec::{Codec, Reply, Request};
use matterix_hardware::deploy::Entry;
use matterix_hardware::pattern::matched;
use matterix_hardware::template::found;
use matterix_ir::message;
use matterix_ir::wire::{FRAMINGS, JSON, Pattern, Piece, Slot, Template};
use matterix_ir::{NodeId, Unit};
use matterix_net::http::{Body, head};

fn plain(text: &str) -> Slot {
    Slot::Plain(text.into())
}

fn number() -> Piece {
    Piece::Number { value: NodeId(0), unit: Unit::one(), digits: None }
}

/// A line: every framing takes it apart from both ends, and every pattern may be held against what comes.
pub fn wire(bytes: &[u8]) {
    let slots = vec![plain("S "), Slot::Any, plain(" "), Slot::Number(Unit::one()), plain(" g")];
    let pattern = Pattern { slots, ..Pattern::default() };
    let word = Piece::Word(NodeId(0), vec!["on".into(), "off".into()]);
    let template = Template { pieces: vec![Piece::Plain("A".into()), number(), word], ..Template::default() };
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
}

/// A message of a driver (the first line), and what a server answers or is asked (the rest).
pub fn http(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let (written, line) = text.split_once('\n').unwrap_or((&text, ""));
    let _ = (message::request(written), message::answer(written));
    let Ok(mut codec) = Codec::new(JSON, None) else { return };
    let patterns = [
        vec![plain(written)],
        vec![plain("201 /data/id=<run> volume="), Slot::Number(Unit::one())],
        vec![plain(written), Slot::Any],
        vec![plain("/errors/0/id="), Slot::Any],
    ];
    for slots in patterns {
        let pattern = Pattern { slots, ..Pattern::default() };
        let reply = codec.rendered(&pattern, |_| "1".into());
        codec.answer(&Reply::of(reply));
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
    let word = Piece::Word(NodeId(0), vec!["left".into(), "right".into(), "left".into()]);
    let templates = [
        vec![Piece::Plain(written.into())],
        vec![Piece::Plain("POST /runs/<run> /data/volume=".into()), number(), Piece::Plain(" mount=".into()), word],
        vec![Piece::Plain(written.into()), number()],
    ];
    let sent = codec.ask(written);
    for pieces in templates {
        let template = Template { pieces, ..Template::default() };
        codec.found(&template, line);
        for mut buffer in [bytes.to_vec(), sent.clone()] {
            while let Some(request) = codec.take_request(&mut buffer) {
                if let Ok(Request::Says(words)) = request {
                    words.iter().for_each(|word| drop(codec.found(&template, word)));
                }
            }
        }
    }
}

/// A request as it comes in to a server: whole or in pieces, it is the same one.
pub fn request(bytes: &[u8]) {
    const LIMIT: usize = 64;
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").map_or(bytes.len(), |at| at + 4);
    let Ok(head) = head(&bytes[..end]) else { return };
    let read = |size: usize| {
        let mut body = Body::new(head.framing, LIMIT)?;
        let mut input = Vec::new();
        for piece in bytes[end..].chunks(size.max(1)) {
            input.extend_from_slice(piece);
            let used = body.take(&input)?;
            input.drain(..used);
        }
        assert!(body.len() <= LIMIT, "more is kept than may be");
        Ok::<_, matterix_net::http::Refusal>(body.is_whole().then(|| (body.into_content(), input)))
    };
    let whole = read(bytes.len());
    assert_eq!(read(1), whole);
    assert_eq!(read(7), whole);
    if let Ok(Some((body, _))) = whole {
        let request = matterix_net::http::Request { head, body };
        let _ = (request.is_for_this_machine(), request.is_of_own_origin(), request.path().len());
    }
}

/// The journal of a deployment, as it is on disk: what was read is written the same way.
pub fn journal(bytes: &[u8]) {
    for line in bytes.split(|b| *b == b'\n') {
        let Ok(entry) = serde_json::from_slice::<Entry>(line) else { continue };
        let text = serde_json::to_string(&entry).expect("an entry is an object");
        let again: Entry = serde_json::from_str(&text).expect("what was written is read");
        assert_eq!(serde_json::to_string(&again).expect("an object"), text);
    }
}
