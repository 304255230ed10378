//! What moves evenly: at rates that stay as they are until a condition changes. So do doses of pumps, what they take from and
//! give to vessels, and counters of the user's own. What moves evenly is known exactly at every moment.
//!
//! A stream takes the same share of each species, `amount * flow / volume`. While all of a mixture shrinks or grows in proportion,
//! amount over volume stays as it is, and the stream brings the same amounts at every moment; whether it does is read off the
//! rates themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::{BinaryOp, NodeId, Op};

use super::Interpreter;
use super::state::AbstractState;
use super::value::{AbstractValue, CLOSE};

/// Rates that differ by less than this share of them are in proportion.
const ALIKE: f64 = 1e-9;

/// Terms whose sum is below this share of them cancel.
const CANCELS: f64 = 1e-12;

/// Shares of the shortest time in which a state would double or vanish at which a term is compared with what it is now: more of them than a
/// difference of two temperatures can have zeros.
const MOMENTS: [f64; 4] = [0.09, 0.23, 0.52, 0.88];

/// Times that conditions may change each other where states stand at a threshold, before what follows is left open.
const MOST_TURNS: usize = 4;

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
    /// How the conditions of terms come out from then on.
    pub truths: BTreeMap<NodeId, bool>,
    /// A state of a mixture that is empty, from which a stream takes.
    pub empty: Option<u32>,
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

impl Interpreter<'_, '_> {
    /// The states that may move evenly; found once.
    pub(super) fn tracks(&mut self) -> Rc<Tracks> {
        if let Some(known) = &self.nodes.tracks {
            return known.clone();
        }
        let found = Rc::new(self.find_tracks());
        self.nodes.tracks = Some(found.clone());
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
    pub(super) fn even(&mut self, facts: &AbstractState, last: &Even) -> Even {
        let tracks = self.tracks();
        let mut open: BTreeSet<u32> = tracks.wild.iter().copied().collect();
        let others = self.but_for_others(facts);
        let mut empty = None;
        loop {
            let mut veiled = others.as_ref().unwrap_or(facts).clone();
            open.iter().for_each(|s| veiled.states[*s as usize] = AbstractValue::top());
            let mut found = Vec::new();
            let mut new = BTreeSet::new();
            let mut even = Even::default();
            for track in tracks.list.iter().filter(|t| !open.contains(&t.state)) {
                match self.slope(track, last, &veiled, &mut even) {
                    Some((value, slope, terms)) => found.push((track, value, slope, terms)),
                    None => _ = new.insert(track.state),
                }
            }
            let slopes = found.iter().filter(|(_, _, slope, _)| *slope != 0.0).map(|(t, v, s, _)| (t.state, *v, *s));
            even.slopes = slopes.collect();
            empty = empty.or(even.empty);
            if new.is_empty() {
                for (track, _, _, terms) in &found {
                    if !terms.iter().all(|i| self.stays(track.state, &track.terms[*i], &even, &open, facts)) {
                        new.insert(track.state);
                    }
                }
            }
            if new.is_empty() && !even.slopes.is_empty() {
                new = self.disturbed(&tracks, &even, &veiled);
            }
            if new.is_empty() {
                return Even { open, empty, ..even };
            }
            open.extend(new);
        }
    }

    /// The value and rate of a state, with the terms that go on; none where one of them is not known.
    fn slope(
        &mut self,
        track: &Track,
        last: &Even,
        veiled: &AbstractState,
        even: &mut Even,
    ) -> Option<(f64, f64, Vec<usize>)> {
        let (mut slope, mut most) = (0.0, 0.0_f64);
        let mut on = Vec::new();
        for (i, term) in track.terms.iter().enumerate() {
            let mut holds = Some(true);
            for (node, as_is) in &term.conditions {
                let truth = match even.truths.get(node) {
                    Some(known) => Some(*known),
                    None => self.comes_out(*node, last, veiled),
                };
                even.truths.extend(truth.map(|truth| (*node, truth)));
                match truth {
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
                        (0.0, _) => 0.0,
                        (_, 0.0) => {
                            if self.eval(*size, veiled).exact() == Some(0.0) {
                                even.empty = Some(*state);
                                return None;
                            }
                            0.0
                        }
                        (quantity, there) => there * quantity / self.eval(*size, veiled).exact()?,
                    }
                }
            };
            if !value.is_finite() {
                return None;
            }
            slope += term.factor * value;
            most = most.max((term.factor * value).abs());
            on.push(i);
        }
        if slope.abs() <= CANCELS * most {
            slope = 0.0;
        }
        if on.is_empty() {
            return Some((0.0, 0.0, on));
        }
        Some((veiled.states[track.state as usize].exact()?, slope, on))
    }

