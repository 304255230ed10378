//! Whether a value may stand where a type is expected.

use matterix_ir::{Diagnostic, Span, codes};

use super::{Num, Value, known_too_late};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::near;

impl Elaborator<'_> {
    /// The value as the type, or a report; `what` names the place in messages.
    pub fn coerce(&mut self, value: Value, ty: &Type, span: Span, what: &str) -> Value {
        match (value, ty) {
            (Value::Error, _) => Value::Error,
            (value, Type::Any) => value,
            (Value::Num(n), Type::Int) => self.coerce_whole(n, span, what),
            (Value::Num(n), Type::Quantity { .. }) => self.coerce_quantity(n, ty, span, what),
            (Value::Concentration(m, s), Type::Quantity { dimension, .. }) => {
                let probe = Num {
                    node: self.graph.number(1.0),
                    dimension: dimension.clone(),
                    point: false,
                    unit: None,
                    literal: false,
                };
                self.concentration(m, s, &probe, span).unwrap_or(Value::Error)
            }
            (Value::Enum(node, words), Type::Enum(wanted)) if words == *wanted => Value::Enum(node, words),
            (Value::Unlimited, Type::Quantity { dimension, point, optional: true }) => {
                let node = self.graph.number(f64::INFINITY);
                Value::Num(Num { node, dimension: dimension.clone(), point: *point, unit: None, literal: false })
            }
            (v @ Value::Bool(_), Type::Bool)
            | (v @ Value::Text(_), Type::Text)
            | (v @ Value::Place(_), Type::Place)
            | (v @ Value::Species(_), Type::Species)
            | (v @ Value::Reaction(_), Type::Reaction)
            | (v @ Value::Material(_), Type::Material { .. })
            | (v @ Value::Nothing, Type::Material { optional: true })
            | (v @ Value::Frame(..), Type::Frame)
            | (v @ Value::Nothing, Type::Instance { optional: true, .. })
            | (v @ Value::InstanceNode(_), Type::Instance { .. }) => v,
            // An instance stands for its own place.
            (Value::Instance(i), Type::Frame) => Value::Frame(i, String::new()),
            (Value::Instance(i) | Value::Qualified(i, _), Type::Instance { kinds, .. }) => {
                self.coerce_instance(i, kinds, ty, span, what)
            }
            (Value::Range(a, b), Type::Range(inner)) => {
                let low = self.coerce(Value::Num(*a), inner, span, what);
                let high = self.coerce(Value::Num(*b), inner, span, what);
                match (low, high) {
                    (Value::Num(a), Value::Num(b)) => Value::Range(Box::new(a), Box::new(b)),
                    _ => Value::Error,
                }
            }
            (value @ Value::Grid(..), Type::List(_)) => {
                let value = self.listed(value);
                self.coerce(value, ty, span, what)
            }
            // One thing, or one number, is a list of one.
            (value @ (Value::Instance(_) | Value::Qualified(..) | Value::Num(_)), Type::List(inner))
                if !matches!(value, Value::Num(_)) || matches!(**inner, Type::Quantity { .. } | Type::Int) =>
            {
                match self.coerce(value, inner, span, what) {
                    Value::Error => Value::Error,
                    one => Value::List(vec![one]),
                }
            }
            (Value::List(items), Type::List(inner)) => {
                let items = flattened(items, inner);
                if **inner == Type::Any && !items.contains(&Value::Error) {
                    return Value::List(items);
                }
                let items: Vec<Value> = items.into_iter().map(|i| self.coerce(i, inner, span, what)).collect();
                if items.contains(&Value::Error) { Value::Error } else { Value::List(items) }
            }
            (Value::Tuple(items), Type::Color) if items.len() == 3 => {
                Value::Tuple(items.into_iter().map(|i| self.coerce(i, &Type::ratio(), span, what)).collect())
            }
            (Value::InstanceNode(_), Type::List(_)) => {
                self.report(known_too_late(&format!("`{what}`"), span));
                Value::Error
            }
            (other, _) => {
                let expected = self.tables.type_name(ty);
                let found = match &other {
                    Value::Num(n) => self.describe(n),
                    Value::Enum(_, words) => format!("one of {}", crate::declare::types::list(words)),
                    v => v.what().to_string(),
                };
                self.report(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    span,
                    format!("`{what}` expects {expected}, found {found}"),
                    format!("this is {found}"),
                ));
                Value::Error
            }
        }
    }

    fn coerce_whole(&mut self, n: Num, span: Span, what: &str) -> Value {
        let value = self.coerce_quantity(n, &Type::ratio(), span, what);
        if let Value::Num(n) = &value
            && let Some(v) = self.glance(n.node).filter(|v| v.is_finite() && v.fract() != 0.0)
        {
            let found = matterix_ir::quantity::show_number(v);
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                span,
                format!("`{what}` expects a whole number, found {found}"),
                "not a whole number",
            ));
            return Value::Error;
        }
        value
    }

    fn coerce_quantity(&mut self, n: Num, ty: &Type, span: Span, what: &str) -> Value {
        let Type::Quantity { dimension, point, .. } = ty else { return Value::Error };
        if !n.dimension.agrees(dimension) {
            let expected = self.tables.units.describe(dimension, *point);
            let found = self.describe(&n);
            let mut d = Diagnostic::error(
                codes::UNIT_MISMATCH,
                span,
                format!("`{what}` expects {expected}, found {found}"),
                format!("this is {found}"),
            );
            let written = n.unit.as_ref().filter(|_| n.literal).map_or("", |unit| unit.symbol.as_str());
            let meant = match written {
                "" => Vec::new(),
                written => self.tables.units.short_for(written, dimension, *point),
            };
            if let [meant] = meant.as_slice() {
                let start = span.end.saturating_sub(written.len() as u32).max(span.start);
                d = d.help(format!("did you mean `{meant}`?"));
                d = d.guess(format!("replace with `{meant}`"), Span { start, ..span }, *meant);
            } else if n.dimension.is_one() && n.literal {
                // A bare number for a temperature is hardly meant in kelvin.
                let usual = if *point { self.type_unit(ty).symbol } else { self.tables.units.symbol(dimension) };
                d = d.help(format!("give the number a unit, such as `{usual}`"));
            } else if let Some(hint) = self.tables.units.hint(&n.dimension, dimension) {
                d = d.help(hint);
            }
            self.report(d);
            return Value::Error;
        }
        if *point && !n.point && !n.dimension.is_any() {
            // `353 K` as one literal is a temperature where one is expected.
            if n.literal {
                return Value::Num(Num { point: true, ..n });
            }
            self.report(
                Diagnostic::error(
                    codes::TEMPERATURE_POINT,
                    span,
                    format!("`{what}` expects a temperature, found a difference"),
                    "this is a difference",
                )
                .help("add it to a temperature: `25 degC + 10 K`"),
            );
            return Value::Error;
        }
        if !*point && n.point {
            let mut d = Diagnostic::error(
                codes::TEMPERATURE_POINT,
                span,
                format!("`{what}` expects a difference, found a temperature"),
                "this is a temperature on a scale",
            );
            d = d.help("a difference of temperatures is written in `K`");
            self.report(d);
            return Value::Error;
        }
        let dimension = if n.dimension.is_any() { dimension.clone() } else { n.dimension.clone() };
        Value::Num(Num { dimension, point: *point, ..n })
    }

    fn coerce_instance(
        &mut self,
        id: matterix_ir::scene::InstanceId,
        kinds: &[crate::names::DeclId],
        ty: &Type,
        span: Span,
        what: &str,
    ) -> Value {
        let Some(&missing) = kinds.iter().find(|k| !self.instance_is(id, **k)) else { return Value::Instance(id) };
        let inst = &self.instances[id.0 as usize];
        let (name, kind, declared) = (inst.name.clone(), self.kind_names(id), inst.span);
        let wanted = self.tables.type_name(ty);
        let mut fitting: Vec<String> = (0..self.instances.len() as u32)
            .map(matterix_ir::scene::InstanceId)
            .filter(|i| kinds.iter().all(|k| self.instance_is(*i, *k)))
            .map(|i| self.instances[i.0 as usize].name.clone())
            .collect();
        fitting.truncate(3);
        let mut d = Diagnostic::error(
            codes::TYPE_MISMATCH,
            span,
            format!("`{what}` expects {wanted}, but `{name}` is {kind}"),
            format!("`{name}` is not a {}", self.tables.kind_name(missing)),
        )
        .because(declared, format!("`{name}` is declared here"));
        let places = self.grid_of(&Value::Instance(id)).and_then(|(id, grid)| self.first_place(id, grid));
        if let Some((place, child)) = places
            && kinds.iter().all(|k| self.instance_is(child, *k))
        {
            d = d.help(format!("name one of its places: `{name}[{place}]`"));
        } else if !fitting.is_empty() {
            d.help.extend(near::question(&fitting));
        }
        self.report(d);
        Value::Error
    }
}

/// Lists of lists as one list, where elements are no lists themselves: `plate.columns` are wells, column by column.
fn flattened(items: Vec<Value>, inner: &Type) -> Vec<Value> {
    if matches!(inner, Type::List(_) | Type::Any) || !items.iter().any(|i| matches!(i, Value::List(_))) {
        return items;
    }
    items.into_iter().flat_map(Value::flat).collect()
}
