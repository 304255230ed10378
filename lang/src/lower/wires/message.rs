//! Messages over HTTP, looked at before anything is sent: their form, and whether something tells what they put in.

use std::collections::BTreeSet;

use matterix_ir::message::{self, Field};
use matterix_ir::wire::{Driver, Exchange, Framing, Pattern, Piece, Slot, Template};
use matterix_ir::{Diagnostic, Span, codes};

use super::hosted::Under;
use crate::ast::{Wire, WireKind};
use crate::lower::Planner;

/// Stands for a value.
const VALUE: &str = "0";

impl<'a> Planner<'a, '_> {
    /// Reports what no server understands.
    pub(super) fn check_messages(&mut self, driver: &Driver, wires: &'a [Wire], under: Option<Under<'a>>) {
        if driver.framing != Framing::Json || !self.lab.prototype {
            return;
        }
        let known: BTreeSet<String> =
            wires.iter().chain(under.map_or(&[][..], |u| u.wires)).flat_map(kept_by).collect();
        let exchanges = driver.said_apart().chain(&driver.play);
        let served = driver.served.iter().chain(driver.alive.iter().map(|a| &a.repeated)).map(|s| &s.exchange);
        for exchange in exchanges.chain(served) {
            self.check_exchange(exchange, &known);
        }
        for exchange in &driver.play {
            let asks = exchange.until.iter().map(|until| &until.asks);
            for sent in exchange.sends.iter().chain(asks) {
                if sent.pieces.iter().any(|p| !matches!(p, Piece::Plain(_))) {
                    self.no_message(sent.span, "the message that plays a file cannot contain values");
                }
            }
        }
        for told in &driver.told {
            self.check_request(&told.asks, &known);
            told.forms().for_each(|(form, _)| self.check_answer(form, &known));
        }
        for (asked, with) in &driver.answers {
            if let Err(why) = message::request(&asked.with(VALUE)) {
                self.no_message(asked.span, &why);
            }
            if let Err(why) = message::answer(&with.with(VALUE)) {
                self.no_message(with.span, &why);
            }
        }
        for refusal in &driver.refusals {
            self.check_answer(&refusal.reply, &known);
        }
    }

    fn check_exchange(&mut self, exchange: &Exchange, known: &BTreeSet<String>) {
        exchange.sends.iter().for_each(|sent| self.check_request(sent, known));
        if let Some(expected) = &exchange.expects {
            self.check_answer(expected, known);
            expected.then.iter().for_each(|expected| self.check_answer(expected, known));
        }
        if let Some(until) = &exchange.until {
            self.check_request(&until.asks, known);
            match &until.expects {
                Some(expected) => self.check_answer(expected, known),
                None => self.no_message(until.asks.span, "over HTTP only a reply can report that a device is ready"),
            }
        }
    }

    fn check_request(&mut self, template: &Template, known: &BTreeSet<String>) {
        let text = template.with(VALUE);
        let request = match message::request(&text) {
            Ok(request) => request,
            Err(why) => return self.no_message(template.span, &why),
        };
        let path = request.target.split(['/', '?', '&', '=']).filter_map(message::kept);
        let missing = path.chain(put_in(&request.fields)).find(|word| !known.contains(*word));
        if let Some(word) = missing {
            self.unknown_word(template.span, word);
        }
    }

    fn check_answer(&mut self, pattern: &Pattern, known: &BTreeSet<String>) {
        let text = pattern.with(VALUE);
        let answer = match message::answer(&text) {
            Ok(answer) => answer,
            Err(why) => return self.no_message(pattern.span, &why),
        };
        let chosen = answer.fields.iter().flat_map(|f| f.pointer.split('/')).filter_map(message::choice);
        let missing = chosen.filter_map(|(_, text)| message::kept(text)).find(|word| !known.contains(*word));
        if let Some(word) = missing {
            self.unknown_word(pattern.span, word);
        }
    }

    fn unknown_word(&mut self, span: Span, word: &str) {
        let headline = format!("`<{word}>` is never set");
        let d = Diagnostic::error(codes::DRIVER_LINE, span, headline, "used here");
        self.lab.report(d.help(format!("keep it from a reply, as in `expects \"201 /data/id=<{word}>\"`")));
    }

    fn no_message(&mut self, span: Span, why: &str) {
        self.lab.report(Diagnostic::error(codes::DRIVER_LINE, span, why.to_owned(), "invalid message"));
    }
}

fn put_in<'t>(fields: &[Field<'t>]) -> impl Iterator<Item = &'t str> {
    fields.iter().filter_map(|f| message::kept(f.value))
}

/// The words that an answer of this form keeps.
pub(super) fn kept_words(expects: &Pattern, framing: &Framing) -> Vec<String> {
    let in_slots = expects.slots.iter().filter_map(|slot| match slot {
        Slot::Kept(word) => Some(word.clone()),
        _ => None,
    });
    if *framing != Framing::Json {
        return in_slots.collect();
    }
    let text = expects.with(VALUE);
    let fields = message::answer(&text).map(|answer| answer.fields).unwrap_or_default();
    put_in(&fields).map(str::to_owned).collect()
}

/// The words that the answers of a line are kept under.
fn kept_by(wire: &Wire) -> Vec<String> {
    let exchange = match &wire.kind {
        WireKind::Fixed { exchange, .. } | WireKind::Command { exchange, .. } => exchange,
        _ => return Vec::new(),
    };
    let until = exchange.until.iter().filter_map(|until| until.expects.as_ref());
    let all = exchange.expects.iter().chain(&exchange.then).chain(until);
    let said = all.filter_map(|expects| message::answer(&expects.text).ok());
    said.flat_map(|answer| put_in(&answer.fields).map(str::to_owned).collect::<Vec<_>>()).collect()
}
