//! Framings and patterns against any bytes at all, and against each other.

use matterix_hardware::codec::{Codec, Reply, Request};
use matterix_hardware::pattern::{Shown, matched, rendered};
use matterix_hardware::template::{fixed, found};
use matterix_ir::form::Form;
use matterix_ir::wire::{Framing, Pattern, Piece, Slot, Template};
use matterix_ir::{NodeId, Unit};
use proptest::collection::vec;
use proptest::prelude::*;

#[allow(dead_code)]
#[path = "decoders/any.rs"]
mod any;

fn codec(framing: &str) -> Codec {
    let all = any::framings();
    let (_, framing, address) = all.iter().find(|(name, ..)| *name == framing).expect("a framing");
    Codec::new(framing, *address).expect("an address")
}

fn names() -> Vec<&'static str> {
    any::framings().into_iter().map(|(name, ..)| name).collect()
}

/// Everything that comes of these bytes, in pieces of this size.
fn replies(framing: &str, bytes: &[u8], size: usize) -> Vec<String> {
    let mut codec = codec(framing);
    if let Ok(frame) = codec.ask("read 2 holding registers at 100") {
        codec.sent(&frame);
    }
    let (mut buffer, mut out) = (Vec::new(), Vec::new());
    for piece in bytes.chunks(size.max(1)) {
        buffer.extend_from_slice(piece);
        while let Some(reply) = codec.take_reply(&mut buffer) {
            out.push(format!("{reply:?}"));
        }
    }
    out
}

