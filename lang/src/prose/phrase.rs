//! Expressions and conditions in words.

use super::{Prose, words};
use crate::ast::{Binary, Expr, ExprKind, MemberKind, Name, Role, Text, TextPart, Unary};
use crate::eval::Value;
use matterix_ir::listing::joined;

impl<'a> Prose<'a, '_> {
    /// What an expression is called; what constants settle is said with its value.
    pub(super) fn say(&mut self, e: &'a Expr) -> String {
        match self.settled(e) {
            Some(value) => format!("{value} (`{}`)", self.written(e)),
            None => self.called_as_written(e),
        }
    }

    /// The value of a call of a function or a calculation that depends on constants only.
    fn settled(&mut self, e: &'a Expr) -> Option<String> {
        let computed = match &*e.kind {
            ExprKind::Call(callee, _) => matches!(&*callee.kind, ExprKind::Name(_)),
            ExprKind::Binary(Binary::Add | Binary::Sub | Binary::Mul | Binary::Div, ..) => true,
            _ => false,
        };
        if !computed || !self.is_plain(e) {
            return None;
        }
        self.constant(|prose| prose.value(e))
    }

    /// Whether an expression is made of numbers, constants and functions of them, and of nothing that a lab holds.
    fn is_plain(&self, e: &Expr) -> bool {
        match &*e.kind {
            ExprKind::Quantity(..) | ExprKind::Number(_) => true,
            ExprKind::Name(name) => !self.vars.contains(&name.text) && self.lab.find_instance(&name.text).is_none(),
            ExprKind::Call(_, args) => args.iter().all(|arg| self.is_plain(&arg.value)),
            ExprKind::Binary(_, a, b) => self.is_plain(a) && self.is_plain(b),
            ExprKind::Unary(_, inner) => self.is_plain(inner),
            ExprKind::Tuple(items, None) => items.iter().all(|item| self.is_plain(item)),
            _ => false,
        }
    }

    /// A quantity that is known before the run.
    fn constant(&mut self, value: impl FnOnce(&mut Self) -> Value) -> Option<String> {
        let (found, reported) = (self.lab.diagnostics.len(), self.lab.reported);
        let value = value(self);
        self.lab.diagnostics.truncate(found);
        self.lab.reported = reported;
        let Value::Num(n) = value else { return None };
        let number = self.lab.graph.constant(n.node)?;
        let units = &self.lab.tables.units;
        Some(match &n.unit {
            Some(unit) => words::quantity(&unit.show(number)),
            None if n.dimension == units.named("Volume") => words::volume(number),
            None if n.dimension == units.named("Mass") => words::mass(number),
            None => words::quantity(&self.lab.unit_of(&n).show(number)),
        })
    }

    fn called_as_written(&mut self, e: &'a Expr) -> String {
        match &*e.kind {
            ExprKind::Name(name) => self.say_name(name),
            ExprKind::Quantity(_, unit) => {
                let text = self.sources.slice(e.span);
                let number = text.strip_suffix(unit.text.as_str()).unwrap_or(text).trim_end();
                format!("{number} {}", words::unit(&unit.text))
            }
            ExprKind::Number(_) => self.written(e),
            ExprKind::Text(text) => format!("“{text}”"),
            ExprKind::Member(base, name) => self.member(base, name),
            ExprKind::IndexWord(base, word) => self.indexed(base, word),
            ExprKind::IndexRange(base, from, to) => {
                format!("{} to {} of {}", from.text, to.text, self.say(base))
            }
            ExprKind::Index(base, index) => {
                if let Value::Species(s) = self.value(index) {
                    let species = self.lab.tables.species.get(s).name.clone();
                    return format!("the concentration of {species} in {}", self.contents_of(base));
                }
                let at = match &*index.kind {
                    // Lists count from 0, people from 1.
                    ExprKind::Number(n) => format!("{}", n + 1.0),
                    _ => format!("number {} (from 0)", self.say(index)),
                };
                format!("value {at} of {}", self.say(base))
            }
            ExprKind::Call(callee, args) => self.function(callee, args, e),
            ExprKind::Unary(Unary::Neg, inner) => format!("−{}", self.operand(inner, tightness(Binary::Mul))),
            ExprKind::Binary(
                op @ (Binary::Add | Binary::Sub | Binary::Mul | Binary::Div | Binary::PlusMinus),
                a,
                b,
            ) => {
                let sign = match op {
                    Binary::Add => "+",
                    Binary::Sub => "−",
                    Binary::Mul => "·",
                    Binary::Div => "/",
                    _ => "±",
                };
                // Of equals the left one goes first.
                let binds = tightness(*op);
                format!("{} {sign} {}", self.operand(a, binds), self.operand(b, binds + 1))
            }
            ExprKind::Binary(..) | ExprKind::Unary(..) => self.condition(e),
            ExprKind::Of(amount, what) => format!("{} of {}", self.say(amount), what.text),
            ExprKind::Range(a, b) => format!("{} to {}", self.say(a), self.say(b)),
            ExprKind::As(inner, _) => self.say(inner),
            ExprKind::Tuple(items, None) if items.len() == 1 => format!("({})", self.say(&items[0])),
            ExprKind::List(items) => {
                let items: Vec<String> = items.iter().map(|i| self.say(i)).collect();
                joined(&items, "and")
            }
            _ => format!("`{}`", self.written(e)),
        }
    }

    /// As it stands in the file, on one line.
    pub(super) fn written(&self, e: &Expr) -> String {
        self.sources.slice(e.span).split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// A parameter of the workflow with its value: `target = 76.33 °C`.
    pub(super) fn parameter(&self, name: &str) -> Option<String> {
        let value = self.arguments.get(name)?;
        if self.lab.find_instance(value).is_some() {
            return Some(format!("**{value}** as {}", words::plain(name)));
        }
        Some(format!("{} = {}", words::plain(name), words::quantity(value)))
    }

    pub(super) fn say_name(&mut self, name: &Name) -> String {
        let text = name.text.as_str();
        if self.vars.iter().any(|v| v == text) {
            return format!("_{}_", words::plain(text));
        }
        if let Some(value) = self.arguments.get(text) {
            return match self.lab.find_instance(value) {
                Some(_) => format!("**{value}**"),
                None => words::quantity(value),
            };
        }
        if self.lab.find_instance(text).is_some() {
            return format!("**{text}**");
        }
        if text == "elapsed" {
            return "the time since the start".to_string();
        }
        let mut scope = self.scope.clone();
        match self.constant(|prose| prose.lab.name_of(name, &mut scope)) {
            Some(value) => format!("{value} ({})", words::plain(text)),
            None => words::plain(text),
        }
    }

    /// The instance or instances an expression stands for, as far as that is known before the run.
    pub(super) fn value(&mut self, e: &'a Expr) -> Value {
        let mut scope = self.scope.clone();
        self.lab.expr(e, &mut scope)
    }

    fn member(&mut self, base: &'a Expr, name: &'a Name) -> String {
        if let ExprKind::Name(step) = &*base.kind
            && matches!(name.text.as_str(), "start" | "end" | "elapsed")
            && self.lab.find_instance(&step.text).is_none()
            && !self.vars.contains(&step.text)
        {
            let step = words::plain(&step.text);
            return match name.text.as_str() {
                "start" => format!("the start of “{step}”"),
                "end" => format!("the end of “{step}”"),
                _ => format!("the time that “{step}” took"),
            };
        }
        let of = self.say(base);
        let known = match self.value(base) {
            Value::Instance(id) => Some(id),
            _ => None,
        };
        // A part of a thing is called by its own name: `ot2.left`.
        if let Some(id) = known {
            let part = format!("{}.{}", self.lab.instances[id.0 as usize].name, name.text);
            if self.lab.find_part(&part) && !self.is_contents(id, &name.text) {
                return format!("**{}**", part);
            }
            let reading = self.lab.all_members(id).iter().any(|m| {
                matches!(&m.member.kind, MemberKind::Value { role: Role::Reading, name: n, .. } if n.text == name.text)
            });
            if reading {
                return format!("the {} reading of {of}", words::plain(&name.text));
            }
        }
        if name.text == PAIRS {
            return format!("neighbours in {of}");
        }
        format!("the {} of {of}", words::plain(&name.text))
    }

    /// Whether a part is the mixture in a vessel.
    fn is_contents(&self, id: matterix_ir::scene::InstanceId, part: &str) -> bool {
        let part = self.lab.instances[id.0 as usize].parts.get(part);
        part.is_some_and(|p| self.lab.is_mixture(*p))
    }

    /// `plate[A1]` is a well, `beaker[EtOH]` a concentration.
    fn indexed(&mut self, base: &'a Expr, word: &Name) -> String {
        let value = self.value(base);
        if self.vars.contains(&word.text) && !self.lab.is_place(&value, &word.text) {
            return format!("value number _{}_ (from 0) of {}", words::plain(&word.text), self.say(base));
        }
        if self.lab.grid_of(&value).is_some() {
            return format!("{} of {}", word.text, self.say(base));
        }
        let species = match self.lab.species_meant(word, &self.scope.clone()) {
            Ok(Some(s)) => self.lab.tables.species.get(s).name.clone(),
            _ => word.text.clone(),
        };
        format!("the concentration of {species} in {}", self.contents_of(base))
    }

    /// A concentration is one in a vessel, whether its contents are named or not.
    fn contents_of(&mut self, base: &'a Expr) -> String {
        match &*base.kind {
            ExprKind::Member(vessel, part) => match self.value(vessel) {
                Value::Instance(id) if self.is_contents(id, &part.text) => self.say(vessel),
                _ => self.say(base),
            },
            _ => self.say(base),
        }
    }

    fn function(&mut self, callee: &'a Expr, args: &'a [crate::ast::Arg], e: &'a Expr) -> String {
        match (&*callee.kind, args) {
            // Rows, columns and wells of a plate.
            (ExprKind::Member(base, name), [one]) => {
                format!("{} {} of {}", words::plain(&name.text), self.say(&one.value), self.say(base))
            }
            (ExprKind::Name(name), [one]) if name.text == "abs" => format!("the size of {}", self.say(&one.value)),
            _ => format!("`{}`", self.written(e)),
        }
    }

    /// A part of a sum or product, in parentheses where it binds less tightly than what it stands in.
    fn operand(&mut self, e: &'a Expr, within: u8) -> String {
        let said = self.say(e);
        match &*e.kind {
            ExprKind::Binary(op, ..) if tightness(*op) < within => format!("({said})"),
            _ => said,
        }
    }

    /// A part of what must hold together, in parentheses where one of several is enough for it.
    fn alternatives(&mut self, e: &'a Expr) -> String {
        let said = self.condition(e);
        match &*e.kind {
            ExprKind::Binary(Binary::Or, ..) => format!("({said})"),
            _ => said,
        }
    }

    /// A condition as a statement: `the temperature of the contents of beaker is at least 60 °C`.
    pub(super) fn condition(&mut self, e: &'a Expr) -> String {
        match &*e.kind {
            ExprKind::Binary(Binary::And, a, b) => format!("{} and {}", self.alternatives(a), self.alternatives(b)),
            ExprKind::Binary(Binary::Or, a, b) => format!("{} or {}", self.condition(a), self.condition(b)),
            // `plate.active`: a truth value is an adjective.
            ExprKind::Member(thing, name) => format!("{} is {}", self.say(thing), words::plain(&name.text)),
            ExprKind::Unary(Unary::Not, inner) => match &*inner.kind {
                ExprKind::Member(thing, name) => format!("{} is not {}", self.say(thing), words::plain(&name.text)),
                ExprKind::Binary(Binary::Is, thing, state) => {
                    format!("{} is not {}", self.say(thing), self.say(state))
                }
                _ => format!("it is not so that {}", self.condition(inner)),
            },
            ExprKind::Binary(Binary::In, a, b) => match &*b.kind {
                ExprKind::Range(low, high) => {
                    format!("{} is between {} and {}", self.say(a), self.say(low), self.say(high))
                }
                ExprKind::List(items) => {
                    let items: Vec<String> = items.iter().map(|i| self.say(i)).collect();
                    format!("{} is {}", self.say(a), joined(&items, "or"))
                }
                ExprKind::Binary(Binary::PlusMinus, ..) => format!("{} is {}", self.say(a), self.say(b)),
                _ => format!("{} is within {}", self.say(a), self.say(b)),
            },
            ExprKind::Binary(op, a, b) => {
                if let (ExprKind::Name(n), Some(words)) = (&*a.kind, passed(*op))
                    && n.text == "elapsed"
                    && !self.vars.contains(&n.text)
                {
                    return format!("{words}{} have passed since the start", self.say(b));
                }
                let word = match op {
                    Binary::Eq | Binary::Is => "is",
                    Binary::Ne => "is not",
                    Binary::Lt => "is below",
                    Binary::Le => "is at most",
                    Binary::Gt => "is above",
                    Binary::Ge => "is at least",
                    _ => return self.say(e),
                };
                format!("{} {word} {}", self.say(a), self.say(b))
            }
            ExprKind::Tuple(items, None) if items.len() == 1 => self.condition(&items[0]),
            _ => self.say(e),
        }
    }

    /// A text with its values in words.
    pub(super) fn text(&mut self, text: &'a Text) -> String {
        let mut out = String::new();
        for part in &text.parts {
            match part {
                TextPart::Plain(plain) => out.push_str(plain),
                TextPart::Value { value, .. } => {
                    // What has a name is named; a number is filled in by whoever does it.
                    let named = matches!(self.value(value), Value::Instance(_));
                    let said = self.say(value);
                    out.push_str(&if named { said } else { format!("[{said}]") });
                }
            }
        }
        out
    }
}

/// The member of a list that gives its neighbours in pairs.
const PAIRS: &str = "pairs";

/// What goes before a time that has passed.
fn passed(op: Binary) -> Option<&'static str> {
    match op {
        Binary::Ge => Some(""),
        Binary::Gt => Some("more than "),
        Binary::Lt => Some("less than "),
        Binary::Le => Some("at most "),
        _ => None,
    }
}

/// How tightly an operator binds, as the language reads it.
fn tightness(op: Binary) -> u8 {
    match op {
        Binary::Pow => 3,
        Binary::Mul | Binary::Div => 2,
        Binary::Add | Binary::Sub | Binary::PlusMinus => 1,
        _ => 0,
    }
}
