//! Replies held against what is expected of them, and put together from it.

use matterix_ir::wire::{Pattern, Slot};

/// The numbers of a reply that looks like this, SI, in order; nothing where it looks otherwise.
pub fn matched(pattern: &Pattern, reply: &str) -> Option<Vec<f64>> {
    let mut numbers = Vec::new();
    let mut rest = reply.trim();
    for (i, slot) in pattern.slots.iter().enumerate() {
        match slot {
            Slot::Plain(text) => rest = after(text, rest)?,
            Slot::Number(unit) => {
                rest = rest.trim_start();
                let length = number_length(rest);
                let number: f64 = rest[..length].parse().ok().filter(|n: &f64| n.is_finite())?;
                numbers.push(unit.to_si(number));
                rest = &rest[length..];
            }
            Slot::Any => {
                // To the next known word, or to the end.
                let Some(Slot::Plain(next)) = pattern.slots.get(i + 1) else {
                    rest = "";
                    continue;
                };
                let word = next.split_whitespace().next()?;
                rest = &rest[rest.find(word)?..];
            }
        }
    }
    rest.trim().is_empty().then_some(numbers)
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

/// How many bytes at the start are a number.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let digits = |from: usize| bytes[from.min(bytes.len())..].iter().take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(sign);
    let mut end = sign + whole;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        if whole + fraction > 0 {
            end += 1 + fraction;
        }
    }
    let exponent = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
    if end > sign && matches!(bytes.get(end), Some(b'e' | b'E')) && digits(end + 1 + exponent) > 0 {
        end += 1 + exponent + digits(end + 1 + exponent);
    }
    end
}

/// A reply that looks like this; `number` says what its numbers are, in their units.
pub fn rendered(pattern: &Pattern, mut number: impl FnMut(&matterix_ir::Unit) -> String) -> String {
    let piece = |slot: &Slot| match slot {
        Slot::Plain(text) => text.clone(),
        Slot::Number(unit) => number(unit),
        Slot::Any => "\"matterixc\"".to_owned(),
    };
    pattern.slots.iter().map(piece).collect()
}

/// The pattern as it was written, for messages.
pub fn written(pattern: &Pattern) -> String {
    let piece = |slot: &Slot| match slot {
        Slot::Plain(text) => text.clone(),
        Slot::Number(unit) => format!("{{{}}}", unit.symbol),
        Slot::Any => "{_}".to_owned(),
    };
    pattern.slots.iter().map(piece).collect()
}
