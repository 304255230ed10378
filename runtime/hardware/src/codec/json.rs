//! Requests to a server and its answers, a line each: a method, a path and a body in JSON; a status and a body in JSON.
//! What drivers write for them is described in [`matterix_ir::message`].

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::message::{self, Field};
use matterix_ir::scene::InstanceId;
use matterix_ir::wire::{Driver, Pattern, Piece, Slot, Template};
use serde_json::{Map, Value};

use super::{Garbled, Reply, Request};
use crate::pattern::{self, Said};
use crate::template::{self, Found};

/// Longest answer, bytes.
pub const LONGEST: usize = 16 << 20;
/// Longest answer that is shown whole, characters.
const SHOWN: usize = 400;
/// Stands for a value while a message is taken apart.
const MARK: &str = "\u{1}";
/// From here on a status means that the server refuses.
const REFUSED: u16 = 400;

/// One end of a connection.
#[derive(Clone, Debug, Default)]
pub struct Json {
    /// What answers said to each device, by the words that drivers keep it under.
    kept: Kept,
    /// Who speaks over the line, and the device whose line it is.
    speaker: Option<(InstanceId, InstanceId)>,
    /// The server's end: what it gave out under these words.
    issued: BTreeSet<(String, String)>,
    /// The server's end: what it gave out last under each word, by the device that it was for.
    latest: Kept,
}

/// What answers said, by the device they were for and the word it is kept under.
pub type Kept = BTreeMap<(InstanceId, String), String>;

impl Json {
    /// What answers said so far.
    pub fn kept(&self) -> &Kept {
        &self.kept
    }

    /// Puts back what an answer said to an earlier process, or for something that goes on beside others.
    pub fn keep(&mut self, device: InstanceId, word: String, text: String) {
        self.kept.insert((device, word), text);
    }

    /// From here on this device speaks: it has words of its own, and knows those of the device whose line it is.
    pub fn speak_for(&mut self, driver: &Driver) {
        self.speaker = Some((driver.instance, driver.host.as_ref().map_or(driver.instance, |host| host.instance)));
    }

    fn known(&self, word: &str) -> Option<&String> {
        let of = |device| self.kept.get(&(device, word.to_owned()));
        let (own, host) = self.speaker?;
        of(own).or_else(|| of(host))
    }

    /// A message as a line; what nobody has said yet is left as the driver has it.
    pub(super) fn request(&self, text: &str) -> Vec<u8> {
        let line = match message::request(text) {
            Ok(request) => {
                let target = self.filled(request.target);
                let body = match request.file {
                    Some(file) => format!(" @{file}"),
                    None => self.body(&request.fields).map_or(String::new(), |body| format!(" {body}")),
                };
                format!("{} {target}{body}\n", request.method)
            }
            Err(_) => format!("{text}\n"),
        };
        line.into_bytes()
    }

    /// The server's end: an answer as a line.
    pub(super) fn reply(&self, text: &str) -> Vec<u8> {
        let line = match message::answer(text) {
            Ok(answer) => {
                let body = self.body(&answer.fields).unwrap_or_else(|| Value::Object(Map::new()));
                format!("{} {body}\n", answer.status.unwrap_or(200))
            }
            Err(_) => "500 {}\n".to_owned(),
        };
        line.into_bytes()
    }

    pub(super) fn take_reply(&self, buffer: &mut Vec<u8>) -> Option<Result<Reply, Garbled>> {
        let text = match line(buffer)? {
            Ok(text) => text,
            Err(garbled) => return Some(Err(garbled)),
        };
        let status = text.split(' ').next().and_then(|s| s.parse::<u16>().ok());
        Some(match (status, parts(&text)) {
            (Some(status), Some(_)) => Ok(Reply { is_error: status >= REFUSED, ..Reply::of(text) }),
            _ => Err(Garbled::new(format!("`{}` is not a reply in JSON", shortened(&text)))),
        })
    }

    pub(super) fn take_request(&self, buffer: &mut Vec<u8>) -> Option<Result<Request, Garbled>> {
        Some(line(buffer)?.map(|text| Request::Says(vec![text])))
    }

    /// The numbers of an answer that looks like this, SI; what drivers keep of it is kept.
    pub(super) fn matched(&mut self, pattern: &Pattern, reply: &str) -> Option<Vec<f64>> {
        let Said { numbers, kept } = self.look(pattern, reply)?;
        if let Some((own, _)) = self.speaker {
            self.kept.extend(kept.into_iter().map(|(word, text)| ((own, word), text)));
        }
        Some(numbers)
    }

