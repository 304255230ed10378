//! Replies held against what is expected of them, and put together from it.

use matterix_ir::Unit;
use matterix_ir::form::Form;
use matterix_ir::wire::{Choice, Pattern, Slot};

/// What a reply says where a pattern looks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// Its numbers, SI, and the indices of its words, in order.
    pub numbers: Vec<f64>,
    /// Texts that are kept, each under its name.
    pub kept: Vec<(String, String)>,
}

/// The numbers of a reply that looks like this, SI, in order; nothing where it looks otherwise.
pub fn matched(pattern: &Pattern, reply: &str) -> Option<Vec<f64>> {
    said(pattern, reply, false).map(|said| said.numbers)
}

/// What a reply says that looks like this; nothing where it looks otherwise. Where it is not `exact`, a blank stands for any
/// number of blanks, and those around it are of no account.
pub fn said(pattern: &Pattern, reply: &str, exact: bool) -> Option<Said> {
    let mut said = Said::default();
    let mut rest = if exact { reply } else { reply.trim() };
    for (i, slot) in pattern.slots.iter().enumerate() {
        match slot {
            Slot::Plain(text) if exact => rest = rest.strip_prefix(text.as_str())?,
            Slot::Plain(text) => rest = after(text, rest)?,
            Slot::Number(unit, form) => {
                let from = if exact || form.width().is_some() { rest } else { rest.trim_start() };
                let read = form.read(from)?;
                said.numbers.push(unit.to_si(read.number));
                rest = &from[read.length..];
            }
            Slot::Word(choices) => {
                let (choice, left) = chosen(choices, rest)?;
                said.numbers.push(choice.index.into());
                rest = left;
            }
            Slot::Skip(width) => {
                let mut chars = rest.chars();
                (0..*width).try_for_each(|_| chars.next().map(drop))?;
                rest = chars.as_str();
            }
            Slot::Any | Slot::Kept(_) => {
                let end = end_of_any(pattern.slots.get(i + 1), rest, exact)?;
                if let Slot::Kept(name) = slot {
                    said.kept.push((name.clone(), rest[..end].trim().to_owned()));
                }
                rest = &rest[end..];
            }
        }
    }
    (if exact { rest.is_empty() } else { rest.trim().is_empty() }).then_some(said)
}

/// The word that a text begins with, the longest of those that fit, and what follows it.
fn chosen<'c, 'r>(choices: &'c [Choice], rest: &'r str) -> Option<(&'c Choice, &'r str)> {
    let known = choices.iter().filter_map(|c| Some((c, c.sent.as_deref()?)));
    let fits = known.filter(|(_, sent)| rest.starts_with(sent));
    match fits.max_by_key(|(_, sent)| sent.len()) {
        Some((choice, sent)) => Some((choice, &rest[sent.len()..])),
        None => choices.iter().find(|c| c.sent.is_none()).map(|choice| (choice, "")),
    }
}

/// Where anything ends: before the next known word, or with the reply.
fn end_of_any(next: Option<&Slot>, rest: &str, exact: bool) -> Option<usize> {
    let Some(Slot::Plain(next)) = next else { return Some(rest.len()) };
    let word = if exact { next.as_str() } else { next.split_whitespace().next()? };
    rest.find(word)
}

/// What follows a text; its blanks stand for any number of them.
fn after<'r>(text: &str, reply: &'r str) -> Option<&'r str> {
    let mut rest = reply;
    let mut words = text.split(' ').peekable();
    while let Some(word) = words.next() {
        rest = rest.strip_prefix(word)?;
        if words.peek().is_some() {
            rest = rest.trim_start();
        }
    }
    Some(rest)
}

/// A value that a reply is to say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// SI; the index of a word.
    pub value: f64,
    /// Digits after the point, where the form of a number does not say.
    pub digits: Option<u8>,
}

/// A reply that looks like this; `value` says what its numbers and words are. In words why there is none.
pub fn rendered(pattern: &Pattern, mut value: impl FnMut(&Slot) -> Shown) -> Result<String, String> {
    let mut out = String::new();
    for slot in &pattern.slots {
        match slot {
            Slot::Plain(text) => out.push_str(text),
            Slot::Number(unit, form) => out.push_str(&number(unit, form, value(slot))?),
            Slot::Word(choices) => {
                let index = value(slot).value;
                let choice = choices.iter().find(|c| f64::from(c.index) == index).or(choices.first());
                out.push_str(choice.and_then(|c| c.sent.as_deref()).unwrap_or("?"));
            }
            Slot::Skip(width) => out.extend(std::iter::repeat_n('0', (*width).into())),
            Slot::Kept(_) | Slot::Any => out.push_str("\"matterixc\""),
        }
    }
    Ok(out)
}

fn number(unit: &Unit, form: &Form, shown: Shown) -> Result<String, String> {
    let number = unit.of_si(shown.value);
    match shown.digits {
        Some(digits) if *form == Form::default() => Ok(crate::template::fixed(number, digits)),
        _ => form.write(number).map_err(|why| format!("{} cannot be sent: {why}", unit.show(shown.value))),
    }
}

/// A reply that looks like this: 1 for a number, the first of the words. In words why there is none.
pub fn example(pattern: &Pattern) -> Result<String, String> {
    rendered(pattern, |slot| {
        let value = match slot {
            Slot::Number(unit, _) => unit.to_si(1.0),
            Slot::Word(choices) => choices.iter().find(|c| c.sent.is_some()).map_or(0.0, |c| c.index.into()),
            Slot::Plain(_) | Slot::Skip(_) | Slot::Kept(_) | Slot::Any => 0.0,
        };
        Shown { value, digits: None }
    })
}

/// The pattern as it was written, for messages.
pub fn written(pattern: &Pattern) -> String {
    let piece = |slot: &Slot| match slot {
        Slot::Plain(text) => text.escape_debug().to_string(),
        Slot::Number(unit, _) => format!("{{{}}}", unit.symbol),
        Slot::Word(choices) => {
            let words: Vec<&str> = choices.iter().map(|c| c.sent.as_deref().unwrap_or("_")).collect();
            format!("{{{}}}", words.join(" | "))
        }
        Slot::Kept(name) => format!("{{<{name}>}}"),
        Slot::Skip(_) | Slot::Any => "{_}".to_owned(),
    };
    pattern.slots.iter().map(piece).collect()
}
