//! Flat chains of operands and operators, shaped by precedence.

use matterix_ir::{Diagnostic, codes};

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower,
};
use crate::ast::{Binary, Expr, ExprKind, Unary};

/// Binding strengths, loosest first.
const OR: u8 = 1;
const AND: u8 = 2;
const NOT: u8 = 3;
const COMPARE: u8 = 4;
const AS: u8 = 5;
const RANGE: u8 = 6;
const PLUS_MINUS: u8 = 7;
const ADD: u8 = 8;
const MUL: u8 = 9;
const NEG: u8 = 10;
const POW: u8 = 11;

/// What stands between two operands.
#[derive(Clone, Copy, PartialEq)]
enum Infix {
    Binary(Binary),
    Range,
}

impl Infix {
    fn of(text: &str) -> Option<(u8, Infix)> {
        let (strength, op) = match text {
            ".." => return Some((RANGE, Infix::Range)),
            "or" => (OR, Binary::Or),
            "and" => (AND, Binary::And),
            "==" => (COMPARE, Binary::Eq),
            "!=" => (COMPARE, Binary::Ne),
            "<" => (COMPARE, Binary::Lt),
            "<=" => (COMPARE, Binary::Le),
            ">" => (COMPARE, Binary::Gt),
            ">=" => (COMPARE, Binary::Ge),
            "in" => (COMPARE, Binary::In),
            "is" => (COMPARE, Binary::Is),
            "+-" => (PLUS_MINUS, Binary::PlusMinus),
            "+" => (ADD, Binary::Add),
            "-" => (ADD, Binary::Sub),
            "*" => (MUL, Binary::Mul),
            "/" => (MUL, Binary::Div),
            "^" => (POW, Binary::Pow),
            _ => return None,
        };
        Some((strength, Infix::Binary(op)))
    }

    fn join(self, left: Expr, right: Expr) -> Expr {
        let span = left.span.to(right.span);
        let kind = match self {
            Infix::Binary(op) => ExprKind::Binary(op, left, right),
            Infix::Range => ExprKind::Range(left, right),
        };
        Expr { kind: Box::new(kind), span }
    }
}

impl Lower<'_> {
    /// A `cond` or an `operand`.
    pub(super) fn chain(&mut self, node: Node) -> Expr {
        let links = node
            .clone()
            .into_inner()
            .filter(|p| !matches!(p.as_rule(), Rule::atom | Rule::species | Rule::state_word | Rule::missing_value))
            .count();
        self.deeper(links, &node.clone(), |this| {
            let span = this.span(&node);
            let mut kids = Kids::of(node);
            let expr = this.binary(&mut kids, OR);
            match kids.peek() {
                None => expr,
                Some(_) => this.error_expr(span),
            }
        })
    }

    /// Everything that binds at least as strongly as `floor`.
    fn binary(&mut self, kids: &mut Kids, floor: u8) -> Expr {
        let mut left = self.prefixed(kids, floor);
        let mut joined = None;
        loop {
            match kids.peek() {
                Some(Rule::as_unit) if floor <= AS => {
                    let Some(node) = kids.take() else { return left };
                    let span = left.span.to(self.span(&node));
                    let kind = match Kids::of(node).eat(Rule::unit) {
                        Some(unit) => ExprKind::As(left, self.unit(&unit)),
                        None => ExprKind::Error,
                    };
                    left = Expr { kind: Box::new(kind), span };
                    joined = None;
                }
                Some(Rule::infix | Rule::rel) => {
                    let Some(op) = kids.take_if(|text| Infix::of(text).is_some_and(|(strength, _)| strength >= floor))
                    else {
                        return left;
                    };
                    let Some((strength, infix)) = Infix::of(op.as_str()) else { return left };
                    let right = self.binary(kids, if strength == POW { strength } else { strength + 1 });
                    if joined == Some(strength) {
                        self.chained(strength, &op);
                    }
                    joined = Some(strength);
                    left = infix.join(left, right);
                }
                _ => return left,
            }
        }
    }

    /// An operand with what stands before it, and `of` after it.
    fn prefixed(&mut self, kids: &mut Kids, floor: u8) -> Expr {
        let Some(node) = kids.take() else { return self.error_expr(self.place(0, 0)) };
        let unary = match node.as_rule() {
            Rule::kw_not => Some((Unary::Not, self.binary(kids, floor.max(NOT)))),
            Rule::neg => Some((Unary::Neg, self.binary(kids, NEG))),
            _ => None,
        };
        if let Some((op, operand)) = unary {
            let span = self.span(&node).to(operand.span);
            return Expr { kind: Box::new(ExprKind::Unary(op, operand)), span };
        }
        let expr = self.expr(node);
        if !kids.has(Rule::kw_of) {
            return expr;
        }
        if kids.has(Rule::missing_value) {
            return self.error_expr(expr.span);
        }
        let of = self.name_in(kids);
        let span = expr.span.to(of.span);
        Expr { kind: Box::new(ExprKind::Of(expr, of)), span }
    }

    /// `a < b < c` and `a .. b .. c` have no meaning.
    fn chained(&mut self, strength: u8, op: &Node) {
        let (span, text) = (self.span(op), op.as_str());
        let diagnostic = match strength {
            RANGE => Diagnostic::error(codes::SYNTAX, span, "a range has two ends", "a third one starts here")
                .help("write `low .. high`"),
            COMPARE => Diagnostic::error(
                codes::SYNTAX,
                span,
                "comparisons cannot be chained",
                format!("`{text}` follows another comparison"),
            )
            .help("join them with `and`: `a < b and b < c`"),
            _ => return,
        };
        self.report(diagnostic);
    }
}
