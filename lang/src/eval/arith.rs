//! Arithmetic: dimensions follow the values; points and differences keep apart.

use matterix_ir::{BinaryOp, Diagnostic, Span, UnaryOp, codes};

use super::{Num, Scope, Value};
use crate::ast::{Binary, Expr};
use crate::declare::units::exponent;
use crate::eval::lab::Elaborator;
use crate::units::Dimension;

impl<'a> Elaborator<'a> {
    /// `a op b` for `+ - * /`.
    pub fn arith(&mut self, op: Binary, a: Value, b: Value, at_a: Span, at_b: Span, span: Span) -> Value {
        if let (Value::Tuple(x), Value::Tuple(y)) = (&a, &b)
            && x.len() == y.len()
            && matches!(op, Binary::Add | Binary::Sub)
        {
            let pairs: Vec<_> = x.iter().cloned().zip(y.iter().cloned()).collect();
            return Value::Tuple(pairs.into_iter().map(|(x, y)| self.arith(op, x, y, at_a, at_b, span)).collect());
        }
        let (a, b) = match op {
            Binary::Mul | Binary::Div => (a, b),
            _ => self.of_one_kind(a, b, at_a, at_b),
        };
        let (Some(a), Some(b)) = (self.operand(a, at_a), self.operand(b, at_b)) else { return Value::Error };
        match op {
            Binary::Mul | Binary::Div => self.product(op, a, b, at_a, at_b),
            _ => self.sum(op, a, b, at_a, at_b, span),
        }
    }

    /// Two operands of a sum; a concentration without a kind takes it from the other side, where that says one.
    fn of_one_kind(&mut self, a: Value, b: Value, at_a: Span, at_b: Span) -> (Value, Value) {
        let says = |n: &Num| n.unit.is_some() || !(n.dimension.is_any() || n.dimension.is_one());
        match (a, b) {
            (Value::Concentration(m, s), Value::Num(n)) if says(&n) => {
                (self.concentration(m, s, &n, at_a).unwrap_or(Value::Error), Value::Num(n))
            }
            (Value::Num(n), Value::Concentration(m, s)) if says(&n) => {
                let b = self.concentration(m, s, &n, at_b).unwrap_or(Value::Error);
                (Value::Num(n), b)
            }
            other => other,
        }
    }

    /// A quantity to calculate with, or a report.
    fn operand(&mut self, value: Value, span: Span) -> Option<Num> {
        match value {
            Value::Num(n) => Some(n),
            Value::Unlimited => Some(Num {
                node: self.graph.number(f64::INFINITY),
                dimension: Dimension::any(),
                point: false,
                unit: None,
                literal: false,
            }),
            Value::Error => None,
            Value::Concentration(..) => {
                let help = "choose one by its unit, in brackets: `(... as mol/L)`, `(... as mol/kg)`, `(... as mol/kg_solvent)`, `(... as %w/w)`; without brackets `as` applies to the whole expression";
                self.without_kind(span, help);
                None
            }
            other => {
                self.expected("a quantity", &other, span);
                None
            }
        }
    }

    /// `v[S]` used before a unit says which concentration is meant.
    pub fn kindless(&mut self, span: Span) {
        self.without_kind(span, "choose one by its unit: `as mol/L`, `as mol/kg`, `as mol/kg_solvent`, `as %w/w`");
    }

    fn without_kind(&mut self, span: Span, help: &str) {
        let headline = "the kind of this concentration is open";
        let d = Diagnostic::error(codes::CONCENTRATION_KIND, span, headline, "per mass, per volume or per solvent?");
        self.report(d.help(help));
    }

    fn product(&mut self, op: Binary, a: Num, b: Num, at_a: Span, at_b: Span) -> Value {
        for (n, span) in [(&a, at_a), (&b, at_b)] {
            if n.point {
                self.report(
                    Diagnostic::error(
                        codes::TEMPERATURE_POINT,
                        span,
                        "a temperature on a scale cannot be multiplied or divided",
                        "a temperature, not a difference",
                    )
                    .help("use `kelvin(...)` for the absolute value, or subtract another temperature first"),
                );
                return Value::Error;
            }
        }
        let (node, dimension) = if op == Binary::Mul {
            (self.graph.binary(BinaryOp::Mul, a.node, b.node), a.dimension.times(&b.dimension))
        } else {
            (self.graph.binary(BinaryOp::Div, a.node, b.node), a.dimension.over(&b.dimension))
        };
        self.note_place(node, at_a.to(at_b));
        let unit = if b.dimension.is_one() { a.unit } else { None };
        Value::Num(Num { node, dimension, point: false, unit, literal: false })
    }

