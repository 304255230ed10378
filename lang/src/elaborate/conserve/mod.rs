//! What each law and effect does to matter: whether atoms, charge and mass stay the same, and whether what it carries from one
//! mixture to another takes its heat along.
//!
//! Laws of the library are left out: they are proven where they are tested.

mod linear;
mod sample;
mod warmth;

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Event};
use matterix_ir::plan::{Plan, Step};
use matterix_ir::quantity::show_number;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, FileId, NodeId, Span, codes};

use crate::declare::SpeciesId;
use crate::eval::Elaborator;
use linear::Linear;
use sample::{POINTS, Point};

/// A sum is off where it differs from nothing by more than this share of its terms.
const OFF: f64 = 1e-6;

/// A change of the amount of a species in a mixture.
#[derive(Clone, Copy)]
struct Change<T> {
    mixture: InstanceId,
    species: SpeciesId,
    by: T,
}

/// What must stay the same, by name: `element C`, `charge`, `mass`; so much of it is in a mol (kg by mass) of each species.
type Quantities = BTreeMap<String, BTreeMap<SpeciesId, f64>>;

/// A law or an effect, for what is said of it.
struct Law<'l> {
    name: &'l str,
    span: Span,
}

impl Elaborator<'_> {
    /// Judges the laws and effects of the user's own files.
    pub fn judge_conservation(&mut self, events: &[Event], plan: &Plan) {
        let library = library(self);
        let own = |span: Span| !library.contains(&span.file);
        let actions = plan.steps.iter().filter_map(|s| if let Step::Operation(o) = &s.step { Some(o) } else { None });
        let mut actions = actions.flat_map(|o| o.at_start.iter().chain(&o.at_end));
        let any = self.processes.iter().any(|p| own(p.span))
            || events.iter().any(|e| own(e.span))
            || actions.any(|a| own(written_at(a)));
        let found = if any { Judge::new(self).all(events, plan) } else { Vec::new() };
        found.into_iter().for_each(|d| self.report(d));
    }

    /// The processes of the user's own files of which no form shows that they conserve matter, with what they do to amounts.
    pub(super) fn doubtful(&self) -> Vec<(usize, Vec<(SpeciesId, NodeId)>)> {
        let library = library(self);
        if self.processes.iter().all(|p| library.contains(&p.span.file)) {
            return Vec::new();
        }
        let judge = Judge::new(self);
        let doubts = judge.rates().into_iter().filter(|(_, changes)| !judge.is_proven(changes));
        let only = |changes: Vec<Change<NodeId>>| changes.into_iter().map(|c| (c.species, c.by)).collect();
        doubts.map(|(process, changes)| (process, only(changes))).collect()
    }

    /// The elements, charge and mass of species.
    pub(super) fn quantities(&self, species: impl Iterator<Item = SpeciesId>) -> Quantities {
        let mut out = Quantities::new();
        for s in species {
            let def = self.tables.species.get(s);
            out.entry("mass".into()).or_default().insert(s, def.molar_mass);
            let Some(formula) = &def.formula else { continue };
            if formula.charge != 0 {
                out.entry("charge".into()).or_default().insert(s, f64::from(formula.charge));
            }
            for (element, count) in &formula.elements {
                out.entry(format!("element {element}")).or_default().insert(s, count.to_f64());
            }
        }
        out
    }
}

/// The files of the library.
fn library(lab: &Elaborator<'_>) -> BTreeSet<FileId> {
    lab.tables.names.modules.iter().filter(|m| m.is_library()).map(|m| m.file).collect()
}

/// Where an action stands in the text.
fn written_at(action: &Action) -> Span {
    match action {
        Action::Assign { span, .. } | Action::Move { span, .. } => *span,
    }
}

struct Judge<'l, 'a> {
    lab: &'l Elaborator<'a>,
    library: BTreeSet<FileId>,
    /// What each amount state is an amount of.
    amounts: BTreeMap<u32, (InstanceId, SpeciesId)>,
    found: Vec<Diagnostic>,
}

impl<'l, 'a> Judge<'l, 'a> {
    fn new(lab: &'l Elaborator<'a>) -> Self {
        let amounts = lab.extensive.iter().filter_map(|(k, state)| Some((*state, (k.instance, k.matter()?))));
        Judge { lab, library: library(lab), amounts: amounts.collect(), found: Vec::new() }
    }

    fn is_own(&self, span: Span) -> bool {
        !self.library.contains(&span.file)
    }

