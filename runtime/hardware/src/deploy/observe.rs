//! What is seen of the lab: told by devices, known by what was commanded, or only supposed by the twin.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Model;
use matterix_ir::{NodeId, Op};

/// What devices tell, and what only the twin supposes.
#[derive(Debug, Default)]
pub struct Observed {
    /// By node: device and line of its driver.
    pub told: BTreeMap<NodeId, (usize, usize)>,
    /// The same, also of the true values that readings show: what a device is at the end is judged by what it shows.
    pub shown: BTreeMap<NodeId, (usize, usize)>,
    /// States that change by laws or with transfers.
    hidden: BTreeSet<u32>,
    /// States that change by laws.
    moving: BTreeSet<u32>,
}

impl Observed {
    /// With what is told.
    pub fn new(model: &Model, told: BTreeMap<NodeId, (usize, usize)>) -> Self {
        let moving: BTreeSet<u32> =
            model.derivatives.iter().filter(|d| model.graph.constant(d.rate) != Some(0.0)).map(|d| d.state).collect();
        let extensive = model.mixtures.iter().flat_map(|m| m.extensive.iter().map(|(_, state)| *state));
        let hidden = moving.iter().copied().chain(extensive).collect();
        let readings = told.iter().filter_map(|(node, line)| match model.graph.op(*node) {
            Op::Reading(r) => Some((model.readings.get(r as usize)?.value, *line)),
            _ => None,
        });
        let mut shown: BTreeMap<NodeId, (usize, usize)> = readings.collect();
        shown.extend(&told);
        Observed { told, shown, hidden, moving }
    }

    /// The outermost nodes in one that devices tell, or show.
    pub fn shows(&self, model: &Model, node: NodeId) -> Vec<NodeId> {
        let (mut found, mut seen, mut open) = (Vec::new(), BTreeSet::new(), vec![node]);
        while let Some(node) = open.pop() {
            match seen.insert(node) {
                false => {}
                true if self.shown.contains_key(&node) => found.push(node),
                true => open.extend(model.graph.op(node).operands()),
            }
        }
        found.sort_unstable();
        found
    }

    /// The reading that shows a true value.
    pub fn reading_of(&self, model: &Model, value: NodeId) -> Option<NodeId> {
        let shows = |node: &NodeId| match model.graph.op(*node) {
            Op::Reading(r) => model.readings.get(r as usize).is_some_and(|reading| reading.value == value),
            _ => false,
        };
        self.told.keys().copied().find(shows)
    }

    /// What a node asks devices for: the outermost told nodes in it, and whether beside them it needs what is only supposed.
    pub fn asks(&self, model: &Model, node: NodeId) -> (Vec<NodeId>, bool) {
        let (mut told, mut supposed) = (Vec::new(), false);
        let mut seen = BTreeSet::new();
        let mut open = vec![node];
        while let Some(node) = open.pop() {
            if !seen.insert(node) {
                continue;
            }
            if self.told.contains_key(&node) {
                told.push(node);
                continue;
            }
            match model.graph.op(node) {
                Op::State(s) => supposed |= self.hidden.contains(&s),
                Op::Reading(_) => supposed = true,
                op => open.extend(op.operands()),
            }
        }
        told.sort_unstable();
        (told, supposed)
    }

    /// Whether a node changes only with what is commanded, so that the twin knows it as well as the device does.
    pub fn is_settled(&self, model: &Model, node: NodeId) -> bool {
        !model.graph.depends(node, |op| match op {
            Op::State(s) => self.moving.contains(s),
            Op::Reading(_) | Op::Time => true,
            _ => false,
        })
    }
}
