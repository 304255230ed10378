//! What flows already when branches begin: it flows once in their time, not once in that of each.

use std::collections::BTreeSet;

use matterix_ir::plan::StepId;

use super::Flow;
use super::even::Even;
use super::facts::Facts;
use super::value::Known;

/// States that move evenly while branches run, whatever these do.
pub(super) struct Afloat {
    states: Vec<u32>,
    /// What they are when the branches begin; none where a branch has a hand in it.
    start: Option<Vec<Known>>,
    /// What they are behind the branch that ends last, with its time, s; none where that is not known.
    last: Option<(f64, Vec<Known>)>,
}

impl Afloat {
    fn values(states: &[u32], facts: &Facts) -> Vec<Known> {
        states.iter().map(|s| facts.states[*s as usize].clone()).collect()
    }

    /// Notes what a branch leaves.
    pub(super) fn note(&mut self, facts: &Facts) {
        let Some(end) = facts.time.exact() else {
            self.last = Some((f64::INFINITY, vec![Known::nothing(); self.states.len()]));
            return;
        };
        if self.last.as_ref().is_none_or(|(time, _)| end > *time) {
            self.last = Some((end, Afloat::values(&self.states, facts)));
        }
    }
}

impl Flow<'_, '_> {
    /// What flows already when these branches begin; none where nothing does.
    pub(super) fn afloat(&mut self, branches: &[StepId], writes: &[BTreeSet<u32>], facts: &Facts) -> Option<Afloat> {
        if branches.len() < 2 || self.tracks().list.is_empty() {
            return None;
        }
        let even = self.even(facts, &Even::default());
        let states: Vec<u32> = even.slopes.iter().map(|(state, ..)| *state).collect();
        if states.is_empty() {
            return None;
        }
        let alone = !states.iter().any(|s| writes.iter().any(|w| w.contains(s)));
        let start = alone.then(|| Afloat::values(&states, facts));
        Some(Afloat { states, start, last: None })
    }

    /// Puts what flows back to where it was when the branches began.
    pub(super) fn begin_again(&mut self, afloat: &Afloat, facts: &mut Facts) {
        self.forget(&afloat.states, facts);
        for (state, value) in afloat.states.iter().zip(afloat.start.iter().flatten()) {
            facts.states[*state as usize] = value.clone();
        }
    }

    /// What flows is behind all branches what it is behind the longest.
    pub(super) fn behind_all(&mut self, afloat: &Afloat, facts: &mut Facts) {
        self.forget(&afloat.states, facts);
        let Some((_, values)) = afloat.last.as_ref().filter(|_| afloat.start.is_some()) else { return };
        for (state, value) in afloat.states.iter().zip(values) {
            facts.states[*state as usize] = value.clone();
        }
    }
}
