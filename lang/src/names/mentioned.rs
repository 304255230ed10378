//! What an expression mentions, read off its form.

use std::collections::BTreeSet;

use crate::ast::{Expr, ExprKind};

/// The name that an expression consists of.
pub(crate) fn bare(e: &Expr) -> Option<&str> {
    match &*e.kind {
        ExprKind::Name(n) => Some(&n.text),
        _ => None,
    }
}

/// Every name of variables and members in an expression.
pub(crate) fn names_in<'e>(e: &'e Expr, out: &mut BTreeSet<&'e str>) {
    each_word(e, &mut |word| match word {
        Word::Name(text) | Word::Member(text) => drop(out.insert(text)),
        Word::Function(_) => {}
    });
}

/// The names of variables and functions in an expression, as they stand there: what may be members of the thing that it is about.
pub(crate) fn names_of(e: &Expr) -> Vec<&str> {
    let mut out = Vec::new();
    each_word(e, &mut |word| match word {
        Word::Name(text) | Word::Function(text) => out.push(text),
        Word::Member(_) => {}
    });
    out
}

/// A word of an expression.
enum Word<'e> {
    /// `x`, and `x` of `amount[x]`.
    Name(&'e str),
    /// `x` of `a.x`.
    Member(&'e str),
    /// `f` of `f(a)`.
    Function(&'e str),
}

fn each_word<'e>(e: &'e Expr, visit: &mut impl FnMut(Word<'e>)) {
    match &*e.kind {
        ExprKind::Name(n) => visit(Word::Name(&n.text)),
        ExprKind::Member(a, n) => {
            visit(Word::Member(&n.text));
            each_word(a, visit);
        }
        // A species may be given as a member: `amount[solute]`.
        ExprKind::IndexWord(a, word) => {
            each_word(a, visit);
            visit(Word::Name(&word.text));
        }
        ExprKind::IndexRange(a, ..) | ExprKind::Prime(a) => each_word(a, visit),
        ExprKind::Unary(_, a) | ExprKind::Of(a, _) | ExprKind::As(a, _) => each_word(a, visit),
        ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) | ExprKind::Range(a, b) => {
            each_word(a, visit);
            each_word(b, visit);
        }
        ExprKind::Call(callee, args) => {
            match bare(callee) {
                Some(function) => visit(Word::Function(function)),
                None => each_word(callee, visit),
            }
            args.iter().for_each(|a| each_word(&a.value, visit));
        }
        ExprKind::Fold { set, body, .. } => {
            each_word(set, visit);
            each_word(body, visit);
        }
        ExprKind::Tuple(items, _) | ExprKind::List(items) => items.iter().for_each(|i| each_word(i, visit)),
        ExprKind::Error | ExprKind::Number(_) | ExprKind::Quantity(..) | ExprKind::Text(_) | ExprKind::Scoped(_) => {}
    }
}
