//! What is seen of the lab: told by devices, known by what was commanded, or only supposed by the twin.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Model;
use matterix_ir::{NodeId, Op};

/// What devices tell, and what only the twin supposes.
#[derive(Debug, Default)]
pub struct Observed {
    /// By node: device and line of its driver.
    pub told: BTreeMap<NodeId, (usize, usize)>,
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
        Observed { told, hidden, moving }
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
