//! K1: reactions that can never start.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Span, codes};

use super::flow::Window;
use crate::ast::{Expr, ExprKind, Member, MemberKind};
use crate::declare::ReactionId;
use crate::declare::tables::{MemberRef, ReactionDef};
use crate::declare::{SpeciesId, Tables};
use crate::eval::lab::Elaborator;
use crate::eval::lab::properties::{GIVES, GIVES_AT};
use crate::eval::lab::reach::Reach;
use crate::eval::{Scope, Value};
use crate::names::DeclId;
use crate::syntax::relocate::Relocate;

/// What one workflow's lab says of the reactions: which start, and what there is anywhere.
#[derive(Clone, Debug)]
pub struct Starts {
    /// By reaction index: whether its reactants meet in a vessel.
    reactions: Vec<bool>,
    /// Species that some vessel can come to hold.
    anywhere: BTreeSet<SpeciesId>,
    /// Name of the lab in the text.
    lab: Span,
    /// What is known of the conditions of reactions over the plan, if it could be followed.
    pub windows: Option<BTreeMap<ReactionId, Window>>,
}

impl Relocate for Starts {
    fn moved(&mut self, to: &dyn Fn(Span) -> Span) {
        self.lab.moved(to);
    }
}

/// Which reactions can start in a lab.
pub fn starts(lab: &Elaborator<'_>, lab_decl: DeclId) -> Starts {
    let reactions = meets(lab);
    let span = crate::names::item_name(lab.tables.names.decl(lab_decl).item).map_or_else(Span::default, |n| n.1);
    Starts { reactions, anywhere: lab.reach.anywhere(), lab: span, windows: None }
}

/// By reaction index: whether its reactants meet in a vessel.
fn meets(lab: &Elaborator<'_>) -> Vec<bool> {
    let mixtures = (0..lab.instances.len() as u32).map(InstanceId).filter(|i| lab.is_mixture(*i));
    let none = BTreeSet::new();
    let held: Vec<&BTreeSet<SpeciesId>> =
        mixtures.map(|m| lab.reach.set(&lab.instances[m.0 as usize].name).unwrap_or(&none)).collect();
    let meet = |r: &ReactionDef<'_>| held.iter().any(|held| r.reactants.iter().all(|(s, _)| held.contains(s)));
    lab.tables.reactions.iter().map(meet).collect()
}

/// Warns of a neutralisation that never starts in the model alone, because what it lacks would come from weak acids or bases there:
/// these react with a strong partner to the end. Other reactions go by how much of it there is.
fn left_out(
    tables: &Tables<'_>,
    reaction: &ReactionDef<'_>,
    missing: &[&(SpeciesId, Span)],
    anywhere: &BTreeSet<SpeciesId>,
) -> Option<Diagnostic> {
    if !reaction.reactants.iter().all(|(s, _)| given_by(tables, *s).next().is_some()) {
        return None;
    }
    let sources = missing.iter().map(|(s, _)| Some((*s, weak_source(tables, *s, anywhere)?)));
    let sources: Vec<(SpeciesId, SpeciesId)> = sources.collect::<Option<_>>()?;
    let (lacks, from) = *sources.first()?;
    let name = |s: SpeciesId| tables.species.get(s).name.as_str();
    let (lacks, from) = (name(lacks), name(from));
    let headline = format!("`{}` never starts: the model does not form `{lacks}` from {from}", reaction.name);
    let d = Diagnostic::warning(
        codes::REACTION_NEVER_STARTS,
        missing[0].1,
        headline,
        format!("the model contains no `{lacks}`"),
    );
    Some(d.help(format!("add a reversible reaction that forms `{lacks}` from {from}, as in `HA <-> H+ + A-`")))
}

/// The value of an option of a member.
fn option<'a>(member: &'a Member, name: &str) -> Option<&'a Expr> {
    let MemberKind::Value { options, .. } = &member.kind else { return None };
    options.iter().find(|o| o.name.text == name).map(|o| &o.value)
}

