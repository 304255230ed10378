//! Laws that exist once for two things, whichever of them comes first.

use std::collections::BTreeSet;

use crate::ast::{Binary, Expr, ExprKind};
use crate::names::{bare, names_in};

/// The two of the `instances` that a law is about whose every pair comes once: those of a symmetric relation that its condition asks for.
/// Not where the condition ties a third instance to one of them and not in the same way to the other, for then the two orders differ.
pub(super) fn unordered<'e>(
    condition: &'e Expr,
    instances: &[&str],
    is_symmetric: &dyn Fn(&str) -> bool,
) -> Option<(&'e str, &'e str)> {
    let (a, b) = asked(condition, instances, is_symmetric)?;
    let others: Vec<&str> = instances.iter().copied().filter(|n| ![a, b].contains(n)).collect();
    let ties = |one, other| ties(condition, one, other, &others);
    (ties(a, b)? == ties(b, a)?).then_some((a, b))
}

/// The two of a symmetric relation that a condition asks for.
fn asked<'e>(e: &'e Expr, instances: &[&str], is_symmetric: &dyn Fn(&str) -> bool) -> Option<(&'e str, &'e str)> {
    match &*e.kind {
        ExprKind::Binary(_, a, b) => asked(a, instances, is_symmetric).or_else(|| asked(b, instances, is_symmetric)),
        ExprKind::Call(callee, args) => {
            let [a, b] = args.as_slice() else { return None };
            let (relation, a, b) = (bare(callee)?, bare(&a.value)?, bare(&b.value)?);
            (a != b && instances.contains(&a) && instances.contains(&b) && is_symmetric(relation)).then_some((a, b))
        }
        _ => None,
    }
}

/// What the condition asks of `one`, without `other`, together with a third instance: calls, with a gap for `one`. None where it asks in
/// another form.
fn ties<'e>(e: &'e Expr, one: &str, other: &str, third: &[&str]) -> Option<BTreeSet<Vec<Option<&'e str>>>> {
    if let ExprKind::Binary(Binary::And, a, b) = &*e.kind {
        let (mut a, b) = (ties(a, one, other, third)?, ties(b, one, other, third)?);
        a.extend(b);
        return Some(a);
    }
    let mut names = BTreeSet::new();
    names_in(e, &mut names);
    let is_tie = names.contains(one) && !names.contains(other) && third.iter().any(|n| names.contains(n));
    if !is_tie {
        return Some(BTreeSet::new());
    }
    let ExprKind::Call(callee, args) = &*e.kind else { return None };
    let mut form = vec![Some(bare(callee)?)];
    for arg in args {
        let name = bare(&arg.value)?;
        form.push(Some(name).filter(|n| *n != one));
    }
    Some(BTreeSet::from([form]))
}
