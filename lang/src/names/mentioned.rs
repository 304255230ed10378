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
    match &*e.kind {
        ExprKind::Name(n) => drop(out.insert(&n.text)),
        ExprKind::Member(a, n) => {
            out.insert(&n.text);
            names_in(a, out);
        }
        // A species may be given as a member: `amount[solute]`.
        ExprKind::IndexWord(a, word) => {
            out.insert(&word.text);
            names_in(a, out);
        }
        ExprKind::IndexRange(a, ..) | ExprKind::Prime(a) => names_in(a, out),
        ExprKind::Unary(_, a) | ExprKind::Of(a, _) | ExprKind::As(a, _) => names_in(a, out),
        ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) | ExprKind::Range(a, b) => {
            names_in(a, out);
            names_in(b, out);
        }
        ExprKind::Call(callee, args) => {
            if bare(callee).is_none() {
                names_in(callee, out);
            }
            args.iter().for_each(|a| names_in(&a.value, out));
        }
        ExprKind::Fold { set, body, .. } => {
            names_in(set, out);
            names_in(body, out);
        }
        ExprKind::Tuple(items, _) | ExprKind::List(items) => items.iter().for_each(|i| names_in(i, out)),
        ExprKind::Error | ExprKind::Number(_) | ExprKind::Quantity(..) | ExprKind::Text(_) | ExprKind::Scoped(_) => {}
    }
}
