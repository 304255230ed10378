//! What is needed, what to beware of, and what is prepared beforehand.

use std::collections::BTreeMap;

use matterix_ir::inventory::Substance;
use matterix_ir::model::Content;
use matterix_ir::scene::{Instance, InstanceId};
use matterix_ir::{Env, NodeId};

use super::list::{List, Step, table};
use super::{Prose, words};
use crate::declare::SpeciesId;
use matterix_ir::listing::joined;

impl Prose<'_, '_> {
    /// The sections before the steps.
    pub(super) fn materials(&self, out: &mut Vec<String>) {
        let held = self.held();
        out.push("## What you need".to_string());
        out.push(self.things());
        if let Some(reagents) = self.reagents(&held) {
            out.push("Amounts computed from the contents of the vessels:".to_string());
            out.push(reagents);
        }
        if let Some(safety) = self.safety() {
            out.push("## Safety".to_string());
            out.push(safety);
        }
        let (solutions, setting_up) = (self.solutions(&held), self.setting_up(&held));
        if solutions.steps.is_empty() && setting_up.steps.is_empty() {
            return;
        }
        out.push("## Preparation".to_string());
        let mut all = solutions.steps;
        all.extend(setting_up.steps);
        out.push(List { steps: all, ..List::default() }.markdown());
    }

    /// kg and SI of the written unit, by holding.
    fn held(&self) -> Vec<(f64, f64)> {
        let stock = &self.program.inventory;
        stock.holdings.iter().map(|h| (self.at_first(h.mass), self.at_first(h.amount))).collect()
    }

    /// A value that rests on parameters only.
    fn at_first(&self, node: NodeId) -> f64 {
        self.with(&[], node)
    }

    /// A value where states are these.
    fn with(&self, states: &[f64], node: NodeId) -> f64 {
        let model = &self.program.model;
        let params: Vec<f64> = model.params.iter().map(|p| p.value).collect();
        model.graph.eval(node, Env { time: 0.0, states, params: &params, locals: &[], readings: &[] })
    }

    /// The pH of a mixture once its salts have dissolved, where equilibria give it one, and whether its model holds there.
    fn ph_at_first(&self, mixture: u32) -> Option<(f64, bool)> {
        let model = &self.program.model;
        let of = model.mixtures.get(mixture as usize)?;
        let shown = of.properties.iter().filter_map(|i| model.observables.get(*i as usize));
        let shown = shown.into_iter().find(|o| o.name.ends_with(".ph"))?;
        let node = *shown.value.first()?;
        let valid = shown.valid.and_then(|i| model.observables.get(i as usize)?.value.first().copied());
        let mut states: Vec<f64> = model.states.iter().map(|s| self.at_first(s.initial)).collect();
        let species = &self.lab.tables.species;
        let place = |s: SpeciesId| of.contents.iter().find(|c| c.species == s.0).map(|c| c.state as usize);
        let is_water = |c: &&Content| species.get(SpeciesId(c.species)).is_water;
        let water = of.contents.iter().find(is_water)?.state as usize;
        for content in of.contents.iter().filter(|c| self.lab.splits(SpeciesId(c.species))) {
            let amount = states[content.state as usize];
            if states[water] <= 0.0 || amount == 0.0 {
                continue;
            }
            states[content.state as usize] = 0.0;
            for (ion, count) in &species.get(SpeciesId(content.species)).dissolves {
                states[place(*ion)?] += count * amount;
            }
        }
        let ph = Some(self.with(&states, node)).filter(|ph| ph.is_finite())?;
        Some((ph, valid.is_none_or(|valid| self.with(&states, valid) == 1.0)))
    }

    fn instance(&self, id: InstanceId) -> &Instance {
        self.program.scene.get(id)
    }

    /// The thing that holds a mixture.
    fn holder(&self, mixture: u32) -> InstanceId {
        let own = self.program.model.mixtures.get(mixture as usize).map_or(InstanceId(0), |m| m.instance);
        self.instance(own).owner.unwrap_or(own)
    }

    /// Everything on the bench with its type and what is known of that.
    fn things(&self) -> String {
        let mut rows = vec![vec!["label".to_string(), "what".to_string(), "stands".to_string()]];
        for thing in self.program.scene.instances.iter().filter(|i| i.owner.is_none()) {
            let on = thing.support.map(|s| format!("on **{}**", self.instance(s).name)).unwrap_or_default();
            rows.push(vec![format!("**{}**", thing.name), self.kind(thing), on]);
        }
        let mut lines = Vec::new();
        table(&rows, 0, &mut lines);
        lines.join("\n")
    }

