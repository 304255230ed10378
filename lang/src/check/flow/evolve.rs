//! What the passing of time does to what is known.
//!
//! A box around the state is kept by the laws where on each of its faces nothing moves outwards. Starting from what is
//! known, the faces that are crossed move out until none is, and back in as far as none comes to be, which bounds every
//! state for all time to come; over a limited time the largest rates within the box bound it further.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::{BinaryOp, Op, Severity, UnaryOp};

use super::Interpreter;
use super::actions::Asked;
use super::bonds::Bonds;
use super::bracket::last_outwards;
use super::course::Course;
use super::fluxes::Row;
use super::groups::{Ties, are_tied};
use super::polytope::scaled;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use crate::chem::Element;

/// A rate below this share of a state's scale per second is rounding.
const STILL: f64 = 1e-13;

/// A state without a declared scale has this share of its value as its scale.
const DEPTH: f64 = 1e-3;

/// Doublings of a face's distance before it counts as without bound.
const DOUBLINGS: f64 = 50.0;

/// A face that moves out goes at most twice so many times further at once.
const MOST_AT_ONCE: f64 = 512.0;

/// Sweeps over all faces before those that are still crossed count as without bound.
const SWEEPS: usize = 40;

/// Sweeps after which faces that still push each other are moved out together, each time.
const EACH: usize = 12;

/// By this share of its distance a face is moved further than alone it would have to be.
const OVERSHOOT: f64 = 0.1;

/// A face that moves out is found to within this share of its last step, 2^-12, one that comes in of its distance, 2^-24.
const CLOSE_OUT: f64 = 1.0 / (1 << 12) as f64;
pub(super) const CLOSE_IN: f64 = 1.0 / (1 << 24) as f64;

/// Times that faces are brought back in.
const NARROWINGS: usize = 6;

/// A face that came in by no more than this share of its distance has come to rest.
pub(super) const AT_REST: f64 = 1e-6;

/// Steps into which a time is divided that is followed closely.
const CLOSE_STEPS: usize = 16;

/// So often the rates of such a step are taken within the bounds that the last ones gave.
const REFINEMENTS: usize = 4;

/// Moving states that are always bounded.
const MOST_MOVING: usize = 48;

/// Rates asked for to bound more of them, in a whole plan, before the rest counts as without bound.
const MOST_RATES: usize = 2_000_000;

/// Rounds of events and laws that change each other, before what they change counts as unknown.
const ROUNDS: usize = 8;

/// Bounds of derivatives, by their index.
type Rates = BTreeMap<u32, (f64, f64)>;

/// Bounds that hold for all time to come, while nothing else changes.
#[derive(Clone, Debug, Default)]
pub struct InvariantBox {
    /// By state.
    pub(super) states: BTreeMap<u32, (f64, f64)>,
    /// How far what goes on can go, and what states that it changes are without it.
    pub(super) bonds: Option<Rc<Bonds>>,
    /// What each derivative that moves has to do with others, where it has been asked for since the derivative changed.
    pub(super) ties: BTreeMap<u32, Rc<Ties>>,
    /// By derivative, its bounds within the box; those of amounts follow from how far what goes on can go.
    pub(super) rates: Rates,
    /// States of which nothing counted as known, for concurrent steps may set them.
    pub(super) veiled: Vec<u32>,
}

impl InvariantBox {
    /// Whether what is known of a state lies within its faces.
    pub(super) fn contains(&self, state: u32, facts: &AbstractState) -> bool {
        let (low, high) = facts.states[state as usize].bounds();
        self.states.get(&state).is_some_and(|(least, most)| least <= &low && &high <= most)
    }
}

/// A pair of faces of the box, by derivative.
#[derive(Clone, Copy)]
pub(super) enum Wall {
    /// Of the state.
    Whole(u32),
    /// Of the state without what the fluxes that change matter bring: a heat content without the heat of reactions.
    Apart(u32),
}

/// What a derivative is of.
pub(super) enum Kind {
    /// An amount: what it is at first and what goes on.
    Matter(Rc<Row>),
    /// Something that fluxes of matter change besides others.
    Mixed(Rc<Row>),
    /// Something else.
    Plain,
}

/// A box that is being made.
pub(super) struct Making {
    /// What is known within it.
    pub(super) within: AbstractState,
    /// Faces of states that fluxes of matter change besides others.
    whole: BTreeMap<u32, (f64, f64)>,
    /// Fluxes that go on.
    active: BTreeSet<usize>,
    /// Whether extents go down and up.
    ways: BTreeMap<usize, (bool, bool)>,
    /// Derivatives that are not zero.
    pub(super) moving: BTreeSet<u32>,
    /// How many of them have faces.
    pub(super) faces: usize,
    /// The walls whose lower, and whose upper, faces were moved out together.
    pub(super) together: [Vec<Wall>; 2],
}

impl Making {
    /// A box around what is known, in which nothing moves yet.
    pub(super) fn around(facts: &AbstractState) -> Self {
        Making {
            within: facts.clone(),
            whole: BTreeMap::new(),
            active: BTreeSet::new(),
            ways: BTreeMap::new(),
            moving: BTreeSet::new(),
            faces: 0,
            together: Default::default(),
        }
    }

