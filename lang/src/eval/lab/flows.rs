//! Flows as they are read: what processes contribute to them.

use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Span};

use super::{Contribution, Elaborator};
use crate::ast::MemberKind;
use crate::declare::{MemberRef, Type};
use crate::eval::Value;

impl<'a> Elaborator<'a> {
    /// The sum of all contributions to a flow, each zero while its process rests.
    pub fn read_flow(&mut self, id: InstanceId, m: MemberRef<'a>, _: Span) -> Value {
        let MemberKind::Value { name, ty, .. } = &m.member.kind else { return Value::Error };
        self.touched_flow = true;
        let ty = self.resolve_type(ty, m.module);
        let Type::Quantity { dimension, .. } = ty else { return Value::Error };
        let key = (id, m.owner, name.text.clone());
        let parts = self.flows.get(&key).cloned().unwrap_or_default();
        let node = self.gated_sum(&parts);
        if self.flows_sealed {
            self.flows_read.insert(key, node);
            self.flow_sums.insert(node, parts);
        }
        self.num(node, dimension)
    }

    /// The sum of contributions, each zero while its process rests.
    pub fn gated_sum(&mut self, parts: &[Contribution]) -> NodeId {
        let mut sum = self.graph.number(0.0);
        for c in parts {
            let node = self.gated(c);
            sum = self.plus(sum, node);
        }
        sum
    }

    /// A contribution, zero while its process rests.
    pub fn gated(&mut self, c: &Contribution) -> NodeId {
        match self.processes[c.process].guard {
            Some(guard) => {
                let zero = self.graph.number(0.0);
                self.graph.select(guard, c.node, zero)
            }
            None => c.node,
        }
    }
}
