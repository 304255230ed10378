//! What the passing of time does to what is known.
//!
//! A box around the state is kept by the laws where on each of its faces nothing moves outwards. Starting from what is
//! known, the faces that are crossed move out until none is, and back in as far as none comes to be, which bounds every
//! state for all time to come; over a limited time the largest rates within the box bound it further.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::{BinaryOp, Op};

use super::Flow;
use super::facts::Facts;
use super::value::{Known, Why};

/// A rate below this share of a state's scale per second moves nothing that matters within the longest run.
const STILL: f64 = 1e-9;

/// Doublings of a face's distance before it counts as without bound.
const DOUBLINGS: usize = 50;

/// Sweeps over all faces before those that are still crossed count as without bound.
const SWEEPS: usize = 40;

/// By this share of its distance a face is moved further than alone it would have to be.
const OVERSHOOT: f64 = 0.1;

/// Halvings that bring a face back in.
const HALVINGS: usize = 24;

/// Times that faces are brought back in.
const NARROWINGS: usize = 6;

/// A face that came in by no more than this share of its distance has come to rest.
const AT_REST: f64 = 1e-6;

/// So many moving states are bounded; more are only known to move.
const MOST_MOVING: usize = 48;

/// Rounds of events and laws that change each other, before what they change counts as unknown.
const ROUNDS: usize = 8;

/// Bounds that hold for all time to come, by state.
pub type Barrier = Rc<BTreeMap<u32, (f64, f64)>>;

impl Flow<'_, '_> {
    /// Time passes; what moves is known within bounds from then on.
    pub fn pass(&mut self, duration: &Known, facts: &mut Facts) {
        let (_, longest) = duration.bounds();
        if longest <= 0.0 {
            return;
        }
        facts.time = Known::binary(BinaryOp::Add, &facts.time, duration);
        facts.reopen(|s| self.lab.rates.contains_key(&s));
        let mut timed = self.timed.clone();
        for _ in 0..ROUNDS {
            let changed = !facts.unsettled.is_empty();
            let moved = self.flow_on(longest, facts);
            if changed || !moved.is_empty() {
                self.note_processes(facts);
            }
            let mut due = self.events_on(&moved);
            due.append(&mut timed);
            self.fire(due, facts);
            if facts.unsettled.is_empty() || moved.is_empty() {
                return;
            }
        }
        let states: Vec<u32> = facts.moving.iter().map(|i| self.derivatives[*i as usize].state).collect();
        facts.forget(&states);
        facts.barrier = None;
    }

    /// Lets the laws act for at most `longest` s; the states that are no longer what they were.
    fn flow_on(&mut self, longest: f64, facts: &mut Facts) -> Vec<u32> {
        if !facts.unsettled.is_empty() {
            facts.barrier = None;
        }
        let barrier = match facts.barrier.clone() {
            Some(barrier) => barrier,
            None => {
                let barrier = Rc::new(self.barrier(facts));
                facts.barrier = Some(barrier.clone());
                barrier
            }
        };
        facts.unsettled.clear();
        if barrier.is_empty() {
            return Vec::new();
        }
        let mut within = facts.clone();
        for (state, (low, high)) in barrier.iter() {
            within.states[*state as usize] = Known::Range(*low, *high, Why::Unknown);
        }
        let mut moved = Vec::new();
        for i in facts.moving.clone() {
            let derivative = &self.derivatives[i as usize];
            let state = derivative.state;
            let Some(&(low, high)) = barrier.get(&state) else { continue };
            let (slowest, fastest) = self.eval(derivative.rate, &within).bounds();
            let (from, to) = facts.states[state as usize].bounds();
            let low = low.max(from + (slowest * longest).min(0.0)).min(from);
            let high = high.min(to + (fastest * longest).max(0.0)).max(to);
            let now =
                if low.is_nan() || high.is_nan() { Known::nothing() } else { Known::Range(low, high, Why::Unknown) };
            if facts.states[state as usize] != now {
                moved.push((state, now));
            }
        }
        let states = moved.iter().map(|(s, _)| *s).collect();
        for (state, now) in moved {
            facts.states[state as usize] = now;
        }
        states
    }