    fn sum(&mut self, op: Binary, a: Num, b: Num, at_a: Span, at_b: Span, span: Span) -> Value {
        if !a.dimension.agrees(&b.dimension) {
            return self.mismatch(op, &a, &b, at_a, at_b);
        }
        let adding = op == Binary::Add;
        let point = match (a.point, b.point, adding) {
            (true, true, true) => {
                self.report(
                    Diagnostic::error(
                        codes::TEMPERATURE_POINT,
                        span,
                        "two temperatures cannot be added",
                        "both are temperatures on a scale",
                    )
                    .because(at_b, "a difference is written in `K`")
                    .help("add a difference: `80 degC + 20 K`"),
                );
                return Value::Error;
            }
            (false, true, false) => {
                self.report(
                    Diagnostic::error(
                        codes::TEMPERATURE_POINT,
                        span,
                        "a temperature cannot be subtracted from a difference",
                        "the right side is a temperature on a scale",
                    )
                    .help("a difference is written in `K`"),
                );
                return Value::Error;
            }
            (true, true, false) => false,
            (x, y, _) => x || y,
        };
        let op = if adding { BinaryOp::Add } else { BinaryOp::Sub };
        let node = self.graph.binary(op, a.node, b.node);
        let unit = if point == a.point {
            a.unit
        } else if point == b.point {
            b.unit
        } else {
            None
        };
        let dimension = if a.dimension.is_any() { b.dimension } else { a.dimension };
        Value::Num(Num { node, dimension, point, unit, literal: false })
    }

    fn mismatch(&mut self, op: Binary, a: &Num, b: &Num, at_a: Span, at_b: Span) -> Value {
        let (x, y) = (self.describe(a), self.describe(b));
        let verb = if op == Binary::Add { "added to" } else { "subtracted from" };
        let (left, right) = if op == Binary::Add { (&x, &y) } else { (&y, &x) };
        let mut d = Diagnostic::error(
            codes::UNIT_MISMATCH,
            at_b,
            format!("{left} cannot be {verb} {right}"),
            format!("this is {y}"),
        )
        .because(at_a, format!("this is {x}"));
        if b.dimension.is_one() && b.literal {
            d = d.help(format!("give the number a unit: `{}`", self.tables.units.symbol(&a.dimension)));
        }
        self.report(d);
        Value::Error
    }

    /// A quantity in words: its dimension.
    pub fn describe(&self, n: &Num) -> String {
        self.tables.units.describe(&n.dimension, n.point)
    }

    /// `a ^ b`: the exponent is a constant where the base has a dimension.
    pub fn power(&mut self, a: &'a Expr, b: &'a Expr, scope: &mut Scope) -> Value {
        let (base, power) = (self.expr(a, scope), self.expr(b, scope));
        let (Some(base), Some(power)) = (self.operand(base, a.span), self.operand(power, b.span)) else {
            return Value::Error;
        };
        if base.point || power.point {
            let span = if base.point { a.span } else { b.span };
            self.report(
                Diagnostic::error(
                    codes::TEMPERATURE_POINT,
                    span,
                    "a temperature on a scale has no powers",
                    "a temperature",
                )
                .help("use `kelvin(...)` for the absolute value"),
            );
            return Value::Error;
        }
        if !power.dimension.agrees(&Dimension::one()) {
            let found = self.describe(&power);
            self.report(Diagnostic::error(
                codes::UNIT_MISMATCH,
                b.span,
                "an exponent must be a plain number",
                format!("this is {found}"),
            ));
            return Value::Error;
        }
        let known =
            exponent(b).or_else(|| self.graph.constant(power.node).and_then(crate::units::Rational::approximate));
        let dimension = match known {
            Some(e) => base.dimension.power(e),
            None if base.dimension.is_one() => Dimension::one(),
            None if base.dimension.is_any() || power.dimension.is_any() => Dimension::any(),
            None => {
                self.report(Diagnostic::error(
                    codes::UNIT_MISMATCH,
                    b.span,
                    "the power of a quantity with a unit needs a constant exponent",
                    "not a constant",
                ));
                return Value::Error;
            }
        };
        let node = self.graph.binary(BinaryOp::Pow, base.node, power.node);
        self.note_place(node, a.span.to(b.span));
        self.num(node, dimension)
    }

    /// The smaller or larger of two quantities of one dimension.
    pub fn extreme(&mut self, op: BinaryOp, a: Value, b: Value, span: Span) -> Value {
        let (a, b) = self.of_one_kind(a, b, span, span);
        let (Some(a), Some(b)) = (self.operand(a, span), self.operand(b, span)) else { return Value::Error };
        if !a.dimension.agrees(&b.dimension) || a.point != b.point {
            let (x, y) = (self.describe(&a), self.describe(&b));
            self.report(Diagnostic::error(
                codes::UNIT_MISMATCH,
                span,
                format!("{x} cannot be compared with {y}"),
                "different dimensions",
            ));
            return Value::Error;
        }
        let node = self.graph.binary(op, a.node, b.node);
        let dimension = if a.dimension.is_any() { b.dimension } else { a.dimension };
        Value::Num(Num { node, dimension, point: a.point, unit: a.unit, literal: false })
    }

    /// `-x` of a quantity.
    pub fn negative(&mut self, value: Value) -> Value {
        match value {
            Value::Num(n) => Value::Num(Num { node: self.graph.unary(UnaryOp::Neg, n.node), literal: false, ..n }),
            other => other,
        }
    }
}
