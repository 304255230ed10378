//! A part of the model: states that move together, how far they have been followed, and what ends their law.

use std::collections::VecDeque;

use matterix_ir::NodeId;
use matterix_ir::interval::Interval;
use nalgebra::Vector6;

use super::bernstein::hull;
use super::dense::{Dense, POINTS};
use super::integrator::{Integrator, Next, Stuck};
use super::mode::Piece;
use super::suspicion::{Scarce, first_drained};
use super::switch::{Crossing, Switches, Unseen};

/// So far may straight lines between the points of a step that are shown lie from its curves, as a share of what a state has spanned: a
/// small part of what recordings promise.
const CLOSE: f64 = 1.5e-4;

/// A step is shown in so many pieces at most.
const MOST_SHOWN: f64 = 100.0;

/// What ends the law of a part within a step; times are s on the clock of the step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Ending {
    /// A comparison changes.
    Crossed(Crossing),
    /// An amount is used up that a law takes more of, by its index.
    Drained(f64, usize),
    /// A comparison may change more often than can be seen.
    Unseen(NodeId),
}

/// One step of the integration, looked through.
#[derive(Clone, Debug)]
struct Leg {
    dense: Dense,
    ending: Option<Ending>,
}

/// States that move together.
#[derive(Clone)]
pub(super) struct Part {
    integrator: Integrator,
    sight: Sight,
    leg: Leg,
    /// Steps taken beyond it.
    ahead: VecDeque<Leg>,
    /// Beyond those no step was found.
    stuck: Option<Stuck>,
    /// How far the leg has been gone through, s on its clock.
    at: f64,
    /// What its states are there.
    values: Vec<f64>,
    /// Where within the leg its curves are shown, s on its clock, the next one last.
    shows: Vec<f64>,
    /// The least and the greatest value of each of its states so far, where curves are shown.
    spans: Vec<(f64, f64)>,
    /// A state was set from outside: what is known of the solution is wrong.
    pub(super) is_broken: bool,
}

/// What is looked for in each step.
#[derive(Clone)]
struct Sight {
    switches: Switches,
    /// The places of the states that these rest on.
    places: Vec<u32>,
    values: Vec<f64>,
    /// Amounts that must not be used up.
    scarce: Vec<Scarce>,
}

impl Sight {
    fn new(switches: Switches, places: Vec<u32>, scarce: Vec<Scarce>) -> Self {
        let values = vec![0.0; places.len()];
        Sight { switches, places, values, scarce }
    }

    /// The first thing that ends the law in a step, from `from` on, s on the clock of the step.
    fn look(&mut self, dense: &Dense, from: f64) -> Option<Ending> {
        let (switches, places) = (&mut self.switches, &self.places);
        let mut path = |time, out: &mut [f64]| dense.some(time, places, out);
        let found = switches.first_crossing(dense.clock, (from, dense.end), &mut self.values, &mut path);
        let crossing = match found {
            Ok(crossing) => crossing,
            Err(Unseen(node)) => return Some(Ending::Unseen(node)),
        };
        let end = crossing.map_or(dense.end, |c| c.time);
        let mut times: Vec<f64> = dense.times().filter(|&t| t > from && t < end).collect();
        times.push(end);
        let drained = first_drained(dense, &self.scarce, from, &times);
        drained.map(|(time, which)| Ending::Drained(time, which)).or(crossing.map(Ending::Crossed))
    }
}

impl Part {
    /// Begins to follow a piece by `integrator`.
    pub(super) fn new(integrator: Integrator, scarce: Vec<Scarce>) -> Self {
        let leg = Leg { dense: integrator.begin(), ending: None };
        let sight = Sight::new(Switches::none(), Vec::new(), scarce);
        let values = vec![0.0; integrator.moving.len()];
        let (ahead, shows, spans) = (VecDeque::new(), Vec::new(), Vec::new());
        Part { integrator, sight, leg, ahead, stuck: None, at: 0.0, values, shows, spans, is_broken: false }
    }

    /// Whether its solution goes on under the law of `piece`.
    pub(super) fn goes_on(&self, piece: &Piece) -> bool {
        !self.is_broken && self.integrator.moving == piece.moving && *self.integrator.rates() == piece.rates
    }

    /// Other comparisons end its law from where it has been followed to on, or the same ones that have other truths by now.
    /// `states` are those that they rest on, ascending.
    pub(super) fn look_out_for(&mut self, switches: Switches, states: &[u32]) {
        if self.sight.switches.find_the_same(&switches) {
            return;
        }
        let scarce = std::mem::take(&mut self.sight.scarce);
        let places = states.iter().map(|s| self.place(*s)).collect();
        self.sight = Sight::new(switches, places, scarce);
        self.leg.ending = (self.at < self.leg.dense.end).then(|| self.sight.look(&self.leg.dense, self.at)).flatten();
        for leg in &mut self.ahead {
            leg.ending = self.sight.look(&leg.dense, leg.dense.start);
        }
    }

    /// The states it moves, ascending.
    pub(super) fn moving(&self) -> &[u32] {
        &self.integrator.moving
    }

    /// The place of one of them.
    pub(super) fn place(&self, state: u32) -> u32 {
        self.integrator.moving.partition_point(|m| *m < state) as u32
    }

    /// What a state is at the lab time `time`, s, beyond where it has been followed to; none where it has been followed so far.
    pub(super) fn value(&self, state: u32, time: f64) -> Option<f64> {
        let clock = self.leg.dense.clock;
        if clock.lab(self.at) >= time {
            return None;
        }
        Some(self.value_within(state, time, self.at))
    }

