//! Texts with a mark at their end.

use super::{Garbled, LONGEST};

/// A text per frame.
#[derive(Clone, Debug)]
pub struct Line {
    /// After what is sent.
    request: &'static str,
    /// After what is answered.
    reply: &'static str,
}

impl Line {
    pub(super) fn new(request: &'static str, reply: &'static str) -> Self {
        Line { request, reply }
    }

    pub(super) fn request(&self, text: &str) -> Vec<u8> {
        [text, self.request].concat().into_bytes()
    }

    pub(super) fn reply(&self, text: &str) -> Vec<u8> {
        [text, self.reply].concat().into_bytes()
    }

    /// The first whole text, without blanks around it; empty ones are passed over.
    pub(super) fn take(&self, buffer: &mut Vec<u8>, request: bool) -> Option<Result<String, Garbled>> {
        let end = if request { self.request } else { self.reply }.as_bytes().last().copied()?;
        loop {
            let Some(at) = buffer.iter().position(|b| *b == end) else {
                if buffer.len() <= LONGEST {
                    return None;
                }
                buffer.clear();
                return Some(Err(Garbled::new(format!("{LONGEST} bytes without an end of a line"))));
            };
            let frame: Vec<u8> = buffer.drain(..=at).collect();
            let text = frame.trim_ascii();
            if text.is_empty() {
                continue;
            }
            let good = text.iter().all(|b| (0x20..0x7f).contains(b) || *b == b'\t');
            let text = std::str::from_utf8(text).ok().filter(|_| good);
            return Some(match text {
                Some(text) => Ok(text.to_owned()),
                None => Err(Garbled::new(format!("`{}` is no text", super::shown(&frame)))),
            });
        }
    }
}
