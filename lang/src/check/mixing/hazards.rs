//! H2: hazards that a step brings about, such as a set point above the boiling point of what stands on the plate.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::Arc;

use matterix_ir::listing::joined;
use matterix_ir::model::{Domain, Event};
use matterix_ir::plan::{Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, FileId, Said, Span};

use super::Walk;
use super::evaluator::NodeEvaluator;
use super::settled::Settling;
use super::state::MixtureState;
use super::uses::Stream;
use crate::elaborate::hazards::{Hazard, Watched};

/// So many things have a finding of their own for the same hazard at one place; the last finding names the others.
const MOST_THINGS: usize = 3;

/// So many of the others are named.
const MOST_NAMES: usize = 12;

/// What was said of one hazard at one place.
#[derive(Default)]
struct Told {
    /// Its combinations of things.
    all: Vec<usize>,
    /// The headline of the last finding of its own.
    last: String,
}

/// The hazards of a lab, by the states they depend on.
pub(super) struct Hazards {
    pub all: Arc<[Hazard]>,
    by_state: BTreeMap<u32, Vec<usize>>,
    /// What is reported already, until it is over.
    present: BTreeSet<usize>,
    /// Those of values that are recorded or kept from a step on.
    standing: BTreeMap<usize, Span>,
    /// Those of transfers that have come about, with what is said of them where a value is used.
    since: BTreeMap<usize, (Span, String)>,
    /// By place and hazard of values and transfers: those of its combinations of things that were told there.
    told: BTreeMap<(Span, Span), Told>,
    /// What happens at once before each of them is asked.
    settling: Settling,
}