    /// Bounds that what moves never leaves.
    fn barrier(&mut self, facts: &mut Facts) -> BTreeMap<u32, (f64, f64)> {
        let mut due: BTreeSet<u32> = std::mem::take(&mut facts.unsettled);
        due.extend(&facts.moving);
        let mut moving: BTreeSet<u32> = BTreeSet::new();
        let mut within = facts.clone();
        for round in 0..=SWEEPS {
            let mut crossed = BTreeSet::new();
            for i in std::mem::take(&mut due) {
                let state = self.derivatives[i as usize].state;
                let (a, b) = self.rate(i, &within);
                if !moving.contains(&i) {
                    let still = self.still(state);
                    if a.abs() <= still && b.abs() <= still {
                        continue;
                    }
                    moving.insert(i);
                }
                let (down, up) = self.crossings(i, &mut within);
                let far = round >= SWEEPS || moving.len() > MOST_MOVING;
                let (start_low, start_high) = facts.states[state as usize].bounds();
                let (mut low, mut high) = within.states[state as usize].bounds();
                if up {
                    let open = far || self.is_amount(state);
                    high = if open { f64::INFINITY } else { self.face(i, high, start_high, 1.0, &mut within) };
                }
                if down {
                    low = match self.is_amount(state) {
                        true => 0.0,
                        false if far => f64::NEG_INFINITY,
                        false => self.face(i, low, start_low, -1.0, &mut within),
                    };
                }
                if up || down {
                    within.states[state as usize] = Known::Range(low, high, Why::Unknown);
                    crossed.insert(i);
                    crossed.extend(self.rates_of.get(&state).into_iter().flatten());
                }
            }
            if crossed.is_empty() {
                break;
            }
            due = crossed;
        }
        if moving.len() <= MOST_MOVING {
            self.narrow(&moving, facts, &mut within);
        }
        facts.moving = moving;
        let bounds = |i: &u32| {
            let state = self.derivatives[*i as usize].state;
            (state, within.states[state as usize].bounds())
        };
        facts.moving.iter().map(bounds).collect()
    }

    /// Where a face that is crossed has to be moved so that it no longer is, and a little further, so that faces that
    /// push each other come to rest. `side` is 1 for an upper face, -1 for a lower one. The rate was evaluated just before.
    fn face(&mut self, derivative: u32, from: f64, start: f64, side: f64, within: &mut Facts) -> f64 {
        let state = self.derivatives[derivative as usize].state;
        let mut step = self.lab.states[state as usize].scale.max((from - start).abs());
        let (mut near, mut far) = (from, from + side * step);
        let mut doublings = 0;
        while self.outwards(derivative, far, side, within) {
            doublings += 1;
            if doublings > DOUBLINGS {
                return side * f64::INFINITY;
            }
            step *= 2.0;
            near = far;
            far += side * step;
        }
        for _ in 0..HALVINGS / 2 {
            let middle = 0.5 * (near + far);
            if self.outwards(derivative, middle, side, within) { near = middle } else { far = middle }
        }
        far + OVERSHOOT * (far - start)
    }

    fn outwards(&mut self, derivative: u32, at: f64, side: f64, within: &mut Facts) -> bool {
        let (slow, fast) = self.rate_at(derivative, at, within);
        if side > 0.0 { fast > 0.0 } else { slow < 0.0 }
    }

