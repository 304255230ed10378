//! What moves evenly: at rates that stay as they are until a condition changes. So do doses of pumps, what they take from and
//! give to vessels, and counters of the user's own. What moves evenly is known exactly at every moment.
//!
//! A stream takes the same share of each species, `amount * flow / volume`. While all of a mixture shrinks or grows in proportion,
//! amount over volume stays as it is, and the stream brings the same amounts at every moment; whether it does is read off the
//! rates themselves.

use std::collections::BTreeSet;
use std::rc::Rc;

use matterix_ir::{BinaryOp, NodeId, Op};

use super::Flow;
use super::facts::Facts;
use super::value::Known;

/// Rates that differ by less than this share of them are in proportion.
const ALIKE: f64 = 1e-9;

/// A state whose rate is a sum that may be even.
#[derive(Debug)]
pub(super) struct Track {
    pub state: u32,
    terms: Vec<Term>,
}

/// A term of a rate: `factor * value` while all conditions come out so.
#[derive(Debug)]
struct Term {
    factor: f64,
    conditions: Vec<(NodeId, bool)>,
    value: Value,
}

/// What a term is made of.
#[derive(Debug)]
enum Value {
    /// Something that does not change while what it rests on does not.
    Plain(NodeId),
    /// The share of a state that a stream carries: `state * quantity / size`.
    Share { state: u32, quantity: NodeId, size: NodeId, members: Vec<(u32, f64)> },
}

/// The states of a lab that may move evenly.
#[derive(Debug, Default)]
pub(super) struct Tracks {
    pub list: Vec<Track>,
    /// Other states that laws move.
    pub wild: Vec<u32>,
    /// Conditions of their terms.
    pub conditions: BTreeSet<NodeId>,
}

/// Rates at one moment, of the states that move evenly from then on.
#[derive(Clone, Debug, Default)]
pub(super) struct Even {
    /// State, value and rate, in the order of the states.
    pub slopes: Vec<(u32, f64, f64)>,
    /// States that are not known to be at rest or to move evenly.
    pub open: BTreeSet<u32>,
}

impl Even {
    /// How fast a state moves, per second.
    pub fn slope(&self, state: u32) -> f64 {
        let place = self.slopes.binary_search_by_key(&state, |(s, ..)| *s);
        place.map_or(0.0, |place| self.slopes[place].2)
    }

    /// Whether a state moves evenly.
    pub fn moves(&self, state: u32) -> bool {
        self.slopes.binary_search_by_key(&state, |(s, ..)| *s).is_ok()
    }
}

impl Flow<'_, '_> {
    /// The states that may move evenly; found once.
    pub(super) fn tracks(&mut self) -> Rc<Tracks> {
        if let Some(known) = &self.tracks {
            return known.clone();
        }
        let found = Rc::new(self.find_tracks());
        self.tracks = Some(found.clone());
        found
    }

    /// States, and what moves evenly by them: a pump that is set going changes what its vessels hold.
    pub(super) fn sets_going(&mut self, states: BTreeSet<u32>) -> BTreeSet<u32> {
        let tracks = self.tracks();
        if tracks.list.is_empty() {
            return states;
        }
        let behind = self.behind(&states);
        let even = tracks.list.iter().map(|t| t.state).filter(|s| behind.contains(s));
        even.chain(states.iter().copied()).collect()
    }

    /// Whether other branches or jobs set going what may move evenly.
    pub(super) fn flows_beside(&mut self) -> bool {
        let tracks = self.tracks();
        let mut beside = self.shared.iter().chain(self.of_jobs());
        beside.any(|set| tracks.list.iter().any(|t| set.contains(&t.state)))
    }

    fn find_tracks(&mut self) -> Tracks {
        let driven: BTreeSet<u32> = self.derivatives.iter().map(|d| d.state).collect();
        let streams = !self.lab.streams.is_empty();
        let mut tracks = Tracks::default();
        let derivatives = self.derivatives;
        for derivative in derivatives.iter().filter(|d| self.lab.graph.constant(d.rate) != Some(0.0)) {
            let rests = !self.parts(derivative.rate).states.iter().any(|s| driven.contains(s));
            let terms = if rests || streams { self.track(derivative.rate) } else { None };
            match terms {
                Some(terms) => tracks.list.push(Track { state: derivative.state, terms }),
                None => tracks.wild.push(derivative.state),
            }
        }
        tracks.list.sort_by_key(|t| t.state);
        let terms = tracks.list.iter().flat_map(|t| &t.terms);
        tracks.conditions = terms.flat_map(|t| t.conditions.iter().map(|(node, _)| *node)).collect();
        tracks
    }

    /// A rate as terms that may be even; none where it is something else.
    fn track(&mut self, rate: NodeId) -> Option<Vec<Term>> {
        let mut out = Vec::new();
        for (flux, factor) in self.terms(rate)? {
            let value = self.share(flux.rate).unwrap_or(Value::Plain(flux.rate));
            out.push(Term { factor, conditions: flux.conditions, value });
        }
        Some(out)
    }

    /// A term of a rate as what a stream carries of a state, where it is that.
    fn share(&mut self, node: NodeId) -> Option<Value> {
        let graph = &self.lab.graph;
        let Op::Binary(BinaryOp::Mul, a, b) = graph.op(node) else { return None };
        let (state, share) = match (graph.op(a), graph.op(b)) {
            (Op::State(s), _) => (s, b),
            (_, Op::State(s)) => (s, a),
            _ => return None,
        };
        let Op::Binary(BinaryOp::Div, quantity, size) = graph.op(share) else { return None };
        let form = self.form(size).filter(|form| form.constant == 0.0)?;
        let members = form.terms.clone();
        Some(Value::Share { state, quantity, size, members })
    }

