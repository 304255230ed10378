//! Comparisons, ranges, membership; each notes what it compared, for reports.

use matterix_ir::plan::Comparison;
use matterix_ir::{BinaryOp, Diagnostic, Leaves, NodeId, Span, UnaryOp, Unit, codes};

use super::{Num, Scope, Value};
use crate::ast::{Binary, Expr, ExprKind, Unary, UnitText};
use crate::declare::units::unit_error;
use crate::eval::lab::{Compared, Elaborator};

impl<'a> Elaborator<'a> {
    /// A truth value's node, or a report.
    pub fn truth(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<NodeId> {
        match self.expr(e, scope) {
            Value::Bool(n) => Some(n),
            Value::Error => None,
            other => {
                self.expected("a condition", &other, e.span);
                None
            }
        }
    }

    /// `a op b` for comparisons.
    pub fn compare(&mut self, op: Binary, a: Value, b: Value, at_a: Span, at_b: Span) -> Value {
        if let Some(node) = self.same_instance(&a, &b) {
            return self.equality(op, node, at_a);
        }
        if let (Value::Bool(x), Value::Bool(y)) = (&a, &b) {
            let node = self.graph.binary(BinaryOp::Eq, *x, *y);
            return self.equality(op, node, at_a);
        }
        if let (Value::Text(x), Value::Text(y)) = (&a, &b) {
            let node = self.graph.number(f64::from(u8::from(x == y)));
            return self.equality(op, node, at_a);
        }
        if let (Value::Species(x), Value::Species(y)) = (&a, &b) {
            let node = self.graph.number(f64::from(u8::from(x == y)));
            return self.equality(op, node, at_a);
        }
        // A thing that may have no material has `nothing` there.
        if let (Value::Material(_), Value::Material(_) | Value::Nothing) | (Value::Nothing, Value::Material(_)) =
            (&a, &b)
        {
            let same = matches!((&a, &b), (Value::Material(x), Value::Material(y)) if x == y);
            let node = self.graph.number(f64::from(u8::from(same)));
            return self.equality(op, node, at_a);
        }
        if let (Value::Enum(..), Value::Enum(..)) = (&a, &b) {
            return match self.same_word(&a, &b, at_a, at_b) {
                Some(node) => self.equality(op, node, at_a),
                None => Value::Error,
            };
        }
        // `x == 5 g +- 0.1 g`.
        if let (Binary::Eq | Binary::Ne, Value::Range(..)) = (op, &b) {
            return match self.inside(a, b, at_a, at_b) {
                Value::Bool(node) => self.equality(op, node, at_a),
                other => other,
            };
        }
        let Some((x, y)) = self.comparable(a, b, at_a, at_b) else { return Value::Error };
        let node = match op {
            Binary::Lt => self.graph.binary(BinaryOp::Lt, x.node, y.node),
            Binary::Le => self.graph.binary(BinaryOp::Le, x.node, y.node),
            Binary::Gt => self.graph.binary(BinaryOp::Lt, y.node, x.node),
            Binary::Ge => self.graph.binary(BinaryOp::Le, y.node, x.node),
            _ => {
                let node = self.graph.binary(BinaryOp::Eq, x.node, y.node);
                if op == Binary::Eq {
                    self.compared_equal(&x, &y, at_a, at_b);
                }
                return self.equality(op, node, at_a);
            }
        };
        let upper = matches!(op, Binary::Lt | Binary::Le);
        let strict = matches!(op, Binary::Lt | Binary::Gt);
        // The side that is a constant is the limit.
        let (value, limit, span, upper) = if self.is_fixed(x.node) && !self.is_fixed(y.node) {
            (&y, &x, at_b, !upper)
        } else {
            (&x, &y, at_a, upper)
        };
        let (low, high) = if upper { (None, Some(limit.node)) } else { (Some(limit.node), None) };
        let unit = self.unit_between(value, limit);
        let value = value.node;
        let comparison = Comparison { text: String::new(), value, low, high, strict, unit };
        self.compared(span, comparison);
        Value::Bool(node)
    }

    /// Notes that two quantities are compared that should be equal: the side that is a constant is both limits.
    fn compared_equal(&mut self, x: &Num, y: &Num, at_x: Span, at_y: Span) {
        let (value, limit, span) =
            if self.is_fixed(x.node) && !self.is_fixed(y.node) { (y, x, at_y) } else { (x, y, at_x) };
        let unit = self.unit_between(value, limit);
        let (low, high) = (Some(limit.node), Some(limit.node));
        let comparison = Comparison { text: String::new(), value: value.node, low, high, strict: false, unit };
        self.compared(span, comparison);
    }

    fn compared(&mut self, span: Span, comparison: Comparison) {
        if let Some(observed) = &mut self.observed {
            observed.compared.push(Compared { span, comparison, each: Vec::new() });
        }
    }

    fn equality(&mut self, op: Binary, node: NodeId, span: Span) -> Value {
        match op {
            Binary::Eq => Value::Bool(node),
            Binary::Ne => Value::Bool(self.graph.unary(UnaryOp::Not, node)),
            _ => {
                self.report(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    span,
                    "only quantities have an order",
                    "compare with `==` or `!=`",
                ));
                Value::Error
            }
        }
    }

