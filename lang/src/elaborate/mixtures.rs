//! The mixtures of the model: their numbers, their extensive states, and what operations change of them.

use std::collections::BTreeSet;

use matterix_ir::model::Action;
use matterix_ir::plan::Operation;
use matterix_ir::scene::InstanceId;

use super::{Elaborator, ExtensiveKey};

impl Elaborator<'_> {
    /// The extensive states of each mixture, by its index in the model.
    pub fn extensive_by_mixture(&self) -> Vec<Vec<(ExtensiveKey, u32)>> {
        let mut out = vec![Vec::new(); self.mixtures.len()];
        for (key, state) in &self.extensive {
            if let Ok(index) = self.mixtures.binary_search(&key.instance) {
                out[index].push((key.clone(), *state));
            }
        }
        out
    }

    /// Index of a mixture in the model.
    pub fn mixture_index(&self, id: InstanceId) -> u32 {
        self.mixtures.partition_point(|m| *m < id) as u32
    }
}

/// The states that an operation's actions change; `extensive` as [`Elaborator::extensive_by_mixture`] gives them.
pub fn written(operation: &Operation, extensive: &[Vec<(ExtensiveKey, u32)>]) -> BTreeSet<u32> {
    let mut out = BTreeSet::new();
    for action in operation.at_start.iter().chain(&operation.at_end) {
        match action {
            Action::Assign { state, .. } => out.extend([*state]),
            Action::Move { from, to, .. } => {
                let held = [from, to].into_iter().filter_map(|m| extensive.get(*m as usize)).flatten();
                out.extend(held.map(|(_, state)| *state));
            }
        }
    }
    out
}
