//! Amounts that laws and effects write: whatever they can bring into a mixture needs a state there.

use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Graph, NodeId, Op, UnaryOp};

use crate::ast::{Expr, ExprKind};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::{Scope, Value};

impl<'a> Elaborator<'a> {
    /// Notes that a law writes `value` to a place without a state. Whether that place is an amount: it gets its state in the
    /// next round, unless nothing but zero is ever written there.
    pub(super) fn writes(&mut self, place: &'a Expr, value: NodeId, scope: &mut Scope) -> bool {
        let Some(amount) = self.amount_at(place, scope) else { return false };
        if !self.vanishes(value) {
            self.written.insert(amount);
        }
        true
    }

    /// The mixture and the species of `m.amount[S]`.
    fn amount_at(&mut self, place: &'a Expr, scope: &mut Scope) -> Option<(InstanceId, SpeciesId)> {
        let (ExprKind::IndexWord(base, _) | ExprKind::Index(base, _)) = &*place.kind else { return None };
        let Value::Method(of, _) = self.expr(base, scope) else { return None };
        let Value::Instance(id) = *of else { return None };
        let s = match &*place.kind {
            ExprKind::IndexWord(_, word) => self.species_meant(word, scope).ok()??,
            ExprKind::Index(_, index) => match self.expr(index, scope) {
                Value::Species(s) => s,
                _ => return None,
            },
            _ => return None,
        };
        Some((id, s))
    }

    /// Whether a value is zero whatever the run does, as far as its form tells: amounts that can never be there are constants.
    pub(super) fn vanishes(&self, node: NodeId) -> bool {
        vanishes(&self.graph, node, &|condition| self.never(condition), &|_| false)
    }
}

/// Whether a value is zero whenever certain states are, as far as its form tells; `never` says which conditions never hold.
pub fn vanishes(graph: &Graph, node: NodeId, never: &dyn Fn(NodeId) -> bool, zero: &dyn Fn(u32) -> bool) -> bool {
    if let Op::Const(v) = graph.op(node) {
        return v == 0.0;
    }
    let order = graph.schedule([node]);
    let mut none: Vec<bool> = Vec::with_capacity(order.len());
    for n in &order {
        let look = |o: NodeId| none[order.partition_point(|other| *other < o)];
        none.push(match graph.op(*n) {
            Op::Const(v) => v == 0.0,
            Op::State(state) => zero(state),
            Op::Time | Op::Param(_) | Op::Local(_) | Op::Reading(_) => false,
            Op::Unary(
                UnaryOp::Neg | UnaryOp::Sqrt | UnaryOp::Abs | UnaryOp::Sin | UnaryOp::Atan | UnaryOp::Floor,
                a,
            ) => look(a),
            Op::Unary(UnaryOp::Not | UnaryOp::Exp | UnaryOp::Ln | UnaryOp::Cos, _) => false,
            Op::Binary(BinaryOp::Mul, a, b) => look(a) || look(b),
            Op::Binary(BinaryOp::Div, a, b) => look(a) && !look(b),
            Op::Binary(BinaryOp::Pow, a, b) => look(a) && graph.constant(b).is_some_and(|b| b > 0.0),
            Op::Binary(BinaryOp::Add | BinaryOp::Sub | BinaryOp::Min | BinaryOp::Max, a, b) => look(a) && look(b),
            Op::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq | BinaryOp::And | BinaryOp::Or, ..) => never(*n),
            Op::List(..) | Op::Solved(..) => false,
            Op::Select(condition, a, b) => (never(condition) || look(a)) && look(b),
        });
    }
    none.last().copied().unwrap_or_default()
}
