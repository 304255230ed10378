//! What the lines of a driver say: texts with values in them, exchanges, readings.

use std::sync::Arc;

use matterix_ir::wire::{Exchange, Framing, Identity, Pattern, Piece, Slot, Template, Told, Until};
use matterix_ir::{Diagnostic, NodeId, Op, Span, Unit, codes};

use super::forms::Speech;
use super::message::kept_words;
use crate::ast::{self, ExprKind, Path, TextPart};
use crate::declare::tables::MemberRef;
use crate::eval::lab::Mode;
use crate::eval::{Scope, Value};
use crate::lower::Planner;
use crate::units::Dimension;

impl<'a> Planner<'a, '_> {
    pub(super) fn exchange(&mut self, of: &'a ast::Exchange, span: Span, scope: &mut Scope) -> Option<Exchange> {
        let mut sends = Vec::with_capacity(of.sends.len());
        for text in &of.sends {
            sends.push(self.template(text, scope)?);
        }
        let mut expects = match &of.expects {
            Some(pattern) => Some(self.pattern(pattern)?.0),
            None => None,
        };
        if !of.then.is_empty() && of.then.len() + 1 != of.sends.len() {
            let headline = format!("{} replies are expected for {} messages", of.then.len() + 1, of.sends.len());
            self.wrong(
                of.then[0].span,
                &headline,
                "the numbers differ",
                "expect one reply for all of them, or one for each",
            );
            return None;
        }
        for pattern in &of.then {
            let (pattern, _) = self.pattern(pattern)?;
            expects.iter_mut().for_each(|first| first.then.push(pattern.clone()));
        }
        let until = match &of.until {
            Some(until) => {
                let asks = self.template(&until.asks, scope)?;
                let expects = match &until.expects {
                    Some(pattern) => Some(self.pattern(pattern)?.0),
                    None => None,
                };
                Some(Until { asks, expects, timeout: self.duration_node(&until.timeout, scope, "timeout")? })
            }
            None => None,
        };
        Some(Exchange { sends, expects, until, span })
    }

    /// The question who a device is: one message, and an answer with words that say so.
    pub(super) fn identity(&mut self, exchange: Exchange, framing: &Framing) -> Option<Identity> {
        let help = "write `identity sends \"I4\" expects \"I4 A {<serial>}\"`";
        let span = exchange.span;
        if *framing == Framing::Calls {
            let headline = "a server of SiLA 2 is identified by its UUID";
            self.wrong(span, headline, "not for this driver", "bind the device by its UUID: `sila = \"UUID\"`");
            return None;
        }
        if exchange.sends.len() != 1 || exchange.until.is_some() {
            self.wrong(span, "`identity` needs exactly one message", "not one message", help);
            return None;
        }
        let words = exchange.expects.as_ref().map(|expects| kept_words(expects, framing)).unwrap_or_default();
        if words.is_empty() {
            self.wrong(span, "`identity` must keep a word of the reply", "keeps nothing", help);
            return None;
        }
        Some(Identity { exchange, words })
    }

    /// A text to send.
    pub(super) fn template(&mut self, text: &'a ast::Text, scope: &mut Scope) -> Option<Template> {
        let template = self.filled_template(text, scope)?;
        if self.speech != Speech::Modbus {
            return Some(template);
        }
        Some(Template { pieces: self.modbus_request(template.pieces, text.span)?, ..template })
    }

    /// A text that an emulator answers with.
    pub(super) fn answer_text(&mut self, text: &'a ast::Text, scope: &mut Scope) -> Option<Template> {
        let template = self.filled_template(text, scope)?;
        if self.speech != Speech::Modbus {
            return Some(template);
        }
        Some(Template { pieces: self.modbus_told(template.pieces, text.span)?, ..template })
    }

    /// A text as it stands in a call: with its quotes escaped where it is in quotes.
    fn quotable(&mut self, text: String, before: &[Piece], at: Span) -> Option<String> {
        let (mut quoted, mut escaped) = (false, false);
        for piece in before {
            let Piece::Plain(plain) = piece else { continue };
            for c in plain.chars() {
                match c {
                    _ if std::mem::take(&mut escaped) => {}
                    '\\' if quoted => escaped = true,
                    '"' => quoted = !quoted,
                    _ => {}
                }
            }
        }
        if quoted {
            return Some(text.replace('\\', "\\\\").replace('"', "\\\""));
        }
        match text.chars().find(|c| "\"\\,:()[]{}".contains(*c)) {
            None => Some(text),
            Some(c) => {
                let headline = format!("a text without quotes cannot contain `{c}`");
                self.wrong(at, &headline, "would be read as a part of the call", "put `\\\"` before and after it");
                None
            }
        }
    }

    fn filled_template(&mut self, text: &'a ast::Text, scope: &mut Scope) -> Option<Template> {
        let mut pieces = Vec::new();
        for part in &text.parts {
            let (value, digits, form) = match part {
                TextPart::Plain(words) => {
                    self.speakable(words, text.span)?;
                    pieces.push(Piece::Plain(words.clone()));
                    continue;
                }
                TextPart::Value { value, digits, form } => (value, *digits, form.as_ref()),
            };
            pieces.push(match self.lab.expr(value, scope) {
                Value::Error => return None,
                Value::Num(n) if matches!(&*value.kind, ExprKind::As(..)) || n.dimension.is_one() => {
                    let unit = n.unit.filter(|_| matches!(&*value.kind, ExprKind::As(..)));
                    let unit = unit.map_or_else(Unit::one, Arc::unwrap_or_clone);
                    let form = self.form_of(digits, form)?;
                    self.fits_form(n.node, &unit, &form, value.span)?;
                    Piece::Number { value: n.node, unit, form }
                }
                Value::Num(n) => {
                    let unit = self.lab.shown(&n).symbol;
                    let headline = "this number needs a unit";
                    let d = Diagnostic::error(codes::DRIVER_LINE, value.span, headline, "the unit is missing");
                    self.lab.report(d.help(format!("write `{{... as {unit}}}`")));
                    return None;
                }
                Value::Enum(node, words) => Piece::Word(node, self.sent_words(&words, form)?),
                Value::Bool(node) => Piece::Word(node, self.sent_words(&truth(), form)?),
                _ if form.is_some() => {
                    let at = form.map_or(value.span, |f| f.span);
                    self.wrong(at, "only numbers and words take a format", "not a number or word", "remove it");
                    return None;
                }
                Value::Text(words) if self.speech == Speech::Calls && text.parts.len() > 1 => {
                    Piece::Plain(self.quotable(words, &pieces, value.span)?)
                }
                Value::Text(text) => Piece::Plain(text),
                Value::Instance(i) | Value::Qualified(i, _) => {
                    Piece::Plain(self.lab.instances[i.0 as usize].name.clone())
                }
                Value::Nothing if self.lenient => return None,
                Value::Nothing | Value::Unlimited => {
                    let headline = "a value of this message is not set in this lab";
                    let d = Diagnostic::error(codes::DRIVER_LINE, value.span, headline, "not set");
                    self.lab.report(d.help("give it where the device is declared, or in a `between` line"));
                    return None;
                }
                other => {
                    self.lab.expected("a quantity or a word", &other, value.span);
                    return None;
                }
            });
        }
        self.parts_of_message(&pieces, text.span)?;
        Some(Template { pieces, span: text.span })
    }

    /// A quantity that a device tells.
    pub(super) fn told(
        &mut self,
        path: &'a Path,
        asks: &'a ast::Text,
        expects: &'a ast::Pattern,
        span: Span,
        scope: &mut Scope,
    ) -> Option<Told> {
        let asks = self.template(asks, scope)?;
        let told = self.tells(path, asks, expects, span, scope)?;
        if self.speech == Speech::Modbus && !self.modbus_fits(&told.asks, &told.expects.slots, expects.span) {
            return None;
        }
        Some(told)
    }

    /// A quantity that a device tells by itself.
    pub(super) fn heard(
        &mut self,
        path: &'a Path,
        text: &'a ast::Pattern,
        every: &'a ast::Expr,
        span: Span,
        scope: &mut Scope,
    ) -> Option<Told> {
        let told = self.tells(path, Template { pieces: Vec::new(), span: text.span }, text, span, scope)?;
        let period = self.duration_node(every, scope, "every")?;
        match self.lab.known(period).filter(|s| *s > 0.0) {
            Some(period) => Some(Told { heard: Some(period), ..told }),
            None => {
                self.wrong(
                    every.span,
                    "the interval between messages must be known before the run",
                    "not a constant",
                    "write it as in `every 1 s`",
                );
                None
            }
        }
    }

    fn tells(
        &mut self,
        path: &'a Path,
        asks: Template,
        expects: &'a ast::Pattern,
        span: Span,
        scope: &mut Scope,
    ) -> Option<Told> {
        let id = scope.this?;
        let name = path.segments.last()?;
        let mode = Mode { reported: true, ..self.lab.mode() };
        let value = self.lab.in_mode(mode, |lab| {
            path.segments.iter().fold(Value::Instance(id), |value, segment| lab.member(value, segment))
        });
        let (text, bounds) = bounded(&expects.text);
        let bounds = match bounds {
            Some(Err(why)) => {
                let d = Diagnostic::error(codes::DRIVER_LINE, expects.span, why, "invalid range");
                self.lab.report(d.help("write two numbers in the given unit, as in `{degC in -50 .. 400}`"));
                return None;
            }
            Some(Ok(bounds)) => Some(bounds),
            None => None,
        };
        let (mut expects, dimensions) = self.pattern(&ast::Pattern { text, span: expects.span })?;
        let mut words = Vec::new();
        let n = match value {
            Value::Error => return None,
            Value::Num(n) => n,
            Value::Enum(node, of) => {
                words = self.told_words(&of, &mut expects, &name.text)?;
                crate::eval::Num { node, dimension: Dimension::one(), point: false, unit: None, literal: false }
            }
            Value::Bool(node) => {
                words = self.told_words(&truth(), &mut expects, &name.text)?;
                crate::eval::Num { node, dimension: Dimension::one(), point: false, unit: None, literal: false }
            }
            other => {
                self.lab.expected("a quantity that a device can report", &other, name.span);
                return None;
            }
        };
        let one = [Dimension::one()];
        let dimensions = if words.is_empty() { dimensions.as_slice() } else { &one };
        let [dimension] = dimensions else {
            let headline = format!("the reply must contain `{}` once", name.text);
            let d =
                Diagnostic::error(codes::DRIVER_LINE, expects.span, headline, format!("{} values", dimensions.len()));
            self.lab.report(d.help("write the unit in braces in place of the number, as in `\"{degC} 2\"`"));
            return None;
        };
        if *dimension != n.dimension {
            let wanted = self.lab.tables.units.describe(&n.dimension, n.point);
            let headline = format!("`{}` is {wanted}, but the unit of this reply has another dimension", name.text);
            self.lab.report(Diagnostic::error(codes::DRIVER_LINE, expects.span, headline, "another dimension"));
            return None;
        }
        let member = match path.segments.as_slice() {
            [only] => self.lab.members_of(id, &only.text).first().copied(),
            _ => None,
        };
        let unit = self.unit_of(member, &expects, n.node);
        let told_in = expects.slots.iter().find_map(number_unit);
        let shows = bounds.zip(told_in).map(|(bounds, unit)| bounds.map(|bound| unit.to_si(bound)));
        // Nothing is colder than 0 K, whatever an instrument can show.
        let shows = if n.point {
            let [least, most] = shows.unwrap_or([0.0, f64::INFINITY]);
            Some([least.max(0.0), most])
        } else {
            shows
        };
        let difference = if n.point { self.lab.tables.si(&n.dimension) } else { unit.clone() };
        let (reading, state) = match self.lab.graph.op(n.node) {
            Op::Reading(r) => (Some(r), None),
            Op::State(s) => (None, Some(s)),
            _ => (None, None),
        };
        let name = format!("{}.{}", self.lab.instances[id.0 as usize].name, super::words(path));
        Some(Told {
            name,
            value: n.node,
            reading,
            state,
            unit,
            difference,
            condition: None,
            words,
            heard: None,
            asks,
            expects,
            shows,
            also: Vec::new(),
            span,
        })
    }

    /// The words of what is told, which a reply gives once by what stands for each.
    fn told_words(&mut self, words: &[String], expects: &mut Pattern, name: &str) -> Option<Vec<String>> {
        let list = words.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ");
        let wrong = |this: &mut Self, headline: String| {
            let example = words.first().map_or("", |w| w.as_str());
            this.wrong(
                expects.span,
                &headline,
                "the word is missing",
                &format!("give a text for each of {list}, as in `{{A = {example} | B = ...}}`"),
            );
        };
        let numbers = expects.slots.iter().filter(|s| matches!(s, Slot::Number(..))).count();
        let all = expects.slots.iter().filter(|s| matches!(s, Slot::Word(_))).count();
        if all != 1 || numbers != 0 {
            wrong(self, format!("the reply must contain the word for `{name}` once"));
            return None;
        }
        let choices = expects.slots.iter().find_map(|s| match s {
            Slot::Word(choices) => Some(choices),
            _ => None,
        })?;
        if let Some(strange) = choices.iter().find(|c| !words.contains(&c.word)) {
            wrong(self, format!("`{name}` has no state `{}`", strange.word));
            return None;
        }
        for slot in &mut expects.slots {
            let Slot::Word(choices) = slot else { continue };
            for choice in choices {
                choice.index = words.iter().position(|w| *w == choice.word).unwrap_or_default() as u32;
            }
        }
        Some(words.to_vec())
    }

    /// The unit a told quantity is shown in: its own, else that of the reply.
    fn unit_of(&mut self, member: Option<MemberRef<'a>>, expects: &matterix_ir::wire::Pattern, node: NodeId) -> Unit {
        if let Op::Reading(r) = self.lab.graph.op(node)
            && let Some(reading) = self.lab.readings.get(r as usize)
        {
            return reading.unit.clone();
        }
        let declared = member.and_then(|m| match &m.member.kind {
            ast::MemberKind::Value { ty, options, .. } => {
                let ty = self.lab.resolve_type(ty, m.module);
                self.lab.declared_unit(options, &ty)
            }
            _ => None,
        });
        let replied = expects.slots.iter().find_map(number_unit).cloned();
        declared.or(replied).unwrap_or_else(Unit::one)
    }
}

