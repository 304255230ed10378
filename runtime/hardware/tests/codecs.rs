//! Framings and patterns against any bytes at all, and against each other.

use matterix_hardware::codec::{Codec, Reply, Request};
use matterix_hardware::pattern::{matched, rendered};
use matterix_hardware::template::{fixed, found};
use matterix_ir::wire::{FRAMINGS, Pattern, Piece, Slot, Template};
use matterix_ir::{NodeId, Unit};
use proptest::collection::vec;
use proptest::prelude::*;

fn codec(framing: &str) -> Codec {
    Codec::new(framing, Some("1")).expect("a framing")
}

/// Everything that comes of these bytes, in pieces of this size.
fn replies(framing: &str, bytes: &[u8], size: usize) -> Vec<String> {
    let mut codec = codec(framing);
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
        for framing in FRAMINGS {
            prop_assert_eq!(replies(framing, &bytes, size), replies(framing, &bytes, bytes.len()));
        }
    }

    #[test]
    fn what_one_end_says_the_other_hears(words in vec("[A-Z][0-9]{0,5}", 1..5), data in "[ -~]{0,40}", busy: bool) {
        for framing in FRAMINGS {
            let (mut master, mut device) = (codec(framing), codec(framing));
            let mut heard = Vec::new();
            for frame in master.say(&words) {
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
            let mut buffer = device.answer(&reply);
            let back = master.take_reply(&mut buffer).expect("a whole frame").expect("a good one");
            prop_assert_eq!(Reply { text: back.text.trim().to_owned(), ..back }, reply, "{}", framing);
        }
    }

    #[test]
    fn a_flipped_bit_never_passes_a_checksum(text in "[A-Z]{1,8}", at in 1_usize..6, bit in 0_u8..8) {
        let mut frame = codec("cavro_oem").answer(&Reply::of(text));
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
    fn a_number_comes_back_from_a_reply(value in -1e6_f64..1e6, digits in 0_u8..6, any in "[ -~]{0,20}") {
        let unit = Unit { symbol: "degC".into(), factor: 1.0, offset: 273.15 };
        let slots = vec![Slot::Plain("S S ".into()), Slot::Number(unit.clone()), Slot::Plain(" 2".into())];
        let pattern = Pattern { slots, ..Pattern::default() };
        let text = rendered(&pattern, |_| fixed(value, digits));
        let back = matched(&pattern, &text).expect("it fits")[0];
        prop_assert!((unit.of_si(back) - value).abs() <= 0.5001 * 10f64.powi(-i32::from(digits)) + 1e-9);
        // Anything else fits or not, but never panics.
        matched(&pattern, &any);
    }

    #[test]
    fn a_number_comes_back_from_a_message(value in 0.0_f64..1e6, digits in 0_u8..6, any in "[ -~]{0,20}") {
        let number = Piece::Number { value: NodeId(0), unit: Unit::one(), digits: Some(digits) };
        let template = Template { pieces: vec![Piece::Plain("A".into()), number], ..Template::default() };
        let all = found(&template, &format!("A{}", fixed(value, digits))).expect("it fits");
        prop_assert!((all[0].value - value).abs() <= all[0].precision * 1.0001 + 1e-9);
        found(&template, &any);
    }
}

#[test]
fn frames_are_those_of_the_manuals() {
    let mut dt = codec("cavro_dt");
    assert_eq!(dt.say(&["Z".into(), "A100".into()]), [b"/1ZA100R\r".to_vec()]);
    assert_eq!(dt.ask("?"), b"/1?\r");
    let mut buffer = b"/0`1500\x03\r\n".to_vec();
    let reply = dt.take_reply(&mut buffer).expect("whole").expect("good");
    assert_eq!(reply, Reply { text: "1500".into(), busy: false, is_error: false });
    let mut buffer = b"/0I\x03\r\n".to_vec();
    let reply = dt.take_reply(&mut buffer).expect("whole").expect("good");
    assert_eq!(reply, Reply { text: "error 9".into(), busy: true, is_error: true });
    let mut oem = codec("cavro_oem");
    let frame = oem.say(&["A100".into()]).concat();
    assert_eq!(&frame[..3], b"\x021\x31");
    assert_eq!(frame.iter().fold(0, |sum, b| sum ^ b), 0, "the checksum is the exclusive or of all before it");
    let mut namur = codec("namur");
    let mut buffer = b"25.3 2 \r\n".to_vec();
    assert_eq!(namur.take_reply(&mut buffer).expect("whole").expect("good").text, "25.3 2");
}