    /// What a state was at the lab time `time`, s, within the present step.
    pub(super) fn value_at(&self, state: u32, time: f64) -> f64 {
        self.value_within(state, time, self.leg.dense.start)
    }

    /// What a state is at the lab time `time`, s, within the present step from `from`, s on its clock, on.
    fn value_within(&self, state: u32, time: f64, from: f64) -> f64 {
        let dense = &self.leg.dense;
        let mut value = [0.0];
        dense.some(dense.clock.local(time).clamp(from, dense.end), &[self.place(state)], &mut value);
        value[0]
    }

    /// Bounds of a state over a piece of lab time, s, within the present step.
    pub(super) fn value_over(&self, state: u32, (from, to): Interval) -> Interval {
        hull(Vector6::from_fn(|k, _| self.value_at(state, from + POINTS[k] * (to - from))))
    }

    /// Its integration is given up: what states were worth is kept in `sizes`.
    pub(super) fn leave(&self, sizes: &mut [f64]) {
        let worth = self.integrator.moving.iter().zip(self.integrator.tolerance.sizes());
        worth.filter(|_| !self.is_broken).for_each(|(state, size)| sizes[*state as usize] = *size);
    }

    /// The present step.
    pub(super) fn dense(&self) -> &Dense {
        &self.leg.dense
    }

    /// Where it is, s on the clock of the present step.
    pub(super) fn at(&self) -> f64 {
        self.at
    }

    /// Goes on to the next step, if the present one has been gone through; whether it did.
    pub(super) fn step(&mut self) -> Result<bool, Stuck> {
        if self.at < self.leg.dense.end {
            return Ok(false);
        }
        if self.is_short() {
            self.run();
        }
        self.leg = self.ahead.pop_front().ok_or(self.stuck.unwrap_or(Stuck::Short))?;
        self.at = self.leg.dense.start;
        Ok(true)
    }

    /// Shows the step that has just begun at so many points within it that straight lines from one to the next stay as close to its
    /// curves as [`CLOSE`].
    pub(super) fn show_within(&mut self) {
        let dense = &self.leg.dense;
        self.spans.resize(self.integrator.moving.len(), (f64::INFINITY, f64::NEG_INFINITY));
        let mut pieces = 1.0_f64;
        for (place, span) in (0..).zip(&mut self.spans) {
            let (bulge, least, most) = dense.bulge(place);
            *span = (span.0.min(least), span.1.max(most));
            let size = span.1 - span.0;
            if bulge > CLOSE * size {
                pieces = pieces.max((bulge / (CLOSE * size)).sqrt().ceil());
            }
        }
        let (from, length, pieces) = (dense.start, dense.end - dense.start, pieces.min(MOST_SHOWN));
        self.shows = (1..pieces as u32).rev().map(|k| from + length * f64::from(k) / pieces).collect();
    }

    /// Where its curves are shown next within the present step, s on its clock.
    pub(super) fn next_show(&self) -> Option<f64> {
        self.shows.last().copied().filter(|time| *time < self.limit())
    }

    /// When it is to be gone on with: where its curves are shown next, or at the end of its step; s of lab time.
    pub(super) fn due(&self) -> f64 {
        self.next_show().map_or_else(|| self.until(), |time| self.leg.dense.clock.lab(time))
    }

    /// Whether the present step is the last one that was taken, and more can be.
    pub(super) fn is_short(&self) -> bool {
        self.ahead.is_empty() && self.stuck.is_none() && self.leg.ending.is_none() && !self.is_broken
    }

    /// Takes steps beyond the present one. That rests on nothing outside of the part, so it does not matter when it is done.
    pub(super) fn run(&mut self) {
        let Part { integrator, sight, ahead, .. } = self;
        let run = integrator.run(&mut |dense| {
            let ending = sight.look(dense, dense.start);
            ahead.push_back(Leg { dense: dense.clone(), ending });
            if ending.is_some() { Next::Stop } else { Next::Step }
        });
        self.stuck = run.err();
    }

    /// What ends the law in the present step.
    pub(super) fn ending(&self) -> Option<Ending> {
        self.leg.ending
    }

    /// How far the present step is good for, s on its clock: to its end, or to where the law ends.
    pub(super) fn limit(&self) -> f64 {
        match self.leg.ending {
            Some(Ending::Crossed(crossing)) => crossing.time,
            Some(Ending::Drained(time, _)) => time,
            Some(Ending::Unseen(_)) => self.at,
            None => self.leg.dense.end,
        }
    }

    /// The same, s of lab time.
    pub(super) fn until(&self) -> f64 {
        self.leg.dense.clock.lab(self.limit())
    }

    /// Goes on to `time`, s on the clock of the present step, and sets the states there.
    pub(super) fn reach(&mut self, time: f64, states: &mut [f64]) {
        self.at = time.clamp(self.at, self.leg.dense.end);
        while self.shows.last().is_some_and(|time| *time <= self.at) {
            self.shows.pop();
        }
        let Part { integrator, values, leg, .. } = self;
        leg.dense.at(self.at, values);
        for (&state, &value) in integrator.moving.iter().zip(values.iter()) {
            states[state as usize] = value;
        }
    }

    /// The same to the lab time `time`, s.
    pub(super) fn reach_lab(&mut self, time: f64, states: &mut [f64]) {
        if self.leg.dense.clock.lab(self.at) < time {
            self.reach(self.leg.dense.clock.local(time), states);
        }
    }
}
