//! The law, taken apart: states whose rates rest on each other move together, apart from all others.
//!
//! What parts have in common rests meanwhile: the room, a set point, a block that is switched off. So a beaker on one
//! hotplate has nothing to do with one on another, and a part whose law is the same after a discontinuity elsewhere goes on as if
//! nothing had happened (ARCHITECTURE.md, "Simulation").

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::{NodeId, Op};

use super::analysis::Analysis;
use super::tape::Tape;

/// A state that does not move is in no part.
pub(super) const NOWHERE: u32 = u32::MAX;

/// States that move together.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Ascending.
    pub(super) moving: Vec<u32>,
    /// Their derivatives.
    pub(super) rates: Tape,
}

/// Comparisons that rest on the same parts.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    /// Ascending; none where they follow the time alone.
    pub(super) parts: Vec<u32>,
    /// The states they rest on, ascending.
    pub(super) states: Vec<u32>,
    /// In order.
    pub(super) nodes: Vec<NodeId>,
}

/// States that move, as they are found to rest on each other.
#[derive(Default)]
pub(super) struct Together {
    /// By state, a lesser one that it moves together with; itself if there is none.
    above: BTreeMap<u32, u32>,
}

impl Together {
    /// Takes a state in; whether it is new.
    pub(super) fn add(&mut self, state: u32) -> bool {
        let known = self.above.len();
        self.above.entry(state).or_insert(state);
        self.above.len() > known
    }

    fn root(&mut self, mut state: u32) -> u32 {
        while let Some(&above) = self.above.get(&state).filter(|above| **above != state) {
            let next = self.above.get(&above).copied().unwrap_or(above);
            self.above.insert(state, next);
            state = next;
        }
        state
    }

    /// Two states that were taken in move together.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.above.insert(a.max(b), a.min(b));
    }

    /// States that move together, each list ascending, in the order of their first states.
    pub(super) fn into_lists(mut self) -> Vec<Vec<u32>> {
        let all: BTreeSet<u32> = self.above.keys().copied().collect();
        let mut found: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for state in all {
            found.entry(self.root(state)).or_default().push(state);
        }
        found.into_values().collect()
    }
}

/// Comparisons by the parts that they rest on; those that cannot change as they are now are left out.
pub(super) fn groups(analysis: Analysis<'_>, nodes: &[NodeId], part_of: &[u32]) -> Vec<Group> {
    let mut found: BTreeMap<Vec<u32>, Group> = BTreeMap::new();
    for &node in nodes {
        let Op::Binary(_, a, b) = analysis.op(node) else { continue };
        if !(analysis.varies(a) || analysis.varies(b)) {
            continue;
        }
        let states = analysis.states_below(&[a, b]);
        let mut parts: Vec<u32> = states.iter().map(|s| part_of[*s as usize]).collect();
        parts.sort_unstable();
        parts.dedup();
        let group = found.entry(parts.clone()).or_insert_with(|| Group { parts, ..Group::default() });
        group.nodes.push(node);
        group.states.extend(states);
    }
    for group in found.values_mut() {
        group.states.sort_unstable();
        group.states.dedup();
    }
    found.into_values().collect()
}
