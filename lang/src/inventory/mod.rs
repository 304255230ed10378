//! What a lab is provided with, read off the elaborated lab: holdings, recipes, substances and what is counted.

mod recipes;
mod substances;

use std::collections::BTreeSet;

use matterix_ir::inventory::{Count, Holding, Inventory, Reaction, Tally};
use matterix_ir::model::Mixture;
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Sources};

use crate::ast::{ExprKind, ItemKind, MemberKind, NamedExpr};
use crate::declare::SpeciesId;
use crate::eval::Value;
use crate::eval::lab::Elaborator;
use crate::names::DeclId;

/// The option of a member that says how its value is counted.
pub const COUNTS_AS: &str = "counts_as";

/// The way to count that an option's value means.
pub fn count_of(option: &NamedExpr) -> Option<Count> {
    match &*option.value.kind {
        ExprKind::Name(word) => Count::of_word(&word.text),
        _ => None,
    }
}

/// Everything of a lab that a bill is about; `mixtures` are those of its model.
pub fn inventory(lab: &mut Elaborator<'_>, sources: &Sources, mixtures: &[Mixture], workflow: DeclId) -> Inventory {
    let held = lab.held.clone();
    let mut holdings = Vec::new();
    let mut species = BTreeSet::new();
    let mut solutions = Vec::new();
    for term in &held {
        let Some(mixture) = mixtures.iter().position(|m| Some(m.instance) == term.mixture) else { continue };
        let mut mass = lab.graph.number(0.0);
        for (s, amount) in &term.amounts {
            let molar_mass = lab.graph.number(lab.tables.species.get(*s).molar_mass);
            let one = lab.graph.binary(BinaryOp::Mul, *amount, molar_mass);
            mass = lab.graph.binary(BinaryOp::Add, mass, one);
        }
        match term.solution {
            Some(id) => solutions.push(id),
            None => species.extend(term.amounts.iter().map(|a| a.0)),
        }
        holdings.push(Holding {
            mixture: mixture as u32,
            substance: term.substance.clone(),
            amount: term.quantity.node,
            unit: lab.unit_of(&term.quantity),
            mass,
            start: term.mixture.and_then(|id| lab.start_of(id)).map(|n| (n.node, lab.unit_of(&n))),
            span: term.span,
        });
    }
    let recipes = recipes::recipes(lab, sources, solutions, &mut species);
    species.extend(mixtures.iter().flat_map(|m| &m.contents).map(|c| SpeciesId(c.species)));
    let at = |id: InstanceId| mixtures.iter().position(|m| m.instance == id).map(|i| i as u32);
    let streams: BTreeSet<(u32, u32)> =
        lab.streams.keys().filter_map(|(_, from, to)| Some((at(*from)?, at(*to)?))).collect();
    Inventory {
        holdings,
        recipes,
        substances: substances::substances(lab, sources, &species),
        tallies: tallies(lab),
        streams: streams.into_iter().collect(),
        studies: studies(lab, workflow),
        reactions: reactions(lab),
    }
}

/// Every member of every instance that is counted.
fn tallies(lab: &mut Elaborator<'_>) -> Vec<Tally> {
    let mut out = Vec::new();
    for i in 0..lab.instances.len() as u32 {
        let instance = InstanceId(i);
        for m in lab.all_members(instance).iter().copied() {
            let MemberKind::Value { name, options, .. } = &m.member.kind else { continue };
            let Some(count) = options.iter().find(|o| o.name.text == COUNTS_AS).and_then(count_of) else { continue };
            let value = match lab.member_value(instance, m, name.span) {
                Value::Bool(node) => node,
                Value::Num(n) => n.node,
                _ => continue,
            };
            out.push(Tally { instance, count, value });
        }
    }
    out
}

/// The reactions of the files.
fn reactions(lab: &Elaborator<'_>) -> Vec<Reaction> {
    let side = |terms: &[(SpeciesId, f64)]| terms.iter().map(|(s, n)| (s.0, *n)).collect();
    let written = lab.tables.reactions.iter().filter(|r| !r.reverse);
    written
        .map(|r| Reaction { name: r.name.clone(), reactants: side(&r.reactants), products: side(&r.products) })
        .collect()
}

/// The studies of a workflow and their numbers of runs.
fn studies(lab: &mut Elaborator<'_>, workflow: DeclId) -> Vec<(String, u64)> {
    let names = lab.tables.names;
    let mut out = Vec::new();
    for decl in &names.decls {
        let ItemKind::Study { name, of, lines } = &decl.item.kind else { continue };
        let of = of.segments.last().and_then(|word| names.lookup(decl.module, &word.text));
        if of == Some(workflow) {
            out.extend(crate::study::count_of(lab, lines, decl.module).map(|runs| (name.text.clone(), runs)));
        }
    }
    out
}
