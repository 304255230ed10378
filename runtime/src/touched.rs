//! What a change of some states concerns, so that whoever follows a run looks at that alone.

use std::collections::BTreeSet;

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

/// Things by what they rest on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touched {
    count: u32,
    /// By state, the things above it.
    above: Vec<Vec<u32>>,
    /// Those that rest on time too.
    timed: Vec<u32>,
}

impl Touched {
    /// Of a model with so many states.
    pub(crate) fn new(states: usize, things: impl IntoIterator<Item = Below>) -> Self {
        let mut touched = Touched { above: vec![Vec::new(); states], ..Touched::default() };
        for below in things {
            if below.is_timed {
                touched.timed.push(touched.count);
            }
            for state in below.states {
                if let Some(above) = touched.above.get_mut(state as usize) {
                    above.push(touched.count);
                }
            }
            touched.count += 1;
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
        let above = changed.iter().filter_map(|state| self.above.get(*state as usize)).flatten();
        let mut touched: Vec<u32> = above.chain(&self.timed).copied().collect();
        touched.sort_unstable();
        touched.dedup();
        touched
    }
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
}
