//! Forms of values on a line, and whether a framing has room for what a message says.

use matterix_ir::form::Form;
use matterix_ir::framing::{Carries, Frames, Part};
use matterix_ir::wire::{Choice, Framing, Piece, Slot};
use matterix_ir::{Diagnostic, NodeId, Span, Unit, codes};

use crate::ast::Name;
use crate::lower::Planner;

/// What the framing of a driver lets its messages say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Speech {
    /// Bodies in JSON.
    #[default]
    Free,
    /// Calls, in which texts stand in quotes.
    Calls,
    /// Printable characters, without these signs.
    Text(Vec<u8>),
    /// Any bytes.
    Bytes,
    /// Requests of Modbus.
    Modbus,
}

impl Speech {
    pub(super) fn of(framing: &Framing) -> Speech {
        match framing {
            Framing::Json => Speech::Free,
            Framing::Calls => Speech::Calls,
            Framing::CavroDt | Framing::CavroOem => Speech::Text(Vec::new()),
            Framing::Frames(frames) => match frames.carries {
                Carries::Text => Speech::Text(ends(frames)),
                Carries::Bytes => Speech::Bytes,
                Carries::Modbus => Speech::Modbus,
            },
        }
    }
}

/// The marks that end a message where no length does, as far as they are one byte.
fn ends(frames: &Frames) -> Vec<u8> {
    let behind = |layout: &[Part]| {
        let at = layout.iter().position(|p| *p == Part::Data)?;
        layout[at + 1..].iter().find_map(|part| match part {
            Part::Fixed(mark) => mark.last().copied(),
            _ => None,
        })
    };
    if frames.length.is_some() {
        Vec::new()
    } else {
        behind(&frames.request).into_iter().chain(behind(&frames.reply)).collect()
    }
}

impl Planner<'_, '_> {
    /// The form of a number: digits after the point, or another one.
    pub(super) fn form_of(&mut self, digits: Option<u8>, written: Option<&Name>) -> Option<Form> {
        let Some(written) = written else { return Some(Form::decimal(digits)) };
        self.parsed_form(&written.text, written.span)
    }

    /// A form as it is written behind a colon.
    pub(super) fn parsed_form(&mut self, text: &str, at: Span) -> Option<Form> {
        let modbus = self.speech == Speech::Modbus;
        let form = match Form::parse(text, modbus) {
            Ok(form) => form,
            Err(why) => {
                self.lab.report(Diagnostic::error(codes::DRIVER_LINE, at, why, "invalid format"));
                return None;
            }
        };
        let wrong = match &self.speech {
            Speech::Text(_) if form.is_raw() => Some((
                "a text framing cannot carry the bytes of a number",
                "add `hex`, or use a framing with `carries: bytes`",
            )),
            Speech::Free | Speech::Calls if !form.is_plain() => Some((
                "a server takes numbers in decimal form",
                "write it as in `:.1`, or `:.0 * 10` if it counts tenths",
            )),
            _ => None,
        };
        if let Some((headline, help)) = wrong {
            self.wrong(at, headline, "another format", help);
            return None;
        }
        Some(if modbus { form.in_hex() } else { form })
    }

    /// Reports a number that is known and does not fit its form.
    pub(super) fn fits_form(&mut self, value: NodeId, unit: &Unit, form: &Form, at: Span) -> Option<()> {
        let Some(known) = self.lab.known(value).filter(|v| v.is_finite()) else { return Some(()) };
        match form.put(unit, known) {
            Ok(_) => Some(()),
            Err(why) => {
                let headline = format!("{} cannot be sent in this format: {why}", unit.show(known));
                self.wrong(at, &headline, "does not fit", "the device would receive another number, or none");
                None
            }
        }
    }

    /// Whether a framing can carry what a message says as it is.
    pub(super) fn speakable(&mut self, text: &str, at: Span) -> Option<()> {
        let (bad, help) = match &self.speech {
            Speech::Free | Speech::Calls => return Some(()),
            Speech::Bytes => (text.chars().find(|c| u32::from(*c) > 0xff), "write bytes as `\\x1b`"),
            Speech::Modbus => (text.chars().find(|c| !matches!(c, ' '..='~')), "write registers as numbers"),
            Speech::Text(ends) => {
                let ends = ends.clone();
                let bad = |c: &char| {
                    !matches!(c, ' '..='~' | '\t') || u8::try_from(u32::from(*c)).is_ok_and(|b| ends.contains(&b))
                };
                (
                    text.chars().find(bad),
                    "a text may have printable characters other than those that end a frame; `carries: bytes` may have any",
                )
            }
        };
        match bad {
            None => Some(()),
            Some(c) => {
                let headline = format!("a message of this framing cannot contain `{}`", c.escape_default());
                self.wrong(at, &headline, "not allowed here", help);
                None
            }
        }
    }

