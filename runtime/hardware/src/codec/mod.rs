//! Framings: how a text is put on a line and taken off again, from both ends.

mod cavro;
mod frame;
mod json;
mod modbus;

use std::time::Duration;

use cavro::Cavro;
use frame::Frame;
pub use json::{Json, Kept, LONGEST as LONGEST_JSON};
use matterix_ir::wire::{Driver, Framing, Pattern, Slot, Template};

use crate::pattern::{self, Said, Shown};
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
    /// Frames as a text declares them.
    Frame(Box<Frame>),
    /// Tecan Cavro pumps.
    Cavro(Cavro),
    /// Requests to a server, with bodies in JSON.
    Json(Json),
    /// Calls of a server: they are no bytes on a line, and only shown.
    Calls,
}

impl Codec {
    /// One end of a line in this framing; an error in words where the address is none it can have.
    pub fn new(framing: &Framing, address: Option<&str>) -> Result<Codec, String> {
        Ok(match framing {
            Framing::Frames(frames) => Codec::Frame(Box::new(Frame::new(frames.clone(), address)?)),
            Framing::CavroDt => Codec::Cavro(Cavro::new(false, address)?),
            Framing::CavroOem => Codec::Cavro(Cavro::new(true, address)?),
            Framing::Json => Codec::Json(Json::default()),
            Framing::Calls => Codec::Calls,
        })
    }

    /// Whether every frame is answered.
    pub fn acknowledges(&self) -> bool {
        match self {
            Codec::Frame(frame) => frame.acknowledges(),
            Codec::Cavro(_) | Codec::Json(_) => true,
            Codec::Calls => false,
        }
    }

    /// Whether a late answer is known for one, so that it is not taken for that to a later question.
    pub fn keeps_answers_apart(&self) -> bool {
        match self {
            Codec::Frame(frame) => frame.is_numbered(),
            Codec::Cavro(_) => false,
            Codec::Json(_) | Codec::Calls => true,
        }
    }

    /// How long a line is quiet before something is sent.
    pub fn silence(&self) -> Duration {
        match self {
            Codec::Frame(frame) => Duration::try_from_secs_f64(frame.silence()).unwrap_or_default(),
            _ => Duration::ZERO,
        }
    }

    /// Commands as frames; an error in words where one has no room for what it says.
    pub fn say(&mut self, texts: &[String]) -> Result<Vec<Vec<u8>>, String> {
        match self {
            Codec::Cavro(cavro) => Ok(vec![cavro.request(&cavro::string(texts))]),
            _ => texts.iter().map(|t| self.ask(t)).collect(),
        }
    }

    /// A question as a frame; an error in words where it has no room for it.
    pub fn ask(&mut self, text: &str) -> Result<Vec<u8>, String> {
        match self {
            Codec::Frame(frame) => frame.request(text),
            Codec::Cavro(cavro) => Ok(cavro.request(text)),
            Codec::Json(json) => Ok(json.request(text)),
            Codec::Calls => Ok(text.as_bytes().to_vec()),
        }
    }

    /// These bytes go out: what comes answers them.
    pub fn sent(&mut self, frame: &[u8]) {
        if let Codec::Frame(own) = self {
            own.sent(frame);
        }
    }