    /// A type with the first sentence of what its declaration says of it.
    fn kind(&self, thing: &Instance) -> String {
        let names = self.lab.tables.names;
        let docs = names.decls.iter().find_map(|d| match crate::names::item_name(d.item) {
            Some((name, _)) if name == thing.kind && !d.item.docs.is_empty() => Some(d.item.docs.join(" ")),
            _ => None,
        });
        match docs {
            Some(docs) => {
                let first = docs.split_once(". ").map_or(docs.as_str(), |(first, _)| first);
                format!("{}. {}", thing.kind, first.trim_end_matches('.').replace('|', "/"))
            }
            None => thing.kind.clone(),
        }
    }

    fn reagents(&self, held: &[(f64, f64)]) -> Option<String> {
        let masses: Vec<f64> = held.iter().map(|h| h.0).collect();
        let all = self.program.inventory.measure_out(&masses);
        if all.is_empty() {
            return None;
        }
        let head = ["substance", "for", "mass", "amount", "volume"];
        let mut rows = vec![head.map(str::to_string).to_vec()];
        for m in all {
            let known = self.program.inventory.substance(&m.substance);
            let within = m.within.iter().rev().map(|w| words::plain(w)).collect::<Vec<_>>().join(", for ");
            let amount = known.and_then(|s| s.molar_mass).map(|molar| amount(m.mass / molar)).unwrap_or_default();
            let volume = known.and_then(|s| s.density).map(|d| words::volume(m.mass / d)).unwrap_or_default();
            rows.push(vec![words::plain(&m.substance), within, words::mass(m.mass), amount, volume]);
        }
        let mut lines = Vec::new();
        table(&rows, 0, &mut lines);
        Some(lines.join("\n"))
    }

    /// Hazards of what is brought in and of what can come of it.
    fn safety(&self) -> Option<String> {
        let stock = &self.program.inventory;
        let masses = vec![0.0; stock.holdings.len()];
        let brought: Vec<String> = stock.measure_out(&masses).into_iter().map(|m| m.substance).collect();
        let mut lines: Vec<String> = Vec::new();
        for s in stock.substances.iter().filter(|s| !s.hazards.is_empty()) {
            let how = if brought.contains(&s.name) { "" } else { " (can form)" };
            lines.push(format!("- **{}**{how}: {}", words::plain(&s.name), hazards(s)));
        }
        if lines.is_empty() {
            return None;
        }
        lines.push(String::new());
        lines.push(
            "This is a screen: it lists recorded hazards of the single substances and does not judge mixtures, amounts or the room. Other substances may still be dangerous. Read the safety data sheets."
                .to_string(),
        );
        Some(lines.join("\n"))
    }

    /// Solutions, each after those it is made of.
    fn solutions(&self, held: &[(f64, f64)]) -> List {
        let stock = &self.program.inventory;
        let mut needed: BTreeMap<&str, f64> = BTreeMap::new();
        for (holding, (mass, _)) in stock.holdings.iter().zip(held) {
            *needed.entry(&holding.substance).or_default() += mass;
        }
        // Each recipe comes after those that use it, so that what they need is known.
        let mut steps = Vec::new();
        for recipe in &stock.recipes {
            let whole = needed.get(recipe.name.as_str()).copied().unwrap_or(0.0);
            for part in &recipe.parts {
                *needed.entry(&part.substance).or_default() += whole * part.share;
            }
            let parts: Vec<String> = recipe
                .parts
                .iter()
                .map(|p| format!("{} of {}", words::mass(whole * p.share), words::plain(&p.substance)))
                .collect();
            let label = recipe.label.as_ref().map(|l| format!(" Label it {}.", written(l))).unwrap_or_default();
            let mix = joined(&parts, "and");
            let place = self.place(recipe.span);
            steps.push(Step::new(format!(
                "Make {} of **{}**: mix {mix}.{label} {place}",
                words::mass(whole),
                words::plain(&recipe.name)
            )));
        }
        let order = self.made_in_order();
        List { steps: order.into_iter().filter_map(|i| steps.get(i).cloned()).collect(), ..List::default() }
    }