proptest! {
    #[test]
    fn any_bytes_are_taken_the_same_in_any_pieces(bytes in vec(any::<u8>(), 0..300), size in 1_usize..20) {
        for framing in names() {
            prop_assert_eq!(replies(framing, &bytes, size), replies(framing, &bytes, bytes.len()));
        }
    }

    #[test]
    fn what_one_end_says_the_other_hears(words in vec("[A-Z][0-9]{0,5}", 1..5), data in "[ -~]{0,40}", busy: bool) {
        for framing in names().into_iter().filter(|name| !name.starts_with("modbus")) {
            // The sign that ends a frame is no part of a message.
            let data = if framing == "ended" { data.replace(';', ",") } else { data.clone() };
            let (mut master, mut device) = (codec(framing), codec(framing));
            let mut heard = Vec::new();
            for frame in master.say(&words).expect("room for it") {
                let mut buffer = frame.clone();
                let request = device.take_request(&mut buffer).expect("a whole frame").expect("a good one");
                prop_assert!(buffer.is_empty());
                match request {
                    Request::Says(words) => heard.extend(words),
                    other => prop_assert!(false, "{:?}", other),
                }
            }
            let last_is_start = words.last().is_some_and(|w| w == "R");
            if !last_is_start {
                prop_assert_eq!(&heard, &words, "{}", framing);
            }
            let is_status = master.acknowledges();
            let reply = Reply { text: data.trim().to_owned(), busy: busy && is_status, is_error: false };
            if reply.text.is_empty() && !is_status {
                continue;
            }
            let mut buffer = device.answer(&reply).expect("room for it");
            let back = master.take_reply(&mut buffer).expect("a whole frame").expect("a good one");
            prop_assert_eq!(Reply { text: back.text.trim().to_owned(), ..back }, reply, "{}", framing);
        }
    }

    #[test]
    fn a_flipped_bit_never_passes_a_checksum(text in "[A-Z]{1,8}", at in 1_usize..6, bit in 0_u8..8) {
        let mut frame = codec("cavro_oem").answer(&Reply::of(text)).expect("room for it");
        let at = at.min(frame.len() - 2);
        frame[at] ^= 1 << bit;
        let mut buffer = frame.clone();
        // What is damaged is refused or still waited for; nothing is taken from it. A letter that becomes the end mark makes a
        // shorter frame, whose sum may be right by chance: then the rest is left behind, which no good frame does.
        if let Some(Ok(reply)) = codec("cavro_oem").take_reply(&mut buffer) {
            prop_assert!(frame[at] == 0x03 && !buffer.is_empty(), "{:?}", reply);
        }
    }

    #[test]
    fn bytes_come_back_as_they_were(data in vec(any::<u8>(), 0..60), noise in vec(any::<u8>(), 0..8), size in 1_usize..9) {
        let text: String = data.iter().map(|b| char::from(*b)).collect();
        let (mut master, mut device) = (codec("safe"), codec("safe"));
        let frame = master.ask(&text).expect("room for it");
        // Noise before a frame may look like the beginning of one; it is over with the frame after.
        let line: Vec<u8> = noise.iter().copied().filter(|b| *b != 2).chain(frame.iter().copied()).collect();
        let (mut buffer, mut heard) = (Vec::new(), Vec::new());
        for piece in line.chunks(size) {
            buffer.extend_from_slice(piece);
            while let Some(request) = device.take_request(&mut buffer) {
                heard.push(request);
            }
        }
        prop_assert_eq!(heard, vec![Ok(Request::Says(vec![text]))]);
    }

    #[test]
    fn one_wrong_byte_is_no_frame(data in "[ -~]{1,20}", at: prop::sample::Index, bit in 0_u8..8) {
        for framing in ["safe", "summed", "behind"] {
            let frame = codec(framing).answer(&Reply::of(data.trim())).expect("room for it");
            let mut spoiled = frame.clone();
            spoiled[at.index(frame.len())] ^= 1 << bit;
            let mut codec = codec(framing);
            let mut buffer = spoiled.clone();
            while let Some(reply) = codec.take_reply(&mut buffer) {
                if let Ok(reply) = reply {
                    // An address has no checksum over it in `safe`; a shorter frame that is whole by chance leaves bytes behind.
                    let is_short = !buffer.is_empty();
                    // A sum does not see the case of its own digits.
                    let is_case = spoiled.eq_ignore_ascii_case(&frame) && reply.text == data.trim();
                    prop_assert!(is_short || is_case, "{framing}: {spoiled:?} gave {reply:?}");
                }
            }
        }
    }

    #[test]
    fn registers_come_back(words in vec(any::<u16>(), 1..60), address in 0_u16..1000, number in 1_usize..5) {
        let digits: String = words.iter().map(|w| format!("{w:04X}")).collect();
        for framing in ["modbus_rtu", "modbus_tcp"] {
            let (mut master, mut device) = (codec(framing), codec(framing));
            let write = format!("write {} holding registers at {address}: 0x{digits}", words.len());
            let read = match words.len() {
                1 => format!("read holding register at {address}"),
                count => format!("read {count} holding registers at {address}"),
            };
            for _ in 0..number {
                for (text, said) in [(&write, "ok".to_owned()), (&read, format!("0x{digits}"))] {
                    let frame = master.ask(text).expect("room for it");
                    master.sent(&frame);
                    let heard = device.take_request(&mut frame.clone()).expect("whole").expect("good");
                    prop_assert_eq!(heard, Request::Says(vec![text.clone()]));
                    let mut back = device.answer(&Reply::of(said.clone())).expect("room for it");
                    let reply = master.take_reply(&mut back).expect("whole").expect("good");
                    prop_assert_eq!(reply.text, said);
                }
            }
        }
    }

    #[test]
    fn a_number_comes_back_from_a_reply(value in -1e6_f64..1e6, digits in 0_u8..6, any in "[ -~]{0,20}") {
        let unit = Unit { symbol: "degC".into(), factor: 1.0, offset: 273.15 };
        let slots = vec![Slot::Plain("S S ".into()), Slot::Number(unit.clone(), Form::default()), Slot::Plain(" 2".into())];
        let pattern = Pattern { slots, ..Pattern::default() };
        let text = rendered(&pattern, |_| Shown { value: unit.to_si(value), digits: Some(digits) }).expect("it fits");
        let back = matched(&pattern, &text).expect("it fits")[0];
        prop_assert!((unit.of_si(back) - value).abs() <= 0.5001 * 10f64.powi(-i32::from(digits)) + 1e-9);
        // Anything else fits or not, but never panics.
        matched(&pattern, &any);
    }

    #[test]
    fn a_number_comes_back_from_a_message(value in 0.0_f64..1e6, digits in 0_u8..6, any in "[ -~]{0,20}") {
        let number = Piece::Number { value: NodeId(0), unit: Unit::one(), form: Form::decimal(Some(digits)) };
        let template = Template { pieces: vec![Piece::Plain("A".into()), number], ..Template::default() };
        let all = found(&template, &format!("A{}", fixed(value, digits))).expect("it fits");
        prop_assert!((all[0].value - value).abs() <= all[0].precision * 1.0001 + 1e-9);
        found(&template, &any);
    }
}

