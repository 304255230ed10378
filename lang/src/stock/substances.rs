//! What is known of the species that are brought in: how to measure them out, and what to beware of.

use std::collections::BTreeSet;

use matterix_ir::Sources;
use matterix_ir::stock::Substance;

use crate::ast::{Expr, ExprKind, FieldValue};
use crate::elaborate::species::field;
use crate::elaborate::{Elaborator, SpeciesId};

/// The species in the order of their declaration.
pub(super) fn substances(lab: &Elaborator<'_>, sources: &Sources, species: &BTreeSet<SpeciesId>) -> Vec<Substance> {
    species.iter().map(|s| substance(lab, sources, *s)).collect()
}

fn substance(lab: &Elaborator<'_>, sources: &Sources, s: SpeciesId) -> Substance {
    let def = lab.tables.species.get(s);
    let value = |key: &str| -> Option<&Expr> {
        match &field(def.fields, key)?.value {
            FieldValue::Expr(e) => Some(e),
            _ => None,
        }
    };
    let word = |e: &Expr| match &*e.kind {
        ExprKind::Text(text) => Some(text.clone()),
        ExprKind::Name(name) => Some(name.text.clone()),
        _ => None,
    };
    let hazards = match value("hazards").map(|e| &*e.kind) {
        Some(ExprKind::List(items)) => items.iter().filter_map(word).collect(),
        _ => Vec::new(),
    };
    let liquid = value("phase").and_then(word).is_some_and(|phase| phase == "liquid");
    let density = value("density").filter(|_| liquid).and_then(|e| match &*e.kind {
        ExprKind::Quantity(v, unit) => lab.tables.unit(&unit.text).ok().map(|u| u.unit.to_si(*v)),
        _ => None,
    });
    let written = |key: &str| value(key).map(|e| sources.slice(e.span).to_owned());
    Substance {
        name: def.name.clone(),
        formula: def.formula.as_ref().map(ToString::to_string).unwrap_or_default(),
        molar_mass: (!def.by_mass).then_some(def.molar_mass),
        density,
        hazards,
        boiling_point: written("boiling_point"),
        flash_point: written("flash_point"),
        span: def.span,
    }
}
