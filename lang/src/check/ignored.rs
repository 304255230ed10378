//! What would be read and then have no effect: said, so that nothing written is passed over in silence.

use matterix_ir::inventory::Count;
use matterix_ir::{Diagnostic, codes};

use crate::ast::{ExprKind, NamedExpr, Role};
use crate::declare::Type;
use crate::declare::failures::BARS;
use crate::declare::fields::word;
use crate::declare::tables::{MATTER, OUTSIDE, is_true};
use crate::elaborate::held_back::OF_EACH;
use crate::elaborate::lab::SYMMETRIC;
use crate::eval::lab::Elaborator;
use crate::eval::lab::free::Bound;
use crate::eval::lab::given::{GIVEN_BY, HIDDEN, INSTEAD, ONLY_WITH, VALID};
use crate::eval::lab::properties::{GIVES, GIVES_AT};
use crate::inventory::{COUNTS_AS, count_of};
use crate::near;

/// Options of a member that mean nothing for a member of its kind.
pub fn options(role: Role, given: &[NamedExpr]) -> Vec<Diagnostic> {
    let (what, known): (&str, &[&str]) = match role {
        Role::State => ("a state", &["unit", "scale", COUNTS_AS, BARS]),
        Role::Extensive => ("an extensive quantity", &["unit", "scale", HIDDEN, ONLY_WITH, MATTER, OUTSIDE, OF_EACH]),
        Role::Derived => ("a derived quantity", &["unit", HIDDEN, VALID, INSTEAD, COUNTS_AS]),
        Role::Reading => ("a reading", &["unit", "resolution", "noise", "period"]),
        Role::Param => ("a parameter", &["above", "at_least", "at_most", GIVEN_BY, GIVES, GIVES_AT]),
        Role::Flow => ("a flow", &[]),
        Role::Part => ("a part", &[]),
    };
    let mut found = unknown(what, given, known);
    found.extend(given.iter().filter_map(misfit));
    let is_plain = |o: &&NamedExpr| o.name.text == HIDDEN && role != Role::Derived && !is_true(&o.value);
    found.extend(given.iter().filter(is_plain).map(|o| {
        let headline = format!("`{HIDDEN}` of {what} must be `true`, or left out");
        Diagnostic::error(codes::TYPE_MISMATCH, o.value.span, headline, "not allowed here")
    }));
    found
}

/// An option whose value is of the wrong form.
fn misfit(o: &NamedExpr) -> Option<Diagnostic> {
    let given = std::slice::from_ref(o);
    let headline = match o.name.text.as_str() {
        GIVEN_BY if word(given, GIVEN_BY) != Some("at") => "`given_by` must be `at`: the value after `holding ... at`",
        BARS if word(given, BARS).is_none() => "`bars` must name the failure of a step that uses the thing",
        ONLY_WITH if word(given, ONLY_WITH).is_none() => "`only_with` must name a parameter",
        MATTER if !is_true(&o.value) => "`matter` must be `true`, or left out",
        OUTSIDE if !is_true(&o.value) => "`outside` must be `true`, or left out",
        GIVES_AT if !matches!(&*o.value.kind, ExprKind::Range(..)) => "`gives_at` must be a range",
        GIVES if !matches!(&*o.value.kind, ExprKind::Text(_)) => "`gives` must be the name of a species in quotes",
        OF_EACH if !matches!(&*o.value.kind, ExprKind::Text(_)) => "`of_each` must be the name of a function in quotes",
        INSTEAD if !matches!(&*o.value.kind, ExprKind::Text(_)) => "`instead` must be a text",
        _ => return None,
    };
    Some(Diagnostic::error(codes::TYPE_MISMATCH, o.value.span, headline, "not allowed here"))
}

/// `matter` or `outside` where there is no amount of each species.
pub fn matter(
    lab: &Elaborator<'_>,
    role: Role,
    each_species: bool,
    ty: &Type,
    given: &[NamedExpr],
) -> Option<Diagnostic> {
    let is_one = |o: &&NamedExpr| matches!(o.name.text.as_str(), MATTER | OUTSIDE);
    let o = given.iter().find(is_one).filter(|_| role == Role::Extensive)?;
    let amount = lab.tables.units.named("Amount");
    let is_amount = matches!(ty, Type::Quantity { dimension, .. } if dimension.agrees(&amount));
    if each_species && is_amount {
        return None;
    }
    let headline = format!("only an `Amount per Species` can be `{}`", o.name.text);
    Some(Diagnostic::error(codes::TYPE_MISMATCH, o.name.span, headline, "not an amount of each species"))
}

/// Options of a function that mean nothing: it may be bounded, and one of two things symmetric.
pub fn function(parameters: usize, given: &[NamedExpr]) -> Vec<Diagnostic> {
    let known: &[&str] = match parameters {
        2 => &["above", "at_least", "at_most", SYMMETRIC],
        _ => &Bound::WORDS,
    };
    let truths = given.iter().filter(|o| o.name.text == SYMMETRIC && parameters == 2);
    let wrong =
        truths.filter(|o| !matches!(&*o.value.kind, ExprKind::Name(n) if matches!(n.text.as_str(), "true" | "false")));
    let wrong = wrong.map(|o| {
        let headline = format!("`{SYMMETRIC}` must be `true` or `false`");
        Diagnostic::error(codes::TYPE_MISMATCH, o.value.span, headline, "neither `true` nor `false`")
    });
    unknown("a function", given, known).into_iter().chain(wrong).collect()
}

fn unknown(what: &str, given: &[NamedExpr], known: &[&str]) -> Vec<Diagnostic> {
    let unknown = given.iter().filter(|o| !known.contains(&o.name.text.as_str()));
    let words =
        given.iter().filter(|o| o.name.text == COUNTS_AS && known.contains(&COUNTS_AS) && count_of(o).is_none());
    let words = words.map(|o| {
        let all: Vec<String> = Count::ALL.iter().map(|(word, _)| format!("`{word}`")).collect();
        let headline = format!("`{COUNTS_AS}` must be one of {}", all.join(", "));
        Diagnostic::about(COUNTS_AS, codes::UNKNOWN_NAME, o.value.span, headline, "not one of them")
    });
    unknown
        .map(|o| {
            let headline = format!("{what} has no option `{}`", o.name.text);
            let d = Diagnostic::error(codes::UNKNOWN_FIELD, o.name.span, headline, "not an option");
            near::proposed(d, &near::nearest(&o.name.text, known), o.name.span)
        })
        .chain(words)
        .collect()
}
