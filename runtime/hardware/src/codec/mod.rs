//! Framings: how a text is put on a line and taken off again, from both ends.

mod cavro;
mod json;
mod line;

use cavro::Cavro;
pub use json::{Json, Kept, LONGEST as LONGEST_JSON};
use line::Line;
use matterix_ir::Unit;
use matterix_ir::wire::{JSON, Pattern, Slot, Template};

use crate::pattern;
use crate::template::{self, Found};

/// Longest frame that is taken for one, bytes.
pub const LONGEST: usize = 4096;

/// What a device answers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reply {
    /// What it says; an error that the framing carries reads `error 9`.
    pub text: String,
    /// The framing says that it is still busy.
    pub busy: bool,
    /// Whether the text is an error that the framing carries.
    pub is_error: bool,
}

impl Reply {
    /// A plain text.
    pub fn of(text: impl Into<String>) -> Self {
        Reply { text: text.into(), ..Reply::default() }
    }
}

/// What came in is no frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Garbled {
    /// In words.
    pub why: String,
}

impl Garbled {
    fn new(why: impl Into<String>) -> Self {
        Garbled { why: why.into() }
    }
}

/// What a device is told or asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// One or more commands.
    Says(Vec<String>),
    /// The frame before, once more: the answer got lost.
    Again,
    /// It is for a device with another address.
    Other,
}

/// A framing in use at one end of a line.
#[derive(Clone, Debug)]
pub enum Codec {
    /// Texts with a mark at their end.
    Line(Line),
    /// Tecan Cavro pumps.
    Cavro(Cavro),
    /// Requests to a server, with bodies in JSON.
    Json(Json),
}

impl Codec {
    /// The framing of this name; an error in words where there is none, or where the address is none it can have.
    pub fn new(framing: &str, address: Option<&str>) -> Result<Codec, String> {
        Ok(match framing {
            "line" | "sics" => Codec::Line(Line::new("\r\n", "\r\n")),
            "namur" => Codec::Line(Line::new("\r\n", " \r\n")),
            "cr" => Codec::Line(Line::new("\r", "\r")),
            "lf" => Codec::Line(Line::new("\n", "\n")),
            // Calls are no bytes on a line; they are only shown.
            matterix_ir::wire::CALLS => Codec::Line(Line::new("", "")),
            "cavro_dt" => Codec::Cavro(Cavro::new(false, address)?),
            "cavro_oem" => Codec::Cavro(Cavro::new(true, address)?),
            JSON => Codec::Json(Json::default()),
            other => return Err(format!("there is no framing `{other}`")),
        })
    }

    /// Whether every frame is answered.
    pub fn acknowledges(&self) -> bool {
        matches!(self, Codec::Cavro(_) | Codec::Json(_))
    }

    /// Commands as frames.
    pub fn say(&mut self, texts: &[String]) -> Vec<Vec<u8>> {
        match self {
            Codec::Line(line) => texts.iter().map(|t| line.request(t)).collect(),
            Codec::Cavro(cavro) => vec![cavro.request(&cavro::string(texts))],
            Codec::Json(json) => texts.iter().map(|t| json.request(t)).collect(),
        }
    }

    /// A question as a frame.
    pub fn ask(&mut self, text: &str) -> Vec<u8> {
        match self {
            Codec::Line(line) => line.request(text),
            Codec::Cavro(cavro) => cavro.request(text),
            Codec::Json(json) => json.request(text),
        }
    }

    /// The first answer in what has come in, which is taken away; nothing while it is not whole.
    pub fn take_reply(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Reply, Garbled>> {
        match self {
            Codec::Line(line) => line.take(buffer, false).map(|text| text.map(Reply::of)),
            Codec::Cavro(cavro) => cavro.take_reply(buffer),
            Codec::Json(json) => json.take_reply(buffer),
        }
    }

    /// The device's end: the first request in what has come in, which is taken away.
    pub fn take_request(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Request, Garbled>> {
        match self {
            Codec::Line(line) => line.take(buffer, true).map(|text| text.map(|t| Request::Says(vec![t]))),
            Codec::Cavro(cavro) => cavro.take_request(buffer),
            Codec::Json(json) => json.take_request(buffer),
        }
    }

    /// The device's end: an answer as a frame.
    pub fn answer(&mut self, reply: &Reply) -> Vec<u8> {
        match self {
            Codec::Line(line) => line.reply(&reply.text),
            Codec::Cavro(cavro) => cavro.reply(reply),
            Codec::Json(json) => json.reply(&reply.text),
        }
    }

    /// The numbers of an answer that looks like this, SI, in order; nothing where it looks otherwise.
    pub fn matched(&mut self, pattern: &Pattern, reply: &str) -> Option<Vec<f64>> {
        match self {
            Codec::Json(json) => json.matched(pattern, reply),
            _ => pattern::matched(pattern, reply),
        }
    }

    /// An answer for messages: where it is long, what a pattern looks at.
    pub fn shown_reply(&self, pattern: Option<&Pattern>, reply: &str) -> String {
        match self {
            Codec::Json(json) => json.shown(pattern, reply),
            _ => reply.to_owned(),
        }
    }

    /// The device's end: the values of a request of this form; nothing where it has another.
    pub fn found(&self, template: &Template, request: &str) -> Option<Vec<Found>> {
        match self {
            Codec::Json(json) => json.found(template, request),
            _ => template::found(template, request),
        }
    }

    /// The device's end: whether a request is this one.
    pub fn asked(&self, known: &Pattern, request: &str) -> bool {
        match self {
            Codec::Json(json) => json.asked(known, request),
            _ => pattern::matched(known, request).is_some(),
        }
    }

    /// The device's end: an answer that looks like this; `number` says what its numbers are, in their units.
    pub fn rendered(&mut self, pattern: &Pattern, number: impl FnMut(&Unit) -> String) -> String {
        match self {
            Codec::Json(json) => json.rendered(pattern, number),
            _ => pattern::rendered(pattern, number),
        }
    }

    /// The device's end: an answer that means a failure, by its name and in words where it has room for them.
    pub fn refused(&mut self, pattern: &Pattern, failure: &str, why: &str) -> String {
        let Codec::Json(json) = self else { return pattern::rendered(pattern, |_| "0".to_owned()) };
        let last = pattern.slots.iter().rposition(|s| *s == Slot::Any);
        let worded = pattern.slots.iter().enumerate().map(|(i, slot)| match slot {
            Slot::Any if Some(i) == last => Slot::Plain(format!("'{}'", why.replace('\'', "\""))),
            Slot::Any => Slot::Plain(failure.to_owned()),
            other => other.clone(),
        });
        json.rendered(&Pattern { slots: worded.collect(), span: pattern.span }, |_| "0".to_owned())
    }

    /// Whether a word that is known without operands means this one, which may have some.
    pub fn is_word(&self, known: &str, word: &str) -> bool {
        known == word || matches!(self, Codec::Cavro(_)) && cavro::is_word(known, word)
    }
}

/// Bytes as people read them: `OUT_SP_1 60.0\r\n`.
pub fn shown(bytes: &[u8]) -> String {
    bytes.escape_ascii().to_string()
}
