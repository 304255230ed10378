//! What is seen of the lab: told by devices, known by what was commanded, or only supposed by the twin.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Model;
use matterix_ir::{NodeId, Op};

/// What devices tell, and what only the twin supposes.
#[derive(Debug, Default)]
pub struct Observed {
    /// By node: device and line of its driver.
    pub told: BTreeMap<NodeId, (usize, usize)>,
    /// What is told of a node: itself, or the reading that shows a true value. What a device is at the end is judged by what it shows.
    shown: BTreeMap<NodeId, NodeId>,
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
        let mut shown: BTreeMap<NodeId, NodeId> = told.keys().map(|node| (*node, *node)).collect();
        for node in told.keys() {
            if let Op::Reading(r) = model.graph.op(*node)
                && let Some(reading) = model.readings.get(r as usize)
            {
                shown.entry(reading.value).or_insert(*node);
            }
        }
        Observed { told, shown, hidden, moving }
    }

    /// The outermost nodes in one that devices show, each with the node that they tell of it.
    pub fn shows(&self, model: &Model, node: NodeId) -> Vec<(NodeId, NodeId)> {
        let found = outermost(model, node, &self.shown, |_| ());
        found.into_iter().map(|node| (node, self.shown[&node])).collect()
    }

    /// What a node asks devices for: the outermost told nodes in it, and whether beside them it needs what is only supposed.
    pub fn asks(&self, model: &Model, node: NodeId) -> (Vec<NodeId>, bool) {
        let mut supposed = false;
        let told = outermost(model, node, &self.told, |op| match op {
            Op::State(s) => supposed |= self.hidden.contains(&s),
            Op::Reading(_) => supposed = true,
            _ => {}
        });
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

/// The outermost of these nodes in one, in order; `rest` is given what else it is made of.
fn outermost<T>(model: &Model, node: NodeId, of: &BTreeMap<NodeId, T>, mut rest: impl FnMut(Op)) -> Vec<NodeId> {
    let (mut found, mut seen, mut open) = (Vec::new(), BTreeSet::new(), vec![node]);
    while let Some(node) = open.pop() {
        if !seen.insert(node) {
            continue;
        }
        if of.contains_key(&node) {
            found.push(node);
            continue;
        }
        let op = model.graph.op(node);
        rest(op);
        open.extend(op.operands());
    }
    found.sort_unstable();
    found
}
