//! Texts with values in braces: `"{item} is at {t as degC :.1}"`.

use matterix_ir::{Diagnostic, codes};

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
        scan,
    },
    Lower,
};
use crate::ast::{Name, Text, TextPart};

/// The deepest brackets inside a value of a text.
const MAX_BRACKETS: usize = 32;

impl Lower<'_> {
    /// The text that stands next, with its values.
    pub(super) fn filled_in(&mut self, kids: &mut Kids) -> Option<Text> {
        kids.eat(Rule::string).map(|node| self.filled(&node))
    }

    /// `{{` and `}}` stand for the braces themselves.
    pub(super) fn filled(&mut self, node: &Node) -> Text {
        let span = self.span(node);
        let raw = node.as_str();
        let start = node.as_span().start();
        let end = raw.len() - usize::from(raw.len() > 1 && raw.ends_with('"'));
        let mut parts = Vec::new();
        let mut plain = String::new();
        let last = raw[..end].rfind('}').unwrap_or(0);
        let mut at = 1.min(end);
        while at < end {
            let rest = &raw[at..end];
            let Some(brace) = rest.find(['{', '}']) else {
                self.unescape(rest, start + at, &mut plain);
                break;
            };
            self.unescape(&rest[..brace], start + at, &mut plain);
            at += brace;
            let rest = &raw[at..end];
            if rest.starts_with("{{") || rest.starts_with("}}") {
                plain.push_str(&rest[..1]);
                at += 2;
                continue;
            }
            let place = self.place(start + at, start + at + 1);
            let closed = rest.starts_with('{') && at < last;
            let Some(close) = closed.then(|| rest.find('}')).flatten() else {
                let (brace, other) =
                    if rest.starts_with('{') { ("{", "no `}` after it") } else { ("}", "no `{` before it") };
                self.report(
                    Diagnostic::error(
                        codes::SYNTAX,
                        place,
                        format!("`{brace}` in a text starts or ends a value"),
                        other,
                    )
                    .help(format!("write `{brace}{brace}` for the brace itself"))
                    .guess("write the brace itself", place, format!("{brace}{brace}")),
                );
                at += 1;
                continue;
            };
            if !plain.is_empty() {
                parts.push(TextPart::Plain(std::mem::take(&mut plain)));
            }
            parts.extend(self.value_part(&rest[1..close], start + at + 1));
            at += close + 1;
        }
        if !plain.is_empty() {
            parts.push(TextPart::Plain(plain));
        }
        Text { parts, span }
    }

    /// What stands between braces, at `start` of the file.
    fn value_part(&mut self, text: &str, start: usize) -> Option<TextPart> {
        let (value, form) = match form_at(text) {
            Some(at) => (&text[..at], Some(&text[at + 1..])),
            None => (text, None),
        };
        let digits = form.and_then(digits_of);
        let form = form.filter(|_| digits.is_none()).map(|form| {
            let at = start + value.len() + 1 + form.len() - form.trim_start().len();
            Name { text: form.trim().to_owned(), span: self.place(at, at + form.trim().len()) }
        });
        if scan::depth(&scan::scan(value)).0 > MAX_BRACKETS {
            let span = self.place(start, start + value.len());
            self.report(
                Diagnostic::error(codes::SYNTAX, span, "this value is nested too deeply", "too many brackets")
                    .help("give it a name with `let`"),
            );
            return None;
        }
        let value = self.piece(start, start + value.len())?;
        Some(TextPart::Value { value, digits, form })
    }
}

/// Where the form of a value begins: at the last colon outside brackets, but for those of paths.
fn form_at(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut depth = 0_i32;
    for (at, byte) in bytes.iter().enumerate().rev() {
        match byte {
            b')' | b']' => depth += 1,
            b'(' | b'[' => depth -= 1,
            b':' if depth == 0 => {
                let doubled = bytes.get(at + 1) == Some(&b':') || at > 0 && bytes[at - 1] == b':';
                return (!doubled && !text[at..].contains('"')).then_some(at);
            }
            _ => {}
        }
    }
    None
}

/// `.1`: digits after the point.
fn digits_of(form: &str) -> Option<u8> {
    let digits = form.trim().strip_prefix('.')?;
    digits.parse().ok().filter(|d| *d <= 15 && digits.bytes().all(|b| b.is_ascii_digit()))
}
