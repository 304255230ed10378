//! The mixtures of the model: their numbers, their extensive states, and what operations change of them.

use std::rc::Rc;

use matterix_ir::model::Action;
use matterix_ir::plan::Operation;
use matterix_ir::scene::InstanceId;
use rustc_hash::FxHashMap;

use crate::eval::lab::{Elaborator, ExtensiveKey};

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

/// The states of a mixture that a transfer takes from, each with that of the other mixture which it adds to, if any.
pub type Passage = Rc<[(u32, Option<u32>)]>;

/// Passages between mixtures, each found once.
#[derive(Default)]
pub struct Passages(FxHashMap<(u32, u32), Passage>);

impl Passages {
    /// What goes from one mixture to another; `extensive` as [`Elaborator::extensive_by_mixture`] gives them.
    pub fn between(&mut self, from: u32, to: u32, extensive: &[Vec<(ExtensiveKey, u32)>]) -> Passage {
        let find = || {
            let held = |mixture: u32| extensive.get(mixture as usize).map_or(&[][..], Vec::as_slice);
            let target = |key: &ExtensiveKey| {
                let same = |(k, _): &&(ExtensiveKey, u32)| k.member == key.member && k.species == key.species;
                held(to).iter().find(same).map(|(_, state)| *state)
            };
            held(from).iter().map(|(key, source)| (*source, target(key))).collect()
        };
        self.0.entry((from, to)).or_insert_with(find).clone()
    }
}

/// The states that an operation's actions change, some of them more than once; `extensive` as
/// [`Elaborator::extensive_by_mixture`] gives them.
pub fn written<'o>(
    operation: &'o Operation,
    extensive: &'o [Vec<(ExtensiveKey, u32)>],
) -> impl Iterator<Item = u32> + 'o {
    changed(operation.at_start.iter().chain(&operation.at_end), extensive)
}

/// The states that actions change, some of them more than once.
pub fn changed<'o>(
    actions: impl IntoIterator<Item = &'o Action> + 'o,
    extensive: &'o [Vec<(ExtensiveKey, u32)>],
) -> impl Iterator<Item = u32> + 'o {
    actions.into_iter().flat_map(|action| {
        let (state, mixtures) = match action {
            Action::Assign { state, .. } => (Some(*state), None),
            Action::Move { from, to, .. } => (None, Some([*from, *to])),
        };
        let held = mixtures.into_iter().flatten().filter_map(|m| extensive.get(m as usize)).flatten();
        state.into_iter().chain(held.map(|(_, state)| *state))
    })
}