    fn is_fixed(&self, node: NodeId) -> bool {
        !self.graph.leaves(node).meets(Leaves::LIVE)
    }

    /// The unit a comparison is shown in: that of its limit, where it has one.
    fn unit_between(&self, value: &Num, limit: &Num) -> Unit {
        limit.unit.as_deref().cloned().unwrap_or_else(|| self.unit_of(value))
    }

    /// The unit a quantity is shown in: the one it was written in, where there is one.
    pub fn unit_of(&self, n: &Num) -> Unit {
        n.unit.as_deref().cloned().unwrap_or_else(|| self.shown(n))
    }

    /// The unit a quantity is shown in where the user gave none.
    pub fn shown(&self, n: &Num) -> Unit {
        if n.point
            && let Some(unit) = self.tables.units.preferred_point(&n.dimension)
        {
            return unit;
        }
        self.tables.si(&n.dimension)
    }

    fn same_instance(&mut self, a: &Value, b: &Value) -> Option<NodeId> {
        let node = |this: &mut Self, v: &Value| match v {
            Value::Instance(i) | Value::Qualified(i, _) => Some(this.graph.number(f64::from(i.0))),
            Value::InstanceNode(n) => Some(*n),
            Value::Nothing => Some(this.graph.number(-1.0)),
            _ => None,
        };
        let (x, y) = (node(self, a)?, node(self, b)?);
        Some(match self.never_the_same(x, y) {
            true => self.graph.number(0.0),
            false => self.graph.binary(BinaryOp::Eq, x, y),
        })
    }

    /// Two quantities of one dimension and scale; a concentration takes its kind from the other side.
    fn comparable(&mut self, a: Value, b: Value, at_a: Span, at_b: Span) -> Option<(Num, Num)> {
        let (a, b) = match (a, b) {
            (Value::Concentration(m, s), Value::Num(n)) => (self.concentration(m, s, &n, at_a)?, Value::Num(n)),
            (Value::Num(n), Value::Concentration(m, s)) => {
                let c = self.concentration(m, s, &n, at_b)?;
                (Value::Num(n), c)
            }
            (a @ Value::Concentration(..), Value::Concentration(..)) => {
                self.kindless(at_a);
                let _ = a;
                return None;
            }
            other => other,
        };
        let (mut x, mut y) = match (a, b) {
            (Value::Num(x), Value::Num(y)) => (x, y),
            (Value::Num(x), Value::Unlimited) => {
                let y = Num { node: self.graph.number(f64::INFINITY), literal: false, unit: None, ..x.clone() };
                (x, y)
            }
            (Value::Error, _) | (_, Value::Error) => return None,
            (Value::Num(_), other) => {
                self.expected("a quantity", &other, at_b);
                return None;
            }
            (other, _) => {
                self.expected("a quantity", &other, at_a);
                return None;
            }
        };
        self.absolute(&mut x, &mut y);
        if !x.dimension.agrees(&y.dimension) {
            let (p, q) = (self.describe(&x), self.describe(&y));
            let mut d = Diagnostic::error(
                codes::UNIT_MISMATCH,
                at_b,
                format!("{p} cannot be compared with {q}"),
                format!("this is {q}"),
            )
            .because(at_a, format!("this is {p}"));
            if y.dimension.is_one() && y.literal {
                // A bare number beside a temperature is hardly meant in kelvin.
                let usual = if x.point { "degC".to_owned() } else { self.tables.units.symbol(&x.dimension) };
                d = d.help(format!("give the number a unit: `{usual}`"));
            }
            self.report(d);
            return None;
        }
        if x.point != y.point && !x.dimension.is_any() && !y.dimension.is_any() {
            let span = if x.point { at_b } else { at_a };
            self.report(
                Diagnostic::error(
                    codes::TEMPERATURE_POINT,
                    span,
                    "a temperature cannot be compared with a difference",
                    "this is a difference",
                )
                .help("a temperature is written in `degC`, or as one literal in `K`"),
            );
            return None;
        }
        Some((x, y))
    }

    /// A literal in kelvin takes the point type of the other side.
    fn absolute(&self, x: &mut Num, y: &mut Num) {
        if x.point && !y.point && y.literal && x.dimension == y.dimension {
            y.point = true;
        }
        if y.point && !x.point && x.literal && x.dimension == y.dimension {
            x.point = true;
        }
    }

