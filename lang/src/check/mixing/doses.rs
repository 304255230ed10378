//! What a step moves while it lasts, where matter flows evenly all the time: the dose of a pump, and what one that was switched on
//! pumps during a wait.

use std::collections::BTreeSet;

use matterix_ir::NodeId;
use matterix_ir::model::Action;
use matterix_ir::plan::Operation;
use matterix_ir::scene::InstanceId;

use super::Walk;
use super::state::MixtureState;

/// Relative difference from which on a rate is not the same.
const SAME_RATE: f64 = 1e-9;

/// The longest time that a flow is followed for, s: that of a wait without a timeout.
const LONGEST: f64 = 30.0 * 86400.0;

/// How often the end of a flow is halved in on.
const HALVINGS: usize = 60;

/// How long something lasts.
#[derive(Clone, Copy)]
enum Lasts {
    /// So many seconds.
    For(f64),
    /// Until a condition holds.
    Until(NodeId),
}

/// What an even flow has brought about when a step is over.
pub(super) struct Dose {
    /// States with their values.
    values: Vec<(u32, f64)>,
    /// Mixtures with the share of the first that has gone into the second.
    shares: Vec<(InstanceId, InstanceId, f64)>,
}

impl Dose {
    /// Whether its share of a transfer is known.
    pub(super) fn takes(&self, from: InstanceId, to: InstanceId) -> bool {
        self.shares.iter().any(|(a, b, _)| (*a, *b) == (from, to))
    }
}

impl Walk<'_, '_> {
    /// The dose of an operation; none where nothing flows, or where time or amount cannot be told.
    pub(super) fn dose(&self, o: &Operation, world: &MixtureState) -> Option<Dose> {
        let lasts = match (&o.takes, &o.until) {
            (Some(takes), _) => Lasts::For(self.eyes.value(takes.nominal, world)),
            (None, Some(until)) => Lasts::Until(until.node),
            (None, None) => return None,
        };
        let dose = self.even_flow(lasts, world)?;
        let mut end = world.clone();
        dose.values.iter().for_each(|(state, value)| end.states[*state as usize] = *value);
        let over = o.until.as_ref().is_none_or(|until| self.eyes.value(until.node, &end) != 0.0);
        over.then_some(dose)
    }

    /// What flows during a wait.
    pub(super) fn waited(&self, time: f64, world: &MixtureState) -> Option<Dose> {
        self.even_flow(Lasts::For(time), world)
    }

    /// Whether something flows already.
    pub(super) fn is_flowing(&self, world: &MixtureState) -> bool {
        !self.eyes.lab.streams.is_empty() && self.flowing(world).is_none_or(|flowing| !flowing.is_empty())
    }

    /// Whether something flows, or may: processes whose condition is not known before the run, and events.
    pub(super) fn may_flow(&self, world: &MixtureState) -> bool {
        let may = |process: usize| self.runs(process, world) != Some(false);
        !self.by_event.is_empty() || self.eyes.lab.streams.keys().any(|(process, ..)| may(*process))
    }

    /// Whether a process acts, if that is known.
    pub(super) fn runs(&self, process: usize, world: &MixtureState) -> Option<bool> {
        let guard = self.eyes.lab.processes.get(process).and_then(|p| p.guard);
        guard.map_or(Some(true), |g| self.eyes.truth(g, world))
    }

    fn even_flow(&self, lasts: Lasts, world: &MixtureState) -> Option<Dose> {
        if self.eyes.lab.streams.is_empty() {
            return None;
        }
        let flowing = self.flowing(world)?;
        if flowing.is_empty() {
            return None;
        }
        let rates = self.rates(&flowing, world)?;
        let after = |t: f64| {
            let mut later = world.clone();
            rates.iter().for_each(|(state, rate)| later.states[*state as usize] += rate * t);
            later
        };
        let time = match lasts {
            Lasts::For(time) => time,
            Lasts::Until(node) => self.time_until(node, world, after)?,
        };
        if !(time > 0.0 && time <= LONGEST) {
            return None;
        }
        let halfway = self.rates(&flowing, &after(time / 2.0))?;
        let even = |(was, is): (&(u32, f64), &(u32, f64))| {
            was.0 == is.0 && (was.1 - is.1).abs() <= SAME_RATE * was.1.abs().max(is.1.abs())
        };
        if rates.len() != halfway.len() || !rates.iter().zip(&halfway).all(even) {
            return None;
        }
        let end = after(time);
        let mut values: Vec<(u32, f64)> = rates.iter().map(|(s, _)| (*s, end.states[*s as usize])).collect();
        for (state, value) in &mut values {
            let before = world.states[*state as usize];
            if self.eyes.counted.contains(state) && *value < 0.0 {
                if *value < -SAME_RATE * before {
                    return None;
                }
                *value = 0.0;
            }
        }
        values.extend(self.set_by_events(world, &after(time * (1.0 + SAME_RATE))));
        let shares = flowing.iter().filter_map(|(process, from, to)| {
            let passage = self.eyes.passage(*from, *to);
            let (there, state) =
                passage.iter().map(|(a, _)| (world.states[*a as usize], *a)).find(|(n, _)| *n > 0.0)?;
            Some((*from, *to, -self.rate(state, world, |p| p == *process) * time / there))
        });
        Some(Dose { values, shares: shares.collect() })
    }