    /// What own processes do to amounts, by process.
    fn rates(&self) -> BTreeMap<usize, Vec<Change<NodeId>>> {
        let own: Vec<bool> = self.lab.processes.iter().map(|p| self.is_own(p.span)).collect();
        let mut out: BTreeMap<usize, Vec<Change<NodeId>>> = BTreeMap::new();
        if !own.contains(&true) {
            return out;
        }
        for (state, (mixture, species)) in &self.amounts {
            for c in self.lab.rates.get(state).into_iter().flatten().filter(|c| own[c.process]) {
                let change = Change { mixture: *mixture, species: *species, by: c.node };
                out.entry(c.process).or_default().push(change);
            }
        }
        out
    }

    fn all(mut self, events: &[Event], plan: &Plan) -> Vec<Diagnostic> {
        for (process, changes) in self.rates() {
            let info = &self.lab.processes[process];
            let law = Law { name: &info.name, span: info.span };
            if !self.said(law.span) {
                self.process(&law, process, &changes);
            }
        }
        for event in events {
            if !self.is_own(event.span) {
                continue;
            }
            self.instant(&Law { name: &event.name, span: event.span }, &event.actions, Some(event.when));
        }
        for step in &plan.steps {
            let Step::Operation(o) = &step.step else { continue };
            for actions in [&o.at_start, &o.at_end] {
                let at = actions.first().map(written_at);
                if let Some(span) = at.filter(|span| self.is_own(*span)) {
                    self.instant(&Law { name: &step.label, span }, actions, None);
                }
            }
        }
        self.found
    }

    /// Whether something was said of a law already: it is the same for all that it is about.
    fn said(&self, span: Span) -> bool {
        self.found.iter().any(|d| d.span() == span)
    }

    /// Whether a form shows that every quantity stays the same.
    fn is_proven(&self, changes: &[Change<NodeId>]) -> bool {
        let quantities = self.lab.quantities(changes.iter().map(|c| c.species));
        quantities.values().all(|of| {
            let mut sum = Linear::default();
            changes.iter().all(|c| sum.add(self.lab, c.by, of.get(&c.species).copied().unwrap_or(0.0)))
                && sum.vanishes()
        })
    }

    fn process(&mut self, law: &Law<'_>, process: usize, changes: &[Change<NodeId>]) {
        if self.is_proven(changes) {
            self.heat(law, process, changes);
            return;
        }
        let guard = self.lab.processes[process].guard;
        for number in 0..POINTS {
            let point = Point::new(self.lab, number);
            if guard.is_some_and(|g| point.value(g) != 1.0) {
                continue;
            }
            let now: Vec<Change<f64>> = changes
                .iter()
                .map(|c| Change { mixture: c.mixture, species: c.species, by: point.value(c.by) })
                .collect();
            if self.off(law, &now) {
                return;
            }
        }
        self.heat(law, process, changes);
    }

    /// Warns of a process that carries matter between mixtures and leaves its heat behind.
    fn heat(&mut self, law: &Law<'_>, process: usize, changes: &[Change<NodeId>]) {
        let mut crossing = BTreeSet::new();
        for c in changes {
            let mut sum = Linear::default();
            let of = |s: SpeciesId| self.lab.tables.species.get(s).molar_mass;
            let here = changes.iter().filter(|other| other.mixture == c.mixture);
            if !here.into_iter().all(|c| sum.add(self.lab, c.by, of(c.species))) || !sum.vanishes() {
                crossing.insert(c.mixture);
            }
        }
        if crossing.len() < 2 {
            return;
        }
        let through_flow = |id: InstanceId| {
            let mut parts = self.lab.flows.iter().filter(|((of, ..), _)| *of == id).flat_map(|(_, parts)| parts);
            parts.any(|c| c.process == process)
        };
        let carried =
            |state: u32| self.lab.rates.get(&state).is_some_and(|all| all.iter().any(|c| c.process == process));
        self.left_behind(law, &crossing, &|id, state| carried(state) || through_flow(id));
    }