    /// Takes over faces of a state that moves.
    pub(super) fn take_over(&mut self, derivative: u32, state: u32, (low, high): (f64, f64)) {
        self.within.states[state as usize] = AbstractValue::Range(low, high, Imprecision::Unknown);
        self.moving.insert(derivative);
        self.faces += 1;
    }
}

impl Interpreter<'_, '_> {
    /// Time passes; what moves is known within bounds from then on.
    pub fn pass(&mut self, duration: &AbstractValue, facts: &mut AbstractState) {
        let (_, longest) = duration.bounds();
        if longest <= 0.0 {
            return;
        }
        let unkept = std::mem::take(&mut facts.unkept).into_iter().collect();
        if self.limits(unkept, facts) == Asked::Handled {
            self.stopped = true;
            return;
        }
        let watched = self.may_break_here(facts);
        let end = facts.time.exact().zip(duration.exact()).map(|(begin, lasts)| begin + lasts);
        let course = duration.exact().map(|exact| self.course(exact, &watched, facts));
        let rest = match course {
            Some(Course::Passed) => return,
            // What is only touched at the end holds.
            Some(Course::Reached(nodes)) if self.only_touches(&nodes, end, facts) => return,
            Some(Course::Reached(nodes)) => return self.ends_broken(&nodes, facts),
            Some(Course::Left(left)) if left < longest => AbstractValue::Point(left),
            _ => duration.clone(),
        };
        self.drift(&rest, facts);
    }

    /// Time passes; what moves is known within bounds, whether it moves evenly or not.
    pub(super) fn drift(&mut self, duration: &AbstractValue, facts: &mut AbstractState) {
        let (_, longest) = duration.bounds();
        let before = facts.time.clone();
        facts.time = AbstractValue::binary(BinaryOp::Add, &before, duration);
        let span = AbstractValue::Range(before.bounds().0, facts.time.bounds().1, Imprecision::Unknown);
        facts.reopen(|s| self.lab.rates.contains_key(&s));
        self.meanwhile = Some(span.clone());
        self.beside_others(facts, |flow, facts| flow.goes_on(longest, &span, facts));
        self.meanwhile = None;
    }

    fn goes_on(&mut self, longest: f64, span: &AbstractValue, facts: &mut AbstractState) {
        let mut timed = self.timed.clone();
        timed.retain(|event| !self.at_moments.contains(event));
        let passed = self.passed_before(facts);
        for round in 0..ROUNDS {
            let changed = !facts.unsettled.is_empty();
            let moved = self.flow_through(longest, span, facts);
            if changed || !moved.is_empty() {
                self.note_processes(facts);
            }
            let mut due = self.events_on(&moved);
            due.append(&mut timed);
            due.retain(|event| !self.at_moments.contains(event));
            let mut recurring = due.clone();
            self.fire(due, facts);
            self.fire_between(span, facts);
            recurring.sort_unstable();
            recurring.dedup();
            let again = self.recur(&recurring, span, facts);
            let moving = facts.moving.iter().map(|i| self.derivatives[*i as usize].state);
            let touched: Vec<u32> = moved.iter().copied().chain(moving).collect();
            let mut due = self.limits_that_ask_for(&touched);
            due.extend(std::mem::take(&mut facts.unkept));
            due.retain(|limit| !passed.contains(limit));
            if self.limits(due, facts) == Asked::Handled {
                self.stopped = true;
                return;
            }
            // What events have changed at once may let laws act.
            if facts.unsettled.is_empty() || (moved.is_empty() && !again && round > 0) {
                return;
            }
        }
        let states: Vec<u32> = facts.moving.iter().map(|i| self.derivatives[*i as usize].state).collect();
        facts.forget(&states);
        facts.barrier = None;
    }

    /// Events that time may bring about more than once: what they would change further counts as unknown. Whether there is any.
    fn recur(&mut self, due: &[u32], span: &AbstractValue, facts: &mut AbstractState) -> bool {
        let due: Vec<u32> = due
            .iter()
            .copied()
            .filter(|i| facts.fired[*i as usize].is_none() || self.comes_and_goes(*i, span, facts))
            .collect();
        let moving: Vec<u32> = facts.moving.iter().map(|i| self.derivatives[*i as usize].state).collect();
        let mut any = false;
        // Each turn forgets a state or ends.
        while let Some(states) = self.further(&due, &moving, facts) {
            self.forget(&states, facts);
            any = true;
        }
        any
    }

    /// Whether the condition of an event may come true more than once in `span`: it follows the time to and fro, or the event
    /// itself changes what it asks for, as a timer that it sets anew.
    fn comes_and_goes(&mut self, event: u32, span: &AbstractValue, facts: &AbstractState) -> bool {
        if !self.timed.contains(&event) {
            return false;
        }
        let when = self.events[event as usize].when;
        let mut within = facts.clone();
        within.time = span.clone();
        if self.eval(when, &within).truth().is_some() {
            return false;
        }
        let waves = |op: Op| matches!(op, Op::Unary(op, _) if op.is_wave() || op == UnaryOp::Abs);
        let changed = self.happen(event, &mut within);
        self.order(when).iter().any(|n| waves(self.lab.graph.op(*n)))
            || self.parts(when).states.iter().any(|s| changed.contains(s))
    }

