//! What can never be true: conditions on where things stand, given everything the plan can do.

use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};

use crate::eval::lab::Elaborator;

/// What is known of a truth value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tri {
    Never,
    Always,
    Maybe,
}

impl Elaborator<'_> {
    /// Whether a condition can never hold, whatever the plan does.
    pub fn never(&self, node: NodeId) -> bool {
        self.tri(node) == Tri::Never
    }

    fn tri(&self, node: NodeId) -> Tri {
        match self.graph.op(node) {
            Op::Const(v) => {
                if v == 0.0 {
                    Tri::Never
                } else {
                    Tri::Always
                }
            }
            Op::Unary(UnaryOp::Not, a) => match self.tri(a) {
                Tri::Never => Tri::Always,
                Tri::Always => Tri::Never,
                Tri::Maybe => Tri::Maybe,
            },
            Op::Binary(BinaryOp::And, a, b) => match (self.tri(a), self.tri(b)) {
                (Tri::Never, _) | (_, Tri::Never) => Tri::Never,
                (Tri::Always, x) | (x, Tri::Always) => x,
                _ => Tri::Maybe,
            },
            Op::Binary(BinaryOp::Or, a, b) => match (self.tri(a), self.tri(b)) {
                (Tri::Always, _) | (_, Tri::Always) => Tri::Always,
                (Tri::Never, x) | (x, Tri::Never) => x,
                _ => Tri::Maybe,
            },
            Op::Binary(BinaryOp::Eq, a, b) => self.holds_eq(a, b).or_else(|| self.holds_eq(b, a)).unwrap_or(Tri::Maybe),
            _ => Tri::Maybe,
        }
    }

    fn holds_eq(&self, state: NodeId, value: NodeId) -> Option<Tri> {
        let (Op::State(s), Some(v)) = (self.graph.op(state), self.graph.constant(value)) else { return None };
        let set = self.targets.noted(s)?;
        Some(if !set.contains(&(v as i64)) {
            Tri::Never
        } else if set.len() == 1 {
            Tri::Always
        } else {
            Tri::Maybe
        })
    }
}
