//! H2: hazards that a step brings about, such as a set point above the boiling point of what stands on the plate.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Domain;
use matterix_ir::{Diagnostic, Span};

use super::Walk;
use super::world::World;
use crate::elaborate::hazards::Hazard;

/// The hazards of a lab, by the states they depend on.
pub(super) struct Hazards {
    all: Vec<Hazard>,
    by_state: BTreeMap<u32, Vec<usize>>,
    /// What is reported already, until it is over.
    present: BTreeSet<usize>,
}

impl Hazards {
    pub(super) fn new(all: Vec<Hazard>) -> Self {
        let mut by_state: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (i, hazard) in all.iter().enumerate() {
            for s in &hazard.states {
                by_state.entry(*s).or_default().push(i);
            }
        }
        Hazards { all, by_state, present: BTreeSet::new() }
    }
}

impl Walk<'_, '_> {
    /// Judges the hazards that are there whatever is done: of things as they are, said once for each declaration.
    pub(super) fn endangered(&mut self, world: &World) {
        for hazard in self.hazards.all.iter().filter(|h| h.states.is_empty()) {
            let mut thing = hazard.about;
            while let Some(owner) = thing.and_then(|id| self.eyes.lab.instances[id.0 as usize].owner) {
                thing = Some(owner);
            }
            let place = thing.map_or(self.place(), |id| self.eyes.lab.instances[id.0 as usize].span);
            if self.eyes.nominal_truth(hazard.when, world) != Some(true) {
                continue;
            }
            let d = self.hazard(hazard, world, place, "declared here");
            if !self.found.iter().any(|f| f.span() == d.span() && f.code == d.code) {
                self.found.push(d);
            }
        }
    }

    /// Judges the hazards that depend on states that a step changed.
    pub(super) fn endanger(&mut self, world: &mut World) {
        let changed = world.take_changed();
        let touched: BTreeSet<usize> =
            changed.iter().filter_map(|s| self.hazards.by_state.get(s)).flatten().copied().collect();
        for i in touched {
            let hazard = &self.hazards.all[i];
            if self.eyes.nominal_truth(hazard.when, world) != Some(true) {
                self.hazards.present.remove(&i);
                continue;
            }
            if self.hazards.present.contains(&i) {
                continue;
            }
            let d = self.hazard(hazard, world, self.place(), "brings it about");
            self.hazards.present.insert(i);
            if !self.found.iter().any(|f| f.span() == d.span() && f.headline == d.headline) {
                self.found.push(d);
            }
        }
    }

    fn hazard(&self, hazard: &Hazard, world: &World, place: Span, said: &str) -> Diagnostic {
        let mut d = Diagnostic::error(hazard.code(), place, hazard.headline(), said);
        d.severity = hazard.severity();
        let mut places = vec![place];
        for s in &hazard.states {
            if let Some(span) = world.set_at(*s)
                && !places.contains(&span)
            {
                places.push(span);
                let name = &self.eyes.lab.states[*s as usize].name;
                d = d.because(span, format!("`{name}` is set here"));
            }
        }
        for term in &hazard.terms {
            let value = self.eyes.value(term.node, world);
            if let Domain::Quantity(unit) = &term.domain
                && value.is_finite()
            {
                d = d.help(format!("`{}` is {}", term.name, unit.show(value)));
            }
        }
        if let Some(help) = &hazard.help {
            d = d.help(help.clone());
        }
        d
    }
}
