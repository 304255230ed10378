//! From what was noted of a run to the bill.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::inventory::Count;
use matterix_ir::model::Content;
use matterix_ir::scene::InstanceId;

use super::follow::Follower;
use super::origins::NOTHING;
use super::*;
use crate::record::run::TOOL;
use crate::run::Outcome;

/// g per kg.
const G: f64 = 1e3;

/// What a mixture is to the bill.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Only gives.
    Inventory,
    /// A vessel with something else in it.
    Product,
    /// No vessel: a tip, a line.
    Device,
    Waste,
}

impl Follower<'_> {
    /// The bill of the run that was followed, for a number of runs like it.
    pub fn bill(&self, outcome: &Outcome, runs: u64) -> Bill {
        let maker = Maker { of: self, parts: self.parts(), runs };
        let plan = &self.program.plan;
        let status = match outcome.status {
            crate::exec::RunStatus::Passed => "passed",
            crate::exec::RunStatus::ExpectationFailed => "missed",
            crate::exec::RunStatus::Cancelled => "cancelled",
            crate::exec::RunStatus::Failed | crate::exec::RunStatus::Fault => "failed",
        };
        Bill {
            schema: BILL_SCHEMA,
            tool: TOOL.to_owned(),
            workflow: plan.workflow.clone(),
            lab: self.program.scene.lab.clone(),
            arguments: plan.arguments.clone(),
            status: status.to_owned(),
            duration: outcome.end_time,
            runs,
            studies: self.program.inventory.studies.clone(),
            reagents: maker.reagents(),
            stocks: maker.stocks(),
            weigh_in: maker.weigh_in(),
            consumables: maker.consumables(),
            labware: maker.labware(),
            mixtures: maker.mixtures(),
            yields: self.yields(),
            waste: maker.waste(),
            devices: maker.devices(outcome.end_time),
            person: self.asked.iter().map(|(time, text)| PersonLine { time: *time, text: text.clone() }).collect(),
            costs: None,
        }
    }

    /// The value at the end of a tally of an instance.
    fn tally(&self, instance: InstanceId, count: Count) -> Option<f64> {
        let tallies = self.program.inventory.tallies.iter().zip(&self.tallies);
        tallies.filter(|(t, _)| t.count == count && t.instance == instance).map(|(_, v)| v.1).next_back()
    }

    /// An instance and everything it is a part of, from the inside out.
    fn owners(&self, instance: InstanceId) -> Vec<InstanceId> {
        let up = |id: &InstanceId| self.program.scene.instances.get(id.0 as usize).and_then(|i| i.owner);
        std::iter::successors(Some(instance), up).collect()
    }

    fn root(&self, instance: InstanceId) -> InstanceId {
        self.owners(instance).last().copied().unwrap_or(instance)
    }

    /// How much there is of a content, by its number in its mixture, at the end, mol: at equilibrium where that settles it.
    pub(super) fn amount(&self, mixture: usize, number: usize, content: &Content) -> Option<f64> {
        let settled = self.settled.get(mixture).and_then(|s| *s.amounts.get(number)?);
        settled.or_else(|| self.states.get(content.state as usize).copied())
    }

    /// The thing that holds a mixture.
    pub(super) fn holder(&self, mixture: usize) -> InstanceId {
        let own = self.program.model.mixtures[mixture].instance;
        self.owners(own).get(1).copied().unwrap_or(own)
    }

    fn parts(&self) -> Vec<Part> {
        let part = |i: usize| {
            let holder = self.holder(i);
            if self.owners(holder).iter().any(|o| self.tally(*o, Count::Waste).is_some_and(|v| v != 0.0)) {
                return Part::Waste;
            }
            if self.tally(holder, Count::Dead).is_none() {
                return Part::Device;
            }
            let row = self.origins.mass.get(i).map_or(&[][..], Vec::as_slice);
            let all: f64 = row.iter().map(|m| m.abs()).sum();
            let own = |h: usize| self.program.inventory.holdings.get(h).is_some_and(|h| h.mixture as usize == i);
            let foreign: f64 = row.iter().enumerate().filter(|(h, _)| !own(*h)).map(|(_, m)| m.abs()).sum();
            let gave = self.origins.gave.get(i).copied().unwrap_or(false);
            if gave && foreign <= all * NOTHING { Part::Inventory } else { Part::Product }
        };
        (0..self.program.model.mixtures.len()).map(part).collect()
    }
}

