//! Parts of lists, and whole numbers one after the other: `wells[2 .. 5]`, `wells.first(8)`, `for i in 1 .. 12`.

use matterix_ir::quantity::show_number;
use matterix_ir::{Diagnostic, Span, codes};

use super::{Decided, Num, Scope, Value};
use crate::ast::{Expr, ExprKind, Name};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::lab::grids::Place;
use crate::units::Dimension;

/// More turns than any loop has.
const MOST: f64 = 1e9;

impl<'a> Elaborator<'a> {
    /// `wells[2 .. 5]` by numbers from 0, `plate[A1 .. B3]` and `ot2.slot[1 .. 3]` by places; both ends are included.
    pub fn slice(&mut self, base: Value, from: &'a Expr, to: &'a Expr, scope: &mut Scope) -> Value {
        let mut end = |this: &mut Self, e: &'a Expr| match &*e.kind {
            ExprKind::Name(n) => this.end_named(&base, n, scope),
            _ => this.expr(e, scope),
        };
        let (low, high) = (end(self, from), end(self, to));
        self.part_between(base, (low, from.span), (high, to.span))
    }

    /// The same with names at both ends, of places or of numbers: `plate[A1 .. B3]`, `wells[i .. k]`.
    pub fn slice_named(&mut self, base: Value, from: &Name, to: &Name, scope: &mut Scope) -> Value {
        let (low, high) = (self.end_named(&base, from, scope), self.end_named(&base, to, scope));
        self.part_between(base, (low, from.span), (high, to.span))
    }

    /// A name at the end of a part: that of a place of a grid goes before others.
    fn end_named(&mut self, base: &Value, n: &Name, scope: &mut Scope) -> Value {
        let is_place = Place::parse(&n.text).is_some() || !self.resolves(n, scope);
        if is_place && self.grid_of(base).is_some() { Value::Place(n.clone()) } else { self.name_of(n, scope) }
    }

    fn part_between(&mut self, base: Value, (low, at_low): (Value, Span), (high, at_high): (Value, Span)) -> Value {
        let is_grid = self.grid_of(&base).is_some();
        if low == Value::Error || high == Value::Error {
            return Value::Error;
        }
        let span = at_low.to(at_high);
        let by_number = matches!((&low, &high), (Value::Num(_), Value::Num(_))) && !self.is_numbered(&base);
        match self.listed(base.clone()) {
            Value::Error => Value::Error,
            Value::List(items) if by_number => self.part_of(items, (low, at_low), (high, at_high)),
            _ if is_grid => {
                let (Some(low), Some(high)) = (self.place_meant(low, at_low), self.place_meant(high, at_high)) else {
                    return Value::Error;
                };
                self.grid_index(&base, &low, Some(&high)).unwrap_or(Value::Error)
            }
            Value::List(_) => {
                let wrong = if matches!(low, Value::Num(_)) { &high } else { &low };
                self.expected("the number of an element", wrong, span)
            }
            other => self.expected("a list or a grid", &other, span),
        }
    }

    /// The name of a place, by its number too.
    fn place_meant(&mut self, value: Value, span: Span) -> Option<Name> {
        if let Value::Place(name) = value {
            return Some(name);
        }
        let Value::Num(n) = self.coerce(value, &Type::ratio(), span, "place") else { return None };
        match self.number_before_run(n.node, "a place", span) {
            Decided::Now(number) => Some(Name { text: number.to_string(), span }),
            Decided::Later | Decided::ByRun => None,
        }
    }

    fn part_of(&mut self, items: Vec<Value>, low: (Value, Span), high: (Value, Span)) -> Value {
        let span = low.1.to(high.1);
        let (Some(from), Some(to)) = (self.whole_number(low.0, low.1), self.whole_number(high.0, high.1)) else {
            return Value::Error;
        };
        let (Decided::Now(from), Decided::Now(to)) = (from, to) else {
            return if self.prototype { Value::List(items) } else { Value::Error };
        };
        // One element stands for all of a list that is not known yet.
        if self.prototype && items.len() == 1 {
            return Value::List(items);
        }
        let count = items.len() as f64;
        if to < from - 1.0 {
            return self.backwards(span);
        }
        // An empty part may begin behind the last element.
        let begin = if to < from { from - 1.0 } else { from };
        if from < 0.0 || begin >= count && begin >= 0.0 {
            return self.no_element(&items, from, low.1);
        }
        if to >= count {
            return self.no_element(&items, to, high.1);
        }
        let part: Vec<Value> = items.into_iter().skip(from as usize).take((to - from + 1.0) as usize).collect();
        self.spend_on_items(part.len());
        Value::List(part)
    }

    /// `wells.first(n)`, `wells.last(n)`: so many elements.
    pub fn end_of(&mut self, items: Vec<Value>, is_first: bool, n: Value, span: Span) -> Value {
        let Some(number) = self.whole_number(n, span) else { return Value::Error };
        let count = match number {
            Decided::Now(count) => count,
            Decided::Later if self.prototype => return Value::List(items),
            Decided::Later | Decided::ByRun => return Value::Error,
        };
        // One element stands for all of a list that is not known yet.
        if self.prototype && items.len() == 1 && count >= 0.0 {
            return Value::List(items);
        }
        if count < 0.0 || count > items.len() as f64 {
            let (s, has) = (if items.len() == 1 { "" } else { "s" }, items.len());
            let headline = format!("the list has {has} element{s}, not {}", show_number(count));
            let d = Diagnostic::error(codes::TYPE_MISMATCH, span, headline, "out of range");
            self.report(with_hint_of_flat(d, &items));
            return Value::Error;
        }
        let skipped = if is_first { 0 } else { items.len() - count as usize };
        self.spend_on_items(count as usize);
        Value::List(items.into_iter().skip(skipped).take(count as usize).collect())
    }

    /// A whole number known before the run, or a report.
    fn whole_number(&mut self, value: Value, span: Span) -> Option<Decided> {
        let Value::Num(n) = self.coerce(value, &Type::ratio(), span, "number") else { return None };
        match self.number_before_run(n.node, "this number", span) {
            Decided::ByRun => None,
            Decided::Now(number) if number.fract() != 0.0 => {
                let headline = format!("{} is not a whole number", show_number(number));
                self.report(Diagnostic::error(codes::TYPE_MISMATCH, span, headline, "a whole number is expected here"));
                None
            }
            known => Some(known),
        }
    }

    /// A number from 0 that no element of a list has.
    pub fn no_element(&mut self, items: &[Value], number: f64, span: Span) -> Value {
        let (count, s) = (items.len(), if items.len() == 1 { "" } else { "s" });
        let headline =
            format!("the list has {count} element{s}, counted from 0: there is no number {}", show_number(number));
        let d = Diagnostic::error(codes::TYPE_MISMATCH, span, headline, "out of range");
        self.report(with_hint_of_flat(d, items));
        Value::Error
    }

    fn backwards(&mut self, span: Span) -> Value {
        let headline = "this range is empty: its lower end is above its upper end";
        let d = Diagnostic::error(codes::EMPTY_RANGE, span, headline, "no number is in it");
        self.report(d.help("write the lower end first"));
        Value::Error
    }

    /// The whole numbers `from .. to` of a loop, which is none where `to` is one below `from`.
    pub fn whole_numbers(&mut self, from: Value, to: Value, at_from: Span, at_to: Span) -> Option<Vec<Value>> {
        let span = at_from.to(at_to);
        for (end, at) in [(&from, at_from), (&to, at_to)] {
            match end {
                Value::Error => return None,
                Value::Num(n) if n.dimension.is_one() => {}
                other => {
                    let found = match other {
                        Value::Num(n) => self.describe(n),
                        other => other.what().to_owned(),
                    };
                    let headline = format!("a loop counts in whole numbers, and this is {found}");
                    let d = Diagnostic::error(codes::TYPE_MISMATCH, at, headline, "not a whole number");
                    self.report(d.help("write `for i in 1 .. 3 { }` and multiply `i`, or a list: `[1 s, 2 s]`"));
                    return None;
                }
            }
        }
        let (low, high) = (self.whole_number(from.clone(), at_from)?, self.whole_number(to, at_to)?);
        let (Decided::Now(low), Decided::Now(high)) = (low, high) else {
            // Of a stand-in one turn is looked at.
            return self.prototype.then(|| vec![from]);
        };
        if high < low - 1.0 {
            self.backwards(span);
            return None;
        }
        let count = high - low + 1.0;
        self.spend_on_items(count.min(MOST) as usize);
        if self.has_spent() {
            return None;
        }
        Some((0..count as u32).map(|i| self.number(low + f64::from(i), Dimension::one(), true)).collect())
    }

    /// The elements of a range between two numbers.
    pub fn elements_of(&mut self, low: Num, high: Num, span: Span) -> Option<Vec<Value>> {
        self.whole_numbers(Value::Num(low), Value::Num(high), span, span)
    }
}

fn with_hint_of_flat(d: Diagnostic, items: &[Value]) -> Diagnostic {
    match items.first() {
        Some(Value::List(_)) => d.help("its elements are lists: `.flat` makes one list of them"),
        _ => d,
    }
}
