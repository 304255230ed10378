//! What decoders do with bytes nobody has seen before: they end, do not panic, and read back what they wrote. The fuzz targets
//! `wire`, `http`, `request` and `journal` are these functions, too.

use matterix_hardware::codec::{Codec, Reply, Request};
use matterix_hardware::deploy::Entry;
use matterix_hardware::pattern::{Shown, matched};
use matterix_hardware::template::found;
use matterix_ir::form::Form;
use matterix_ir::framing::{CHECKSUMS, Carries, Check, Checksum, Counted, Frames, Mark, Part, Stretch};
use matterix_ir::message;
use matterix_ir::wire::{Choice, Framing, Pattern, Piece, Slot, Template};
use matterix_ir::{NodeId, Unit};
use matterix_net::http::{Body, head};

fn plain(text: &str) -> Slot {
    Slot::Plain(text.into())
}

fn number() -> Piece {
    Piece::Number { value: NodeId(0), unit: Unit::one(), form: Form::default() }
}

fn form(text: &str) -> Form {
    Form::parse(text, false).expect("a form")
}

fn sum(name: &str) -> Checksum {
    CHECKSUMS.iter().find(|(known, _)| *known == name).expect("a checksum").1.clone()
}

/// Framings of every kind, each with an address that a device of it can have.
pub fn framings() -> Vec<(&'static str, Framing, Option<&'static str>)> {
    let over = |from, to| Stretch { from, to };
    let fixed = |bytes: &[u8]| Part::Fixed(bytes.to_vec());
    let frames =
        |carries, request: Vec<Part>, reply: Vec<Part>, length: Option<Counted>, check: Option<(&str, Stretch)>| {
            let check = check.map(|(name, over)| Check { sum: sum(name), over });
            Framing::Frames(Frames { name: "test".into(), carries, request, reply, length, check, silence: 0.0 })
        };
    let both = |carries, layout: Vec<Part>, length, check| frames(carries, layout.clone(), layout, length, check);
    let line = |end: &[u8]| both(Carries::Text, vec![Part::Data, fixed(end)], None, None);
    let namur = frames(Carries::Text, vec![Part::Data, fixed(b"\r\n")], vec![Part::Data, fixed(b" \r\n")], None, None);
    let summed = vec![
        fixed(b"[M"),
        Part::Address(Some(form("02"))),
        Part::Length(form("u8 hex")),
        Part::Data,
        Part::Check(form("u8 hex")),
        fixed(b"\r"),
    ];
    let safe = vec![fixed(b"\x02"), Part::Length(form("u8")), Part::Data, Part::Check(form("u16 big")), fixed(b"\x03")];
    let behind = vec![fixed(b"\x02"), Part::Address(None), Part::Data, fixed(b"\x03"), Part::Check(form("u8"))];
    let ended = vec![fixed(b":"), Part::Data, Part::Check(form("u8 hex lower")), fixed(b";")];
    let counted = |from, to, more| Some(Counted { over: over(from, to), more });
    let rtu = vec![Part::Address(Some(form("u8"))), Part::Data, Part::Check(form("u16 little"))];
    let tcp = vec![
        Part::Number(form("u16 big")),
        fixed(&[0, 0]),
        Part::Length(form("u16 big")),
        Part::Address(Some(form("u8"))),
        Part::Data,
    ];
    vec![
        ("line", line(b"\r\n"), None),
        ("cr", line(b"\r"), None),
        ("namur", namur, None),
        (
            "summed",
            both(
                Carries::Text,
                summed,
                counted(Mark::Start, Mark::Check, 0),
                Some(("sum8", over(Mark::Start, Mark::Data))),
            ),
            Some("1"),
        ),
        (
            "safe",
            both(
                Carries::Bytes,
                safe,
                counted(Mark::Length, Mark::End, -1),
                Some(("crc16_xmodem", over(Mark::Data, Mark::Data))),
            ),
            None,
        ),
        ("behind", both(Carries::Text, behind, None, Some(("xor8", over(Mark::Start, Mark::Check)))), Some("A")),
        ("ended", both(Carries::Text, ended, None, Some(("lrc8", over(Mark::Data, Mark::Data)))), None),
        (
            "modbus_rtu",
            both(Carries::Modbus, rtu, None, Some(("crc16_modbus", over(Mark::Address, Mark::Data)))),
            Some("1"),
        ),
        ("modbus_tcp", both(Carries::Modbus, tcp, counted(Mark::Address, Mark::Data, 0), None), Some("1")),
        ("cavro_dt", Framing::CavroDt, Some("1")),
        ("cavro_oem", Framing::CavroOem, Some("1")),
    ]
}

/// A line: every framing takes it apart from both ends, and every pattern may be held against what comes.
pub fn wire(bytes: &[u8]) {
    let slots = vec![plain("S "), Slot::Any, plain(" "), Slot::Number(Unit::one(), Form::default()), plain(" g")];
    let choice = |sent: Option<&str>, index| Choice { sent: sent.map(str::to_owned), word: "w".into(), index };
    let numbers = ["i16 big", "f32 swapped", "bcd 4", "u8 hex", "05.1"].map(|f| Slot::Number(Unit::one(), form(f)));
    let words = vec![Slot::Skip(1), Slot::Word(vec![choice(Some("S"), 0), choice(None, 1)]), Slot::Kept("k".into())];
    let patterns = [slots, numbers.to_vec(), words].map(|slots| Pattern { slots, ..Pattern::default() });
    let word = Piece::Word(NodeId(0), vec!["on".into(), "off".into()]);
    let template = Template { pieces: vec![Piece::Plain("A".into()), number(), word], ..Template::default() };
    for (_, framing, address) in framings() {
        let Ok(mut codec) = Codec::new(&framing, address) else { continue };
        if let Ok(frame) = codec.ask("read 2 holding registers at 100") {
            codec.sent(&frame);
        }
        let mut buffer = bytes.to_vec();
        while let Some(reply) = codec.take_reply(&mut buffer) {
            if let Ok(reply) = reply {
                patterns.iter().for_each(|p| drop(matched(p, &reply.text)));
                patterns.iter().for_each(|p| drop(codec.said(p, &reply.text)));
                found(&template, &reply.text);
                codec.found(&template, &reply.text);
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
    let Ok(mut codec) = Codec::new(&Framing::Json, None) else { return };
    let patterns = [
        vec![plain(written)],
        vec![plain("201 /data/id=<run> volume="), Slot::Number(Unit::one(), Form::default())],
        vec![plain(written), Slot::Any],
        vec![plain("/errors/0/id="), Slot::Any],
    ];
    for slots in patterns {
        let pattern = Pattern { slots, ..Pattern::default() };
        let reply = codec.rendered(&pattern, |_| Shown { value: 1.0, digits: None }).expect("a number");
        codec.answer(&Reply::of(reply)).expect("no frame around it");
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
    let sent = codec.ask(written).expect("no frame around it");
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
