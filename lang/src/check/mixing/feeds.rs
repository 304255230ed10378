//! What laws, events and effects bring into mixtures by writing amounts.

use std::cell::RefCell;
use std::rc::Rc;

use matterix_ir::model::{Action, Event};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Span};

use super::Walk;
use super::evaluator::NodeEvaluator;
use super::state::{Came, Contents, Entry, MixtureState};
use crate::declare::SpeciesId;
use crate::elaborate::writes::vanishes;

/// An amount that a law writes.
pub(super) struct Feed {
    mixture: InstanceId,
    species: SpeciesId,
    /// While it is written, or when.
    condition: Option<NodeId>,
    /// What is written: a rate, or what comes to be there.
    value: NodeId,
    /// The place of the law.
    span: Span,
    /// What the mixture held when the species was there already, or on its way, the last time.
    idle: RefCell<Option<Contents>>,
}

impl Feed {
    fn new(mixture: InstanceId, species: SpeciesId, condition: Option<NodeId>, value: NodeId, span: Span) -> Feed {
        Feed { mixture, species, condition, value, span, idle: RefCell::default() }
    }
}

/// The amounts that processes and events write. What reactions make, and the ions that a species becomes, is known otherwise.
pub(super) fn feeds(eyes: &NodeEvaluator<'_, '_>, events: &[Event]) -> Vec<Feed> {
    let lab = eyes.lab;
    let species = &lab.tables.species;
    let is_ion = |m: InstanceId, s: SpeciesId| {
        let held = lab.reach.set(&lab.instances[m.0 as usize].name);
        held.into_iter().flatten().any(|have| species.get(*have).dissolves.iter().any(|d| d.0 == s))
    };
    let mut out = Vec::new();
    let streams = |process: usize| lab.streams.keys().any(|(p, ..)| *p == process);
    for (state, (mixture, species)) in &eyes.amount_of {
        for c in lab.rates.get(state).into_iter().flatten() {
            let process = &lab.processes[c.process];
            if process.reaction.is_none() && !streams(c.process) {
                let (condition, value, span) = (process.guard, c.node, process.span);
                out.push(Feed::new(*mixture, *species, condition, value, span));
            }
        }
    }
    for event in events {
        for action in &event.actions {
            let Action::Assign { state, value, .. } = action else { continue };
            let Some((mixture, species)) = eyes.amount_of.get(state) else { continue };
            if !is_ion(*mixture, *species) {
                let (condition, span) = (Some(event.when), event.span);
                out.push(Feed::new(*mixture, *species, condition, *value, span));
            }
        }
    }
    // What is zero whatever is there brings nothing, as where a salt that dissolves is set to none.
    let lasting = |f: &Feed| !vanishes(&lab.graph, f.value, &|c| lab.never(c), &|_| false);
    out.into_iter().filter(lasting).collect()
}

/// Whether a mixture holds more of a species than a residue.
fn holds(world: &MixtureState, mixture: InstanceId, species: SpeciesId) -> bool {
    world.held(mixture).get(&species).is_some_and(|e| !e.residue)
}

impl Walk<'_, '_> {
    /// What laws may have written by now, with what is there, and what streams carry on of it.
    pub(super) fn fed(&mut self, world: &mut MixtureState) {
        for _ in 0..self.feeds.len() {
            let due = |f: &&Feed| self.feeds_now(f, world);
            let due: Vec<(InstanceId, SpeciesId, Span)> =
                self.feeds.iter().filter(due).map(|f| (f.mixture, f.species, f.span)).collect();
            if due.is_empty() {
                return;
            }
            for (mixture, species, span) in due {
                self.bring(mixture, species, span, world);
            }
            self.streams(None, world);
        }
    }

    /// Whether a law may write something now that is not there. Contents that are as they were before have the species as before.
    fn feeds_now(&self, feed: &Feed, world: &MixtureState) -> bool {
        let held = world.held(feed.mixture);
        if feed.idle.borrow().as_ref().is_some_and(|before| Rc::ptr_eq(before, held)) {
            return false;
        }
        if self.is_there(feed.mixture, feed.species, world) {
            feed.idle.replace(Some(held.clone()));
            return false;
        }
        self.may_write(feed.condition, feed.value, world)
    }

    /// The species that an effect brings into a mixture that has none of it.
    pub(super) fn effected(&self, action: &Action, world: &MixtureState) -> Option<(InstanceId, SpeciesId)> {
        let Action::Assign { state, value, .. } = action else { return None };
        let (mixture, species) = *self.eyes.amount_of.get(state)?;
        let brings = !self.is_there(mixture, species, world) && self.may_write(None, *value, world);
        brings.then_some((mixture, species))
    }

    /// Whether a species is in a mixture, or something that it comes of there.
    fn is_there(&self, mixture: InstanceId, species: SpeciesId, world: &MixtureState) -> bool {
        let splits =
            |have: &SpeciesId| self.eyes.lab.tables.species.get(*have).dissolves.iter().any(|d| d.0 == species);
        holds(world, mixture, species) || world.held(mixture).keys().any(splits)
    }

    /// Whether something may be written now.
    fn may_write(&self, condition: Option<NodeId>, value: NodeId, world: &MixtureState) -> bool {
        let absent = |state: u32| self.eyes.amount_of.get(&state).is_some_and(|(m, s)| !holds(world, *m, *s));
        condition.is_none_or(|c| self.eyes.truth(c, world) != Some(false))
            && !vanishes(&self.eyes.lab.graph, value, &|c| self.eyes.lab.never(c), &absent)
    }

    /// Puts a species into a mixture and judges what it meets there.
    pub(super) fn bring(&mut self, mixture: InstanceId, species: SpeciesId, span: Span, world: &mut MixtureState) {
        let came = vec![Came { span, into: mixture }];
        let entry = Entry { content: None, certain: false, residue: false, came };
        Rc::make_mut(&mut world.mixtures[mixture.0 as usize]).insert(species, entry);
        let others: Vec<SpeciesId> = world.present(mixture).map(|p| p.0.0).filter(|o| *o != species).collect();
        self.meet(world, mixture, species, &others, None);
        self.touch(world, mixture, species, None);
        let place = self.place();
        for s in world.react(self.eyes.lab, mixture, place) {
            let all: Vec<SpeciesId> = world.present(mixture).map(|p| p.0.0).filter(|o| *o != s).collect();
            self.meet(world, mixture, s, &all, None);
        }
        self.settle();
    }
}