    /// States that one of these events would change further if it came about once more; none where each of them comes about no more.
    fn further(&mut self, due: &[u32], moving: &[u32], facts: &AbstractState) -> Option<Vec<u32>> {
        let changes: Vec<Vec<u32>> = due.iter().map(|event| self.happen(*event, &mut facts.clone())).collect();
        due.iter().enumerate().find_map(|(own, event)| {
            let others = changes.iter().enumerate().filter(|(other, _)| *other != own).flat_map(|(_, states)| states);
            let others: Vec<u32> = moving.iter().chain(others).copied().collect();
            self.changed_again(*event, &others, facts)
        })
    }

    /// States that an event would change further if it came about once more; none where nothing that may change by then makes its
    /// condition false and true again.
    fn changed_again(&mut self, event: u32, others: &[u32], facts: &AbstractState) -> Option<Vec<u32>> {
        let when = self.events[event as usize].when;
        let mut again = facts.clone();
        if let Some(span) = self.meanwhile.as_ref().filter(|_| self.timed.contains(&event)) {
            again.time = span.clone();
        }
        self.assume(when, true, &mut again);
        let changed = self.happen(event, &mut again);
        let mut later = again.clone();
        later.forget(others);
        if self.eval(when, &later).truth() == Some(false) {
            return None;
        }
        let grows = |state: &u32| {
            let ((low, high), (least, most)) =
                (facts.states[*state as usize].bounds(), again.states[*state as usize].bounds());
            least < low || most > high
        };
        let states: Vec<u32> = changed.into_iter().filter(grows).collect();
        Some(states).filter(|states| !states.is_empty())
    }

    /// The same while the time itself, which some laws follow, lies within `span`.
    fn flow_through(&mut self, longest: f64, span: &AbstractValue, facts: &mut AbstractState) -> Vec<u32> {
        if self.clocked.is_empty() {
            return self.flow_on(longest, facts);
        }
        // What holds for this span need not hold for the next.
        facts.barrier = None;
        facts.unsettled.extend(&self.clocked);
        let after = std::mem::replace(&mut facts.time, span.clone());
        let moved = self.flow_on(longest, facts);
        (facts.time, facts.barrier) = (after, None);
        moved
    }

    /// Events of the time that may have come about and be over at the end of `span`.
    fn fire_between(&mut self, span: &AbstractValue, facts: &mut AbstractState) {
        for event in self.timed.clone() {
            let when = self.events[event as usize].when;
            if self.at_moments.contains(&event) || self.eval(when, facts).truth() != Some(false) {
                continue;
            }
            let after = std::mem::replace(&mut facts.time, span.clone());
            let within = self.eval(when, facts).truth();
            facts.time = after;
            if within.is_none() {
                let untouched = facts.clone();
                self.happen(event, facts);
                *facts = untouched.clone().join(facts.clone(), &untouched, self.site(), Imprecision::Unknown);
            }
        }
    }

    /// Lets the laws act for at most `longest` s; the states that are no longer what they were.
    fn flow_on(&mut self, longest: f64, facts: &mut AbstractState) -> Vec<u32> {
        if self.pass_unheeded(facts) {
            return Vec::new();
        }
        let has_changed =
            !facts.unsettled.is_empty() || facts.bonds.as_ref().is_some_and(|bonds| !bonds.all_hold(facts));
        let barrier = match facts.barrier.take().filter(|barrier| barrier.veiled == self.veiled) {
            Some(barrier) if !has_changed => barrier,
            known => Rc::new(self.barrier(known.map(Rc::unwrap_or_clone), facts)),
        };
        facts.barrier = Some(barrier.clone());
        facts.unsettled.clear();
        if barrier.states.is_empty() {
            return Vec::new();
        }
        let mut within = facts.clone();
        for (state, (low, high)) in &barrier.states {
            within.states[*state as usize] = AbstractValue::Range(*low, *high, Imprecision::Unknown);
        }
        within.bonds.clone_from(&barrier.bonds);
        let (bonds, amounts) = self.go_on(longest, &barrier, &within, facts);
        let known = Some(&barrier.rates);
        let mut moved = self.moved(longest, (&barrier, known), &within, facts, (&bonds, &amounts));
        for _ in 0..self.refinements {
            // Until then nothing leaves these bounds, so rates within them bound it further.
            for (state, now) in &moved {
                within.states[*state as usize] = now.clone();
            }
            moved = self.moved(longest, (&barrier, None), &within, facts, (&bonds, &amounts));
        }
        let states = moved.iter().map(|(s, _)| *s).collect();
        for (state, now) in moved {
            facts.states[state as usize] = now;
        }
        facts.bonds = bonds.map(|mut bonds| {
            bonds.stamp(facts);
            Rc::new(bonds)
        });
        states
    }

