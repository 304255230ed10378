//! The two protocols of Tecan Cavro pumps: for terminals (DT) and with checksums (OEM).
//!
//! After Tecan's manual of the Cavro XCalibur, 733085-B. Status byte: 01X0eeee, X set when ready, eeee the error.

use super::{Garbled, LONGEST, Reply, Request};

const STX: u8 = 0x02;
const ETX: u8 = 0x03;
const MASTER: u8 = b'0';
const READY: u8 = 0x20;
const STATUS: u8 = 0x40;
/// Set in the sequence byte where a frame is sent once more.
const AGAIN: u8 = 0x08;

/// One end of a line to a pump.
#[derive(Clone, Debug)]
pub struct Cavro {
    oem: bool,
    address: u8,
    /// Number of the frame, 1 to 7.
    sequence: u8,
}

impl Cavro {
    pub(super) fn new(oem: bool, address: Option<&str>) -> Result<Self, String> {
        let number = address.and_then(|a| a.parse::<u8>().ok()).filter(|n| (1..=15).contains(n));
        let number = number.ok_or("the address of a pump is 1 to 15, one more than its switch position")?;
        Ok(Cavro { oem, address: b'0' + number, sequence: 0 })
    }

    pub(super) fn request(&mut self, text: &str) -> Vec<u8> {
        if !self.oem {
            return [b"/", [self.address].as_slice(), text.as_bytes(), b"\r"].concat();
        }
        self.sequence = self.sequence % 7 + 1;
        sealed(&[[self.address, 0x30 | self.sequence].as_slice(), text.as_bytes()].concat())
    }

    pub(super) fn reply(&mut self, reply: &Reply) -> Vec<u8> {
        let error = if reply.is_error { number_of(&reply.text) } else { 0 };
        let status = STATUS | if reply.busy { 0 } else { READY } | (error & 0x0f);
        let text = if reply.is_error { "" } else { &reply.text };
        if self.oem {
            return sealed(&[[MASTER, status].as_slice(), text.as_bytes()].concat());
        }
        [[b'/', MASTER, status].as_slice(), text.as_bytes(), &[ETX], b"\r\n"].concat()
    }

    pub(super) fn take_reply(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Reply, Garbled>> {
        let frame = self.take(buffer, &[ETX])?;
        Some(frame.and_then(|frame| match frame.as_slice() {
            [MASTER, status, text @ ..] if status & 0xd0 == STATUS => {
                let error = status & 0x0f;
                let text = match error {
                    0 => plain(text)?,
                    _ => format!("error {error}"),
                };
                Ok(Reply { text, busy: status & READY == 0, is_error: error != 0 })
            }
            other => Err(Garbled::new(format!("`{}` is not a reply of a pump", super::shown(other)))),
        }))
    }

    pub(super) fn take_request(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Request, Garbled>> {
        let frame = self.take(buffer, if self.oem { &[ETX] } else { b"\r" })?;
        Some(frame.and_then(|frame| {
            let (address, rest) = frame.split_first().ok_or_else(|| Garbled::new("an empty frame"))?;
            if *address != self.address {
                return Ok(Request::Other);
            }
            let text = match (self.oem, rest) {
                (false, text) => text,
                (true, [sequence, text @ ..]) if sequence & 0xf0 == 0x30 => {
                    let (number, again) = (sequence & 0x07, sequence & AGAIN != 0);
                    if again && number == self.sequence {
                        return Ok(Request::Again);
                    }
                    self.sequence = number;
                    text
                }
                _ => return Err(Garbled::new("a frame without a number")),
            };
            Ok(Request::Says(words(&plain(text)?)))
        }))
    }

    /// The first whole frame without what encloses it. What comes before its start belongs to none.
    fn take(&self, buffer: &mut Vec<u8>, end: &[u8]) -> Option<Result<Vec<u8>, Garbled>> {
        let start = if self.oem { STX } else { b'/' };
        match buffer.iter().position(|b| *b == start) {
            Some(at) => drop(buffer.drain(..at)),
            None if buffer.len() <= LONGEST => return None,
            None => {
                buffer.clear();
                return Some(Err(Garbled::new(format!("{LONGEST} bytes without a frame"))));
            }
        }
        let close = match buffer.iter().position(|b| end.contains(b)) {
            Some(close) => close,
            None if buffer.len() <= LONGEST => return None,
            None => {
                buffer.clear();
                return Some(Err(Garbled::new("a frame without an end")));
            }
        };
        if !self.oem {
            let frame: Vec<u8> = buffer.drain(..=close).collect();
            return Some(Ok(frame[1..frame.len() - 1].to_vec()));
        }
        if buffer.len() < close + 2 {
            return None;
        }
        let frame: Vec<u8> = buffer.drain(..close + 2).collect();
        let (sum, body) = (frame[close + 1], &frame[..=close]);
        if checksum(body) != sum {
            return Some(Err(Garbled::new(format!("the checksum of `{}` is wrong", super::shown(&frame)))));
        }
        Some(Ok(body[1..close].to_vec()))
    }
}

/// A frame with its marks and checksum.
fn sealed(body: &[u8]) -> Vec<u8> {
    let mut frame = [[STX].as_slice(), body, &[ETX]].concat();
    frame.push(checksum(&frame));
    frame
}

fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, b| sum ^ b)
}

fn plain(bytes: &[u8]) -> Result<String, Garbled> {
    let good = bytes.iter().all(|b| (0x20..0x7f).contains(b));
    let text = std::str::from_utf8(bytes).ok().filter(|_| good);
    text.map(str::to_owned).ok_or_else(|| Garbled::new(format!("`{}` is not text", super::shown(bytes))))
}

fn number_of(error: &str) -> u8 {
    error.rsplit(' ').next().and_then(|n| n.parse().ok()).unwrap_or(0)
}

/// What ends a move: the one command that a busy pump takes. It acts at once; with an `R` behind it what was broken off would go on
/// (manual of the XLP 6000, 734237-C, 3.5).
const TERMINATE: &str = "T";

/// Commands as one string, which `R` starts.
pub(super) fn string(texts: &[String]) -> String {
    match texts {
        [only] if only == TERMINATE => only.clone(),
        all => format!("{}R", all.concat()),
    }
}

/// A string of commands, taken apart: a sign with its operands each. The `R` that starts it is left out.
fn words(text: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for c in text.chars() {
        match out.last_mut() {
            Some(word) if c.is_ascii_digit() || c == ',' || c == '.' => word.push(c),
            _ => out.push(c.to_string()),
        }
    }
    if out.len() > 1 && out.last().is_some_and(|w| w == "R") {
        out.pop();
    }
    out
}

/// Whether `word` is the command `known`, which is known without operands: `Z1,1,1` is `Z`.
pub(super) fn is_word(known: &str, word: &str) -> bool {
    known.len() == 1 && known.bytes().all(|b| b.is_ascii_alphabetic()) && word.starts_with(known)
}