    /// The first answer in what has come in, which is taken away; nothing while it is not whole.
    pub fn take_reply(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Reply, Garbled>> {
        match self {
            Codec::Frame(frame) => frame.take_reply(buffer),
            Codec::Cavro(cavro) => cavro.take_reply(buffer),
            Codec::Json(json) => json.take_reply(buffer),
            Codec::Calls => None,
        }
    }

    /// The device's end: the first request in what has come in, which is taken away.
    pub fn take_request(&mut self, buffer: &mut Vec<u8>) -> Option<Result<Request, Garbled>> {
        match self {
            Codec::Frame(frame) => frame.take_request(buffer),
            Codec::Cavro(cavro) => cavro.take_request(buffer),
            Codec::Json(json) => json.take_request(buffer),
            Codec::Calls => None,
        }
    }

    /// The device's end: an answer as a frame; an error in words where it has no room for it.
    pub fn answer(&mut self, reply: &Reply) -> Result<Vec<u8>, String> {
        match self {
            Codec::Frame(frame) => frame.reply(reply),
            Codec::Cavro(cavro) => Ok(cavro.reply(reply)),
            Codec::Json(json) => Ok(json.reply(&reply.text)),
            Codec::Calls => Ok(reply.text.as_bytes().to_vec()),
        }
    }

    /// The numbers of an answer that looks like this, SI, in order; nothing where it looks otherwise.
    pub fn matched(&mut self, pattern: &Pattern, reply: &str) -> Option<Vec<f64>> {
        self.said(pattern, reply).map(|said| said.numbers)
    }

    /// What an answer says that looks like this; nothing where it looks otherwise. Over HTTP what is kept stays here.
    pub fn said(&mut self, pattern: &Pattern, reply: &str) -> Option<Said> {
        match self {
            Codec::Json(json) => json.matched(pattern, reply).map(|numbers| Said { numbers, kept: Vec::new() }),
            _ => pattern::said(pattern, reply, self.is_exact()),
        }
    }

    /// Whether blanks are bytes as others are.
    fn is_exact(&self) -> bool {
        matches!(self, Codec::Frame(frame) if frame.is_exact())
    }

    /// The device's end: what it answers to what its driver knows no answer to; none where it is silent.
    pub fn unknown(&self) -> Option<&'static str> {
        matches!(self, Codec::Frame(frame) if frame.acknowledges()).then_some("exception 2")
    }

    /// An answer for messages: where it is long, what a pattern looks at.
    pub fn shown_reply(&self, pattern: Option<&Pattern>, reply: &str) -> String {
        match self {
            Codec::Json(json) => json.shown(pattern, reply),
            Codec::Frame(frame) if frame.acknowledges() => modbus::shown_answer(reply),
            Codec::Frame(frame) if frame.is_exact() => {
                frame::bytes(reply).map_or_else(|| reply.to_owned(), |b| shown(&b))
            }
            _ => reply.to_owned(),
        }
    }

    /// The device's end: the values of a request of this form; nothing where it has another.
    pub fn found(&self, template: &Template, request: &str) -> Option<Vec<Found>> {
        match self {
            Codec::Json(json) => json.found(template, request),
            _ => template::found_in(template, request, self.is_exact()),
        }
    }

    /// The device's end: whether a request is this one.
    pub fn asked(&self, known: &Pattern, request: &str) -> bool {
        match self {
            Codec::Json(json) => json.asked(known, request),
            _ => pattern::said(known, request, self.is_exact()).is_some(),
        }
    }

    /// The device's end: an answer that looks like this; `value` says what its numbers and words are. An error in words where one
    /// does not fit its form.
    pub fn rendered(&mut self, pattern: &Pattern, value: impl FnMut(&Slot) -> Shown) -> Result<String, String> {
        let text = pattern::rendered(pattern, value)?;
        Ok(match self {
            Codec::Json(json) => json.named(&text),
            _ => text,
        })
    }

    /// The device's end: what is said next is for the device of this driver.
    pub fn speak_for(&mut self, driver: &Driver) {
        if let Codec::Json(json) = self {
            json.speak_for(driver);
        }
    }

    /// A server's end: an answer that several drivers ask for in the same words; each finds what it expects.
    pub fn joined(answers: &[String]) -> Option<String> {
        let (first, rest) = answers.split_first()?;
        let fields = rest.iter().filter_map(|answer| Some(answer.split_once(' ')?.1));
        Some(std::iter::once(first.as_str()).chain(fields).collect::<Vec<_>>().join(" "))
    }

    /// The device's end: an answer that means a failure, by its name and in words where it has room for them.
    pub fn refused(&mut self, pattern: &Pattern, failure: &str, why: &str) -> String {
        let nothing = |_: &Slot| Shown::default();
        let Codec::Json(json) = self else { return pattern::rendered(pattern, nothing).unwrap_or_default() };
        let last = pattern.slots.iter().rposition(|s| *s == Slot::Any);
        let worded = pattern.slots.iter().enumerate().map(|(i, slot)| match slot {
            Slot::Any if Some(i) == last => Slot::Plain(format!("'{}'", why.replace('\'', "\""))),
            Slot::Any => Slot::Plain(failure.to_owned()),
            other => other.clone(),
        });
        let worded = Pattern { slots: worded.collect(), ..Pattern::default() };
        json.named(&pattern::rendered(&worded, nothing).unwrap_or_default())
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
