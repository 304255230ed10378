//! The course of what moves evenly while time passes: from one change of a condition to the next, each at its moment, with the
//! events that happen there and the limits that are passed on the way.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::{BinaryOp, Leaves, NodeId, Op, Severity, UnaryOp};

use super::Interpreter;
use super::dual::{Along, Dual};
use super::eval::Exact;
use super::even::{Even, Tracks};
use super::state::{AbstractState, same_history};
use super::timers::{Timers, comes_before};
use super::value::{AbstractValue, CLOSE, Imprecision};

/// Changes of conditions within one step before the rest of it is followed in bounds.
const MOST_CHANGES: usize = 1000;

/// Where it is looked whether a difference changes evenly, as shares of the time.
const BETWEEN: [f64; 3] = [0.23, 0.5, 0.81];

/// A difference that departs from a straight line by less than this share of what is compared is one.
const STRAIGHT: f64 = 1e-9;

/// Pieces of a time that are looked at for a turn of what looks straight where points show it.
const MOST_PIECES: usize = 200;

/// A piece is halved no further than to this share of the time.
const FINEST: f64 = 1.0 / (1 << 12) as f64;

/// How a course ends.
pub(super) enum Course {
    /// These conditions have come to what was waited for.
    Reached(Vec<NodeId>),
    /// All of the time has passed.
    Passed,
    /// Further on nothing moves evenly: what is left of the time, s.
    Left(f64),
}

/// Two sides of a comparison, or of what bends a line.
type Sides = (NodeId, Option<NodeId>);

/// A limit that was passed on the way, with what was known there.
struct Passed {
    limit: u32,
    there: AbstractState,
}

impl Even {
    /// Makes of `within`, which has what is known now but for what moves, what is known at all times between two from now, s.
    fn between(&self, (from, to): (f64, f64), now: &AbstractState, within: &mut AbstractState) {
        self.open.iter().for_each(|s| within.states[*s as usize] = AbstractValue::top());
        for (state, value, slope) in &self.slopes {
            let (first, last) = (value + slope * from, value + slope * to);
            within.states[*state as usize] =
                AbstractValue::Range(first.min(last), first.max(last), Imprecision::Unknown);
        }
        within.time =
            AbstractValue::binary(BinaryOp::Add, &now.time, &AbstractValue::Range(from, to, Imprecision::Unknown));
    }
}

impl Interpreter<'_, '_> {
    /// Follows what moves evenly for at most `longest` s, or until a condition comes to what it is waited for to be.
    pub(super) fn course(&mut self, longest: f64, until: &[(NodeId, bool)], facts: &mut AbstractState) -> Course {
        let tracks = self.tracks();
        if tracks.list.is_empty() && self.timed.is_empty() {
            return Course::Left(longest);
        }
        let mut passed = Vec::new();
        let begun = facts.clone();
        let end = self.along(&tracks, longest, until, facts, &mut passed);
        if begun.time != facts.time {
            self.limits_passed(&Even::default(), &begun, facts, &mut passed);
        }
        for Passed { limit, there } in passed {
            self.pass_limit(limit, there, facts);
        }
        end
    }

