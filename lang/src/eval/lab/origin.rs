//! Where the numbers of a model come from: the lines that add up to a rate or a flow, and the text of operations that may fail.

use matterix_ir::model::{self, Flow, Place};
use matterix_ir::{BinaryOp, NodeId, Op, Span, UnaryOp};

use super::{Contribution, Elaborator};

/// Contributions as the run is told them.
pub fn terms(parts: &[Contribution]) -> Vec<model::Contribution> {
    let told = |c: &Contribution| model::Contribution { process: c.process as u32, node: c.node, span: c.span };
    parts.iter().map(told).collect()
}

impl Elaborator<'_> {
    /// Notes where an operation stands, if it may leave a number without a value.
    pub fn note_place(&mut self, node: NodeId, span: Span) {
        let may_fail = match self.graph.op(node) {
            Op::Binary(BinaryOp::Div, _, by) => self.graph.constant(by).is_none(),
            op @ Op::Select(..) => self.graph.is_table(op),
            Op::Binary(BinaryOp::Pow, ..) | Op::Unary(UnaryOp::Sqrt | UnaryOp::Ln, _) => true,
            _ => false,
        };
        if may_fail && !self.draft && !self.prototype {
            self.written_at.entry(node).or_insert(span);
        }
    }

    /// The flows that laws use, with what they are the sums of.
    pub fn told_flows(&self) -> Vec<Flow> {
        let moves = self.flows_read.iter().filter(|(_, node)| self.graph.constant(**node).is_none());
        let told = moves.filter_map(|(key, node)| {
            let name = format!("{}.{}", self.instances.get(key.0.0 as usize)?.name, key.2);
            Some(Flow { name, node: *node, terms: terms(self.flows.get(key)?) })
        });
        told.collect()
    }

    /// Where operations stand that may have no value.
    pub fn told_places(&self) -> Vec<Place> {
        self.written_at.iter().map(|(node, span)| Place { node: *node, span: *span }).collect()
    }
}