    /// The states that change within `longest` s, each with its bounds, by the rates that states `within` bounds give, as far as they are not
    /// known.
    fn moved(
        &mut self,
        longest: f64,
        (barrier, known): (&InvariantBox, Option<&Rates>),
        within: &AbstractState,
        facts: &AbstractState,
        (bonds, amounts): (&Option<Bonds>, &BTreeMap<u32, (f64, f64)>),
    ) -> Vec<(u32, AbstractValue)> {
        let mut moved: Vec<(u32, AbstractValue)> = Vec::new();
        for i in facts.moving.clone() {
            let derivative = &self.derivatives[i as usize];
            let state = derivative.state;
            let Some(&(low, high)) = barrier.states.get(&state) else { continue };
            let (low, high) = match amounts.get(&state) {
                Some(bounds) => *bounds,
                None => {
                    let known = known.and_then(|known| known.get(&i).copied());
                    let (slowest, fastest) = known.unwrap_or_else(|| self.eval(derivative.rate, within).bounds());
                    let (from, to) = facts.states[state as usize].bounds();
                    let low = low.max(from + (slowest * longest).min(0.0)).min(from);
                    let high = high.min(to + (fastest * longest).max(0.0)).max(to);
                    bonds.as_ref().map_or((low, high), |bonds| bonds.cut(state, (low, high)))
                }
            };
            let now = if low.is_nan() || high.is_nan() {
                AbstractValue::top()
            } else {
                AbstractValue::Range(low, high, Imprecision::Unknown)
            };
            if facts.states[state as usize] != now {
                moved.push((state, now));
            }
        }
        moved
    }

    /// Time passes in small steps, and what moves is bounded more closely.
    pub(super) fn pass_closely(&mut self, duration: f64, facts: &mut AbstractState) {
        self.refinements = REFINEMENTS;
        let step = duration / CLOSE_STEPS as f64;
        for _ in 0..CLOSE_STEPS {
            let before = facts.clone();
            self.pass(&AbstractValue::Point(step), facts);
            self.by_totals(step, &before, facts);
        }
        self.refinements = 0;
    }

    /// How far what changes matter goes on for at most `longest` s, with what states are without it, and the bounds of amounts.
    fn go_on(
        &mut self,
        longest: f64,
        barrier: &InvariantBox,
        within: &AbstractState,
        facts: &AbstractState,
    ) -> (Option<Bonds>, BTreeMap<u32, (f64, f64)>) {
        let Some(all) = &barrier.bonds else { return (None, BTreeMap::new()) };
        let stoichiometry = self.stoichiometry();
        let rows = facts.moving.iter().filter_map(|i| stoichiometry.rows.get(*i as usize)?.as_ref().map(|r| (*i, r)));
        let rows: Vec<(u32, &Rc<Row>)> = rows.collect();
        let fluxes: BTreeSet<usize> = rows.iter().flat_map(|(_, row)| &row.fluxes).map(|(flux, _)| *flux).collect();
        let mut bonds = facts.bonds.as_deref().cloned().unwrap_or_default();
        let mut more: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for flux in fluxes {
            let (direction, by) = &stoichiometry.directions[flux];
            if all.range_in(direction).is_none() {
                continue;
            }
            let (low, high) = self.flux(&stoichiometry.fluxes[flux], within);
            let (low, high) = scaled(longest, scaled(*by, (low, high)));
            direction.iter().for_each(|(state, _)| bonds.cover(*state, facts));
            let extent = bonds.extent_of(direction);
            let (a, b) = more.entry(extent).or_default();
            (*a, *b) = (*a + low.min(0.0), *b + high.max(0.0));
        }
        for (extent, (low, high)) in more {
            let extent = &mut bonds.extents[extent];
            let furthest = all.range_in(&extent.direction).unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            let (from, to) = extent.range;
            extent.range = ((from + low).max(furthest.0).min(from), (to + high).min(furthest.1).max(to));
        }
        for (i, row) in rows {
            let state = self.derivatives[i as usize].state;
            let Some(&(low, high)) = all.states.get(&state).map(|bond| bond.base.bounds()).as_ref() else { continue };
            if self.is_amount(state) {
                continue;
            }
            let (slowest, fastest) = self.rest(row, within);
            if let Some(bond) = bonds.states.get_mut(&state) {
                let (from, to) = bond.base.bounds();
                let low = low.max(from + scaled(longest, (slowest.min(0.0), 0.0)).0).min(from);
                let high = high.min(to + scaled(longest, (0.0, fastest.max(0.0))).1).max(to);
                bond.base = AbstractValue::Range(low, high, Imprecision::Unknown);
            }
        }
        let amounts = bonds.tighten(|state| self.is_amount(state), |state| self.atoms(state));
        (Some(bonds), amounts.into_iter().collect())
    }

