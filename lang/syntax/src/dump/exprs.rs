//! Expressions, types and arguments.

use super::{Sexp, leaf, name, names, node, quoted};
use crate::ast::{Arg, Binary, Expr, ExprKind, NamedExpr, Param, Path, Sig, Type, Unary, UnitText};

pub(super) fn expr(expr: &Expr) -> Sexp {
    match &*expr.kind {
        ExprKind::Error => leaf("error"),
        ExprKind::Number(value) => leaf(format!("{value:?}")),
        ExprKind::Quantity(value, of) => node("quantity").with([leaf(format!("{value:?}")), unit(of)]),
        ExprKind::Text(text) => quoted(text),
        ExprKind::Name(word) => name(word),
        ExprKind::Scoped(of) => path(of),
        ExprKind::Member(of, member) => node(format!(".{}", member.text)).with([self::expr(of)]),
        ExprKind::IndexWord(of, word) => node("index").with([self::expr(of), name(word)]),
        ExprKind::IndexRange(of, from, to) => node("index").with([self::expr(of), name(from), leaf(".."), name(to)]),
        ExprKind::Index(of, at) => node("index").with([self::expr(of), node("expr").with([self::expr(at)])]),
        ExprKind::Call(of, list) => node("call").with([self::expr(of)]).with(args(list)),
        ExprKind::Fold { fold, var, set, body } => {
            node("fold").with([name(fold), name(var), self::expr(set), self::expr(body)])
        }
        ExprKind::Prime(of) => node("prime").with([self::expr(of)]),
        ExprKind::Unary(op, of) => node(unary(*op)).with([self::expr(of)]),
        ExprKind::Binary(op, left, right) => node(binary(*op)).with([self::expr(left), self::expr(right)]),
        ExprKind::Of(amount, of) => node("of").with([self::expr(amount), name(of)]),
        ExprKind::Range(low, high) => node("..").with([self::expr(low), self::expr(high)]),
        ExprKind::As(of, to) => node("as").with([self::expr(of), unit(to)]),
        ExprKind::Tuple(parts, of) => {
            node("tuple").with(parts.iter().map(self::expr)).with(of.as_ref().map(|u| node("unit").with([unit(u)])))
        }
        ExprKind::List(parts) => node("list").with(parts.iter().map(self::expr)),
    }
}

fn unary(op: Unary) -> &'static str {
    match op {
        Unary::Neg => "neg",
        Unary::Not => "not",
    }
}

fn binary(op: Binary) -> &'static str {
    match op {
        Binary::Or => "or",
        Binary::And => "and",
        Binary::Eq => "==",
        Binary::Ne => "!=",
        Binary::Lt => "<",
        Binary::Le => "<=",
        Binary::Gt => ">",
        Binary::Ge => ">=",
        Binary::In => "in",
        Binary::Is => "is",
        Binary::PlusMinus => "+-",
        Binary::Add => "+",
        Binary::Sub => "-",
        Binary::Mul => "*",
        Binary::Div => "/",
        Binary::Pow => "^",
    }
}

pub(super) fn unit(unit: &UnitText) -> Sexp {
    leaf(&unit.text)
}

pub(super) fn path(path: &Path) -> Sexp {
    node("path").with(names(&path.segments))
}

pub(super) fn args(args: &[Arg]) -> Vec<Sexp> {
    let arg = |arg: &Arg| match &arg.name {
        Some(name) => node(format!("{}:", name.text)).with([expr(&arg.value)]),
        None => expr(&arg.value),
    };
    args.iter().map(arg).collect()
}

pub(super) fn named(options: &[NamedExpr]) -> Option<Sexp> {
    let named = |n: &NamedExpr| node(format!("{}:", n.name.text)).with([expr(&n.value)]);
    (!options.is_empty()).then(|| node("options").with(options.iter().map(named)))
}

/// A part under a word, where there is one.
pub(super) fn maybe(word: &str, part: Option<&Expr>) -> Option<Sexp> {
    part.map(|part| node(word).with([expr(part)]))
}

pub(super) fn ty(of: &Type) -> Sexp {
    node("type")
        .with(of.paths.iter().map(path))
        .with((!of.words.is_empty()).then(|| node("words").with(names(&of.words))))
        .with(of.argument.as_deref().map(ty))
        .with(of.optional.then(|| leaf("?")))
        .with(maybe("where", of.condition.as_ref()))
}

pub(super) fn param(param: &Param) -> Sexp {
    node("param")
        .with([name(&param.name)])
        .with(param.ty.as_ref().map(ty))
        .with(param.of.as_ref().map(|of| node("of").with([name(of)])))
        .with(maybe("default", param.default.as_ref()))
}

pub(super) fn sig(sig: &Sig) -> Sexp {
    let group = |(label, params): &(crate::ast::Name, Vec<Param>)| node(&label.text).with(params.iter().map(param));
    node("sig")
        .with([node("verb").with(names(&sig.verb))])
        .with(sig.params.iter().map(param))
        .with(sig.labelled.iter().map(group))
        .with(sig.result.as_ref().map(|r| node("result").with([ty(r)])))
}
