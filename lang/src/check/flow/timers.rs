//! Timers: events that the time brings about at moments that are known, whether or not anything flows meanwhile.

use std::collections::BTreeSet;

use matterix_ir::graph::Env;
use matterix_ir::{BinaryOp, NodeId};

use super::Interpreter;
use super::even::Even;
use super::state::AbstractState;
use super::value::{AbstractValue, CLOSE, Imprecision};

/// How many neighbouring numbers are tried for the moment at which a run fires a timer.
const NEIGHBOURS: usize = 8;

/// Sums of whole numbers of ticks are exact: ticks per second.
const TICKS: f64 = 1024.0;

/// Events of the time that are followed at their moments.
#[derive(Debug, Default)]
pub(super) struct Timers {
    /// By index, ascending.
    pub events: Vec<u32>,
    /// Others of the time may come about at moments that are not known.
    pub unsure: bool,
}

impl Timers {
    /// Those of which nothing is known.
    fn unsure() -> Self {
        Timers { events: Vec::new(), unsure: true }
    }
}

impl Interpreter<'_, '_> {
    /// Events of the time that may come about within `left` s while states move so.
    pub(super) fn timers(&mut self, even: &Even, left: f64, facts: &AbstractState) -> Timers {
        if self.timed.is_empty() {
            return Timers::default();
        }
        let others = self.but_for_others(facts);
        let facts = others.as_ref().unwrap_or(facts);
        let mut within = self.veiled(even, facts);
        within.time =
            AbstractValue::binary(BinaryOp::Add, &facts.time, &AbstractValue::Range(0.0, left, Imprecision::Unknown));
        let mut events = Vec::new();
        for i in self.timed.clone() {
            let when = self.events[i as usize].when;
            let lasts = facts.fired[i as usize];
            if self.eval(when, &within).truth().is_some_and(|truth| !truth || lasts == Some(true)) {
                continue;
            }
            // One that is due by rounding alone is left to bounds, too.
            match self.along_at(when, even, 0.0, facts) {
                Some(now) if now.value == 0.0 || lasts == Some(true) => {}
                _ => return Timers::unsure(),
            }
            events.push(i);
        }
        if !events.is_empty() && self.disturbs_timers(&events, even, facts) {
            return Timers::unsure();
        }
        Timers { events, unsure: false }
    }

    /// What is known while states move so, but for how far they get.
    fn veiled(&self, even: &Even, facts: &AbstractState) -> AbstractState {
        let mut veiled = facts.clone();
        let moving = even.open.iter().copied().chain(even.slopes.iter().map(|(s, ..)| *s));
        moving.for_each(|s| veiled.states[s as usize] = AbstractValue::top());
        veiled
    }

    /// Whether an event at a moment that is not known may change what these timers ask for, or what they change.
    fn disturbs_timers(&mut self, timers: &[u32], even: &Even, facts: &AbstractState) -> bool {
        let events = self.events;
        let mut needed = BTreeSet::new();
        for i in timers {
            let event = &events[*i as usize];
            needed.extend(self.parts(event.when).states.iter().copied());
            needed.extend(self.changed_by(&event.actions).into_iter().filter(|s| !even.open.contains(s)));
        }
        let mut veiled = self.veiled(even, facts);
        veiled.time = AbstractValue::top();
        needed.iter().for_each(|s| veiled.states[*s as usize] = AbstractValue::top());
        let mut open = even.open.clone();
        let mut loose: BTreeSet<u32> = BTreeSet::new();
        loop {
            let before = loose.len();
            for (i, event) in events.iter().enumerate() {
                let i = i as u32;
                if timers.contains(&i) || loose.contains(&i) {
                    continue;
                }
                let parts = self.parts(event.when);
                let exact = |s: &u32| even.moves(*s) || facts.states[*s as usize].exact().is_some();
                // Where what it asks for is known, only what happens at a moment brings it about.
                let at_a_moment = parts.states.iter().all(|s| !open.contains(s) && exact(s));
                if at_a_moment || self.eval(event.when, &veiled).truth() == Some(false) {
                    continue;
                }
                loose.insert(i);
                for state in self.changed_by(&event.actions) {
                    if needed.contains(&state) {
                        return true;
                    }
                    open.insert(state);
                    veiled.states[state as usize] = AbstractValue::top();
                }
            }
            if loose.len() == before {
                return false;
            }
        }
    }

    /// The moment about `at`, s, at which a run fires the first of these timers: conditions are compared there number by number.
    pub(super) fn moment(&self, timers: &Timers, at: f64, even: &Even, facts: &AbstractState) -> f64 {
        let pending: Vec<NodeId> = timers
            .events
            .iter()
            .filter(|i| facts.fired[**i as usize] != Some(true))
            .map(|i| self.events[*i as usize].when)
            .collect();
        let Some(now) = facts.time.exact().filter(|_| !pending.is_empty()) else { return at };
        let readings = vec![f64::NAN; self.lab.readings.len()];
        let due = |time: f64| {
            let value = |s: &AbstractValue| s.exact().unwrap_or(f64::NAN);
            let mut states: Vec<f64> = facts.states.iter().map(value).collect();
            even.slopes.iter().for_each(|(s, value, slope)| states[*s as usize] = value + slope * (time - now));
            let params: Vec<f64> = self.params.iter().map(value).collect();
            let locals: Vec<f64> = facts.locals.iter().map(value).collect();
            let env = Env { time, states: &states, params: &params, locals: &locals, readings: &readings };
            pending.iter().any(|node| self.lab.graph.eval(*node, env) != 0.0)
        };
        let mut time = at;
        for _ in 0..NEIGHBOURS {
            if !due(time) {
                time = time.next_up();
            } else if time.next_down() > now && due(time.next_down()) {
                time = time.next_down();
            } else {
                return time;
            }
        }
        at
    }
}

/// Whether a moment comes before the end of a step, s; none where rounding decides, which may come out otherwise in a run.
pub(super) fn comes_before(moment: f64, end: f64) -> Option<bool> {
    if end == f64::INFINITY {
        return moment.is_finite().then_some(true);
    }
    let apart = (moment - end).abs() > CLOSE * moment.abs().max(end.abs());
    let exact = |time: f64| (time * TICKS).fract() == 0.0;
    (apart || (exact(moment) && exact(end))).then_some(moment <= end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_decides_nothing() {
        assert_eq!(comes_before(600.0, 600.0), Some(true));
        assert_eq!(comes_before(600.5, 600.0), Some(false));
        assert_eq!(comes_before(0.1 + 0.2, 0.3), None);
        assert_eq!(comes_before(0.3, 0.3), None);
        assert_eq!(comes_before(0.3, 0.4), Some(true));
        assert_eq!(comes_before(0.3, f64::INFINITY), Some(true));
    }
}