    /// What a derivative is of.
    pub(super) fn kind(&mut self, derivative: u32) -> Kind {
        let stoichiometry = self.stoichiometry();
        match stoichiometry.rows.get(derivative as usize).cloned().flatten() {
            Some(row) if self.is_amount(self.derivatives[derivative as usize].state) => Kind::Matter(row),
            Some(row) => Kind::Mixed(row),
            None => Kind::Plain,
        }
    }

    /// Bounds that what moves never leaves: those that are known, of what has nothing to do with anything that has changed since.
    fn barrier(&mut self, known: Option<InvariantBox>, facts: &mut AbstractState) -> InvariantBox {
        let known = match known.map(|known| self.renewed(known, facts)) {
            Some(Ok(renewed)) => return renewed,
            Some(Err(known)) => Some(known),
            None => None,
        };
        let ties = known.as_ref().map(|known| self.unaffected(known, facts)).unwrap_or_default();
        let kept: BTreeSet<u32> = ties.keys().copied().collect();
        if let Some(known) = known.as_ref().filter(|_| !kept.is_empty()) {
            let before = facts.clone();
            let found = self.enclosed(&kept, facts);
            // What began to move meanwhile may have to do with what was kept.
            if !are_tied(&found.ties, &ties) {
                return self.with_kept(found, known, (kept, ties), facts);
            }
            *facts = before;
        }
        self.enclosed(&BTreeSet::new(), facts)
    }

    /// The bounds that were found together with those that are kept.
    fn with_kept(
        &self,
        mut found: InvariantBox,
        known: &InvariantBox,
        (kept, ties): (BTreeSet<u32>, BTreeMap<u32, Rc<Ties>>),
        facts: &mut AbstractState,
    ) -> InvariantBox {
        let is_kept = |state: u32| self.derivative_of(state).is_some_and(|i| kept.contains(&i));
        found.states.extend(known.states.iter().filter(|(s, _)| is_kept(**s)).map(|(s, faces)| (*s, *faces)));
        found.rates.extend(known.rates.iter().filter(|(i, _)| kept.contains(i)).map(|(i, rate)| (*i, *rate)));
        found.ties.extend(ties);
        let nothing = Bonds::default();
        let (here, there) = (found.bonds.as_deref().cloned(), known.bonds.as_deref());
        found.bonds = match (here, there) {
            (None, None) => None,
            (here, there) => Some(Rc::new(here.unwrap_or_default().but_for(there.unwrap_or(&nothing), is_kept))),
        };
        facts.moving.extend(kept);
        found
    }

    /// Bounds of all that moves but for what is kept.
    pub(super) fn enclosed(&mut self, kept: &BTreeSet<u32>, facts: &mut AbstractState) -> InvariantBox {
        let mut due: BTreeSet<u32> = std::mem::take(&mut facts.unsettled);
        due.extend(&facts.moving);
        due.retain(|i| !kept.contains(i));
        facts.rebind(Bonds::settle);
        let mut box_ = Making::around(facts);
        // Faces that late sweeps cross are without bound from then on, and each flux starts once, so that this ends.
        let mut round = 0;
        while !due.is_empty() {
            let mut crossed = BTreeSet::new();
            for i in std::mem::take(&mut due) {
                match self.kind(i) {
                    Kind::Matter(row) => self.react(i, &row, facts, &mut box_, &mut crossed),
                    kind => self.push_out(i, &kind, round >= SWEEPS, facts, &mut box_, &mut crossed),
                }
            }
            due = crossed;
            round += 1;
            if !due.is_empty() && round % EACH == 0 && round < SWEEPS {
                self.settle_together(facts, &mut box_, &mut due);
            }
            due.retain(|i| !kept.contains(i));
        }
        self.narrow_together(facts, &mut box_);
        if self.is_too_much(&box_) {
            self.say_unbounded();
        } else {
            let walls = self.walls(&box_);
            self.narrow(&walls, facts, &mut box_);
        }
        let (mut states, mut ties, mut rates) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for i in &box_.moving {
            let derivative = &self.derivatives[*i as usize];
            states.insert(derivative.state, box_.within.states[derivative.state as usize].bounds());
            ties.insert(*i, Rc::new(self.ties(*i, facts)));
            if !self.is_amount(derivative.state) {
                rates.insert(*i, self.eval(derivative.rate, &box_.within).bounds());
            }
        }
        facts.moving = box_.moving;
        InvariantBox { states, bonds: box_.within.bonds, ties, rates, veiled: self.veiled.clone() }
    }

    /// Whether so many states move that bounding them takes more than a plan may ask for.
    fn is_too_much(&self, making: &Making) -> bool {
        making.faces > MOST_MOVING && self.rates_asked > MOST_RATES
    }

    /// Says once from which step on what moves is not bounded.
    fn say_unbounded(&mut self) {
        if self.quiet == 0 && !self.unbounded_said {
            self.unbounded_said = true;
            let headline = format!("more than {MOST_MOVING} quantities change at the same time in a long workflow");
            self.not_analysed(Severity::Advice, headline, "their values are unknown from here on");
        }
    }

