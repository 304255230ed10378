//! Messages of Modbus, put into their one spelling: registers are hexadecimal digits behind `0x`.

use matterix_ir::modbus::{HEX, Request};
use matterix_ir::wire::{Piece, Slot, Template};
use matterix_ir::{Diagnostic, Span, codes};

use crate::lower::Planner;

/// What stands between a request and what it writes.
const WRITES: &str = ": ";

impl Planner<'_, '_> {
    /// A request with what it writes as digits; none, and reported, where Modbus has no such request.
    pub(super) fn modbus_request(&mut self, pieces: Vec<Piece>, at: Span) -> Option<Vec<Piece>> {
        let mut out: Vec<Piece> = Vec::new();
        let mut writes = None;
        for piece in pieces {
            match (piece, writes) {
                (Piece::Plain(text), None) => match text.split_once(WRITES) {
                    Some((what, values)) => {
                        let coils = what.contains("coil");
                        writes = Some(coils);
                        let begins = if coils { "" } else { HEX };
                        out.push(Piece::Plain(format!("{what}{WRITES}{begins}")));
                        out.push(Piece::Plain(self.values(values, coils, at)?));
                    }
                    None => out.push(Piece::Plain(text)),
                },
                (Piece::Plain(text), Some(coils)) => out.push(Piece::Plain(self.values(&text, coils, at)?)),
                (Piece::Word(node, words), Some(false)) => {
                    let words = words.iter().map(|w| self.values(w, false, at)).collect::<Option<_>>()?;
                    out.push(Piece::Word(node, words));
                }
                (Piece::Number { form, .. }, Some(false)) if form.width().is_none() => {
                    return self.no_register(at, "a value for a register needs a format in bytes");
                }
                (other, _) => out.push(other),
            }
        }
        let sample = |piece: &Piece| match piece {
            Piece::Plain(text) => text.clone(),
            Piece::Number { form, .. } => "0".repeat(form.width().unwrap_or(1)),
            Piece::Word(_, words) => words.first().cloned().unwrap_or_default(),
        };
        if let Err(why) = Request::parse(&out.iter().map(sample).collect::<String>()) {
            self.lab.report(Diagnostic::error(codes::DRIVER_LINE, at, why, "not a request of Modbus"));
            return None;
        }
        Some(out)
    }

    /// What an emulator answers, with what registers hold as digits.
    pub(super) fn modbus_told(&mut self, pieces: Vec<Piece>, at: Span) -> Option<Vec<Piece>> {
        let is_spoken =
            matches!(pieces.first(), Some(Piece::Plain(text)) if text.starts_with(|c: char| c.is_ascii_alphabetic()));
        if is_spoken || pieces.is_empty() {
            return Some(pieces);
        }
        let mut out = vec![Piece::Plain(HEX.to_owned())];
        for piece in pieces {
            out.push(match piece {
                Piece::Plain(text) => Piece::Plain(self.values(&text, false, at)?),
                Piece::Number { form, .. } if form.width().is_none() => {
                    return self.no_register(at, "a value for a register needs a format in bytes");
                }
                other => other,
            });
        }
        Some(out)
    }

    /// Whether an answer is as long as the registers that are asked for; reported where it is not.
    pub(super) fn modbus_fits(&mut self, asks: &Template, slots: &[Slot], at: Span) -> bool {
        let plain = |piece: &Piece| match piece {
            Piece::Plain(text) => Some(text.clone()),
            _ => None,
        };
        let asked = asks.pieces.iter().map(plain).collect::<Option<String>>();
        let Some(asked) = asked.and_then(|text| Request::parse(&text).ok()) else { return true };
        let length = |slot: &Slot| match slot {
            Slot::Plain(text) => Some(text.len()),
            Slot::Number(_, form) => form.width(),
            Slot::Word(choices) => choices.iter().find_map(|c| c.sent.as_ref()).map(String::len),
            _ => None,
        };
        let Some(told) = slots.iter().map(length).sum::<Option<usize>>() else { return true };
        let is_spoken = !matches!(slots.first(), Some(Slot::Plain(text)) if text.starts_with(HEX));
        let (count, digits) = (asked.count.unwrap_or(1), told.saturating_sub(HEX.len()));
        if is_spoken || asked.values.is_some() || digits == 4 * usize::from(count) {
            return true;
        }
        let headline = format!("the reply of {count} registers is read as {} bytes", digits / 2);
        self.wrong(at, &headline, "each register has two bytes", "read as many registers as the number takes");
        false
    }

    /// An answer with what registers hold as digits.
    pub(super) fn modbus_answer(&mut self, slots: Vec<Slot>, at: Span) -> Option<Vec<Slot>> {
        let is_word = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic());
        let is_spoken = match slots.first() {
            Some(Slot::Plain(text)) => is_word(text),
            Some(Slot::Word(choices)) => choices.iter().all(|c| c.sent.as_deref().is_none_or(is_word)),
            Some(Slot::Any | Slot::Kept(_)) | None => true,
            Some(_) => false,
        };
        if is_spoken {
            return Some(slots);
        }
        let mut out = vec![Slot::Plain(HEX.to_owned())];
        for slot in slots {
            out.push(match slot {
                Slot::Plain(text) => Slot::Plain(self.values(&text, false, at)?),
                Slot::Number(_, form) if form.width().is_none() => {
                    return self.no_register(at, "a value of a register needs a format in bytes");
                }
                Slot::Word(mut choices) => {
                    for choice in &mut choices {
                        let Some(sent) = &choice.sent else { continue };
                        choice.sent = Some(self.values(sent, false, at)?);
                    }
                    Slot::Word(choices)
                }
                other => other,
            });
        }
        Some(out)
    }

    /// `1 0x00FF` as `000100FF`; words of coils as they are.
    fn values(&mut self, text: &str, coils: bool, at: Span) -> Option<String> {
        if coils {
            return Some(text.to_owned());
        }
        let digits = |word: &str| match word.strip_prefix(HEX) {
            Some(digits) => Some(digits.to_ascii_uppercase()),
            None => {
                let number = word.parse::<i32>().ok().filter(|n| (-32_768..=65_535).contains(n))?;
                Some(format!("{:04X}", number & 0xffff))
            }
        };
        let all: Option<String> = text.split_whitespace().map(digits).collect();
        if all.is_none() {
            return self.no_register(at, &format!("registers cannot hold `{}`", text.trim()));
        }
        all
    }

    fn no_register<T>(&mut self, at: Span, headline: &str) -> Option<T> {
        let help = "write it as in `{t as degC :i16 * 10}`, `{degC :f32 swapped}`, `1` or `0x00FF`";
        self.wrong(at, headline, "not 16 bits each", help);
        None
    }
}
