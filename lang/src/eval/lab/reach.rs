//! Which species can get into which mixture: by what it holds, by transfers, by reactions and dissociation, by laws and effects that
//! write an amount. And what states that hold an instance can point at.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::scene::InstanceId;
use serde::{Deserialize, Serialize};

use super::Elaborator;
use super::targets::Numbers;
use crate::declare::{SpeciesId, Tables};

/// Species by mixture name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reach {
    sets: BTreeMap<String, BTreeSet<SpeciesId>>,
    /// What laws and effects write, as far as earlier rounds found it: it only grows, so that the rounds come to an end.
    written: BTreeMap<String, BTreeSet<SpeciesId>>,
    origins: BTreeMap<String, BTreeSet<String>>,
    /// What states that hold an instance can point at, by the name of the state; it only grows as well.
    pub(super) targets: BTreeMap<String, Arc<Numbers>>,
}

impl Reach {
    /// The species that can get into a mixture.
    pub fn of(&self, mixture: &str) -> Vec<SpeciesId> {
        self.set(mixture).map(|s| s.iter().copied().collect()).unwrap_or_default()
    }

    /// The species that can get into a mixture, if any can.
    pub fn set(&self, mixture: &str) -> Option<&BTreeSet<SpeciesId>> {
        self.sets.get(mixture)
    }

    /// Whether it follows from what is moved where alone, so that a task which moves the same has the same.
    pub fn is_moved(&self) -> bool {
        self.written.is_empty()
    }

    /// Whether all its species are of a table: one that an earlier state of a text led to may name some that are gone.
    pub fn is_of(&self, tables: &Tables<'_>) -> bool {
        let species = tables.species.iter().count();
        self.sets.values().chain(self.written.values()).flatten().all(|s| (s.0 as usize) < species)
    }

    /// The reagents that can get into a mixture; known only where something asks for lineage.
    pub fn origins<'r>(&'r self, mixture: &str) -> impl Iterator<Item = &'r str> + use<'r> {
        self.origins.get(mixture).into_iter().flatten().map(String::as_str)
    }

    /// Everything that can get into any mixture.
    pub fn anywhere(&self) -> BTreeSet<SpeciesId> {
        self.sets.values().flatten().copied().collect()
    }

    /// Whether another one has all of it.
    pub(crate) fn is_within(&self, other: &Reach) -> bool {
        let Reach { sets, written, origins, targets } = self;
        within(sets, &other.sets, BTreeSet::is_subset)
            && within(written, &other.written, BTreeSet::is_subset)
            && within(origins, &other.origins, BTreeSet::is_subset)
            && within(targets, &other.targets, |a, b| a.is_subset(b))
    }

    /// Takes in all of another one.
    pub(crate) fn extend(&mut self, other: Reach) {
        let Reach { sets, written, origins, targets } = other;
        sets.into_iter().for_each(|(name, set)| self.sets.entry(name).or_default().extend(set));
        written.into_iter().for_each(|(name, set)| self.written.entry(name).or_default().extend(set));
        origins.into_iter().for_each(|(name, set)| self.origins.entry(name).or_default().extend(set));
        for (name, set) in targets {
            Arc::make_mut(self.targets.entry(name).or_default()).extend(set.iter().copied());
        }
    }

    /// Closes the initial contents, and what laws and effects write, under transfers, reactions and dissociation.
    pub fn compute(lab: &Elaborator<'_>) -> Reach {
        let mut written = lab.reach.written.clone();
        for (id, s) in &lab.written {
            written.entry(lab.instances[id.0 as usize].name.clone()).or_default().insert(*s);
        }
        let mut sets: BTreeMap<InstanceId, BTreeSet<SpeciesId>> = BTreeMap::new();
        for i in 0..lab.instances.len() as u32 {
            let id = InstanceId(i);
            if lab.per_species(id) {
                let inst = &lab.instances[i as usize];
                let held = inst.contents.iter().map(|c| c.0);
                sets.insert(id, held.chain(written.get(&inst.name).into_iter().flatten().copied()).collect());
            }
        }
        loop {
            let before: usize = sets.values().map(BTreeSet::len).sum();
            for set in sets.values_mut() {
                close(set, lab.tables);
            }
            for (from, to) in &lab.moves {
                let moved = sets.get(from).cloned().unwrap_or_default();
                sets.entry(*to).or_default().extend(moved);
            }
            if sets.values().map(BTreeSet::len).sum::<usize>() == before {
                break;
            }
        }
        let name = |id: InstanceId| lab.instances[id.0 as usize].name.clone();
        let origins = if lab.follows_lineage { origins(lab) } else { BTreeMap::new() };
        Reach {
            sets: sets.into_iter().map(|(id, set)| (name(id), set)).collect(),
            written,
            origins: origins.into_iter().map(|(id, set)| (name(id), set)).collect(),
            targets: targets(lab),
        }
    }
}