    /// Brings faces back in as far as nothing crosses them.
    fn narrow(&mut self, moving: &BTreeSet<u32>, facts: &Facts, within: &mut Facts) {
        for _ in 0..NARROWINGS {
            let mut rests = true;
            for i in moving {
                let state = self.derivatives[*i as usize].state;
                let (inner_low, inner_high) = facts.states[state as usize].bounds();
                self.rate(*i, within);
                for upper in [true, false] {
                    let (low, high) = within.states[state as usize].bounds();
                    let (mut near, mut far) = if upper { (inner_high, high) } else { (inner_low, low) };
                    if !far.is_finite() || near == far {
                        continue;
                    }
                    for _ in 0..HALVINGS {
                        let middle = 0.5 * (near + far);
                        let side = if upper { 1.0 } else { -1.0 };
                        if self.outwards(*i, middle, side, within) { near = middle } else { far = middle }
                    }
                    let (inner, before) = if upper { (inner_high, high) } else { (inner_low, low) };
                    rests &= (before - far).abs() <= AT_REST * (before - inner).abs();
                    let face = if upper { (low, far) } else { (far, high) };
                    within.states[state as usize] = Known::Range(face.0, face.1, Why::Unknown);
                }
            }
            if rests {
                return;
            }
        }
    }

    /// Whether the lower and the upper face of a state's bounds are crossed outwards; its rate was evaluated just before.
    fn crossings(&mut self, derivative: u32, within: &mut Facts) -> (bool, bool) {
        let state = self.derivatives[derivative as usize].state;
        let (low, high) = within.states[state as usize].bounds();
        let still = self.still(state);
        let down = low.is_finite() && self.rate_at(derivative, low, within).0 < -still;
        let up = high.is_finite() && self.rate_at(derivative, high, within).1 > still;
        (down, up)
    }

    /// Bounds of a derivative.
    fn rate(&mut self, derivative: u32, within: &Facts) -> (f64, f64) {
        self.enclose(self.derivatives[derivative as usize].rate, within).bounds()
    }

    /// Bounds of a derivative with its own state at a value, where it was evaluated before with nothing else otherwise.
    fn rate_at(&mut self, derivative: u32, at: f64, within: &mut Facts) -> (f64, f64) {
        let derivative = &self.derivatives[derivative as usize];
        let place = derivative.state as usize;
        let before = std::mem::replace(&mut within.states[place], Known::Point(at));
        let bounds = self.enclose_again(derivative.rate, derivative.state, within).bounds();
        within.states[place] = before;
        bounds
    }

    fn still(&self, state: u32) -> f64 {
        STILL * self.lab.states[state as usize].scale
    }

    /// Whether a state is an amount of a species, which is never less than nothing.
    fn is_amount(&self, state: u32) -> bool {
        self.amounts.contains(&state)
    }

    /// Notes which reactions can go on now, and between which bounds their conditions lie.
    fn note_processes(&mut self, facts: &Facts) {
        for i in 0..self.lab.processes.len() {
            let process = &self.lab.processes[i];
            let (Some(reaction), Some(guard)) = (process.reaction, process.guard) else { continue };
            if self.windows.get(&reaction).is_some_and(|w| w.reached) {
                continue;
            }
            let reached = self.eval(guard, facts).truth() != Some(false);
            let window = self.windows.entry(reaction).or_default();
            window.reached |= reached;
            if reached {
                continue;
            }
            self.enclose(guard, facts);
            for n in self.order(guard).iter().copied() {
                let Op::Binary(BinaryOp::Le, a, b) = self.lab.graph.op(n) else { continue };
                let live = if self.lab.graph.constant(a).is_some() { b } else { a };
                if !self.parts(live).states.is_empty() {
                    let (low, high) = self.values.of(live).bounds();
                    let window = self.windows.entry(reaction).or_default();
                    window.low = window.low.min(low);
                    window.high = window.high.max(high);
                }
            }
        }
    }
}

/// What is known of the condition of a reaction over the whole plan.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Whether it may hold at some time.
    pub reached: bool,
    /// The least value it was compared at, SI.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Default for Window {
    fn default() -> Self {
        Window { reached: false, low: f64::INFINITY, high: f64::NEG_INFINITY }
    }
}