/// The properties that say of a species that it is made in water.
fn given_by<'t, 'a>(
    tables: &'t Tables<'a>,
    s: SpeciesId,
) -> impl Iterator<Item = (&'a str, MemberRef<'a>)> + use<'t, 'a> {
    let made = tables.species.get(s).name.clone();
    let gives = move |m: &MemberRef<'a>| {
        option(m.member, GIVES).is_some_and(|e| matches!(&*e.kind, ExprKind::Text(name) if *name == made))
    };
    tables.properties.iter().map(|(key, m)| (*key, *m)).filter(move |(_, m)| gives(m))
}

/// A species of the lab of which a property says that it makes another one in water.
fn weak_source(tables: &Tables<'_>, s: SpeciesId, anywhere: &BTreeSet<SpeciesId>) -> Option<SpeciesId> {
    let mut lab = Elaborator::new(tables, Reach::default());
    for (key, m) in given_by(tables, s) {
        let at = option(m.member, GIVES_AT).and_then(|e| match lab.expr(e, &mut Scope::module(m.module)) {
            Value::Range(low, high) => Some((lab.graph.constant(low.node)?, lab.graph.constant(high.node)?)),
            _ => None,
        });
        let (low, high) = at.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let mut found = anywhere.iter().copied();
        let source = found.find(|o| lab.property_value(*o, key).is_some_and(|v| (low..=high).contains(&v)));
        if source.is_some() {
            return source;
        }
    }
    None
}

/// Reports reactions of one module whose reactants meet in no workflow of its file.
pub fn never_starts(tables: &Tables<'_>, module: usize, workflows: &[Starts]) -> Vec<Diagnostic> {
    let Some(first) = workflows.first() else { return Vec::new() };
    let anywhere: BTreeSet<SpeciesId> = workflows.iter().flat_map(|w| w.anywhere.iter().copied()).collect();
    let mut out: Vec<Diagnostic> = Vec::new();
    let mut reported: Vec<usize> = Vec::new();
    for (index, r) in tables.reactions.iter().enumerate() {
        let started = workflows.iter().any(|w| w.reactions.get(index) == Some(&true));
        if r.module != module || r.reverse {
            continue;
        }
        if started {
            out.extend(never_warm(tables, index, workflows));
            continue;
        }
        let lab_span = first.lab;
        let missing: Vec<_> = r.terms.iter().filter(|(s, _)| !anywhere.contains(s)).collect();
        // What only waits for a reaction reported already is part of that finding.
        let cause = reported.iter().position(|first| {
            !missing.is_empty()
                && missing.iter().all(|(s, _)| tables.reactions[*first].products.iter().any(|(p, _)| p == s))
        });
        if let Some(cause) = cause {
            let text = format!("`{}` depends on it and cannot start either", r.name);
            out[cause].labels.push(matterix_ir::Label { span: r.span, text, primary: false });
            continue;
        }
        reported.push(index);
        if let Some(d) = left_out(tables, r, &missing, &anywhere) {
            out.push(d);
            continue;
        }
        let d = match missing.as_slice() {
            [(s, span), rest @ ..] => {
                let def = tables.species.get(*s);
                let name = &def.name;
                let mut d = Diagnostic::error(
                    codes::REACTION_NEVER_STARTS,
                    *span,
                    format!("`{}` can never start: there is no `{name}` anywhere in the workflow", r.name),
                    format!("no vessel holds `{name}`, and no reaction makes it"),
                );
                for (s, span) in rest {
                    let other = &tables.species.get(*s).name;
                    d = d.because(*span, format!("`{other}` is missing as well"));
                }
                d = d.because(lab_span, "no vessel of this lab holds it");
                let sources: Vec<String> = tables
                    .species
                    .iter()
                    .filter(|(_, o)| o.dissolves.iter().any(|(i, _)| i == s))
                    .map(|(_, o)| o.name.clone())
                    .take(3)
                    .collect();
                if sources.is_empty() {
                    d.help(format!("add `{name}` to a recipe or to the contents of a vessel"))
                } else {
                    d.help(format!("`{name}` comes from dissolving {}: add one to a recipe", sources.join(", ")))
                }
            }
            [] => Diagnostic::error(
                codes::REACTION_NEVER_STARTS,
                r.span,
                format!("`{}` can never start: its reactants never meet in one vessel", r.name),
                "no vessel receives all of them",
            )
            .because(lab_span, "no transfer between the vessels of this lab brings them together")
            .help("add a transfer that mixes them"),
        };
        out.push(d);
    }
    out
}