    /// What moves evenly from here on, where states moved as they `last` did before.
    pub(super) fn even(&mut self, facts: &Facts, last: &Even) -> Even {
        let tracks = self.tracks();
        let mut open: BTreeSet<u32> = tracks.wild.iter().copied().collect();
        let others = self.but_for_others(facts);
        loop {
            let mut veiled = others.as_ref().unwrap_or(facts).clone();
            open.iter().for_each(|s| veiled.states[*s as usize] = Known::nothing());
            let mut found = Vec::new();
            let mut new = BTreeSet::new();
            for track in tracks.list.iter().filter(|t| !open.contains(&t.state)) {
                match self.slope(track, last, &veiled) {
                    Some((value, slope, terms)) => found.push((track, value, slope, terms)),
                    None => _ = new.insert(track.state),
                }
            }
            let slopes = found.iter().filter(|(_, _, slope, _)| *slope != 0.0).map(|(t, v, s, _)| (t.state, *v, *s));
            let even = Even { slopes: slopes.collect(), open: BTreeSet::new() };
            if new.is_empty() {
                for (track, _, _, terms) in &found {
                    if !terms.iter().all(|i| self.stays(&track.terms[*i], &even, &open, facts)) {
                        new.insert(track.state);
                    }
                }
            }
            if new.is_empty() && !even.slopes.is_empty() {
                new = self.disturbed(&tracks, &even, &veiled);
            }
            if new.is_empty() {
                return Even { open, ..even };
            }
            open.extend(new);
        }
    }

    /// The value and rate of a state, with the terms that go on; none where one of them is not known.
    fn slope(&mut self, track: &Track, last: &Even, veiled: &Facts) -> Option<(f64, f64, Vec<usize>)> {
        let mut slope = 0.0;
        let mut on = Vec::new();
        for (i, term) in track.terms.iter().enumerate() {
            let mut holds = Some(true);
            for (node, as_is) in &term.conditions {
                match self.truth_beyond(*node, last, veiled) {
                    Some(truth) if truth != *as_is => holds = Some(false),
                    None if holds == Some(true) => holds = None,
                    _ => {}
                }
            }
            if holds == Some(false) {
                continue;
            }
            holds?;
            let value = match &term.value {
                Value::Plain(node) => self.eval(*node, veiled).exact()?,
                Value::Share { state, quantity, size, .. } => {
                    let quantity = self.eval(*quantity, veiled).exact()?;
                    match (quantity, veiled.states[*state as usize].exact()?) {
                        (0.0, _) | (_, 0.0) => 0.0,
                        (quantity, there) => there * quantity / self.eval(*size, veiled).exact()?,
                    }
                }
            };
            if !value.is_finite() {
                return None;
            }
            slope += term.factor * value;
            on.push(i);
        }
        if on.is_empty() {
            return Some((0.0, 0.0, on));
        }
        Some((veiled.states[track.state as usize].exact()?, slope, on))
    }

    /// Whether a term stays as it is while states move so.
    fn stays(&mut self, term: &Term, even: &Even, open: &BTreeSet<u32>, facts: &Facts) -> bool {
        let mut rests = |node: NodeId| {
            let parts = self.parts(node);
            !parts.timed && !parts.states.iter().any(|s| even.moves(*s) || open.contains(s))
        };
        match &term.value {
            Value::Plain(node) => rests(*node),
            Value::Share { state, quantity, members, .. } => {
                if !rests(*quantity) || open.contains(state) || members.iter().any(|(s, _)| open.contains(s)) {
                    return false;
                }
                let pair = |s: u32| Some((facts.states[s as usize].exact()?, even.slope(s)));
                let mut sum = (0.0, 0.0);
                for (s, c) in members {
                    let Some((value, slope)) = pair(*s) else { return false };
                    sum = (sum.0 + c * value, sum.1 + c * slope);
                }
                let alike = |s: u32| {
                    pair(s).is_some_and(|(value, slope)| {
                        let (a, b) = (slope * sum.0, value * sum.1);
                        (a - b).abs() <= ALIKE * a.abs().max(b.abs())
                    })
                };
                alike(*state) && members.iter().all(|(s, _)| alike(*s))
            }
        }
    }

    /// States whose rates an event may change that only a run can tell.
    fn disturbed(&mut self, tracks: &Tracks, even: &Even, veiled: &Facts) -> BTreeSet<u32> {
        let mut moving = veiled.clone();
        let slopes: Vec<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        slopes.iter().for_each(|s| moving.states[*s as usize] = Known::nothing());
        moving.time = Known::nothing();
        let unknown: BTreeSet<u32> =
            (0..self.lab.states.len() as u32).filter(|s| moving.states[*s as usize].exact().is_none()).collect();
        let mut set = BTreeSet::new();
        let events = self.events;
        for event in events {
            let parts = self.parts(event.when);
            // What rests on even states alone is followed.
            let loose = parts.states.iter().any(|s| unknown.contains(s) && !even.moves(*s));
            if loose && self.eval(event.when, &moving).truth() != Some(false) {
                set.extend(self.changed_by(&event.actions));
            }
        }
        if set.is_empty() {
            return set;
        }
        let behind = self.behind(&set);
        tracks.list.iter().map(|t| t.state).filter(|s| behind.contains(s) && even.moves(*s)).collect()
    }
}
