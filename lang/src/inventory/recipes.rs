//! Recipes of the solutions that are held, and of those they are made of.

use std::collections::BTreeSet;

use matterix_ir::Sources;
use matterix_ir::inventory::{Portion, Recipe};

use crate::ast::{FieldValue, ItemKind};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::lab::substances::Substance;
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
    let ItemKind::Solution { name, labelled, .. } = &decl.item.kind else { return None };
    let mut lines = Vec::new();
    for portion in lab.portions(id)? {
        let FieldValue::Expr(e) = &portion.field.value else { continue };
        match lab.substance(&portion.field.key, decl.module)? {
            Substance::Species(s) => drop(species.insert(s)),
            Substance::Solution(id) => queue.push(id),
        }
        let text = sources.slice(e.span).to_owned();
        lines.push(Portion { substance: portion.field.key.text.clone(), text, share: portion.share });
    }
    let label = labelled.as_ref().map(|l| sources.slice(l.value.span.to(l.species.span)).to_owned());
    Some(Recipe { name: name.text.clone(), parts: lines, label, span: name.span })
}