    /// What an answer says where a pattern looks, or its beginning.
    pub(super) fn shown(&self, pattern: Option<&Pattern>, reply: &str) -> String {
        let status = reply.split(' ').next().unwrap_or_default();
        let members = pattern.zip(parts(reply)).map(|(pattern, (_, body))| {
            let text = pattern.with(MARK);
            let fields = message::answer(&text).map(|a| a.fields).unwrap_or_default();
            let member = |f: Field<'_>| body.pointer(&f.pointer).map(|v| format!(" {}={}", f.pointer, plain(v)));
            fields.into_iter().filter_map(member).collect::<String>()
        });
        match members {
            Some(members) if !members.is_empty() => format!("{status}{}", shortened(&members)),
            _ => shortened(reply),
        }
    }

    /// The server's end: the values of a request of this form; nothing where it has another.
    pub(super) fn found(&self, template: &Template, request: &str) -> Option<Vec<Found>> {
        let (method, rest) = request.split_once(' ')?;
        let (target, body) = rest.split_once(' ').unwrap_or((rest, "{}"));
        let text = template.with(MARK);
        let wanted = message::request(&text).ok()?;
        if wanted.method != method || wanted.file != body.strip_prefix('@') {
            return None;
        }
        let body: Value = if wanted.file.is_some() { Value::Null } else { serde_json::from_str(body).ok()? };
        let mut values = template.pieces.iter().filter(|p| !matches!(p, Piece::Plain(_)));
        let mut out = Vec::new();
        let (wanted_path, path): (Vec<&str>, Vec<&str>) =
            (wanted.target.split('/').collect(), target.split('/').collect());
        if wanted_path.len() != path.len() {
            return None;
        }
        for (wanted, is) in wanted_path.into_iter().zip(path) {
            out.extend(self.value(wanted, is, &mut values)?);
        }
        for field in &wanted.fields {
            let is = body.pointer(&field.pointer)?;
            let is_empty = is.as_object().is_some_and(Map::is_empty);
            match field.value {
                "{}" if is_empty || is.is_object() => {}
                whole if is.is_object() && serde_json::from_str::<Value>(whole).is_ok_and(|whole| whole == *is) => {}
                wanted => out.extend(self.value(wanted, &plain(is), &mut values)?),
            }
        }
        Some(out)
    }

    /// The server's end: whether a request is one that a driver declares the answer to.
    pub(super) fn asked(&self, known: &Pattern, request: &str) -> bool {
        let piece = |slot: &Slot| match slot {
            Slot::Plain(text) => Some(Piece::Plain(text.clone())),
            Slot::Number(..) | Slot::Word(_) | Slot::Skip(_) | Slot::Kept(_) | Slot::Any => None,
        };
        let pieces: Option<Vec<Piece>> = known.slots.iter().map(piece).collect();
        let template = pieces.map(|pieces| Template { pieces, span: known.span });
        template.is_some_and(|template| self.found(&template, request).is_some())
    }

    fn value<'t>(&self, wanted: &str, is: &str, values: &mut impl Iterator<Item = &'t Piece>) -> Option<Vec<Found>> {
        if let Some(word) = message::kept(wanted) {
            return self.issued.contains(&(word.to_owned(), is.to_owned())).then(Vec::new);
        }
        let mut pieces = Vec::new();
        for (i, text) in wanted.split(MARK).enumerate() {
            if i > 0 {
                pieces.extend(values.next().cloned());
            }
            pieces.push(Piece::Plain(text.to_owned()));
        }
        template::found(&Template { pieces, ..Template::default() }, is)
    }

    /// The server's end: an answer, under new names where drivers keep some.
    pub(super) fn named(&mut self, text: &str) -> String {
        let mut out = String::with_capacity(text.len());
        for (i, word) in text.split(' ').enumerate() {
            out.push_str(if i > 0 { " " } else { "" });
            let Some((pointer, value)) = word.split_once('=') else {
                out.push_str(word);
                continue;
            };
            let pointer = message::chosen(pointer, |word| self.given_out(word));
            let Some(kept) = message::kept(value) else {
                out.push_str(&format!("{pointer}={value}"));
                continue;
            };
            let name = format!("{kept}-{}", self.issued.len() + 1);
            out.push_str(&format!("{pointer}='{name}'"));
            if let Some((own, _)) = self.speaker {
                self.latest.insert((own, kept.to_owned()), name.clone());
            }
            self.issued.insert((kept.to_owned(), name));
        }
        out
    }

    /// The server's end: what it gave out last under a word to the device that it speaks to, or to the one whose line that is.
    fn given_out(&self, word: &str) -> Option<String> {
        let of = |device| self.latest.get(&(device, word.to_owned())).cloned();
        let (own, host) = self.speaker?;
        of(own).or_else(|| of(host))
    }

    /// Whether a message puts in something that no answer has said.
    pub fn lacks(&self, text: &str) -> bool {
        let Ok(request) = message::request(text) else { return false };
        let values = request.fields.iter().filter(|f| !f.quoted).map(|f| f.value);
        let mut words = request.target.split('/').chain(values).filter_map(message::kept);
        words.any(|word| self.known(word).is_none())
    }

    /// The numbers of an answer that looks like this, and what is kept of it.
    fn look(&self, pattern: &Pattern, reply: &str) -> Option<Said> {
        let (status, body) = parts(reply)?;
        let text = pattern.with(MARK);
        let answer = message::answer(&text).ok()?;
        if answer.status.is_some_and(|wanted| wanted != status) {
            return None;
        }
        let mut values = pattern.slots.iter().filter(|s| !matches!(s, Slot::Plain(_)));
        let (mut numbers, mut kept) = (Vec::new(), Vec::new());
        for field in &answer.fields {
            let is = plain(at(&body, &message::chosen(&field.pointer, |word| self.known(word).cloned()))?);
            if let Some(word) = message::kept(field.value) {
                kept.push((word.to_owned(), is));
                continue;
            }
            let mut slots = Vec::new();
            for (i, text) in field.value.split(MARK).enumerate() {
                if i > 0 {
                    slots.extend(values.next().cloned());
                }
                if !text.is_empty() {
                    slots.push(Slot::Plain(text.to_owned()));
                }
            }
            numbers.extend(pattern::matched(&Pattern { slots, ..Pattern::default() }, &is)?);
        }
        Some(Said { numbers, kept })
    }

    fn filled(&self, target: &str) -> String {
        let known = |word: &str| message::kept(word).and_then(|w| self.known(w)).cloned();
        target.split('/').map(|s| known(s).unwrap_or_else(|| s.to_owned())).collect::<Vec<_>>().join("/")
    }

    /// A body with these members; none where there are none.
    fn body(&self, fields: &[Field<'_>]) -> Option<Value> {
        let mut body = Value::Null;
        for field in fields {
            let kept = message::kept(field.value).filter(|_| !field.quoted).and_then(|w| self.known(w));
            let value = match (kept, field.quoted) {
                (Some(text), _) => Value::from(text.as_str()),
                (None, true) => Value::from(field.value),
                (None, false) => serde_json::from_str(field.value).unwrap_or_else(|_| Value::from(field.value)),
            };
            put(&mut body, &field.pointer, value);
        }
        (!body.is_null()).then_some(body)
    }
}