/// A reaction whose reactants meet, but never at temperatures (or whatever else its law asks for) where it goes.
fn never_warm(tables: &Tables<'_>, index: usize, workflows: &[Starts]) -> Option<Diagnostic> {
    let id = ReactionId(index as u32);
    let r = &tables.reactions[index];
    let mut all = Window::default();
    for w in workflows.iter().filter(|w| w.reactions.get(index) == Some(&true)) {
        // A law without a condition, or one that could not be followed, may act.
        let window = w.windows.as_ref()?.get(&id)?;
        if window.reached {
            return None;
        }
        all = Window { reached: false, low: all.low.min(window.low), high: all.high.max(window.high) };
    }
    let headline =
        format!("`{}` can never start: its reactants meet, but only under conditions outside its law", r.name);
    let d = Diagnostic::error(codes::REACTION_NEVER_STARTS, r.span, headline, "never proceeds");
    let valid = r.fields.iter().find(|f| f.key.text == "valid");
    let unit = tables.units.dimension("Temperature").and_then(|t| tables.units.preferred_point(&t.dimension));
    Some(match (valid, unit) {
        (Some(field), Some(unit)) if all.low.is_finite() && all.high.is_finite() => {
            let (low, high) = (unit.show(all.low), unit.show(all.high));
            d.because(field.span, format!("its reactants are only ever between {low} and {high}"))
                .help("heat or cool the vessel further, or widen `valid` if the law is known to be valid there")
        }
        _ => d.help("check the conditions `valid` and `requires` of the reaction"),
    })
}

/// U4: rate constants of the reactions that can start.
pub fn rates(lab: &mut Elaborator<'_>) {
    for (index, meet) in meets(lab).into_iter().enumerate() {
        let library = lab.tables.names.modules[lab.tables.reactions[index].module].is_library();
        if !library && meet {
            lab.check_rate(crate::declare::ReactionId(index as u32));
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::check::tests::found;

    fn bench(holding: &str) -> String {
        format!(
            r#"use std::glassware::Beaker250mL
            species P {{ formula: "C2H4O2", density: 1 g/mL, specific_heat: 4 J/(g*K) }}
            species Q {{ formula: "C2H4O2", density: 1 g/mL, specific_heat: 4 J/(g*K) }}
            reaction decay: P -> Q {{ rate: 1e-3 1/s, order: {{ P: 1 }} }}
            lab bench {{
                ambient: 25 degC
                cup = Beaker250mL at (0, 0, 0) m holding 10 g of water{holding}
            }}
            workflow w in bench {{ wait 1 s }}"#
        )
    }

    fn never(holding: &str) -> Vec<String> {
        found(&bench(holding), |bench| {
            let (module, lab) = bench.at;
            let starts = super::starts(bench.lab, lab);
            super::never_starts(bench.tables, module, &[starts])
        })
    }

    #[test]
    fn a_reaction_whose_reactant_is_there_starts() {
        assert_eq!(never(" + 1 mmol of P"), [""; 0]);
    }

    #[test]
    fn a_reaction_whose_reactant_is_nowhere_never_starts() {
        let found = "reaction-never-starts: `decay` can never start: there is no `P` anywhere in the workflow";
        assert_eq!(never(""), [found]);
    }
}
