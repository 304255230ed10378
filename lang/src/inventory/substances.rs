//! What is known of the species that are brought in: how to measure them out, and what to beware of.

use std::collections::BTreeSet;

use matterix_ir::Sources;
use matterix_ir::inventory::Substance;

use crate::ast::{Expr, ExprKind, FieldValue, Unary};
use crate::declare::SpeciesId;
use crate::declare::species::field;
use crate::eval::Value;
use crate::eval::lab::Elaborator;

/// The species in the order of their declaration.
pub(super) fn substances(lab: &mut Elaborator<'_>, sources: &Sources, species: &BTreeSet<SpeciesId>) -> Vec<Substance> {
    species.iter().map(|s| substance(lab, sources, *s)).collect()
}

fn substance(lab: &mut Elaborator<'_>, sources: &Sources, s: SpeciesId) -> Substance {
    let def = lab.tables.species.get(s);
    let hazards = match lab.property(s, "hazards") {
        Some(Value::List(items)) => items.into_iter().filter_map(text).collect(),
        _ => Vec::new(),
    };
    let liquid = def.phase() == Some("liquid");
    let density = lab.property_value(s, "density").filter(|_| liquid);
    let (boiling_point, flash_point) =
        (written(lab, sources, s, "boiling_point"), written(lab, sources, s, "flash_point"));
    Substance {
        name: def.name.clone(),
        formula: def.formula.as_ref().map(ToString::to_string).unwrap_or_default(),
        molar_mass: (!def.by_mass).then_some(def.molar_mass),
        density,
        hazards,
        boiling_point,
        flash_point,
        span: def.span,
    }
}

fn text(value: Value) -> Option<String> {
    match value {
        Value::Text(text) => Some(text),
        _ => None,
    }
}

/// A quantity as it is written; one that is worked out, with its value.
fn written(lab: &mut Elaborator<'_>, sources: &Sources, s: SpeciesId, key: &str) -> Option<String> {
    let Value::Num(n) = lab.property(s, key)? else { return None };
    match &field(lab.tables.species.get(s).fields, key)?.value {
        FieldValue::Expr(e) if is_literal(e) => Some(sources.slice(e.span).to_owned()),
        _ => Some(lab.unit_of(&n).show(lab.graph.constant(n.node)?)),
    }
}

/// Whether a quantity is written as such: `12 degC`, `-85.0 degC`.
fn is_literal(e: &Expr) -> bool {
    match &*e.kind {
        ExprKind::Quantity(..) => true,
        ExprKind::Unary(Unary::Neg, inner) => is_literal(inner),
        _ => false,
    }
}