/// The value that a pointer says; `[member:text]` in it is the first of an array of which that member is the text.
fn at<'v>(body: &'v Value, pointer: &str) -> Option<&'v Value> {
    pointer.split('/').skip(1).try_fold(body, |at, token| match message::choice(token) {
        Some((member, text)) => at.as_array()?.iter().find(|item| item.get(member).is_some_and(|is| plain(is) == text)),
        None => at.pointer(&format!("/{token}")),
    })
}

/// Puts a value where a pointer says, with what must be around it.
fn put(whole: &mut Value, pointer: &str, value: Value) {
    let mut at = whole;
    for token in pointer.split('/').skip(1) {
        if let Some((member, text)) = message::choice(token) {
            at = one_of(at, member, text);
            continue;
        }
        let token = token.replace("~1", "/").replace("~0", "~");
        let number = token.parse::<usize>().ok();
        if at.is_null() {
            *at = if number.is_some() { Value::Array(Vec::new()) } else { Value::Object(Map::new()) };
        }
        if !at.is_object() && !at.is_array() {
            *at = Value::Object(Map::new());
        }
        at = match at {
            Value::Array(items) => {
                let index = number.unwrap_or(items.len()).min(items.len());
                if index == items.len() {
                    items.push(Value::Null);
                }
                &mut items[index]
            }
            other => &mut other[token],
        };
    }
    *at = value;
}

/// The item of an array of which this member is this text; it is put there where there is none.
fn one_of<'v>(at: &'v mut Value, member: &str, text: &str) -> &'v mut Value {
    if !at.is_array() {
        *at = Value::Array(Vec::new());
    }
    let Value::Array(items) = at else { return at };
    let index = items.iter().position(|item| item.get(member).is_some_and(|is| plain(is) == text));
    let index = index.unwrap_or_else(|| {
        items.push(serde_json::json!({ member: text }));
        items.len() - 1
    });
    &mut items[index]
}

/// The first whole line, which is taken away.
fn line(buffer: &mut Vec<u8>) -> Option<Result<String, Garbled>> {
    let Some(at) = buffer.iter().position(|b| *b == b'\n') else {
        if buffer.len() <= LONGEST {
            return None;
        }
        buffer.clear();
        return Some(Err(Garbled::new(format!("{LONGEST} bytes without an end"))));
    };
    let bytes: Vec<u8> = buffer.drain(..=at).collect();
    let text = String::from_utf8(bytes).map(|t| t.trim_end().to_owned());
    Some(text.map_err(|_| Garbled::new("it is not text in UTF-8")))
}

/// Status and body of an answer.
fn parts(reply: &str) -> Option<(u16, Value)> {
    let (status, body) = reply.split_once(' ').unwrap_or((reply, "null"));
    Some((status.parse().ok()?, serde_json::from_str(body).ok()?))
}

/// A value as drivers write it: a text without quotes, all else as JSON.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text.to_owned(),
    }
}