fn number_unit(slot: &Slot) -> Option<&Unit> {
    match slot {
        Slot::Number(unit, _) => Some(unit),
        _ => None,
    }
}

/// Between a unit and what its instrument can show.
const IN: &str = " in ";

/// A reply without what the instrument can show, and that: `{degC in -50 .. 400}`; in words what is wrong with it.
fn bounded(text: &str) -> (String, Option<Result<[f64; 2], String>>) {
    let braces = text.match_indices('{').filter_map(|(at, _)| {
        let (before, rest) = text.split_at(at);
        let end = rest.find('}')?;
        let (unit, range) = rest[1..end].split_once(IN).filter(|(unit, _)| !unit.contains('{'))?;
        Some((before, unit, range, &rest[end..]))
    });
    let Some((before, unit, range, after)) = braces.into_iter().next() else { return (text.to_owned(), None) };
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
    let (range, form) =
        range.split_once(':').map_or((range, String::new()), |(range, form)| (range, format!(" :{form}")));
    let bounds = range.split_once("..").and_then(|(least, most)| Some([number(least)?, number(most)?]));
    let bounds = bounds.filter(|[least, most]| least < most);
    let whole = format!("{before}{{{}{form}{after}", unit.trim());
    (
        whole,
        Some(bounds.ok_or_else(|| format!("`{}` is not a range from the smallest to the largest value", range.trim()))),
    )
}

/// The words of a truth value.
fn truth() -> [String; 2] {
    ["false".to_owned(), "true".to_owned()]
}