struct Maker<'f, 'p> {
    of: &'f Follower<'p>,
    parts: Vec<Part>,
    runs: u64,
}

impl Maker<'_, '_> {
    fn name(&self, instance: InstanceId) -> &str {
        &self.of.program.scene.get(instance).name
    }

    fn kind(&self, instance: InstanceId) -> &str {
        &self.of.program.scene.get(instance).kind
    }

    /// Share of a mixture that cannot be got out.
    fn dead(&self, mixture: usize) -> f64 {
        self.of.tally(self.of.holder(mixture), Count::Dead).unwrap_or(0.0)
    }

    fn reagents(&self) -> Vec<ReagentLine> {
        let holdings = &self.of.program.inventory.holdings;
        let mut names: Vec<&str> = Vec::new();
        for holding in holdings {
            if !names.contains(&holding.substance.as_str()) {
                names.push(&holding.substance);
            }
        }
        names.into_iter().map(|name| self.reagent(name)).collect()
    }

    fn reagent(&self, name: &str) -> ReagentLine {
        let holdings = &self.of.program.inventory.holdings;
        let own: Vec<usize> = (0..holdings.len()).filter(|h| holdings[*h].substance == name).collect();
        let held = |h: &usize| self.of.held.get(*h).copied().unwrap_or_default();
        let mass: f64 = own.iter().map(|h| held(h).0).sum();
        let unit = own.first().map(|h| &holdings[*h].unit);
        let one_unit = own.iter().all(|h| Some(&holdings[*h].unit) == unit);
        let amount = unit.filter(|_| one_unit).map(|unit| {
            let si: f64 = own.iter().map(|h| held(h).1).sum();
            Quantity { value: unit.of_si(si), unit: unit.symbol.clone() }
        });
        let mut at = BTreeMap::from([(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.0)]);
        let (mut dead, mut taken, mut kept) = (0.0, 0.0, 0.0);
        for (i, part) in self.parts.iter().enumerate() {
            let here: f64 = own.iter().filter_map(|h| self.of.origins.mass.get(i)?.get(*h)).sum();
            *at.entry(*part as u8).or_default() += here;
            let put: f64 = own.iter().filter(|h| holdings[**h].mixture as usize == i).map(|h| held(h).0).sum();
            if *part == Part::Inventory {
                dead += here * self.dead(i);
                taken += put - here;
            } else {
                kept += put;
            }
        }
        let sum = |part: Part| at.get(&(part as u8)).copied().unwrap_or(0.0) * G;
        ReagentLine {
            name: name.to_owned(),
            amount,
            mass: mass * G,
            mass_all: mass * G * self.runs as f64,
            taken: taken * G,
            in_products: sum(Part::Product),
            left_over: sum(Part::Inventory),
            dead: dead * G,
            in_devices: sum(Part::Device),
            in_waste: sum(Part::Waste),
            least: (taken + dead + kept) * G,
        }
    }

    fn stocks(&self) -> Vec<StockLine> {
        let stocks = (0..self.parts.len()).filter(|i| self.parts[*i] == Part::Inventory);
        let line = |i: usize| {
            let own =
                self.of.program.inventory.holdings.iter().zip(&self.of.held).filter(|(h, _)| h.mixture as usize == i);
            let (mut held, mut texts) = (0.0, Vec::new());
            for (holding, (mass, amount)) in own {
                held += mass;
                texts.push(format!("{} of {}", holding.unit.show(*amount), holding.substance));
            }
            let left = self.of.origins.total(i);
            StockLine {
                vessel: self.name(self.of.holder(i)).to_owned(),
                holds: texts.join(" + "),
                held: held * G,
                taken: (held - left) * G,
                left_over: left * G,
                dead: left * self.dead(i) * G,
            }
        };
        stocks.map(line).collect()
    }

    fn weigh_in(&self) -> Vec<WeighLine> {
        let masses: Vec<f64> = self.of.held.iter().map(|h| h.0).collect();
        let all = self.of.program.inventory.measure_out(&masses);
        all.into_iter().map(|m| self.weigh(m.substance, m.within, m.mass)).collect()
    }

