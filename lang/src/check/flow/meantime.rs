//! What goes on by itself while branches or jobs are followed one after the other over the same time: flows and timers that
//! were set going before. It goes on once, however many branches there are.

use std::collections::BTreeSet;
use std::rc::Rc;

use super::Interpreter;
use super::even::Even;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};

/// What moves by itself when concurrent steps begin.
#[derive(Clone, Debug)]
pub(super) struct Meantime {
    /// What was known then.
    begun: Rc<AbstractState>,
    /// States that none of the concurrent steps changes, nor what they set going.
    alone: BTreeSet<u32>,
    /// Other states that move.
    mixed: BTreeSet<u32>,
}

impl Interpreter<'_, '_> {
    /// States that flows and timers change which go on now, as far as they are followed exactly.
    fn going_on(&mut self, facts: &AbstractState) -> BTreeSet<u32> {
        let tracks = self.tracks();
        if tracks.list.is_empty() && self.timed.is_empty() {
            return BTreeSet::new();
        }
        let even = self.even(facts, &Even::default());
        let mut moved: BTreeSet<u32> = even.slopes.iter().map(|(s, ..)| *s).collect();
        let events = self.events;
        for timer in self.timers(&even, f64::INFINITY, facts).events {
            moved.extend(self.changed_by(&events[timer as usize].actions));
        }
        if moved.is_empty() {
            return moved;
        }
        let mut behind = self.behind(&moved);
        tracks.wild.iter().for_each(|s| _ = behind.remove(s));
        behind
    }

    /// What is known but for what concurrent steps may set at any time, such as whether a pump runs; none where there is no such.
    /// What the step that is followed has to itself they do not.
    pub(super) fn but_for_others(&mut self, facts: &AbstractState) -> Option<AbstractState> {
        let open = self.set_by_others();
        if open.is_empty() {
            return None;
        }
        let mut veiled = facts.clone();
        open.iter().for_each(|s| veiled.states[*s as usize] = AbstractValue::top());
        Some(veiled)
    }

    /// Time passes in which concurrent steps may set states that this line sets too: what moves is bounded whatever these are.
    pub(super) fn beside_others(
        &mut self,
        facts: &mut AbstractState,
        pass: impl FnOnce(&mut Self, &mut AbstractState),
    ) {
        let mut kept = Vec::new();
        for s in self.set_by_others() {
            kept.push((s, std::mem::replace(&mut facts.states[s as usize], AbstractValue::top())));
            facts.reopen(|state| state == s);
        }
        let veiled: Vec<u32> = kept.iter().map(|(s, _)| *s).filter(|s| self.rates_of.contains_key(s)).collect();
        // What bounded the last time that passed beside them bounds this one too where nothing else has changed since.
        if facts.barrier.as_ref().is_some_and(|barrier| barrier.veiled != veiled) {
            facts.barrier = None;
        }
        if facts.barrier.is_none() {
            veiled.iter().for_each(|s| self.touch(*s, facts));
        }
        let before = std::mem::replace(&mut self.veiled, veiled);
        pass(self, facts);
        self.veiled = before;
        for (s, known) in kept {
            facts.states[s as usize] = known;
            facts.reopen(|state| state == s);
        }
    }

    /// States that concurrent steps may set at any time, and this line as well; not what it has to itself.
    fn set_by_others(&mut self) -> Vec<u32> {
        let others: BTreeSet<u32> = self.contested.iter().flatten().copied().collect();
        if others.is_empty() {
            return Vec::new();
        }
        let tracks = self.tracks();
        let moved = |s: &u32| tracks.list.iter().any(|t| t.state == *s) || tracks.wild.contains(s);
        others.into_iter().filter(|s| !moved(s) && !self.has_claimed(*s)).collect()
    }

    /// Whether what is followed has the thing to itself that a state is of.
    fn has_claimed(&self, state: u32) -> bool {
        let mut at = Some(self.lab.state_owner[state as usize]);
        while let Some(id) = at {
            if self.claimed.contains(&id) {
                return true;
            }
            at = self.lab.instances[id.0 as usize].owner;
        }
        false
    }