    /// `low .. high`.
    pub fn range(&mut self, low: Value, high: Value, at_low: Span, at_high: Span) -> Value {
        let unlimited = |v: &Value, n: &Num, this: &mut Self, sign: f64| match v {
            Value::Unlimited => {
                Some(Num { node: this.graph.number(sign * f64::INFINITY), literal: false, ..n.clone() })
            }
            _ => None,
        };
        let (a, b) = match (&low, &high) {
            (Value::Unlimited, Value::Num(n)) => (unlimited(&low, n, self, -1.0), Some(n.clone())),
            (Value::Num(n), Value::Unlimited) => (Some(n.clone()), unlimited(&high, n, self, 1.0)),
            _ => match self.comparable(low, high, at_low, at_high) {
                Some((a, b)) => (Some(a), Some(b)),
                None => return Value::Error,
            },
        };
        let (Some(a), Some(b)) = (a, b) else { return Value::Error };
        if let (Some(x), Some(y)) = (self.graph.constant(a.node), self.graph.constant(b.node))
            && x > y
        {
            let headline = "this range is empty: its lower end is above its upper end";
            let d = Diagnostic::error(codes::EMPTY_RANGE, at_low.to(at_high), headline, "no value is in it");
            self.report(d.help("write the lower end first"));
            return Value::Error;
        }
        Value::Range(Box::new(a), Box::new(b))
    }

    /// `x in range` or `x in list`.
    pub fn inside(&mut self, x: Value, set: Value, at_x: Span, at_set: Span) -> Value {
        match self.listed(set) {
            Value::Range(low, high) => {
                let Some((value, low)) = self.comparable(x.clone(), Value::Num(*low), at_x, at_set) else {
                    return Value::Error;
                };
                let Some((_, high)) = self.comparable(x, Value::Num(*high), at_x, at_set) else { return Value::Error };
                let above = self.graph.binary(BinaryOp::Le, low.node, value.node);
                let below = self.graph.binary(BinaryOp::Le, value.node, high.node);
                let unit = self.unit_between(&value, &low);
                // An end that no value is beyond is none.
                let end = |node, none| Some(node).filter(|node| self.graph.constant(*node) != Some(none));
                let (low, high) = (end(low.node, f64::NEG_INFINITY), end(high.node, f64::INFINITY));
                let value = value.node;
                let comparison = Comparison { text: String::new(), value, low, high, strict: false, unit };
                self.compared(at_x, comparison);
                Value::Bool(self.graph.binary(BinaryOp::And, above, below))
            }
            Value::List(items) => {
                let mut any = self.graph.number(0.0);
                for item in items {
                    // None of them alone is a limit.
                    let one = self.define(|lab| lab.compare(Binary::Eq, x.clone(), item, at_x, at_set));
                    let Value::Bool(one) = one else { return Value::Error };
                    any = self.graph.binary(BinaryOp::Or, any, one);
                }
                Value::Bool(any)
            }
            Value::Error => Value::Error,
            other => self.expected("a range or a list", &other, at_set),
        }
    }

    /// `x is word`: a truth value among the members of x.
    pub fn is(&mut self, a: &'a Expr, b: &'a Expr, scope: &mut Scope) -> Value {
        if let ExprKind::Unary(Unary::Not, _) = &*b.kind {
            let headline = "`not` stands before the condition";
            let d = Diagnostic::error(codes::TYPE_MISMATCH, b.span, headline, "not a word that a value can be");
            self.report(d.help("write `not (x is active)` for `x is not active`"));
            return Value::Error;
        }
        let value = self.expr(a, scope);
        if let Value::Enum(..) = value {
            let word = self.like(b, &value, scope);
            return self.compare(Binary::Eq, value, word, a.span, b.span);
        }
        let (base, word) = match (&value, &*b.kind) {
            (Value::Error, _) => return Value::Error,
            (Value::Instance(i) | Value::Qualified(i, _), ExprKind::Name(word)) => (*i, word),
            _ => {
                self.report(crate::declare::types::unsupported(b.span, "`is` conditions on this value"));
                return Value::Error;
            }
        };
        if !self.has_member(base, &word.text)
            && let Some(value) = self.is_word(base, word)
        {
            return value;
        }
        match self.member(Value::Instance(base), word) {
            v @ (Value::Bool(_) | Value::Error) => v,
            other => self.expected("a truth value", &other, b.span),
        }
    }

    /// `x as unit`: the value of that dimension, shown in that unit.
    pub fn as_unit(&mut self, value: Value, unit: &UnitText, span: Span) -> Value {
        let resolved = match self.tables.unit(&unit.text) {
            Ok(r) => r,
            Err(error) => {
                self.report(unit_error(unit, error));
                return Value::Error;
            }
        };
        let wanted = Num {
            node: self.graph.number(resolved.unit.to_si(1.0)),
            dimension: resolved.dimension,
            point: resolved.point,
            unit: Some(resolved.unit.clone()),
            literal: true,
        };
        match self.comparable(value, Value::Num(wanted), span, unit.span) {
            Some((x, _)) => Value::Num(Num { unit: Some(resolved.unit), ..x }),
            None => Value::Error,
        }
    }
}