    /// Lets the fluxes that change an amount go as far as they can.
    fn react(
        &mut self,
        derivative: u32,
        row: &Row,
        facts: &AbstractState,
        making: &mut Making,
        crossed: &mut BTreeSet<u32>,
    ) {
        let stoichiometry = self.stoichiometry();
        let still = self.still(self.derivatives[derivative as usize].state, facts);
        let mut more = None;
        for (flux, c) in &row.fluxes {
            let (low, high) = self.flux(&stoichiometry.fluxes[*flux], &making.within);
            if !making.active.contains(flux) && (low * c).abs() <= still && (high * c).abs() <= still {
                continue;
            }
            making.active.insert(*flux);
            let (direction, by) = &stoichiometry.directions[*flux];
            let (low, high) = scaled(*by, (low, high));
            let known = making.within.bonds.as_ref().and_then(|bonds| bonds.known_extent(direction));
            let (down, up) = known.and_then(|extent| making.ways.get(&extent)).copied().unwrap_or_default();
            if (low < 0.0 && !down) || (high > 0.0 && !up) {
                let bonds = Rc::make_mut(making.within.bonds.get_or_insert_default());
                direction.iter().for_each(|(state, _)| bonds.cover(*state, facts));
                let extent = bonds.extent_of(direction);
                making.ways.insert(extent, (down || low < 0.0, up || high > 0.0));
                more = Some(extent);
            }
        }
        if row.fluxes.iter().any(|(flux, _)| making.active.contains(flux)) {
            making.moving.insert(derivative);
        }
        if let Some(extent) = more {
            self.go_further(extent, facts, making, crossed);
        }
    }

    /// Bounds extents anew that hang together with one where more of them go on: what one uses up another may give back, as a catalyst.
    fn go_further(&mut self, extent: usize, facts: &AbstractState, making: &mut Making, crossed: &mut BTreeSet<u32>) {
        let Some(mut shared) = making.within.bonds.take() else { return };
        let bonds = Rc::make_mut(&mut shared);
        let before: Vec<(f64, f64)> = bonds.extents.iter().map(|e| e.range).collect();
        let open = |extent: usize, range: &mut (f64, f64)| {
            let (down, up) = making.ways.get(&extent).copied().unwrap_or_default();
            *range = (if down { f64::NEG_INFINITY } else { range.0 }, if up { f64::INFINITY } else { range.1 });
        };
        let mut changed = BTreeSet::new();
        let amounts = bonds.tighten_from(Some(extent), |state| self.is_amount(state), |state| self.atoms(state), open);
        for (state, (low, high)) in amounts {
            let known = AbstractValue::Range(low, high, Imprecision::Unknown);
            if making.within.states[state as usize] != known {
                making.within.states[state as usize] = known;
                changed.insert(state);
            }
        }
        let further = bonds.extents.iter().zip(&before).filter(|(extent, before)| extent.range != **before);
        changed.extend(further.flat_map(|(extent, _)| extent.direction.iter().map(|(state, _)| *state)));
        bonds.stamp(&making.within);
        making.within.bonds = Some(shared);
        for state in changed {
            let of = self.derivative_of(state);
            if let Some(i) = of.filter(|_| !self.is_amount(state)) {
                self.put(i, facts, making);
            }
            crossed.extend(of);
            crossed.extend(self.rates_of.get(&state).into_iter().flatten());
        }
    }

    /// What is known of a state that fluxes of matter change besides others: by itself, and without what they bring.
    fn put(&mut self, derivative: u32, facts: &AbstractState, making: &mut Making) {
        let state = self.derivatives[derivative as usize].state;
        let whole = *making.whole.entry(derivative).or_insert_with(|| facts.states[state as usize].bounds());
        let bounds = making.within.bonds.as_ref().map_or(whole, |bonds| bonds.cut(state, whole));
        making.within.set(state, AbstractValue::Range(bounds.0, bounds.1, Imprecision::Unknown));
    }

    /// Moves the faces of a state out that are crossed.
    pub(super) fn push_out(
        &mut self,
        derivative: u32,
        kind: &Kind,
        late: bool,
        facts: &AbstractState,
        making: &mut Making,
        crossed: &mut BTreeSet<u32>,
    ) {
        let state = self.derivatives[derivative as usize].state;
        let (a, b) = self.rate(derivative, &making.within);
        if !making.moving.contains(&derivative) {
            let still = self.still(state, facts);
            if a.abs() <= still && b.abs() <= still {
                return;
            }
            making.moving.insert(derivative);
            making.faces += 1;
        }
        let far = late || self.is_too_much(making);
        let apart = matches!(kind, Kind::Mixed(_)) && making.within.hangs(state);
        if apart {
            // A flux of matter may have been found since.
            self.put(derivative, facts, making);
        }
        let walls = [apart.then_some(Wall::Apart(derivative)), Some(Wall::Whole(derivative))];
        for wall in walls.into_iter().flatten() {
            let (down, up) = self.crossings(wall, making);
            let (start_low, start_high) = self.begins(wall, facts);
            let before = self.faces(wall, making);
            let (mut low, mut high) = before;
            if up {
                let open = far || self.is_amount(state);
                high = if open { f64::INFINITY } else { self.face(wall, high, start_high, 1.0, making) };
            }
            if down {
                low = match self.is_amount(state) {
                    true => 0.0,
                    false if far => f64::NEG_INFINITY,
                    false => self.face(wall, low, start_low, -1.0, making),
                };
            }
            if (up || down) && (low, high) != before {
                self.set_faces(wall, (low, high), facts, making);
                crossed.insert(derivative);
                crossed.extend(self.rates_of.get(&state).into_iter().flatten());
            }
        }
    }