impl Hazards {
    pub(super) fn new(all: Vec<Hazard>) -> Self {
        let mut by_state: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (i, hazard) in all.iter().enumerate() {
            for s in hazard.states.iter().filter(|_| !matches!(hazard.watched, Watched::Transfer(..))) {
                by_state.entry(*s).or_default().push(i);
            }
        }
        let (present, standing, since, told) = (BTreeSet::new(), BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Hazards { all: all.into(), by_state, present, standing, since, told, settling: Settling::default() }
    }

    /// Takes note of the events that set what hazards ask for.
    pub(super) fn settle(&mut self, eyes: &NodeEvaluator<'_, '_>, events: &[Event], library: &BTreeSet<FileId>) {
        let (settling, reads) = Settling::new(eyes, &self.all, events, library);
        self.settling = settling;
        for (i, state) in reads.iter().flat_map(|(i, states)| states.iter().map(|s| (*i, *s))) {
            let known = self.by_state.entry(state).or_default();
            if !matches!(self.all[i].watched, Watched::Transfer(..)) && !known.contains(&i) {
                known.push(i);
            }
        }
    }
}

impl Walk<'_, '_> {
    /// A moment as a hazard sees it.
    fn seen_by<'m>(&self, i: usize, world: &'m MixtureState) -> Cow<'m, MixtureState> {
        self.hazards.settling.settled(i, self.eyes, self.events, world)
    }

    /// Judges the hazards that are there whatever is done: of things as they are, said once for each declaration.
    pub(super) fn endangered(&mut self, world: &MixtureState) {
        let as_it_is = |h: &&Hazard| h.states.is_empty() && h.watched == Watched::Steps;
        for hazard in self.hazards.all.iter().filter(as_it_is) {
            let place = self.declared_at(hazard);
            if self.eyes.nominal_truth(hazard.when, world) != Some(true) {
                continue;
            }
            let d = self.hazard(hazard, self.worded(hazard, world), world, (place, "declared here"));
            if !self.found.iter().any(|f| f.span() == d.span() && f.code == d.code) {
                self.found.push(d);
            }
        }
    }

    /// Where the whole thing stands in the lab that a hazard is about.
    fn declared_at(&self, hazard: &Hazard) -> Span {
        let lab = self.eyes.lab;
        hazard.about.map_or(self.place(), |id| lab.instances[lab.outermost(id).0 as usize].span)
    }

    /// Judges the hazards of what the text gives for the start, where it is given.
    pub(super) fn given(&mut self, world: &MixtureState) {
        let all = self.hazards.all.clone();
        for (i, hazard) in all.iter().enumerate() {
            let Watched::Given(span) = hazard.watched else { continue };
            if self.eyes.nominal_truth(hazard.when, world) == Some(true) {
                let place = span.unwrap_or_else(|| self.declared_at(hazard));
                let d = self.hazard(hazard, self.worded(hazard, world), world, (place, "given here"));
                self.tell(i, d);
            }
        }
    }

    /// Judges the hazards of what the lab itself measures out: contents given in the dimension of a watched value.
    pub(super) fn measured_out(&mut self, world: &MixtureState) {
        let lab = self.eyes.lab;
        for held in &lab.held {
            let Some(m) = held.mixture else { continue };
            let dimension = &held.quantity.dimension;
            let is_of =
                |h: &Hazard| h.about == Some(m) || (h.about.is_some() && h.about == lab.instances[m.0 as usize].owner);
            let watches = |h: &Hazard| h.measure.as_ref().is_some_and(|d| d == dimension) && is_of(h);
            let found: Vec<usize> = (0..self.hazards.all.len()).filter(|i| watches(&self.hazards.all[*i])).collect();
            for i in found {
                let hazard = &self.hazards.all[i];
                let world = &*self.seen_by(i, world);
                if self.eyes.nominal_truth(hazard.when, world) == Some(true) {
                    let d = self.hazard(hazard, self.worded(hazard, world), world, (held.span, "dispensed here"));
                    self.tell(i, d);
                }
            }
        }
    }

    /// Judges the hazards that depend on states that a step changed.
    pub(super) fn endanger(&mut self, world: &mut MixtureState) {
        let changed = world.take_changed();
        let touched: BTreeSet<usize> =
            changed.iter().filter_map(|s| self.hazards.by_state.get(s)).flatten().copied().collect();
        for i in touched {
            let hazard = &self.hazards.all[i];
            let law = self.uses.by_law.get(&i).copied();
            let since = match hazard.watched {
                Watched::Steps => None,
                Watched::Value(_) if law.is_some() => None,
                _ if self.hazards.standing.contains_key(&i) => self.hazards.standing.get(&i).copied(),
                _ => continue,
            };
            let world = &*self.seen_by(i, world);
            if self.eyes.nominal_truth(hazard.when, world) != Some(true) {
                self.hazards.present.remove(&i);
                continue;
            }
            if !self.hazards.present.insert(i) {
                continue;
            }
            let hazard = &self.hazards.all[i];
            if self.follows(hazard) {
                continue;
            }
            // What is so from the start stands where the lab puts it.
            let (place, said) = match self.places.len() {
                1 => (self.declared_at(hazard), "true from the start"),
                _ => (self.place(), "this step causes it"),
            };
            let law = law.filter(|_| hazard.watched != Watched::Steps);
            let mut d = self.hazard(
                hazard,
                self.worded(hazard, world),
                world,
                (law.unwrap_or(place), if law.is_some() { "used here" } else { said }),
            );
            if law.is_some() {
                d = d.because(place, said);
            }
            if let Some(since) = since.filter(|since| *since != place) {
                d = d.because(since, "used from here on");
            }
            self.tell(i, d);
        }
    }

    /// Whether a hazard of a mixture only follows from a pair that must not meet and that this step, or the lab, is reported to bring together
    /// there: mending that mends it.
    fn follows(&self, hazard: &Hazard) -> bool {
        let place = if self.places.len() == 1 { None } else { Some(self.place()) };
        hazard.grave
            && self.told.iter().any(|(pair, at, i)| {
                Some(pair.0) == hazard.about
                    && place.is_none_or(|place| place == *at)
                    && self.found.get(*i).is_some_and(Diagnostic::is_error)
            })
    }

    /// Judges the hazards of what a step uses.
    pub(super) fn used(&mut self, id: StepId, world: &MixtureState) {
        let Some(found) = self.uses.by_step.get(&id).cloned() else { return };
        let lasts = matches!(self.plan.get(id).step, Step::Record { .. } | Step::Keep { .. });
        for i in found.iter().copied() {
            if lasts {
                let place = self.place();
                self.hazards.standing.entry(i).or_insert(place);
            }
            self.used_here(i, world);
        }
    }

    /// Judges the hazards of a flow that goes on from now on.
    pub(super) fn flows(&mut self, stream: Stream, world: &MixtureState) {
        let found = self.uses.by_stream.get(&stream).cloned();
        found.iter().flat_map(|found| found.iter()).for_each(|i| self.used_here(*i, world));
    }

    /// Judges the hazards of a transfer that is about to take a share.
    pub(super) fn transfers(&mut self, from: InstanceId, to: InstanceId, share: f64, world: &mut MixtureState) {
        let Some(found) = self.uses.by_transfer.get(&(from, to)).cloned() else { return };
        world.share = share;
        for i in found {
            let hazard = &self.hazards.all[i];
            if !matches!(hazard.watched, Watched::Transfer(.., Some(_))) {
                self.used_here(i, world);
                continue;
            }
            let world = &*self.seen_by(i, world);
            if self.eyes.nominal_truth(hazard.when, world) == Some(true) {
                let words = self.worded(hazard, world).unwrap_or_default();
                let place = self.place();
                self.hazards.since.insert(i, (place, words));
            }
        }
        world.share = f64::NAN;
    }

    /// Tells a hazard of a transfer where the value is used that it is about.
    fn used_after(&mut self, i: usize, world: &MixtureState) {
        let Some((place, words)) = self.hazards.since.remove(&i) else { return };
        let world = &*self.seen_by(i, world);
        let hazard = &self.hazards.all[i];
        // What was so after the transfer is what counts.
        let words = Some(words).filter(|words| !words.is_empty()).or_else(|| self.worded(hazard, world));
        let d = self.hazard(hazard, words, world, (self.place(), "used here"));
        self.tell(i, d.because(place, "mixed here"));
    }

    fn used_here(&mut self, i: usize, world: &MixtureState) {
        let hazard = &self.hazards.all[i];
        if self.hazards.since.contains_key(&i) {
            return self.used_after(i, world);
        }
        let world = &*self.seen_by(i, world);
        if self.eyes.nominal_truth(hazard.when, world) == Some(true) {
            let said = if matches!(hazard.watched, Watched::Transfer(..)) { "mixed here" } else { "used here" };
            let d = self.hazard(hazard, self.worded(hazard, world), world, (self.place(), said));
            self.hazards.present.insert(i);
            self.tell(i, d);
        }
    }

    /// Takes in a finding, unless the same was said at the same place, or said of several other things.
    fn tell(&mut self, i: usize, d: Diagnostic) {
        let hazard = &self.hazards.all[i];
        let once = hazard.watched != Watched::Steps || !hazard.said.is_empty();
        if once {
            let told = self.hazards.told.entry((d.span(), hazard.span)).or_default();
            if told.all.contains(&i) {
                return;
            }
            told.all.push(i);
            if told.all.len() > MOST_THINGS {
                return;
            }
            told.last.clone_from(&d.headline);
        }
        if !self.found.iter().any(|f| f.span() == d.span() && f.headline == d.headline) {
            self.found.push(d);
        }
    }

    /// Names the things beside those that have a finding of their own in the last of these.
    pub(super) fn tell_of_others(&mut self) {
        for ((place, _), told) in &self.hazards.told {
            let Some(others) = told.all.get(MOST_THINGS..).filter(|others| !others.is_empty()) else { continue };
            let names: BTreeSet<String> = others.iter().map(|i| self.hazards.all[*i].about(self.eyes.lab)).collect();
            let mut listed: Vec<String> = names.iter().take(MOST_NAMES).cloned().collect();
            if names.len() > MOST_NAMES {
                listed.push(format!("{} more", names.len() - MOST_NAMES));
            }
            let said = format!("the same holds for {}", joined(&listed, "and"));
            if let Some(d) = self.found.iter_mut().find(|d| d.span() == *place && d.headline == told.last) {
                d.help.insert(0, said);
            }
        }
    }

    /// What is so, in the words of a hazard: of the first that it asks about and that is so.
    fn worded(&self, hazard: &Hazard, world: &MixtureState) -> Option<String> {
        self.all_words(hazard, world).next()
    }

    /// The same of all that are so.
    fn all_words<'s>(&'s self, hazard: &'s Hazard, world: &'s MixtureState) -> impl Iterator<Item = String> + 's {
        let is_so = |said: &&Said| self.eyes.nominal_truth(said.node, world) == Some(true);
        let lab = self.eyes.lab;
        let value = |node| {
            let value = self.eyes.value(node, world);
            Ok::<_, Infallible>(Some(value).filter(|v| v.is_finite()))
        };
        let instance = |at: f64| lab.instances.get(at as usize).map_or("nothing", |i| i.name.as_str()).to_string();
        hazard.said.iter().filter(is_so).filter_map(move |Said { text, .. }| text.show(value, instance).ok())
    }

    fn hazard(
        &self,
        hazard: &Hazard,
        words: Option<String>,
        world: &MixtureState,
        (place, said): (Span, &str),
    ) -> Diagnostic {
        let in_words = words.is_some();
        let others: Vec<String> = match &words {
            Some(first) => self.all_words(hazard, world).filter(|other| other != first).take(MOST_THINGS).collect(),
            None => Vec::new(),
        };
        let headline = words.unwrap_or_else(|| hazard.headline());
        let mut d = Diagnostic::error(hazard.code(), place, headline, said);
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
        for term in hazard.terms.iter().filter(|_| !in_words) {
            let value = self.eyes.value(term.node, world);
            if let Domain::Quantity(unit) = &term.domain
                && value.is_finite()
            {
                d = d.help(format!("`{}` is {}", term.name, unit.show(value)));
            }
        }
        for other in others {
            d = d.help(format!("also: {other}"));
        }
        if let Some(help) = &hazard.help {
            d = d.help(help.clone());
        }
        if !hazard.grave && in_words {
            d = d.help(format!("if this is intended, write `allow {} \"why\"`", hazard.name));
        }
        d
    }
}