    /// Recipes in the order of the text, but each after those it needs.
    fn made_in_order(&self) -> Vec<usize> {
        let recipes = &self.program.inventory.recipes;
        let mut open: Vec<usize> = (0..recipes.len()).collect();
        open.sort_by_key(|i| recipes[*i].span);
        let mut out: Vec<usize> = Vec::new();
        while !open.is_empty() {
            let waits =
                |i: &usize| recipes[*i].parts.iter().any(|p| open.iter().any(|o| recipes[*o].name == p.substance));
            let next = open.iter().position(|i| !waits(i)).unwrap_or(0);
            out.push(open.remove(next));
        }
        out
    }

    /// `12 mmol (552.8 mg, 704.2 µL) of EtOH`: an amount of substance with what is measured out for it.
    fn portion(&self, name: &str, written: &str, mass: f64, amount: f64) -> String {
        let known = self.program.inventory.substance(name);
        let in_mol = |molar: f64| (amount * molar - mass).abs() <= 1e-9 * mass && molar != 1.0;
        let Some(known) = known.filter(|s| s.molar_mass.is_some_and(in_mol)) else {
            return format!("{written} of {}", words::plain(name));
        };
        let volume = known.density.map(|d| format!(", {}", words::volume(mass / d))).unwrap_or_default();
        format!("{written} ({}{volume}) of {}", words::mass(mass), words::plain(name))
    }

    /// Vessels are filled.
    fn setting_up(&self, held: &[(f64, f64)]) -> List {
        let mut fills: Vec<(Vec<String>, (String, String), String)> = Vec::new();
        let stock = &self.program.inventory;
        for mixture in 0..self.program.model.mixtures.len() as u32 {
            let terms = stock.holdings.iter().zip(held).filter(|(h, _)| h.mixture == mixture);
            let texts: Vec<String> = terms
                .clone()
                .map(|(h, (mass, amount))| {
                    self.portion(&h.substance, &words::quantity(&h.unit.show(*amount)), *mass, *amount)
                })
                .collect();
            let Some((first, _)) = terms.clone().next() else { continue };
            let warm = first.start.as_ref().map(|(node, unit)| words::quantity(&unit.show(self.at_first(*node))));
            let warm = warm.map(|t| format!(" at {t}")).unwrap_or_default();
            let ph = self
                .ph_at_first(mixture)
                .map(|(ph, holds)| match holds {
                    true => format!(" Its pH is {ph:.2}."),
                    false => format!(" Its pH is near {ph:.2}, outside the range of its model."),
                })
                .unwrap_or_default();
            let (vessel, what, place) = (
                self.instance(self.holder(mixture)).name.clone(),
                (format!("{}{warm}", joined(&texts, "and")), ph),
                self.place(first.span),
            );
            match fills.last_mut() {
                Some((vessels, same, at)) if *same == what && *at == place => vessels.push(vessel),
                _ => fills.push((vec![vessel], what, place)),
            }
        }
        let steps = fills.into_iter().map(|(vessels, (what, ph), place)| {
            let each = if vessels.len() > 1 { "each of " } else { "" };
            let names: Vec<String> = match vessels.as_slice() {
                [first, .., last] if vessels.len() > 4 => vec![format!("**{first}** to **{last}**")],
                all => all.iter().map(|v| format!("**{v}**")).collect(),
            };
            Step::new(format!("Put {what} into {each}{}.{ph} {place}", joined(&names, "and")))
        });
        List { steps: steps.collect(), ..List::default() }
    }
}

fn amount(mol: f64) -> String {
    words::scaled(mol, &[(1.0, "mol"), (1e-3, "mmol"), (1e-6, "µmol"), (1e-9, "nmol")])
}

/// Hazards with the temperatures that matter.
fn hazards(s: &Substance) -> String {
    let mut all: Vec<String> = s.hazards.iter().map(|h| words::plain(h)).collect();
    all.extend(s.flash_point.as_ref().map(|t| format!("flash point {}", words::quantity(t))));
    all.extend(s.boiling_point.as_ref().map(|t| format!("boils at {}", words::quantity(t))));
    all.join(", ")
}

/// A label as it stands in the file: `0.04 mol/kg of KI`.
fn written(label: &str) -> String {
    match label.split_once(" of ") {
        Some((value, of)) => format!("{} of {}", words::quantity(value), words::plain(of)),
        None => label.to_string(),
    }
}