    /// When a condition comes true, with what events set by then; none where it is true at once, or never.
    fn time_until(&self, node: NodeId, world: &MixtureState, after: impl Fn(f64) -> MixtureState) -> Option<f64> {
        let over = |t: f64| {
            let mut then = after(t);
            for (state, value) in self.set_by_events(world, &then) {
                then.states[state as usize] = value;
            }
            self.eyes.value(node, &then) != 0.0
        };
        let mut late =
            std::iter::successors(Some(1e-3), |t| Some(t * 2.0)).take_while(|t| *t < LONGEST).find(|t| over(*t))?;
        let mut early = 0.0;
        for _ in 0..HALVINGS {
            let middle = (early + late) / 2.0;
            match over(middle) {
                true => late = middle,
                false => early = middle,
            }
        }
        (early > 0.0).then_some(late)
    }

    /// Transfers that go on; none where it is not known which.
    fn flowing(&self, world: &MixtureState) -> Option<BTreeSet<(usize, InstanceId, InstanceId)>> {
        let lab = self.eyes.lab;
        let (mut flowing, mut open) = (BTreeSet::new(), self.by_event.clone());
        for (stream, flows) in &lab.streams {
            match self.runs(stream.0, world) {
                Some(false) => {}
                Some(true) if self.eyes.value(*flows, world) == 0.0 => {}
                Some(true) => {
                    flowing.insert(*stream);
                }
                None => {
                    open.insert((stream.1, stream.2));
                }
            }
        }
        let involved: BTreeSet<InstanceId> = flowing.iter().flat_map(|(_, from, to)| [*from, *to]).collect();
        let apart = open.iter().all(|(from, to)| !involved.contains(from) && !involved.contains(to));
        apart.then_some(flowing)
    }

    /// How fast these transfers change the states; none where an amount is among them of which that is not known.
    fn rates(
        &self,
        flowing: &BTreeSet<(usize, InstanceId, InstanceId)>,
        world: &MixtureState,
    ) -> Option<Vec<(u32, f64)>> {
        let processes: BTreeSet<usize> = flowing.iter().map(|stream| stream.0).collect();
        let mut out = Vec::new();
        for (state, contributions) in &self.eyes.lab.rates {
            if !contributions.iter().any(|c| processes.contains(&c.process)) {
                continue;
            }
            let rate = self.rate(*state, world, |p| processes.contains(&p));
            if rate.is_finite() {
                out.push((*state, rate));
            } else if self.eyes.counted.contains(state) {
                return None;
            }
        }
        Some(out)
    }

    /// How fast some processes change a state.
    fn rate(&self, state: u32, world: &MixtureState, of: impl Fn(usize) -> bool) -> f64 {
        let contributions = self.eyes.lab.rates.get(&state).into_iter().flatten();
        contributions.filter(|c| of(c.process)).map(|c| self.eyes.value(c.node, world)).sum()
    }

    /// What events assign that come about between two points, but amounts: a pump that has given its dose stops.
    fn set_by_events(&self, before: &MixtureState, after: &MixtureState) -> Vec<(u32, f64)> {
        let begins = |when| self.eyes.value(when, before) == 0.0 && self.eyes.value(when, after) != 0.0;
        let come = self.events.iter().filter(|e| begins(e.when));
        let assigned = come.flat_map(|e| &e.actions).filter_map(|action| match action {
            Action::Assign { state, value, .. } if !self.eyes.counted.contains(state) => {
                Some((*state, self.eyes.value(*value, after)))
            }
            _ => None,
        });
        assigned.filter(|(_, value)| value.is_finite()).collect()
    }

    /// Judges the hazards of what flows over with a dose.
    pub(super) fn pours(&mut self, dose: &Dose, world: &mut MixtureState) {
        for (from, to, share) in &dose.shares {
            self.transfers(*from, *to, *share, world);
        }
    }

    /// Puts down what a dose has left.
    pub(super) fn given_off(&self, dose: &Dose, world: &mut MixtureState) {
        let ends = dose.shares.iter().flat_map(|(from, to, _)| [*from, *to]);
        world.settle_at(self.eyes, &dose.values, ends);
    }
}