    fn weigh(&self, name: String, within: Vec<String>, mass: f64) -> WeighLine {
        let known = self.of.program.inventory.substance(&name);
        WeighLine {
            formula: known.map(|s| s.formula.clone()).unwrap_or_default(),
            amount: known.and_then(|s| s.molar_mass).map(|m| mass / m * 1e3),
            volume: known.and_then(|s| s.density).map(|d| mass / d * 1e6),
            hazards: known.map(|s| s.hazards.clone()).unwrap_or_default(),
            mass: mass * G,
            mass_all: mass * G * self.runs as f64,
            name,
            within,
        }
    }

    fn consumables(&self) -> Vec<ConsumableLine> {
        let scene = &self.of.program.scene;
        let mut lines: BTreeMap<(String, String), (BTreeSet<InstanceId>, u64, u64)> = BTreeMap::new();
        for (tally, (before, after)) in self.of.program.inventory.tallies.iter().zip(&self.of.tallies) {
            if tally.count != Count::Used {
                continue;
            }
            let pack = scene.get(tally.instance).owner.unwrap_or(tally.instance);
            let key = (self.kind(tally.instance).to_owned(), self.kind(pack).to_owned());
            let (packs, used, all) = lines.entry(key).or_default();
            packs.insert(pack);
            *used += u64::from(*after != 0.0 && *before == 0.0);
            *all += 1;
        }
        let line = |((kind, from_kind), (packs, used, all)): ((String, String), (BTreeSet<InstanceId>, u64, u64))| {
            let each_holds = (all / packs.len().max(1) as u64).max(1);
            ConsumableLine {
                kind,
                from_kind,
                from: packs.iter().map(|p| self.name(*p).to_owned()).collect(),
                used,
                used_all: used.saturating_mul(self.runs),
                each_holds,
                packs_all: used.saturating_mul(self.runs).div_ceil(each_holds),
            }
        };
        lines.into_iter().map(line).filter(|l| l.used > 0).collect()
    }

    fn labware(&self) -> Vec<LabwareLine> {
        let mut lines: BTreeMap<InstanceId, (usize, usize)> = BTreeMap::new();
        for (i, part) in self.parts.iter().enumerate() {
            if matches!(part, Part::Device | Part::Waste) {
                continue;
            }
            let (used, all) = lines.entry(self.of.root(self.of.holder(i))).or_default();
            let held = self.of.program.inventory.holdings.iter().any(|h| h.mixture as usize == i);
            *used += usize::from(held || self.of.origins.touched.get(i).copied().unwrap_or(false));
            *all += 1;
        }
        let line = |(id, (places_used, places)): (InstanceId, (usize, usize))| LabwareLine {
            name: self.name(id).to_owned(),
            kind: self.kind(id).to_owned(),
            places_used,
            places,
        };
        lines.into_iter().filter(|(_, (used, _))| *used > 0).map(line).collect()
    }

    /// What is in vessels that equilibria say something of.
    fn mixtures(&self) -> Vec<MixtureLine> {
        let model = &self.of.program.model;
        let is_told = |i: &usize| {
            let at_equilibrium = model.mixtures[*i].contents.iter().any(|c| c.settled.is_some());
            at_equilibrium && self.parts[*i] != Part::Device && self.of.origins.total(*i) > 0.0
        };
        (0..self.parts.len()).filter(is_told).map(|i| self.mixture(i)).collect()
    }

    fn mixture(&self, i: usize) -> MixtureLine {
        let model = &self.of.program.model;
        let mixture = &model.mixtures[i];
        let name = self.name(mixture.instance);
        let own = |index: u32| {
            let observable = model.observables.get(index as usize)?;
            let own = observable.name.strip_prefix(name).unwrap_or(&observable.name).trim_start_matches('.');
            Some((own.to_owned(), &observable.unit))
        };
        let property = |(index, value): &(u32, f64)| {
            let (own, unit) = own(*index)?;
            let (value, unit) = (unit.of_si(*value), unit.symbol.clone());
            value.is_finite().then_some((own, Quantity { value, unit }))
        };
        let solid = |(at, c): (usize, &Content)| {
            let species = model.species.get(c.species as usize)?;
            let amount = self.of.amount(i, at, c).filter(|n| *n > 0.0 && model.is_solid(c))?;
            Some(SolidLine { name: species.name.clone(), amount: amount * 1e3, mass: amount * species.molar_mass * G })
        };
        let (properties, outside) = self.of.settled.get(i).map_or((&[][..], &[][..]), |s| (&s.properties, &s.outside));
        MixtureLine {
            vessel: self.name(self.of.holder(i)).to_owned(),
            properties: properties.iter().filter_map(property).collect(),
            outside: outside.iter().filter_map(|i| Some(own(*i)?.0)).collect(),
            solids: mixture.contents.iter().enumerate().filter_map(solid).collect(),
        }
    }