    /// How a condition comes out from now on. What stands at its threshold and rests there comes out as it did when it came to it.
    fn comes_out(&mut self, node: NodeId, last: &Even, facts: &AbstractState) -> Option<bool> {
        match last.truths.get(&node) {
            Some(before) if self.rests_at_threshold(node, last, facts) => Some(*before),
            _ => self.truth_beyond(node, last, facts),
        }
    }

    /// Whether two sides of a comparison are equal and stay so.
    fn rests_at_threshold(&mut self, node: NodeId, even: &Even, facts: &AbstractState) -> bool {
        let order = self.order(node);
        order.iter().any(|n| {
            let Op::Binary(BinaryOp::Lt | BinaryOp::Le, a, b) = self.lab.graph.op(*n) else { return false };
            let difference = self.difference((a, Some(b)), even, 0.0, facts);
            difference.is_some_and(|(now, slope, size)| slope == 0.0 && now.abs() <= CLOSE * size)
        })
    }

    /// Whether a condition of a flow stands at its threshold, where only how it came there tells how it comes out.
    pub(super) fn rests_at_thresholds(&mut self, even: &Even, facts: &AbstractState) -> bool {
        even.truths.keys().any(|node| self.rests_at_threshold(*node, even, facts))
    }

    /// What moves evenly from here on, where the conditions it goes by come out as it moves; none where they change each other, as that
    /// of a flow that empties what fills only while it does not go on.
    pub(super) fn settled(&mut self, facts: &AbstractState, last: &Even) -> Option<Even> {
        let mut even = self.even(facts, last);
        for _ in 0..MOST_TURNS {
            let conditions: Vec<(NodeId, bool)> = even.truths.iter().map(|(node, truth)| (*node, *truth)).collect();
            let as_it_moves = |(node, truth): &(NodeId, bool)| {
                self.comes_out(*node, &even, facts).is_none_or(|beyond| beyond == *truth)
            };
            if even.slopes.is_empty() || conditions.iter().all(as_it_moves) {
                return Some(even);
            }
            even = self.even(facts, &even);
        }
        None
    }

    /// Whether a term is what it is now while states that it rests on move so, as what flows between two of the same temperature. What it
    /// may add to its `state` otherwise is rounding.
    fn is_constant(&mut self, state: u32, node: NodeId, even: &Even, facts: &AbstractState) -> bool {
        let Some(now) = self.along_at(node, even, 0.0, facts) else { return false };
        let scale = |(_, value, slope): &(u32, f64, f64)| (value / slope).abs();
        let horizon = even.slopes.iter().map(scale).filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
        let Some(size) = facts.states[state as usize].exact() else { return false };
        let slack = ALIKE * size.abs() / horizon;
        horizon.is_finite()
            && MOMENTS.iter().all(|share| {
                let then = self.along_at(node, even, share * horizon, facts);
                then.is_some_and(|then| (then.value - now.value).abs() <= slack)
            })
    }

    /// Whether a term of the rate of a `state` stays as it is while states move so.
    fn stays(&mut self, state: u32, term: &Term, even: &Even, open: &BTreeSet<u32>, facts: &AbstractState) -> bool {
        match &term.value {
            Value::Plain(node) => {
                let (mut at_rest, mut known) = (true, true);
                let parts = self.parts(*node);
                for s in &parts.states {
                    (at_rest, known) = (at_rest && !even.moves(*s), known && !open.contains(s));
                }
                known && !parts.timed && (at_rest || self.is_constant(state, *node, even, facts))
            }
            Value::Share { state, quantity, members, .. } => {
                let parts = self.parts(*quantity);
                let rests = !parts.timed && !parts.states.iter().any(|s| even.moves(*s) || open.contains(s));
                if !rests || open.contains(state) || members.iter().any(|(s, _)| open.contains(s)) {
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
    fn disturbed(&mut self, tracks: &Tracks, even: &Even, veiled: &AbstractState) -> BTreeSet<u32> {
        let mut moving = veiled.clone();
        let slopes: Vec<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        slopes.iter().for_each(|s| moving.states[*s as usize] = AbstractValue::top());
        moving.time = AbstractValue::top();
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