#[test]
fn frames_are_those_of_the_manuals() {
    let mut dt = codec("cavro_dt");
    assert_eq!(dt.say(&["Z".into(), "A100".into()]), Ok(vec![b"/1ZA100R\r".to_vec()]));
    assert_eq!(dt.ask("?"), Ok(b"/1?\r".to_vec()));
    let mut buffer = b"/0`1500\x03\r\n".to_vec();
    let reply = dt.take_reply(&mut buffer).expect("whole").expect("good");
    assert_eq!(reply, Reply { text: "1500".into(), busy: false, is_error: false });
    let mut buffer = b"/0I\x03\r\n".to_vec();
    let reply = dt.take_reply(&mut buffer).expect("whole").expect("good");
    assert_eq!(reply, Reply { text: "error 9".into(), busy: true, is_error: true });
    let mut oem = codec("cavro_oem");
    let frame = oem.say(&["A100".into()]).expect("room for it").concat();
    assert_eq!(&frame[..3], b"\x021\x31");
    assert_eq!(frame.iter().fold(0, |sum, b| sum ^ b), 0, "the checksum is the exclusive or of all before it");
    // Modbus over Serial Line, and a request to unit 17 for three registers from 107 (section 6.3 of the specification).
    let mut rtu = Codec::new(&framing("modbus_rtu"), Some("17")).expect("an address");
    let frame = rtu.ask("read 3 holding registers at 107").expect("room for it");
    assert_eq!(frame, [0x11, 0x03, 0x00, 0x6b, 0x00, 0x03, 0x76, 0x87]);
    let mut namur = codec("namur");
    let mut buffer = b"25.3 2 \r\n".to_vec();
    assert_eq!(namur.take_reply(&mut buffer).expect("whole").expect("good").text, "25.3 2");
}

fn framing(name: &str) -> Framing {
    any::framings().into_iter().find(|(known, ..)| *known == name).expect("a framing").1
}

#[test]
fn a_late_answer_and_one_of_another_device_are_passed_over() {
    let mut tcp = codec("modbus_tcp");
    let first = tcp.ask("read holding register at 5").expect("room for it");
    tcp.sent(&first);
    let second = tcp.ask("read holding register at 6").expect("room for it");
    tcp.sent(&second);
    let answer = |number: u8, unit: u8, value: u8| vec![0, number, 0, 0, 0, 5, unit, 3, 2, 0, value];
    let mut buffer = [answer(1, 1, 7), answer(2, 9, 8), answer(2, 1, 9)].concat();
    assert_eq!(tcp.take_reply(&mut buffer), Some(Ok(Reply::of("0x0009"))), "{first:?} {second:?}");
    assert!(buffer.is_empty());
}

#[test]
fn a_message_without_room_is_not_sent() {
    let mut safe = codec("safe");
    assert!(safe.ask(&"x".repeat(300)).is_err(), "a length of one byte counts to 255");
    assert!(safe.ask("\u{20ac}").is_err(), "this is no byte");
    assert!(Codec::new(&framing("line"), Some("1")).is_err(), "a line has no address");
    assert!(
        Codec::new(&framing("modbus_rtu"), Some("300")).is_err() && Codec::new(&framing("modbus_rtu"), None).is_err()
    );
}

#[test]
fn a_checksum_that_is_wrong_is_said_to_be() {
    let mut frame = codec("safe").answer(&Reply::of("OK")).expect("room for it");
    frame[2] = b'N';
    let garbled = codec("safe").take_reply(&mut frame).expect("whole").expect_err("wrong");
    assert!(garbled.why.contains("checksum"), "{}", garbled.why);
}
