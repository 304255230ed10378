//! Calls as imperative sentences, by the phrases that stand with their verbs.

use std::collections::BTreeMap;

use super::list::Step;
use super::{Prose, words};
use crate::ast::{Binary, Call, Clause, ClauseKind, Expr, ExprKind, ItemKind, MemberKind, Param, Sig, TextPart, Unary};
use crate::eval::Value;
use crate::eval::lab::verbs::Verb;
use crate::names::verb_text;

/// At most so many rows of a table of wells.
const MOST_ROWS: usize = 24;

/// Options that a skill or command takes.
pub(super) fn options(clauses: &[Clause]) -> impl Iterator<Item = &Param> {
    clauses.iter().filter_map(|c| match &c.kind {
        ClauseKind::Option(p) => Some(p),
        _ => None,
    })
}

/// The form of a call with its parameters: `bring _v_ to _t_`.
pub(super) fn form(sig: &Sig) -> String {
    let mut out = vec![verb_text(&sig.verb)];
    out.extend(sig.params.iter().map(|p| format!("_{}_", p.name.text)));
    for (label, params) in &sig.labelled {
        out.extend(params.iter().map(|p| format!("{} _{}_", label.text, p.name.text)));
    }
    out.join(" ")
}

/// A value that a condition of a phrase can look at.
#[derive(Clone, Debug, PartialEq)]
enum Simple {
    Number(f64),
    Word(String),
    Truth(bool),
}