    /// Concurrent steps that change these states begin; nothing where nothing goes on by itself.
    pub(super) fn meantime(&mut self, written: &BTreeSet<u32>, facts: &AbstractState) -> Option<Meantime> {
        let moving = self.going_on(facts);
        if moving.is_empty() {
            return None;
        }
        let written = self.behind(written);
        let (mixed, alone) = moving.into_iter().partition(|s| written.contains(s));
        Some(Meantime { begun: Rc::new(facts.clone()), alone, mixed })
    }

    /// Another of the concurrent steps begins at the same time: what moves by itself is as it was then, and nothing is known of
    /// what those before have set going, or changed of it.
    pub(super) fn begin_again(&mut self, meantime: Option<&Meantime>, facts: &mut AbstractState) {
        let mut open = self.going_on(facts);
        if let Some(meantime) = meantime {
            open.extend(&meantime.mixed);
            open.retain(|s| !meantime.alone.contains(s));
            self.put_back(meantime, &meantime.begun, facts);
        }
        self.forget(&open.into_iter().collect::<Vec<_>>(), facts);
    }

    /// What moves by itself is as it is in `other`.
    fn put_back(&mut self, meantime: &Meantime, other: &AbstractState, facts: &mut AbstractState) {
        let states: Vec<u32> = meantime.alone.iter().copied().collect();
        facts.rebind(|bonds, _| bonds.release(&states));
        for state in &states {
            facts.states[*state as usize] = other.states[*state as usize].clone();
            facts.untell(std::iter::once(*state));
            self.touch(*state, facts);
        }
        for event in self.events_on(&states) {
            facts.fired[event as usize] = other.fired[event as usize];
        }
        facts.barrier = None;
    }

    /// The concurrent steps are over: what moves by itself is as the one that ended last left it.
    pub(super) fn go_on_from(
        &mut self,
        meantime: Option<&Meantime>,
        ends: &[AbstractState],
        facts: &mut AbstractState,
    ) {
        let Some(meantime) = meantime else { return };
        let last = facts.time.exact().and_then(|time| ends.iter().find(|end| end.time.exact() == Some(time)));
        match last {
            Some(last) => self.put_back(meantime, last, facts),
            None => self.forget(&meantime.alone.iter().copied().collect::<Vec<_>>(), facts),
        }
        self.forget(&meantime.mixed.iter().copied().collect::<Vec<_>>(), facts);
    }

    /// Time goes on from `facts.time` to `end` by what goes on beside a job that changes `written` and ends then.
    pub(super) fn catch_up(&mut self, end: &AbstractValue, written: &BTreeSet<u32>, facts: &mut AbstractState) {
        if end.bounds().1 <= facts.time.bounds().0 {
            return;
        }
        let Some(meantime) = self.meantime(written, facts) else { return };
        let mut later = facts.clone();
        if let (Some(now), Some(end)) = (facts.time.exact(), end.exact()) {
            let unbroken = std::mem::take(&mut self.unbroken);
            self.pass(&AbstractValue::Point(end - now), &mut later);
            self.unbroken = unbroken;
        } else {
            later.time = AbstractValue::top();
        }
        let ends = [later];
        let now = std::mem::replace(&mut facts.time, end.clone());
        self.go_on_from(Some(&meantime), &ends, facts);
        facts.time = now;
    }

    /// What moves otherwise than evenly goes on while a job is waited for that ends then.
    pub(super) fn moves_until(&mut self, end: &AbstractValue, facts: &mut AbstractState) {
        let longest = end.bounds().1 - facts.time.bounds().0;
        if longest <= 0.0 || facts.unsettled.is_empty() && facts.moving.is_empty() {
            return;
        }
        let even: Vec<u32> = self.going_on(facts).into_iter().collect();
        let kept: Vec<AbstractValue> = even.iter().map(|s| facts.states[*s as usize].clone()).collect();
        let now = facts.time.clone();
        self.drift(&AbstractValue::Range(0.0, longest, Imprecision::Unknown), facts);
        facts.time = now;
        even.iter().zip(kept).for_each(|(s, known)| facts.states[*s as usize] = known);
    }

    /// What moves by itself is not known while a job that changes `written` is followed behind its time.
    pub(super) fn look_back(&mut self, written: &BTreeSet<u32>, facts: &mut AbstractState) -> Option<Meantime> {
        let meantime = self.meantime(written, facts)?;
        let moving: Vec<u32> = meantime.alone.union(&meantime.mixed).copied().collect();
        self.forget(&moving, facts);
        Some(meantime)
    }
}
