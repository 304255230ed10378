//! The law, taken apart: states whose rates rest on each other move together, apart from all others.
//!
//! What parts have in common rests meanwhile: the room, a set point, a block that is switched off. So a beaker on one
//! hotplate has nothing to do with one on another, and a part whose law is the same after a discontinuity elsewhere goes on as if
//! nothing had happened (ARCHITECTURE.md, "Simulation").

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::NodeId;
use rustc_hash::FxHashMap;

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

/// What the moving states below operations come to together. Each operation is worked out once, as long as neither law nor parts change.
#[derive(Default)]
struct Below<T> {
    known: FxHashMap<NodeId, T>,
}

impl<T: Copy + Default> Below<T> {
    /// What `state` gives for each moving state below `node` and is met for the first time, joined by `and` with what is known.
    fn of(
        &mut self,
        analysis: Analysis<'_>,
        node: NodeId,
        state: &mut impl FnMut(u32) -> T,
        and: &mut impl FnMut(T, T) -> T,
    ) -> T {
        let node = analysis.same(node);
        let mut todo = vec![(node, false)];
        while let Some((at, is_ready)) = todo.pop() {
            if self.known.contains_key(&at) {
                continue;
            }
            let below = || analysis.below(at);
            match analysis.moving_state(at) {
                Some(moving) => _ = self.known.insert(at, state(moving)),
                None if is_ready => {
                    let all = below().filter_map(|n| self.known.get(&n).copied()).fold(T::default(), &mut *and);
                    self.known.insert(at, all);
                }
                None => {
                    todo.push((at, true));
                    todo.extend(below().map(|n| (n, false)));
                }
            }
        }
        self.known.get(&node).copied().unwrap_or_default()
    }
}

/// A walk from the rates of states, which comes by each operation once: what several rates share is looked at for the first of them.
#[derive(Default)]
pub(super) struct Walk {
    /// One of the moving states below.
    below: Below<Option<u32>>,
}

impl Walk {
    /// Moving states below `rate`: all of them, or for what the walk has come by before one that moves together with the others.
    pub(super) fn from(&mut self, analysis: Analysis<'_>, rate: NodeId) -> Vec<u32> {
        let mut found = BTreeSet::new();
        let one = self.below.of(analysis, rate, &mut Some, &mut |a, b| {
            found.extend(a.into_iter().chain(b));
            a.or(b)
        });
        found.extend(one);
        found.into_iter().collect()
    }
}

/// The parts that moving states belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Parts {
    #[default]
    None,
    One(u32),
    Several,
}

impl Parts {
    fn and(self, other: Parts) -> Parts {
        match (self, other) {
            (Parts::None, one) | (one, Parts::None) => one,
            (a, b) if a == b => a,
            _ => Parts::Several,
        }
    }
}

/// The parts below operations.
#[derive(Default)]
pub(super) struct PartsBelow(Below<Parts>);

impl PartsBelow {
    fn of(&mut self, analysis: Analysis<'_>, node: NodeId, part_of: &[u32]) -> Parts {
        self.0.of(analysis, node, &mut |state| Parts::One(part_of[state as usize]), &mut Parts::and)
    }
}

/// The moving states that comparisons and whole numbers rest on, ascending.
pub(super) fn rested_on(analysis: Analysis<'_>, comparisons: &[NodeId]) -> Vec<u32> {
    let sides: Vec<NodeId> = comparisons.iter().flat_map(|node| analysis.op(*node).operands()).collect();
    analysis.states_below(&sides)
}

/// Comparisons and whole numbers by the parts that they rest on; those that cannot change as they are now are left out.
pub(super) fn groups(
    analysis: Analysis<'_>,
    nodes: &[NodeId],
    part_of: &[u32],
    below: &mut PartsBelow,
) -> Vec<(Vec<u32>, Vec<NodeId>)> {
    let mut found: BTreeMap<Vec<u32>, Vec<NodeId>> = BTreeMap::new();
    for &node in nodes {
        let sides = analysis.op(node).operands();
        if !sides.clone().any(|side| analysis.varies(side)) {
            continue;
        }
        let parts = sides.map(|side| below.of(analysis, side, part_of)).fold(Parts::None, Parts::and);
        let parts = match parts {
            Parts::None => Vec::new(),
            Parts::One(part) => vec![part],
            Parts::Several => {
                let mut parts: Vec<u32> = rested_on(analysis, &[node]).iter().map(|s| part_of[*s as usize]).collect();
                parts.sort_unstable();
                parts.dedup();
                parts
            }
        };
        found.entry(parts).or_default().push(node);
    }
    found.into_iter().collect()
}
