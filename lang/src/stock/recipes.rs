//! Recipes of the solutions that are held, and of those they are made of.

use std::collections::BTreeSet;

use matterix_ir::Sources;
use matterix_ir::stock::{Portion, Recipe};

use crate::ast::{ExprKind, FieldValue, ItemKind};
use crate::elaborate::contents::Substance;
use crate::elaborate::{Elaborator, SpeciesId};
use crate::eval::{Scope, Value};
use crate::names::DeclId;

/// The recipes, each after those that use it; the species they need are added to `species`.
pub(super) fn recipes(
    lab: &mut Elaborator<'_>,
    sources: &Sources,
    wanted: Vec<DeclId>,
    species: &mut BTreeSet<SpeciesId>,
) -> Vec<Recipe> {
    let mut out = Vec::new();
    let mut queue = wanted;
    let mut seen = BTreeSet::new();
    let mut next = 0;
    while let Some(id) = queue.get(next).copied() {
        next += 1;
        if seen.insert(id) {
            out.extend(recipe(lab, sources, id, &mut queue, species));
        }
    }
    out
}

/// One recipe as masses per mass of the whole; nothing where it is wrong, which is reported elsewhere.
fn recipe(
    lab: &mut Elaborator<'_>,
    sources: &Sources,
    id: DeclId,
    queue: &mut Vec<DeclId>,
    species: &mut BTreeSet<SpeciesId>,
) -> Option<Recipe> {
    let decl = lab.tables.names.decl(id);
    let ItemKind::Solution { name, fields, labelled } = &decl.item.kind else { return None };
    let fraction = lab.tables.units.named("MassFraction");
    let mut lines = Vec::new();
    let mut rest = None;
    for field in fields {
        let FieldValue::Expr(e) = &field.value else { continue };
        let what = lab.substance(&field.key, decl.module)?;
        match &what {
            Substance::Species(s) => drop(species.insert(*s)),
            Substance::Solution(id) => queue.push(*id),
        }
        let text = sources.slice(e.span).to_owned();
        let mass = if matches!(&*e.kind, ExprKind::Name(n) if n.text == "rest") {
            rest = Some(lines.len());
            0.0
        } else {
            let Value::Num(n) = lab.expr(e, &mut Scope::module(decl.module)) else { return None };
            if n.dimension == fraction {
                lab.graph.constant(n.node)?
            } else {
                let mut mass = 0.0;
                for (s, node) in lab.amounts_of(&what, n, e.span, &field.key) {
                    mass += lab.graph.constant(node)? * lab.tables.species.get(s).molar_mass;
                }
                mass
            }
        };
        lines.push(Portion { substance: field.key.text.clone(), text, share: mass });
    }
    let sum: f64 = lines.iter().map(|l| l.share).sum();
    match rest.and_then(|i| lines.get_mut(i)) {
        Some(rest) => rest.share = 1.0 - sum,
        None => lines.iter_mut().for_each(|l| l.share /= sum),
    }
    let label = labelled.as_ref().map(|l| sources.slice(l.value.span.to(l.species.span)).to_owned());
    Some(Recipe { name: name.text.clone(), parts: lines, label, span: name.span })
}