    /// The faces of a wall.
    pub(super) fn faces(&self, wall: Wall, making: &Making) -> (f64, f64) {
        let state = |i: u32| self.derivatives[i as usize].state;
        match wall {
            Wall::Whole(i) => {
                making.whole.get(&i).copied().unwrap_or_else(|| making.within.states[state(i) as usize].bounds())
            }
            Wall::Apart(i) => self.apart(state(i), &making.within),
        }
    }

    /// What is known of a state without what fluxes of matter bring.
    fn apart(&self, state: u32, facts: &AbstractState) -> (f64, f64) {
        let bond = facts.bonds.as_ref().and_then(|bonds| bonds.states.get(&state));
        bond.map_or_else(|| facts.states[state as usize].bounds(), |bond| bond.base.bounds())
    }

    /// Where the faces of a wall stand at first.
    pub(super) fn begins(&self, wall: Wall, facts: &AbstractState) -> (f64, f64) {
        match wall {
            Wall::Whole(i) => facts.states[self.derivatives[i as usize].state as usize].bounds(),
            Wall::Apart(i) => self.apart(self.derivatives[i as usize].state, facts),
        }
    }

    pub(super) fn set_faces(&mut self, wall: Wall, faces: (f64, f64), facts: &AbstractState, making: &mut Making) {
        let (Wall::Whole(i) | Wall::Apart(i)) = wall;
        let state = self.derivatives[i as usize].state;
        let known = AbstractValue::Range(faces.0, faces.1, Imprecision::Unknown);
        match wall {
            Wall::Apart(_) => {
                making.within.rebind(|bonds, _| {
                    if let Some(bond) = bonds.states.get_mut(&state) {
                        bond.base = known;
                    }
                });
                self.put(i, facts, making);
            }
            Wall::Whole(_) if making.whole.contains_key(&i) => {
                making.whole.insert(i, faces);
                self.put(i, facts, making);
            }
            Wall::Whole(_) => making.within.set(state, known),
        }
    }

    /// Where a face that is crossed has to be moved so that it no longer is, and a little further, so that faces that
    /// push each other come to rest. `side` is 1 for an upper face, -1 for a lower one. The rate was evaluated just before.
    fn face(&mut self, wall: Wall, from: f64, start: f64, side: f64, making: &mut Making) -> f64 {
        let (Wall::Whole(i) | Wall::Apart(i)) = wall;
        let state = self.derivatives[i as usize].state;
        let mut step = match self.scale(state, &making.within) {
            scale if scale > 0.0 => scale,
            // What is nothing at first has the size that it comes to in a second.
            _ => {
                let (slow, fast) = self.rate_at(wall, from, making);
                if side > 0.0 { fast } else { -slow }
            }
        };
        step = step.max((from - start).abs());
        let (mut near, mut far) = (from, from + side * step);
        let mut slower = self.outwards(wall, near, side, making);
        let mut doublings = 0.0;
        loop {
            let out = self.outwards(wall, far, side, making);
            if out.is_nan() || out <= 0.0 {
                break;
            }
            // Along a straight line it comes to rest at once; else the step is doubled.
            let further = (1.0 + out / (slower - out)).clamp(1.0, MOST_AT_ONCE);
            let times = if slower > out { 2.0 * further } else { 2.0 };
            doublings += times.log2();
            if doublings > DOUBLINGS {
                return side * f64::INFINITY;
            }
            step *= times;
            (near, slower) = (far, out);
            far += side * step;
        }
        far = last_outwards(near, far, CLOSE_OUT, |at| self.outwards(wall, at, side, making));
        far + OVERSHOOT * (far - start)
    }

    /// How fast a wall is crossed outwards where it has a value; not positive where it is not.
    pub(super) fn outwards(&mut self, wall: Wall, at: f64, side: f64, making: &mut Making) -> f64 {
        let (slow, fast) = self.rate_at(wall, at, making);
        if side > 0.0 { fast } else { -slow }
    }

    /// The walls of the box.
    pub(super) fn walls(&mut self, making: &Making) -> Vec<Wall> {
        let mut walls = Vec::new();
        for i in making.moving.clone() {
            match self.kind(i) {
                Kind::Matter(_) => {}
                Kind::Mixed(_) if making.within.hangs(self.derivatives[i as usize].state) => {
                    walls.extend([Wall::Apart(i), Wall::Whole(i)]);
                }
                _ => walls.push(Wall::Whole(i)),
            }
        }
        walls
    }

