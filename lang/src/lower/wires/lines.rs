//! What the lines of a driver say: texts with values in them, exchanges, readings.

use std::sync::Arc;

use matterix_ir::wire::{Exchange, Piece, Slot, Template, Told, Until};
use matterix_ir::{Diagnostic, NodeId, Op, Span, Unit, codes};

use crate::ast::{self, ExprKind, Path, TextPart};
use crate::elaborate::tables::MemberRef;
use crate::eval::{Scope, Value};
use crate::lower::Planner;

impl<'a> Planner<'a, '_> {
    pub(super) fn exchange(&mut self, of: &'a ast::Exchange, span: Span, scope: &mut Scope) -> Option<Exchange> {
        let mut sends = Vec::with_capacity(of.sends.len());
        for text in &of.sends {
            sends.push(self.template(text, scope)?);
        }
        let expects = match &of.expects {
            Some(pattern) => Some(self.pattern(pattern)?.0),
            None => None,
        };
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

    /// A text to send.
    pub(super) fn template(&mut self, text: &'a ast::Text, scope: &mut Scope) -> Option<Template> {
        let mut pieces = Vec::new();
        for part in &text.parts {
            let (value, digits) = match part {
                TextPart::Plain(text) => {
                    pieces.push(Piece::Plain(text.clone()));
                    continue;
                }
                TextPart::Value { value, digits } => (value, *digits),
            };
            pieces.push(match self.lab.expr(value, scope) {
                Value::Error => return None,
                Value::Num(n) if matches!(&*value.kind, ExprKind::As(..)) || n.dimension.is_one() => {
                    let unit = n.unit.filter(|_| matches!(&*value.kind, ExprKind::As(..)));
                    Piece::Number { value: n.node, unit: unit.map_or_else(Unit::one, Arc::unwrap_or_clone), digits }
                }
                Value::Num(n) => {
                    let unit = self.lab.shown(&n).symbol;
                    let headline = "a device is sent a number: say in which unit";
                    let d = Diagnostic::error(codes::DRIVER_LINE, value.span, headline, "no unit");
                    self.lab.report(d.help(format!("write `{{... as {unit}}}`")));
                    return None;
                }
                Value::Enum(node, words) => Piece::Word(node, words.to_vec()),
                Value::Bool(node) => Piece::Word(node, vec!["false".to_string(), "true".to_string()]),
                Value::Text(text) => Piece::Plain(text),
                Value::Instance(i) | Value::Qualified(i, _) => {
                    Piece::Plain(self.lab.instances[i.0 as usize].name.clone())
                }
                Value::Nothing if self.lenient => return None,
                Value::Nothing | Value::Unlimited => {
                    let headline = "what a device is to be sent is not given in this lab";
                    let d = Diagnostic::error(codes::DRIVER_LINE, value.span, headline, "not given");
                    self.lab.report(d.help("give it where the device is declared, or in a `between` line"));
                    return None;
                }
                other => {
                    self.lab.expected("a quantity or a word", &other, value.span);
                    return None;
                }
            });
        }
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
        let id = scope.this?;
        let name = path.segments.last()?;
        let live = std::mem::replace(&mut self.lab.readings_live, true);
        let mut value = Value::Instance(id);
        for segment in &path.segments {
            value = self.lab.member(value, segment);
        }
        self.lab.readings_live = live;
        let asks = self.template(asks, scope)?;
        let (text, bounds) = bounded(&expects.text);
        let bounds = match bounds {
            Some(Err(why)) => {
                let d = Diagnostic::error(codes::DRIVER_LINE, expects.span, why, "what can it show?");
                self.lab.report(d.help("write two numbers in the unit before them, as in `{degC in -50 .. 400}`"));
                return None;
            }
            Some(Ok(bounds)) => Some(bounds),
            None => None,
        };
        let (expects, dimensions) = self.pattern(&ast::Pattern { text, span: expects.span })?;
        let n = match value {
            Value::Error => return None,
            Value::Num(n) => n,
            other => {
                self.lab.expected("a quantity that a device can tell", &other, name.span);
                return None;
            }
        };
        let [dimension] = dimensions.as_slice() else {
            let headline = format!("the reply must say once what `{}` is", name.text);
            let d =
                Diagnostic::error(codes::DRIVER_LINE, expects.span, headline, format!("{} values", dimensions.len()));
            self.lab.report(d.help("write the unit in braces where the number stands, as in `\"{degC} 2\"`"));
            return None;
        };
        if *dimension != n.dimension {
            let wanted = self.lab.tables.units.describe(&n.dimension, n.point);
            let headline = format!("`{}` is {wanted}, which the unit of this reply is not", name.text);
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
            asks,
            expects,
            shows,
            also: Vec::new(),
            span,
        })
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
        Slot::Number(unit) => Some(unit),
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
    let bounds = range.split_once("..").and_then(|(least, most)| Some([number(least)?, number(most)?]));
    let bounds = bounds.filter(|[least, most]| least < most);
    let whole = format!("{before}{{{}{after}", unit.trim());
    (whole, Some(bounds.ok_or_else(|| format!("`{}` are not the least and the most of something", range.trim()))))
}
