//! Ranges that the needs of a command set for its parameters.

use std::sync::Arc;

use matterix_ir::graph::{BinaryOp, Op, UnaryOp};
use matterix_ir::offer::{Bound, Bounds};
use matterix_ir::plan::Condition;
use matterix_ir::{Graph, NodeId};

/// The interval in which all of these needs keep a local, as far as they compare it with numbers that are known before a run.
pub(super) fn bounds(
    graph: &Graph,
    needs: &[Arc<Condition>],
    local: u32,
    known: &dyn Fn(NodeId) -> Option<f64>,
) -> Bounds {
    needs.iter().map(|n| of(graph, n.node, local, known, false)).fold(Bounds::default(), Bounds::and)
}

/// The interval in which a condition holds, or does not hold where it is `negated`.
fn of(graph: &Graph, node: NodeId, local: u32, known: &dyn Fn(NodeId) -> Option<f64>, negated: bool) -> Bounds {
    let is_it = |node| graph.op(node) == Op::Local(local);
    match graph.op(node) {
        Op::Unary(UnaryOp::Not, a) => of(graph, a, local, known, !negated),
        Op::Binary(BinaryOp::And, a, b) if !negated => {
            of(graph, a, local, known, false).and(of(graph, b, local, known, false))
        }
        Op::Binary(BinaryOp::Or, a, b) if negated => {
            of(graph, a, local, known, true).and(of(graph, b, local, known, true))
        }
        // `a <= b` that does not hold is `a > b`, which leaves `b` out.
        Op::Binary(op @ (BinaryOp::Lt | BinaryOp::Le), a, b) => {
            let is_open = (op == BinaryOp::Lt) != negated;
            let (greatest_of, least_of) = if negated { (b, a) } else { (a, b) };
            let end = |other| known(other).filter(|n| n.is_finite()).map(|number| Bound { number, is_open });
            match (is_it(greatest_of), is_it(least_of)) {
                (true, false) => Bounds { least: None, greatest: end(least_of) },
                (false, true) => Bounds { least: end(greatest_of), greatest: None },
                _ => Bounds::default(),
            }
        }
        _ => Bounds::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comparisons_with_known_numbers_bound_a_parameter() {
        let mut graph = Graph::default();
        let (t, other) = (graph.add(Op::Local(3)), graph.add(Op::Local(4)));
        let (low, high, state) = (graph.number(1.0), graph.number(5.0), graph.add(Op::State(0)));
        let above = graph.binary(BinaryOp::Le, low, t);
        let below = graph.binary(BinaryOp::Lt, t, high);
        let both = graph.binary(BinaryOp::And, above, below);
        let beyond = graph.unary(UnaryOp::Not, below);
        let live = graph.binary(BinaryOp::Le, t, state);
        let foreign = graph.binary(BinaryOp::Le, other, high);
        let either = graph.binary(BinaryOp::Or, above, below);
        let known = |node| match graph.op(node) {
            Op::Const(n) => Some(n),
            _ => None,
        };
        let within = |node| of(&graph, node, 3, &known, false);
        let end = |number, is_open| Some(Bound { number, is_open });
        assert_eq!(within(both), Bounds { least: end(1.0, false), greatest: end(5.0, true) });
        assert_eq!(within(beyond), Bounds { least: end(5.0, false), greatest: None });
        for node in [live, foreign, either] {
            assert_eq!(within(node), Bounds::default());
        }
    }
}