    fn along(
        &mut self,
        tracks: &Tracks,
        longest: f64,
        until: &[(NodeId, bool)],
        facts: &mut AbstractState,
        passed: &mut Vec<Passed>,
    ) -> Course {
        let mut left = longest;
        let end = facts.time.exact().map(|now| now + longest);
        let mut last = Even::default();
        let mut changes = 0;
        let begun = facts.clone();
        for _ in 0..MOST_CHANGES {
            let Some(even) = self.settled(facts, &last) else { break };
            if let Some(state) = even.empty.filter(|_| left > 0.0) {
                if passed.is_empty() {
                    self.takes_from_nothing(state);
                }
                self.forget(&even.slopes.iter().map(|(s, ..)| *s).collect::<Vec<u32>>(), facts);
                return Course::Left(left);
            }
            let timers = self.timers(&even, left, facts);
            let still = even.slopes.is_empty() && timers.events.is_empty();
            if timers.unsure || (still && (changes == 0 || !self.rests_at_thresholds(&even, facts))) {
                break;
            }
            // What only a run can tell may come about at any moment.
            if until.iter().any(|(node, _)| self.along_at(*node, &even, 0.0, facts).is_none()) {
                break;
            }
            if left > 0.0 {
                self.limits_passed(&even, &begun, facts, passed);
            }
            let sides = self.sides(tracks, &even, &timers, until);
            let Some(next) = self.next_change(&sides, &even, left, facts) else { break };
            let dry = dry_at(&even, &self.amounts);
            let mut step = next.min(left).min(dry.unwrap_or(f64::INFINITY));
            if !step.is_finite() {
                break;
            }
            let (now, mut to) = (facts.time.exact(), None);
            if let (Some(now), Some(end), false) = (now, end, timers.events.is_empty()) {
                let moment = self.moment(&timers, now + step, &even, facts);
                let Some(before) = comes_before(moment, end) else { break };
                to = Some(if before { moment } else { end });
                step = to.map_or(step, |to| to - now);
            }
            self.go_along(step, &even, &timers, &sides, facts);
            left -= step;
            if let (Some(to), Some(end)) = (to, end) {
                facts.time = AbstractValue::Point(to);
                left = end - to;
            }
            if dry.is_some_and(|dry| dry <= step) {
                // A limit that was passed before ends the step there.
                self.runs_dry(&even, step, passed.is_empty(), facts);
                return Course::Left(left);
            }
            let history = facts.history.clone();
            self.events_along(&even, &timers, facts);
            let jumped = !same_history(&history, &facts.history);
            let reached = until.iter().filter(|(node, truth)| self.truth_beyond(*node, &even, facts) == Some(*truth));
            let reached: Vec<NodeId> = reached.map(|(node, _)| *node).collect();
            if !reached.is_empty() {
                return Course::Reached(reached);
            }
            if left <= 0.0 {
                return Course::Passed;
            }
            last = even;
            if jumped {
                last.truths.clear();
            }
            changes += 1;
        }
        if changes == MOST_CHANGES {
            let headline = format!("flows and timers switch more than {MOST_CHANGES} times in this step");
            self.not_analysed(Severity::Advice, headline, "`check` knows only bounds of their results");
        }
        Course::Left(left)
    }