    fn waste(&self) -> Vec<WasteLine> {
        let (program, mut out) = (self.of.program, Vec::new());
        for (i, mixture) in program.model.mixtures.iter().enumerate() {
            let mass = self.of.origins.total(i);
            if self.parts[i] != Part::Waste || mass <= 0.0 {
                continue;
            }
            let mut reagents: Vec<(String, f64)> = Vec::new();
            for (holding, mass) in program.inventory.holdings.iter().zip(&self.of.origins.mass[i]) {
                match reagents.iter_mut().find(|(name, _)| *name == holding.substance) {
                    Some(line) => line.1 += mass * G,
                    None => reagents.push((holding.substance.clone(), mass * G)),
                }
            }
            reagents.retain(|(_, m)| *m > mass * G * NOTHING);
            let contents = mixture.contents.iter().enumerate().filter_map(|(at, c)| {
                let species = program.model.species.get(c.species as usize)?;
                let amount = self.of.amount(i, at, c)?;
                Some((species.name.clone(), amount * species.molar_mass * G))
            });
            out.push(WasteLine {
                vessel: self.name(self.of.holder(i)).to_owned(),
                mass: mass * G,
                mass_all: mass * G * self.runs as f64,
                reagents,
                contents: contents.filter(|(_, m)| *m > mass * G * NOTHING).collect(),
            });
        }
        out
    }

    fn devices(&self, end: f64) -> Vec<DeviceLine> {
        let (program, scene) = (self.of.program, &self.of.program.scene);
        let passive = |id: InstanceId| {
            let root = self.of.root(id);
            let vessel = (0..self.parts.len()).any(|i| {
                !matches!(self.parts[i], Part::Device | Part::Waste) && self.of.root(self.of.holder(i)) == root
            });
            let pack =
                program.inventory.tallies.iter().any(|t| t.count == Count::Used && self.of.root(t.instance) == root);
            let running =
                program.inventory.tallies.iter().any(|t| t.count == Count::Running && self.of.root(t.instance) == root);
            (vessel || pack) && !running
        };
        let mut used: BTreeMap<InstanceId, Vec<(f64, f64)>> = BTreeMap::new();
        let mut running = used.clone();
        for (instance, from, to) in &self.of.uses {
            used.entry(self.of.root(*instance)).or_default().push((*from, *to));
        }
        for (tally, intervals) in program.inventory.tallies.iter().zip(&self.of.running) {
            if tally.count == Count::Running {
                running.entry(self.of.root(tally.instance)).or_default().extend(intervals);
            }
        }
        let readers = program.model.readings.iter().map(|r| self.of.root(r.instance));
        let all: BTreeSet<InstanceId> = used.keys().chain(running.keys()).copied().chain(readers).collect();
        let line = |id: InstanceId| {
            let used = used.get(&id).cloned().unwrap_or_default();
            let running = running.get(&id).cloned().unwrap_or_default();
            let busy = covered(used.iter().chain(&running).copied().collect(), end);
            let steps = self.of.steps.iter().enumerate();
            let own = steps.filter(|(i, _)| self.of.root(InstanceId(*i as u32)) == id).map(|(_, n)| *n);
            DeviceLine {
                name: scene.get(id).name.clone(),
                kind: scene.get(id).kind.clone(),
                in_use: covered(used, end),
                running: covered(running, end),
                busy,
                busy_all: busy * self.runs as f64,
                steps: own.max().unwrap_or(0),
            }
        };
        all.into_iter().filter(|id| !passive(*id)).map(line).collect()
    }
}

/// Length of the union of intervals that end by `end`, s.
fn covered(mut intervals: Vec<(f64, f64)>, end: f64) -> f64 {
    intervals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut sum, mut reached) = (0.0, 0.0_f64);
    for (from, to) in intervals {
        let (from, to) = (from.max(reached), to.min(end));
        if to > from {
            sum += to - from;
        }
        reached = reached.max(to);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::covered;

    #[test]
    fn intervals_that_overlap_count_once() {
        assert_eq!(covered(vec![(5.0, 9.0), (0.0, 2.0), (1.0, 3.0), (8.0, 20.0)], 10.0), 8.0);
    }
}