    /// Brings faces back in as far as nothing crosses them.
    pub(super) fn narrow(&mut self, walls: &[Wall], facts: &AbstractState, making: &mut Making) {
        for _ in 0..NARROWINGS {
            let mut rests = true;
            for wall in walls {
                let (inner_low, inner_high) = self.begins(*wall, facts);
                let (Wall::Whole(i) | Wall::Apart(i)) = *wall;
                self.rate(i, &making.within);
                for upper in [true, false] {
                    let (low, high) = self.faces(*wall, making);
                    let (near, mut far) = if upper { (inner_high, high) } else { (inner_low, low) };
                    if !far.is_finite() || near == far {
                        continue;
                    }
                    let side = if upper { 1.0 } else { -1.0 };
                    far = last_outwards(near, far, CLOSE_IN, |at| self.outwards(*wall, at, side, making));
                    let (inner, before) = if upper { (inner_high, high) } else { (inner_low, low) };
                    rests &= (before - far).abs() <= AT_REST * (before - inner).abs();
                    let face = if upper { (low, far) } else { (far, high) };
                    self.set_faces(*wall, face, facts, making);
                }
            }
            if rests {
                return;
            }
        }
    }

    /// Whether the lower and the upper face of a wall are crossed outwards; the rate was evaluated just before.
    pub(super) fn crossings(&mut self, wall: Wall, making: &mut Making) -> (bool, bool) {
        let (Wall::Whole(i) | Wall::Apart(i)) = wall;
        let (low, high) = self.faces(wall, making);
        let still = self.still(self.derivatives[i as usize].state, &making.within);
        let down = low.is_finite() && self.rate_at(wall, low, making).0 < -still;
        let up = high.is_finite() && self.rate_at(wall, high, making).1 > still;
        (down, up)
    }

    /// Bounds of a derivative.
    pub(super) fn rate(&mut self, derivative: u32, within: &AbstractState) -> (f64, f64) {
        self.enclose(self.derivatives[derivative as usize].rate, within).bounds()
    }

    /// Bounds of how fast what a wall is of changes where it has a value; the rate was evaluated before with nothing else
    /// otherwise. Nothing moves where both kinds of walls leave no room.
    pub(super) fn rate_at(&mut self, wall: Wall, at: f64, making: &mut Making) -> (f64, f64) {
        let (Wall::Whole(i) | Wall::Apart(i)) = wall;
        let derivative = &self.derivatives[i as usize];
        let state = derivative.state;
        let hangs = making.whole.contains_key(&i);
        let added = making.within.bonds.as_ref().filter(|_| hangs).map(|bonds| bonds.added(state));
        let there = match (wall, added) {
            (Wall::Whole(_), None) => AbstractValue::Point(at),
            (Wall::Whole(_), Some(added)) => {
                let (low, high) = self.apart(state, &making.within);
                if at < low + added.0 || at > high + added.1 {
                    return (0.0, 0.0);
                }
                AbstractValue::Point(at)
            }
            (Wall::Apart(_), added) => {
                let (added, whole) = (added.unwrap_or_default(), making.whole.get(&i).copied());
                let (low, high) = whole.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
                let (low, high) = (low.max(at + added.0), high.min(at + added.1));
                if low > high {
                    return (0.0, 0.0);
                }
                AbstractValue::Range(low, high, Imprecision::Unknown)
            }
        };
        self.rates_asked += 1;
        let before = std::mem::replace(&mut making.within.states[state as usize], there);
        let bounds = match (wall, self.kind(i)) {
            (Wall::Apart(_), Kind::Mixed(row)) => self.rest_again(&row, state, &making.within),
            _ => self.enclose_again(derivative.rate, state, &making.within).bounds(),
        };
        making.within.states[state as usize] = before;
        bounds
    }

    pub(super) fn still(&self, state: u32, facts: &AbstractState) -> f64 {
        STILL * self.scale(state, facts)
    }

    /// The declared scale of a state, else a share of the largest value that it may have; 0 where that is nothing.
    fn scale(&self, state: u32, facts: &AbstractState) -> f64 {
        self.lab.states[state as usize].scale.unwrap_or_else(|| {
            let (low, high) = facts.states[state as usize].bounds();
            DEPTH * [low, high].iter().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()))
        })
    }

    /// Whether a state is an amount of a species, which is never less than nothing.
    fn is_amount(&self, state: u32) -> bool {
        self.amounts.contains(&state)
    }

    /// The atoms of each element in what an amount counts.
    pub(super) fn atoms(&self, state: u32) -> Vec<(Element, f64)> {
        let counted = self.mixtures.iter().flatten().find(|(_, s)| *s == state).and_then(|(key, _)| key.species);
        let formula = counted.and_then(|species| self.lab.tables.species.get(species).formula.as_ref());
        formula.map_or(Vec::new(), |f| f.elements.iter().map(|(element, n)| (*element, n.to_f64())).collect())
    }

    /// Notes which reactions can go on now, and between which bounds their conditions lie.
    fn note_processes(&mut self, facts: &AbstractState) {
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