    /// What is compared in conditions that what moves evenly decides.
    fn sides(&mut self, tracks: &Tracks, even: &Even, timers: &Timers, until: &[(NodeId, bool)]) -> Vec<Sides> {
        let states: Vec<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        let events = self.events_on(&states).into_iter().chain(timers.events.iter().copied());
        let limits = states.iter().filter_map(|s| self.limits_of.get(s)).flatten();
        let mut roots: BTreeSet<NodeId> = events.map(|i| self.events[i as usize].when).collect();
        roots.extend(limits.map(|i| self.plan.limits[*i as usize].condition.node));
        roots.extend(tracks.conditions.iter().copied().chain(until.iter().map(|(node, _)| *node)));
        let mut sides = BTreeSet::new();
        for root in roots {
            for node in self.order(root).iter() {
                match self.lab.graph.op(*node) {
                    Op::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq | BinaryOp::Min | BinaryOp::Max, a, b) => {
                        _ = sides.insert((a, Some(b)))
                    }
                    Op::Unary(UnaryOp::Abs | UnaryOp::Floor, a) => _ = sides.insert((a, None)),
                    _ => {}
                }
            }
        }
        let touched = |node: &NodeId, flow: &mut Self| {
            let parts = flow.parts(*node);
            parts.timed || parts.states.iter().any(|s| even.moves(*s))
        };
        sides.into_iter().filter(|(a, b)| touched(a, self) || b.is_some_and(|b| touched(&b, self))).collect()
    }

    /// How long it is until the first of these differences changes its sign, s; none where one of them may do so that is not
    /// followed.
    fn next_change(&mut self, sides: &[Sides], even: &Even, left: f64, facts: &AbstractState) -> Option<f64> {
        let mut next = f64::INFINITY;
        let mut followed = Vec::new();
        for side in sides {
            // What rests on other things as well is looked at when the time has passed.
            let Some((now, slope, size)) = self.difference(*side, even, 0.0, facts) else {
                // A wave of the time may come about and be over before that, and what is read is known within bounds.
                if [Some(side.0), side.1].into_iter().flatten().any(|node| self.parts(node).timed || self.is_read(node))
                {
                    return None;
                }
                continue;
            };
            followed.push(*side);
            let at = -now / slope;
            if slope != 0.0 && now.abs() > CLOSE * size && at > 0.0 {
                next = next.min(at);
            }
        }
        let end = next.min(left);
        if !end.is_finite() {
            return Some(next);
        }
        for side in followed {
            let (now, _, size) = self.difference(side, even, 0.0, facts)?;
            let (then, _, far) = self.difference(side, even, end, facts)?;
            let mut bends = self.is_wave(side);
            for share in BETWEEN {
                let (between, ..) = self.difference(side, even, share * end, facts)?;
                bends |= (between - (now + share * (then - now))).abs() > STRAIGHT * size.max(far);
            }
            let is_followed = match bends {
                true => self.stays_apart(side, even, (0.0, end), facts),
                // Points show no turn that is over between them.
                false => self.is_straight(side, even) || self.turns_nowhere(side, even, (end, size.max(far)), facts),
            };
            if !is_followed {
                return None;
            }
        }
        Some(next)
    }

    /// Whether two sides follow what moves in straight lines, by their form.
    fn is_straight(&mut self, (a, b): Sides, even: &Even) -> bool {
        [Some(a), b].into_iter().flatten().all(|node| {
            let order = self.order(node);
            let mut degrees: BTreeMap<NodeId, u8> = BTreeMap::new();
            for node in order.iter().copied() {
                let op = self.lab.graph.op(node);
                let of = |node: NodeId| degrees.get(&node).copied().unwrap_or(0);
                let most = op.operands().map(of).max().unwrap_or(0);
                let is_kept = match op {
                    Op::Unary(UnaryOp::Neg, _) | Op::Binary(BinaryOp::Add | BinaryOp::Sub, ..) => true,
                    Op::Binary(BinaryOp::Mul, a, b) => of(a).min(of(b)) == 0,
                    Op::Binary(BinaryOp::Div, _, b) => of(b) == 0,
                    Op::Select(condition, ..) => of(condition) == 0,
                    _ => false,
                };
                let degree = match op {
                    Op::State(state) => u8::from(even.slopes.iter().any(|(s, ..)| *s == state)),
                    Op::Time => 1,
                    _ if most == 1 && !is_kept => 2,
                    _ => most,
                };
                degrees.insert(node, degree);
            }
            degrees.get(&node).is_none_or(|degree| *degree < 2)
        })
    }

    /// Whether two sides that look straight are apart at all times before an end, but for what is next to it and to the beginning.
    fn turns_nowhere(&mut self, side: Sides, even: &Even, (end, size): (f64, f64), facts: &AbstractState) -> bool {
        let mut todo = vec![(0.0, 1.0)];
        let (mut pieces, mut within) = (0, facts.clone());
        while let Some((from, to)) = todo.pop() {
            pieces += 1;
            if pieces > MOST_PIECES {
                return false;
            }
            even.between((from * end, to * end), facts, &mut within);
            let (low, high) = self.apart_within(side, &within);
            let is_next = (from == 0.0 || to == 1.0) && to - from < FINEST;
            if low > 0.0 || high < 0.0 || low.abs().max(high.abs()) <= CLOSE * size || is_next {
                continue;
            }
            if to - from < FINEST {
                return false;
            }
            let middle = 0.5 * (from + to);
            todo.extend([(middle, to), (from, middle)]);
        }
        true
    }

    /// Whether a side is a wave: it may turn as often as it likes between two moments.
    fn is_wave(&mut self, (a, b): Sides) -> bool {
        let waves = |op: Op| matches!(op, Op::Unary(op, _) if op.is_wave());
        [Some(a), b].into_iter().flatten().any(|node| self.order(node).iter().any(|n| waves(self.lab.graph.op(*n))))
    }

    /// Whether a node hangs on what a device reads.
    fn is_read(&self, node: NodeId) -> bool {
        self.lab.graph.leaves(node).meets(Leaves::READING)
    }

    /// Whether two sides are apart all the time between two.
    fn stays_apart(&mut self, side: Sides, even: &Even, times: (f64, f64), facts: &AbstractState) -> bool {
        let mut within = facts.clone();
        even.between(times, facts, &mut within);
        let (low, high) = self.apart_within(side, &within);
        low > 0.0 || high < 0.0
    }

    /// Bounds of the difference of two sides.
    fn apart_within(&mut self, (a, b): Sides, within: &AbstractState) -> (f64, f64) {
        let (low, high) = self.eval(a, within).bounds();
        let (least, most) = b.map_or((0.0, 0.0), |b| self.eval(b, within).bounds());
        (low - most, high - least)
    }

    /// The difference of two sides after a time, how fast it changes, and the size of the larger one.
    pub(super) fn difference(
        &mut self,
        (a, b): Sides,
        even: &Even,
        time: f64,
        facts: &AbstractState,
    ) -> Option<(f64, f64, f64)> {
        let a = self.along_at(a, even, time, facts)?;
        let b = b.map_or(Some(Dual::default()), |b| self.along_at(b, even, time, facts))?;
        let known = |v: f64| if v.is_nan() { 0.0 } else { v };
        Some((known(a.value - b.value), known(a.slope - b.slope), a.value.abs().max(b.value.abs())))
    }

    pub(super) fn along_at(&mut self, node: NodeId, even: &Even, time: f64, facts: &AbstractState) -> Option<Dual> {
        let along = Along { exact: Exact { params: &self.params, facts }, even, time };
        self.nodes.formulas.of(&self.lab.graph, node).value(&along, &mut self.duals)
    }

    /// Whether a condition holds from now on while states move so, even where what it compares has just become equal.
    pub(super) fn truth_beyond(&mut self, node: NodeId, even: &Even, facts: &AbstractState) -> Option<bool> {
        let by_motion = self.along_at(node, even, 0.0, facts).map(|dual| dual.value != 0.0);
        by_motion.or_else(|| self.eval(node, facts).truth())
    }

    /// Lets time pass in which what moves evenly does so; what else moves is known in bounds.
    fn go_along(&mut self, step: f64, even: &Even, timers: &Timers, sides: &[Sides], facts: &mut AbstractState) {
        let before = facts.clone();
        let followed: Vec<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        let mut events = self.events_on(&followed);
        events.extend(&timers.events);
        events.extend(self.events_at_rest(even, facts));
        self.at_moments.clone_from(&timers.events);
        for event in &events {
            if self.comes_at_its_moment(*event, even, facts) {
                self.at_moments.push(*event);
            }
        }
        self.unheard(|flow| flow.drift(&AbstractValue::Point(step), facts));
        self.at_moments.clear();
        // What the events that are followed do is done at their moment.
        let set: BTreeSet<u32> =
            events.iter().flat_map(|i| self.changed_by(&self.events[*i as usize].actions)).collect();
        let kept = set.into_iter().filter(|s| !even.open.contains(s)).chain(followed.iter().copied());
        let kept: Vec<u32> =
            kept.chain(self.tracks().list.iter().map(|t| t.state).filter(|s| !even.open.contains(s))).collect();
        self.narrow_by_streams(step, even, facts);
        let back: Vec<(u32, AbstractValue)> = kept.iter().map(|s| (*s, before.states[*s as usize].clone())).collect();
        facts.rebind(|bonds, _| bonds.release(&kept));
        back.into_iter().for_each(|(s, known)| facts.states[s as usize] = known);
        for i in events {
            facts.fired[i as usize] = before.fired[i as usize];
        }
        facts.history = before.history;
        let mut changes: Vec<(u32, AbstractValue)> =
            even.slopes.iter().map(|(s, value, slope)| (*s, AbstractValue::point(value + slope * step))).collect();
        for (a, b) in sides {
            self.snap(*a, *b, &mut changes, facts);
        }
        self.write(changes, facts);
        facts.barrier = None;
    }

    /// Whether all that an event asks for is known at every moment while states move so: it comes about between two steps of them only.
    fn comes_at_its_moment(&mut self, event: u32, even: &Even, facts: &AbstractState) -> bool {
        let parts = self.parts(self.events[event as usize].when);
        let known = |s: &u32| !even.open.contains(s) && facts.states[*s as usize].exact().is_some();
        !parts.timed && parts.states.iter().all(known)
    }

    /// Events of states that are known to stay as they are where flows balance each other: they do not come about.
    fn events_at_rest(&mut self, even: &Even, facts: &AbstractState) -> Vec<u32> {
        let rest = |s: u32| !even.moves(s) && !even.open.contains(&s) && facts.states[s as usize].exact().is_some();
        let tracks = self.tracks();
        let resting: Vec<u32> = tracks.list.iter().map(|t| t.state).filter(|s| rest(*s)).collect();
        let mut events = self.events_on(&resting);
        events.retain(|i| {
            let parts = self.parts(self.events[*i as usize].when);
            !parts.timed && parts.states.iter().all(|s| rest(*s))
        });
        events
    }

    /// Brings in how far streams have gone by what they have taken evenly, and with it the amounts where they end: of a reagent no more
    /// reacts than was dosed.
    fn narrow_by_streams(&mut self, step: f64, even: &Even, facts: &mut AbstractState) {
        let Some(mut bonds) = facts.bonds.as_deref().cloned() else { return };
        bonds.settle(facts);
        let ends: Vec<(u32, f64)> = even.slopes.iter().map(|(s, value, slope)| (*s, value + slope * step)).collect();
        let Some(still) = bonds.come_to(&ends) else { return };
        let amounts = bonds.tighten(|state| self.amounts.contains(&state), |state| self.atoms(state));
        let still = still.into_iter().map(|(state, base)| (state, base.bounds()));
        for (state, (low, high)) in still.chain(amounts) {
            let (least, most) = facts.states[state as usize].bounds();
            let (low, high) = (low.max(least), high.min(most));
            if low <= high {
                facts.states[state as usize] = AbstractValue::Range(low, high, Imprecision::Unknown);
            }
        }
        bonds.stamp(facts);
        facts.bonds = Some(Rc::new(bonds)).filter(|bonds| !bonds.is_empty());
    }

    /// A state that has come to a number, give or take rounding, is that number.
    fn snap(&mut self, a: NodeId, b: Option<NodeId>, changes: &mut [(u32, AbstractValue)], facts: &AbstractState) {
        let Some(b) = b else { return };
        for (moving, still) in [(a, b), (b, a)] {
            let Op::State(state) = self.lab.graph.op(moving) else { continue };
            let Some(goal) = self.eval(still, facts).exact() else { continue };
            if self.parts(still).states.iter().any(|s| changes.iter().any(|(c, _)| c == s)) {
                continue;
            }
            for (_, known) in changes.iter_mut().filter(|(s, _)| *s == state) {
                if known.exact().is_some_and(|v| (v - goal).abs() <= 1e-12 * goal.abs()) {
                    *known = AbstractValue::Point(goal);
                }
            }
        }
    }

    /// Events that what moved evenly and the time bring about now, each time the first of the text, as in a run.
    fn events_along(&mut self, even: &Even, timers: &Timers, facts: &mut AbstractState) {
        let followed: Vec<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        let mut due = self.events_on(&followed);
        due.extend(&timers.events);
        due.sort_unstable();
        due.dedup();
        let mut sure = true;
        let mut last = None;
        for _ in 0..MOST_CHANGES {
            let mut next = None;
            for i in &due {
                let now = self.truth_beyond(self.events[*i as usize].when, even, facts);
                let before = &mut facts.fired[*i as usize];
                if now != Some(true) {
                    *before = now;
                } else if *before != Some(true) && next.is_none() {
                    sure &= *before == Some(false);
                    next = Some(*i);
                }
            }
            let Some(i) = next else { return };
            last = Some(i);
            let changed = self.happen(i, facts);
            facts.fired[i as usize] = self.truth_beyond(self.events[i as usize].when, even, facts).or(Some(true));
            let on = self.events_on(&changed).into_iter().filter(|e| !due.contains(e)).collect();
            self.fire(on, facts);
        }
        if let Some(last) = last.filter(|_| sure) {
            self.cascades(last);
        }
        let changed = due.iter().flat_map(|i| self.changed_by(&self.events[*i as usize].actions)).collect::<Vec<u32>>();
        self.forget(&changed, facts);
    }

    /// Notes the limits that hold no longer.
    fn limits_passed(&mut self, even: &Even, before: &AbstractState, facts: &AbstractState, passed: &mut Vec<Passed>) {
        let changed = (0..self.lab.states.len() as u32)
            .filter(|s| even.moves(*s) || before.states[*s as usize] != facts.states[*s as usize]);
        let due: BTreeSet<u32> = changed.filter_map(|s| self.limits_of.get(&s)).flatten().copied().collect();
        for limit in due {
            let node = self.plan.limits[limit as usize].condition.node;
            let new = !passed.iter().any(|p| p.limit == limit);
            if new
                && self.truth_beyond(node, even, facts) == Some(false)
                && self.eval(node, before).truth() != Some(false)
            {
                passed.push(Passed { limit, there: facts.clone() });
            }
        }
    }

    /// Reports a limit that was passed on the way: by what it comes to in the end, where it still does not hold then.
    fn pass_limit(&mut self, index: u32, there: AbstractState, facts: &mut AbstractState) {
        let limit = &self.plan.limits[index as usize];
        let name = limit.condition.failure();
        let lasts = self.eval(limit.condition.node, facts).truth() == Some(false);
        let shown = if lasts { facts.clone() } else { there.clone() };
        self.unless_taken(name, |flow| flow.passed(limit, &shown, false));
        self.limit_taken |= self.is_taken(name);
        let goes_on = !self.is_taken(name) || self.is_shared(limit.condition.node);
        self.raise(name, there);
        if goes_on {
            let states = self.parts(limit.condition.node).states.clone();
            self.forget(&states, facts);
        }
        self.stopped |= !goes_on;
    }

    /// A stream takes more than there is, which is reported where the run comes to it.
    fn runs_dry(&mut self, even: &Even, step: f64, comes: bool, facts: &mut AbstractState) {
        let empty = even.slopes.iter().filter(|(s, value, slope)| {
            self.amounts.contains(s) && *slope < 0.0 && value + slope * step <= STRAIGHT * value
        });
        let empty: Vec<u32> = empty.map(|(s, ..)| *s).collect();
        if let Some(amount) = empty.first().filter(|_| comes) {
            self.used_up(*amount, facts);
        }
        let moved: Vec<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        self.forget(&moved, facts);
    }
}

/// When the first amount that a stream takes is used up, s.
fn dry_at(even: &Even, amounts: &BTreeSet<u32>) -> Option<f64> {
    let falls = even.slopes.iter().filter(|(s, value, slope)| amounts.contains(s) && *slope < 0.0 && *value > 0.0);
    falls.map(|(_, value, slope)| -value / slope).min_by(f64::total_cmp)
}