    /// Reports numbers that cannot be told from what follows them.
    pub(super) fn parts_of_message(&mut self, pieces: &[Piece], at: Span) -> Option<()> {
        let open = |p: &Piece| matches!(p, Piece::Number { form, .. } if form.width().is_none());
        let touches = pieces.windows(2).any(|pair| {
            open(&pair[0])
                && match &pair[1] {
                    Piece::Plain(text) => goes_on(text),
                    Piece::Number { .. } => true,
                    Piece::Word(_, words) => words.iter().any(|w| goes_on(w)),
                }
        });
        if touches && !matches!(self.speech, Speech::Free | Speech::Calls) {
            let help = "put a separator between them, or give the number a width, as in `:05.1`";
            self.wrong(at, "the end of this number is ambiguous", "the next part follows directly", help);
            return None;
        }
        Some(())
    }

    /// Reports values of a reply that cannot be told from what follows them.
    pub(super) fn parts_of_reply(&mut self, slots: &[Slot], at: Span) -> Option<()> {
        let touches = slots.windows(2).any(|pair| match (&pair[0], &pair[1]) {
            (Slot::Any | Slot::Kept(_), next) => !matches!(next, Slot::Plain(_)),
            (Slot::Number(_, form), Slot::Plain(text)) if form.width().is_none() => goes_on(text),
            (Slot::Number(_, form), _) => form.width().is_none(),
            _ => false,
        });
        if touches {
            let headline = "a reply needs a text between two values";
            let d = Diagnostic::error(codes::DRIVER_LINE, at, headline, "two values follow directly");
            self.lab.report(
                d.help("put a separator between them, or give the first a width, as in `{degC :05.1}` or `{_ :u16}`"),
            );
            return None;
        }
        Some(())
    }

    /// `S = stopped | I = running`.
    pub(super) fn choices(&mut self, text: &str, at: Span) -> Option<Vec<Choice>> {
        let mut out: Vec<Choice> = Vec::new();
        let parts: Vec<&str> = text.split('|').collect();
        for (i, part) in parts.iter().enumerate() {
            let (sent, word) = part.rsplit_once('=').map(|(sent, word)| (sent.trim(), word.trim())).unwrap_or_default();
            let sent = if sent == "_" && i + 1 == parts.len() && i > 0 { None } else { Some(sent) };
            let again = out.iter().any(|c| sent.is_some() && c.sent.as_deref() == sent);
            if sent == Some("") || sent == Some("_") || word.is_empty() || again {
                let headline =
                    if again { "the same text is given for two words" } else { "this list of words is incomplete" };
                self.wrong(
                    at,
                    headline,
                    "invalid format",
                    "write it as in `{S = stopped | I = running}`; `_ = other` at the end takes all other texts",
                );
                return None;
            }
            if let Some(sent) = sent {
                self.speakable(sent, at)?;
            }
            out.push(Choice { sent: sent.map(str::to_owned), word: word.to_owned(), index: 0 });
        }
        Some(out)
    }

    /// The words of a value on the line, each by what stands for it there.
    pub(super) fn sent_words(&mut self, words: &[String], form: Option<&Name>) -> Option<Vec<String>> {
        let Some(form) = form else { return Some(words.to_vec()) };
        let choices = self.choices(&form.text, form.span)?;
        let sent = |word: &String| choices.iter().find(|c| c.word == *word).and_then(|c| c.sent.clone());
        let all: Option<Vec<String>> = words.iter().map(sent).collect();
        let strange = choices.iter().find(|c| !words.contains(&c.word));
        if all.is_none() || strange.is_some() {
            let list = words.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ");
            self.wrong(
                form.span,
                "every word needs a text for it",
                "other words",
                &format!("give a text for each of {list}"),
            );
            return None;
        }
        all
    }
}

/// Whether a text would be read as more of a number before it.
fn goes_on(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit() || c == '.')
}