impl<'a> Prose<'a, '_> {
    /// A call as a step; a table where it goes over several places.
    pub(super) fn call(&mut self, call: &'a Call) -> Step {
        let Some(verb) = self.lab.verbs.get(&call.span).cloned() else {
            return Step::new(words::sentence(&self.called(call)));
        };
        let names = self.lab.tables.names;
        let (sig, clauses, own) = match verb {
            Verb::Skill(id) => {
                let decl = names.decl(id);
                let ItemKind::Skill { sig, clauses, body, .. } = &decl.item.kind else {
                    return Step::new(words::sentence(&self.called(call)));
                };
                let library = names.modules.get(decl.module).is_none_or(|m| m.is_library());
                (sig, clauses, (body.is_some() && !library).then_some(id))
            }
            Verb::Command(_, m) => {
                let MemberKind::Command { sig, clauses } = &m.member.kind else {
                    return Step::new(words::sentence(&self.called(call)));
                };
                (sig, clauses, None)
            }
        };
        let said: Vec<_> = clauses
            .iter()
            .filter_map(|c| match &c.kind {
                ClauseKind::Says { text, when } => Some((text, when.as_ref())),
                _ => None,
            })
            .collect();
        let arguments = self.arguments_of(sig, clauses, call);
        let mut text;
        if said.is_empty() {
            text = self.called(call);
            if let Some(id) = own {
                if !self.procedures.contains(&id) {
                    self.procedures.push(id);
                }
                text = format!("{text} (see “To {}” below)", form(sig).replace('_', ""));
            }
        } else {
            let mut named: Vec<String> = Vec::new();
            text = String::new();
            for (phrase, when) in said {
                named.extend(when.iter().flat_map(|e| mentioned(e)));
                let spoken = when.is_none_or(|when| self.holds(when, &arguments) == Some(true));
                for part in &phrase.parts {
                    if let TextPart::Value { value, .. } = part {
                        named.extend(mentioned(value));
                    }
                }
                if !spoken {
                    continue;
                }
                if !text.is_empty() && !phrase.parts.first().is_some_and(starts_tight) {
                    text.push(' ');
                }
                for part in &phrase.parts {
                    match part {
                        TextPart::Plain(plain) => text.push_str(plain),
                        TextPart::Value { value, .. } => text.push_str(&self.argument(value, &arguments, call)),
                    }
                }
            }
            let extra: Vec<String> = call
                .options
                .iter()
                .filter(|o| !named.contains(&o.name.text))
                .map(|o| format!("{}: {}", words::plain(&o.name.text), self.say(&o.value)))
                .collect();
            if !extra.is_empty() {
                text = format!("{text} ({})", extra.join(", "));
            }
        }
        Step { text: words::sentence(&text), table: self.places(call), groups: Vec::new() }
    }

    /// A call in the words of the file.
    fn called(&mut self, call: &'a Call) -> String {
        let mut out: Vec<String> = Vec::new();
        for word in &call.words {
            let thing = self.lab.find_instance(&word.text).is_some()
                || self.vars.contains(&word.text)
                || self.arguments.contains_key(&word.text);
            out.push(if thing { self.say_name(word) } else { words::plain(&word.text) });
        }
        if let Some(object) = &call.object {
            out.push(self.say(object));
        }
        for (label, e) in &call.labelled {
            out.push(format!("{} {}", label.text, self.say(e)));
        }
        if !call.options.is_empty() {
            let all: Vec<String> = call
                .options
                .iter()
                .map(|o| format!("{}: {}", words::plain(&o.name.text), self.say(&o.value)))
                .collect();
            out.push(format!("({})", all.join(", ")));
        }
        out.join(" ")
    }

    /// What stands for each parameter and option; the object by a bare word is left out here.
    fn arguments_of(&self, sig: &'a Sig, clauses: &'a [Clause], call: &'a Call) -> BTreeMap<&'a str, &'a Expr> {
        let mut out: BTreeMap<&str, &Expr> = BTreeMap::new();
        if let (Some(p), Some(e)) = (sig.params.first(), &call.object) {
            out.insert(&p.name.text, e);
        }
        for (label, params) in &sig.labelled {
            let Some(p) = params.first() else { continue };
            let given = call.labelled.iter().find(|(l, _)| l.text == label.text).map(|(_, e)| e);
            out.extend(given.or(p.default.as_ref()).map(|e| (p.name.text.as_str(), e)));
        }
        for p in options(clauses) {
            let given = call.options.iter().find(|o| o.name.text == p.name.text).map(|o| &o.value);
            out.extend(given.or(p.default.as_ref()).map(|e| (p.name.text.as_str(), e)));
        }
        out
    }

    /// What a phrase names: an argument, or the device itself.
    fn argument(&mut self, e: &'a Expr, arguments: &BTreeMap<&'a str, &'a Expr>, call: &'a Call) -> String {
        let ExprKind::Name(name) = &*e.kind else { return self.say(e) };
        if let Some(given) = arguments.get(name.text.as_str()) {
            return self.say(given);
        }
        let by = call.labelled.iter().find(|(l, _)| l.text == "by").map(|(_, e)| e);
        match (name.text.as_str(), by, &call.object, call.words.last()) {
            // A command of the thing that is its object, or of the one after `by`.
            ("self", Some(device), ..) | ("self", None, Some(device), _) => self.say(device),
            (_, _, _, Some(word)) => self.say_name(word),
            _ => self.say_name(name),
        }
    }

    /// Whether the condition of a phrase holds, as far as the arguments say.
    fn holds(&mut self, e: &'a Expr, arguments: &BTreeMap<&'a str, &'a Expr>) -> Option<bool> {
        match &*e.kind {
            ExprKind::Binary(Binary::And, a, b) => Some(self.holds(a, arguments)? && self.holds(b, arguments)?),
            ExprKind::Binary(Binary::Or, a, b) => Some(self.holds(a, arguments)? || self.holds(b, arguments)?),
            ExprKind::Unary(Unary::Not, inner) => self.holds(inner, arguments).map(|t| !t),
            ExprKind::Binary(op, a, b) => {
                let (a, b) = (self.simple(a, arguments)?, self.simple(b, arguments)?);
                match (op, &a, &b) {
                    (Binary::Eq | Binary::Is, ..) => Some(a == b),
                    (Binary::Ne, ..) => Some(a != b),
                    (Binary::Lt, Simple::Number(a), Simple::Number(b)) => Some(a < b),
                    (Binary::Le, Simple::Number(a), Simple::Number(b)) => Some(a <= b),
                    (Binary::Gt, Simple::Number(a), Simple::Number(b)) => Some(a > b),
                    (Binary::Ge, Simple::Number(a), Simple::Number(b)) => Some(a >= b),
                    _ => None,
                }
            }
            _ => match self.simple(e, arguments)? {
                Simple::Truth(t) => Some(t),
                _ => None,
            },
        }
    }

    fn simple(&mut self, e: &'a Expr, arguments: &BTreeMap<&'a str, &'a Expr>) -> Option<Simple> {
        match &*e.kind {
            ExprKind::Number(v) => Some(Simple::Number(*v)),
            ExprKind::Quantity(v, unit) => {
                self.lab.tables.unit(&unit.text).ok().map(|u| Simple::Number(u.unit.to_si(*v)))
            }
            ExprKind::Name(n) => match arguments.get(n.text.as_str()) {
                Some(given) if !std::ptr::eq(*given, e) => self.simple(given, &BTreeMap::new()),
                _ => match n.text.as_str() {
                    "true" => Some(Simple::Truth(true)),
                    "false" => Some(Simple::Truth(false)),
                    // A variable of a loop or a result is not known.
                    text if self.vars.iter().any(|v| v == text) => None,
                    text => Some(Simple::Word(text.to_string())),
                },
            },
            _ => None,
        }
    }

    /// The places a call goes over, one row each, where arguments are lists of places.
    fn places(&mut self, call: &'a Call) -> Vec<Vec<String>> {
        let mut columns: Vec<(String, Vec<String>)> = Vec::new();
        for (label, e) in &call.labelled {
            let all = match self.value(e) {
                Value::List(items) => items.iter().filter_map(|v| self.lab.spoken(v)).collect(),
                Value::Instance(id) if matches!(&*e.kind, ExprKind::IndexWord(..)) => {
                    vec![self.lab.instances[id.0 as usize].name.clone()]
                }
                _ => continue,
            };
            columns.push((label.text.clone(), all));
        }
        let rows = columns.iter().map(|c| c.1.len()).max().unwrap_or(0);
        if !(2..=MOST_ROWS).contains(&rows) || columns.iter().any(|c| c.1.len() != rows && c.1.len() != 1) {
            return Vec::new();
        }
        let mut out = vec![columns.iter().map(|c| c.0.clone()).collect::<Vec<_>>()];
        for row in 0..rows {
            out.push(columns.iter().filter_map(|c| c.1.get(row).or(c.1.first()).cloned()).collect());
        }
        out
    }
}

/// Whether a phrase begins with a comma or the like, which stands close.
fn starts_tight(part: &TextPart) -> bool {
    matches!(part, TextPart::Plain(text) if text.starts_with([',', ';', '.', ')']))
}

/// Names in the condition of a phrase or in its braces.
fn mentioned(e: &Expr) -> Vec<String> {
    match &*e.kind {
        ExprKind::Name(n) => vec![n.text.clone()],
        ExprKind::Binary(_, a, b) => mentioned(a).into_iter().chain(mentioned(b)).collect(),
        ExprKind::Unary(_, inner) => mentioned(inner),
        _ => Vec::new(),
    }
}
