//! What replies look like: words with units where numbers stand.

use std::sync::Arc;

use matterix_ir::form::Form;
use matterix_ir::wire::{Pattern, Slot};
use matterix_ir::{Diagnostic, Span, Unit, codes};

use super::forms::Speech;
use crate::ast::{self, UnitText};
use crate::declare::units::unit_error;
use crate::lower::Planner;
use crate::units::Dimension;

/// What stands for anything.
const ANY: &str = "_";

impl Planner<'_, '_> {
    /// A pattern with the dimensions of its numbers, in order.
    pub(super) fn pattern(&mut self, of: &ast::Pattern) -> Option<(Pattern, Vec<Dimension>)> {
        let (mut slots, mut dimensions) = (Vec::new(), Vec::new());
        let mut plain = String::new();
        let mut rest = of.text.as_str();
        while let Some(at) = rest.find(['{', '}']) {
            plain.push_str(&rest[..at]);
            rest = &rest[at..];
            if rest.starts_with("{{") || rest.starts_with("}}") {
                plain.push_str(&rest[..1]);
                rest = &rest[2..];
                continue;
            }
            let Some(close) = rest.find('}').filter(|_| rest.starts_with('{')) else {
                let headline = "braces in a reply mark a number, or any text as `{_}`";
                let d =
                    Diagnostic::error(codes::DRIVER_LINE, of.span, headline, "an opening or closing brace is missing");
                self.lab.report(d.help("write `{{` or `}}` for a brace itself"));
                return None;
            };
            if !plain.is_empty() {
                slots.push(Slot::Plain(std::mem::take(&mut plain)));
            }
            let inner = rest[1..close].trim();
            rest = &rest[close + 1..];
            if let Some(name) = inner.strip_prefix('<').and_then(|name| name.strip_suffix('>')) {
                slots.push(Slot::Kept(self.kept_name(name, of.span)?));
                continue;
            }
            if inner.contains('=') {
                slots.push(Slot::Word(self.choices(inner, of.span)?));
                continue;
            }
            let (inner, form) =
                inner.rsplit_once(':').map_or((inner, None), |(inner, form)| (inner.trim(), Some(form)));
            let form = match form {
                Some(form) => self.parsed_form(form.trim(), of.span)?,
                None => Form::default(),
            };
            slots.push(match inner {
                ANY => match form.width().map(u8::try_from) {
                    Some(Ok(width)) => Slot::Skip(width),
                    _ => Slot::Any,
                },
                "" => {
                    dimensions.push(Dimension::one());
                    Slot::Number(Unit::one(), form)
                }
                unit => match self.lab.tables.unit(unit) {
                    Ok(resolved) => {
                        dimensions.push(resolved.dimension);
                        Slot::Number(Arc::unwrap_or_clone(resolved.unit), form)
                    }
                    Err(error) => {
                        let d = unit_error(&UnitText { text: unit.to_owned(), span: of.span }, error);
                        self.lab.report(Diagnostic { fixes: Vec::new(), ..d });
                        return None;
                    }
                },
            });
        }
        plain.push_str(rest);
        if !plain.is_empty() {
            slots.push(Slot::Plain(plain));
        }
        for slot in &slots {
            if let Slot::Plain(text) = slot {
                self.speakable(text, of.span)?;
            }
        }
        self.parts_of_reply(&slots, of.span)?;
        if self.speech == Speech::Modbus {
            slots = self.modbus_answer(slots, of.span)?;
        }
        Some((Pattern { slots, then: Vec::new(), span: of.span }, dimensions))
    }

    /// The name under which a journal keeps what a reply says.
    fn kept_name(&mut self, name: &str, at: Span) -> Option<String> {
        if matches!(self.speech, Speech::Free | Speech::Calls) {
            self.wrong(
                at,
                "a value of a server's reply is kept without braces",
                "has braces",
                &format!("write `<{name}>`"),
            );
            return None;
        }
        if !crate::syntax::is_name(name) {
            self.wrong(at, "`<...>` must contain a name", "not a name", "write it as in `{<serial>}`");
            return None;
        }
        Some(name.to_owned())
    }
}