    /// What an event or an effect does in an instant.
    fn instant(&mut self, law: &Law<'_>, actions: &[Action], when: Option<NodeId>) {
        let writes = |a: &Action| matches!(a, Action::Assign { state, .. } if self.amounts.contains_key(state));
        if !actions.iter().any(writes) || self.said(law.span) {
            return;
        }
        for number in 0..POINTS {
            let mut point = Point::new(self.lab, number);
            if when.is_some_and(|w| point.value(w) != 1.0) || !point.perform(actions) {
                continue;
            }
            let before = Point::new(self.lab, number);
            let changed = point.written().iter().filter_map(|(state, now)| {
                let (mixture, species) = *self.amounts.get(state)?;
                Some(Change { mixture, species, by: now - before.state(*state) })
            });
            let changes: Vec<Change<f64>> = changed.collect();
            if self.off(law, &changes) {
                return;
            }
            let mut mass: BTreeMap<InstanceId, (f64, f64)> = BTreeMap::new();
            for c in &changes {
                let by = c.by * self.lab.tables.species.get(c.species).molar_mass;
                let sum = mass.entry(c.mixture).or_default();
                *sum = (sum.0 + by, sum.1 + by.abs());
            }
            let crosses = |(id, (sum, of)): (&InstanceId, &(f64, f64))| (sum.abs() > OFF * of).then_some(*id);
            let crossing: BTreeSet<InstanceId> = mass.iter().filter_map(crosses).collect();
            if crossing.len() > 1 {
                let written = point.written();
                self.left_behind(law, &crossing, &|_, state| written.contains_key(&state));
                return;
            }
        }
    }

    /// Warns where some heat of the mixtures between which matter is carried stays as it is.
    fn left_behind(
        &mut self,
        law: &Law<'_>,
        crossing: &BTreeSet<InstanceId>,
        carried: &dyn Fn(InstanceId, u32) -> bool,
    ) {
        let scalars = self.lab.extensive.iter().filter(|(k, _)| k.species.is_none() && crossing.contains(&k.instance));
        let Some((key, _)) = scalars.into_iter().find(|(k, state)| !carried(k.instance, **state)) else { return };
        let names: Vec<String> =
            crossing.iter().map(|id| format!("`{}`", self.lab.instances[id.0 as usize].name)).collect();
        let (what, names) = (&key.member, names.join(" and "));
        let headline = format!("`{}` moves matter between {names} but leaves its `{what}` behind", law.name);
        let said = format!("the `{what}` of `{}` does not change", self.lab.instances[key.instance.0 as usize].name);
        let d = Diagnostic::warning(codes::HEAT_LEFT_BEHIND, law.span, headline, said)
            .help("write `move(rate, from: a, to: b)`: it moves a share of every quantity")
            .help(format!(
                "for one species, move its heat too: `a.{what}' -= h` and `b.{what}' += h` with `let h = q * S.heat_capacity * (a.temperature - reference_temperature)`"
            ));
        self.found.push(d);
    }

    /// Reports a law that makes or loses something at a point; whether it does.
    fn off(&mut self, law: &Law<'_>, changes: &[Change<f64>]) -> bool {
        if !changes.iter().all(|c| c.by.is_finite()) {
            return false;
        }
        let mut lost = Vec::new();
        let Some(most) = changes.iter().max_by(|a, b| a.by.abs().total_cmp(&b.by.abs())) else { return false };
        for (name, of) in self.lab.quantities(changes.iter().map(|c| c.species)) {
            let terms = changes.iter().filter_map(|c| Some(c.by * of.get(&c.species)?));
            let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), t| (sum + t, size + t.abs()));
            if sum.abs() > OFF * size {
                lost.push((name, sum / most.by.abs()));
            }
        }
        if lost.is_empty() {
            return false;
        }
        let def = self.lab.tables.species.get(most.species);
        let unit = if def.by_mass { "kg" } else { "mol" };
        let shown = |(name, by): &(String, f64)| match (name.as_str(), def.by_mass) {
            ("mass", false) => format!("{} g", show_number(by.abs() * 1e3)),
            ("mass", true) => format!("{} kg", show_number(by.abs())),
            _ => format!("{} mol of {}", show_number(by.abs()), name.trim_start_matches("element ")),
        };
        let each = [("makes", 1.0), ("loses", -1.0)].map(|(verb, side)| {
            let some: Vec<String> = lost.iter().filter(|(_, by)| by * side > 0.0).map(shown).collect();
            (!some.is_empty()).then(|| format!("{verb} {}", some.join(", ")))
        });
        let each: Vec<String> = each.into_iter().flatten().collect();
        let place = &self.lab.instances[most.mixture.0 as usize].name;
        let names: Vec<&str> = lost.iter().map(|(name, _)| name.as_str()).collect();
        let headline = format!("`{}` does not conserve {}", law.name, names.join(", "));
        let said = format!("for 1 {unit} of `{}` in `{place}` it {}", def.name, each.join(" and "));
        let d = Diagnostic::error(codes::BALANCE_BREACH, law.span, headline, said)
            .help("add to one mixture the amount that another loses, or write a `reaction`, whose equation is checked")
            .help("matter that escapes into the air needs a vessel as its target");
        self.found.push(d);
        true
    }
}
