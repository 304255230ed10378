//! What a value would be after a transfer.

use std::collections::HashMap;

use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, NodeId, Op};

use super::lab::{Elaborator, ExtensiveKey};

impl Elaborator<'_> {
    /// What a value would be with a share of one mixture added to another one.
    pub fn after_adding(&mut self, value: NodeId, share: NodeId, (from, to): (InstanceId, InstanceId)) -> NodeId {
        let held = |id: InstanceId, lab: &Self| -> Vec<(ExtensiveKey, u32)> {
            let first = ExtensiveKey { instance: id, member: String::new(), species: None, matter: false };
            let all = lab.extensive.range(first..).take_while(|(key, _)| key.instance == id);
            all.map(|(key, state)| (key.clone(), *state)).collect()
        };
        let gives: HashMap<_, _> =
            held(from, self).into_iter().map(|(key, state)| ((key.member, key.species), state)).collect();
        let mut states = HashMap::new();
        for (key, state) in held(to, self) {
            let Some(source) = gives.get(&(key.member, key.species)) else { continue };
            let (there, comes) = (self.graph.add(Op::State(state)), self.graph.add(Op::State(*source)));
            let comes = self.graph.binary(BinaryOp::Mul, share, comes);
            states.insert(state, self.graph.binary(BinaryOp::Add, there, comes));
        }
        self.graph.with_states(value, &states)
    }
}
