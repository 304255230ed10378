//! What a change of some states concerns, so that whoever follows a run looks at that alone.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Model;
use matterix_ir::{NodeId, Op};

/// What a thing that is watched rests on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Below {
    /// The states.
    pub(crate) states: BTreeSet<u32>,
    /// Whether it may change where no state does: with time, or with what the plan or a device says.
    pub(crate) is_timed: bool,
}

impl Below {
    /// Of some values of a model.
    pub(crate) fn new(model: &Model, nodes: &[NodeId]) -> Self {
        let mut below = Below::default();
        for &node in nodes {
            model.graph.visit(node, |op| match op {
                Op::State(state) => {
                    below.states.insert(state);
                }
                Op::Time | Op::Local(_) | Op::Reading(_) => below.is_timed = true,
                _ => {}
            });
        }
        below
    }

    /// Of these states alone.
    pub(crate) fn states(states: impl IntoIterator<Item = u32>) -> Self {
        Below { states: states.into_iter().collect(), is_timed: false }
    }
}

/// So many things are put in order by comparing them; more are marked.
const FEW: usize = 64;

/// Things by what they rest on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touched {
    count: u32,
    /// By state, which of `sets` is above it. All amounts of a mixture have the same things above them, its concentrations.
    above: Vec<u32>,
    sets: Vec<Vec<u32>>,
    /// Those that rest on time too.
    timed: Vec<u32>,
}

impl Touched {
    /// Of a model with so many states.
    pub(crate) fn new(states: usize, things: impl IntoIterator<Item = Below>) -> Self {
        let (mut above, mut touched) = (vec![Vec::new(); states], Touched::default());
        for below in things {
            if below.is_timed {
                touched.timed.push(touched.count);
            }
            for state in below.states {
                if let Some(above) = above.get_mut(state as usize) {
                    above.push(touched.count);
                }
            }
            touched.count += 1;
        }
        let mut numbers: BTreeMap<Vec<u32>, u32> = BTreeMap::new();
        for things in above {
            let next = numbers.len() as u32;
            touched.above.push(*numbers.entry(things).or_insert(next));
        }
        touched.sets = vec![Vec::new(); numbers.len()];
        for (things, number) in numbers {
            touched.sets[number as usize] = things;
        }
        touched
    }

    /// All things.
    pub(crate) fn all(&self) -> Vec<u32> {
        (0..self.count).collect()
    }

    /// The things that may be other than before where these states are, ascending.
    pub(crate) fn by(&self, changed: &[u32]) -> Vec<u32> {
        if changed.len() == self.above.len() {
            return self.all();
        }
        let mut sets: Vec<u32> = changed.iter().filter_map(|state| self.above.get(*state as usize).copied()).collect();
        sets.sort_unstable();
        sets.dedup();
        let above = sets.iter().flat_map(|set| &self.sets[*set as usize]).chain(&self.timed).copied();
        let many = sets.iter().map(|set| self.sets[*set as usize].len()).sum::<usize>() > FEW;
        if many {
            return in_order(above, self.count);
        }
        let mut touched: Vec<u32> = above.collect();
        touched.sort_unstable();
        touched.dedup();
        touched
    }
}

/// Numbers below `count`, ascending, each once.
fn in_order(numbers: impl Iterator<Item = u32>, count: u32) -> Vec<u32> {
    let mut marks = vec![0u64; count.div_ceil(u64::BITS) as usize];
    for number in numbers {
        marks[(number / u64::BITS) as usize] |= 1 << (number % u64::BITS);
    }
    let mut out = Vec::new();
    for (word, mut bits) in (0..).zip(marks) {
        while bits != 0 {
            out.push(word * u64::BITS + bits.trailing_zeros());
            bits &= bits - 1;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rests_on_changed_states_or_on_time_is_touched() {
        let timed = Below { is_timed: true, ..Below::states([0]) };
        let touched = Touched::new(4, [Below::states([1, 2]), Below::states([2]), timed, Below::default()]);
        assert_eq!(touched.by(&[]), [2]);
        assert_eq!(touched.by(&[1]), [0, 2]);
        assert_eq!(touched.by(&[1, 2]), [0, 1, 2]);
        assert_eq!(touched.by(&[0, 1, 2, 3]), [0, 1, 2, 3]);
    }

    #[test]
    fn many_things_come_in_order_and_once() {
        let things: Vec<Below> = (0..300).map(|i| Below::states([i % 3, (i / 2) % 5])).collect();
        let touched = Touched::new(6, things.clone());
        for changed in [vec![0], vec![1, 4], vec![0, 1, 2], vec![3, 4, 5]] {
            let rests = |below: &Below| changed.iter().any(|state| below.states.contains(state));
            let plain: Vec<u32> = (0..300).filter(|i| rests(&things[*i as usize])).collect();
            assert_eq!(touched.by(&changed), plain);
        }
    }
}