/// Whether each list of one is a part of the list of that name of another, which need not have empty ones.
fn within<T: Default>(
    one: &BTreeMap<String, T>,
    other: &BTreeMap<String, T>,
    is_subset: impl Fn(&T, &T) -> bool,
) -> bool {
    one.iter().all(|(name, set)| is_subset(set, other.get(name).unwrap_or(&T::default())))
}

/// What states can point at: what this round began with, and whatever it noted beyond that.
fn targets(lab: &Elaborator<'_>) -> BTreeMap<String, Arc<Numbers>> {
    let mut all = lab.reach.targets.clone();
    let noted = lab.noted_targets();
    // A state that may point at anything after all.
    all.retain(|name, _| noted.contains_key(name));
    for (name, numbers) in noted {
        let known = all.entry(name).or_default();
        if !numbers.is_subset(known) {
            *known = Arc::new(known.union(&numbers).copied().collect());
        }
    }
    all
}

/// The reagents that transfers can bring into each mixture.
fn origins(lab: &Elaborator<'_>) -> BTreeMap<InstanceId, BTreeSet<String>> {
    let mut sets: BTreeMap<InstanceId, BTreeSet<String>> = BTreeMap::new();
    for (i, inst) in lab.instances.iter().enumerate() {
        if let Some(origin) = &inst.origin {
            sets.entry(InstanceId(i as u32)).or_default().insert(origin.clone());
        }
    }
    loop {
        let mut changed = false;
        for (from, to) in lab.moves.iter().chain(&lab.soiled) {
            let moved = sets.get(from).cloned().unwrap_or_default();
            let there = sets.entry(*to).or_default();
            let before = there.len();
            there.extend(moved);
            changed |= there.len() != before;
        }
        if !changed {
            return sets;
        }
    }
}

/// Adds what the species can turn into.
fn close(set: &mut BTreeSet<SpeciesId>, tables: &Tables<'_>) {
    let is_formal = |s: &SpeciesId| tables.species.get(*s).is_electron;
    loop {
        let before = set.len();
        let ions: Vec<_> = set.iter().flat_map(|s| tables.species.get(*s).dissolves.iter().map(|d| d.0)).collect();
        set.extend(ions);
        for r in &tables.reactions {
            if r.reactants.iter().all(|(s, _)| set.contains(s)) {
                set.extend(r.products.iter().map(|p| p.0));
            }
        }
        for e in tables.equilibria.iter().filter(|e| e.gas.is_none()) {
            let is_there = |left: bool| {
                let mut side = e.terms.iter().filter(|(_, n)| (*n < 0.0) == left);
                side.all(|(s, _)| set.contains(s) || tables.species.get(*s).is_water || is_formal(s))
            };
            // What was put in without its liquid goes into the water.
            let has_liquid = e.terms.iter().all(|(s, _)| {
                tables.species.get(*s).liquid.is_none_or(|liquid| set.contains(&liquid) || set.contains(s))
            });
            let is_wet = e.terms.iter().all(|(s, _)| !tables.species.get(*s).is_water || set.contains(s));
            if is_wet && has_liquid && (is_there(true) || is_there(false)) {
                set.extend(e.terms.iter().map(|t| t.0).filter(|s| !is_formal(s)));
            }
        }
        if set.len() == before {
            return;
        }
    }
}
