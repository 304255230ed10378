//! Numbers that are none: a quotient of nothing, the root of what is below zero.

use crate::graph::{BinaryOp, Graph, NodeId, Op, UnaryOp, apply};

/// So many operations are followed where values are not known.
const MOST_FOLLOWED: usize = 64;

/// The operation that leaves `node` without a value, among those that its value rests on: its operands are finite, its result is
/// not. A limit that is declared without bound is a value. `value` gives what is known of a node; of `a and b` and of `choose`
/// only the part that decides counts.
pub fn undefined(graph: &Graph, node: NodeId, value: &mut dyn FnMut(NodeId) -> Option<f64>) -> Option<NodeId> {
    Search { graph, value, left: MOST_FOLLOWED }.decides(node)
}

/// Why an operation has no value, in words.
pub fn why(op: Op) -> &'static str {
    match op {
        Op::Binary(BinaryOp::Div, ..) => "something is divided by 0",
        Op::Unary(UnaryOp::Sqrt, _) => "the root of a number below 0",
        Op::Unary(UnaryOp::Ln, _) => "the logarithm of a number that is not above 0",
        Op::Binary(BinaryOp::Pow, ..) => "a power that no number is",
        Op::Select(..) => "a table is read beyond its first or last point",
        _ => "it is too large, or endless less endless",
    }
}

struct Search<'a> {
    graph: &'a Graph,
    value: &'a mut dyn FnMut(NodeId) -> Option<f64>,
    left: usize,
}

impl Search<'_> {
    /// The same where the value is one of a condition.
    fn decides(&mut self, node: NodeId) -> Option<NodeId> {
        match self.graph.op(node) {
            Op::Unary(UnaryOp::Not, a) => self.decides(a),
            Op::Binary(BinaryOp::And, a, b) => self.either(a, b, 0.0),
            Op::Binary(BinaryOp::Or, a, b) => self.either(a, b, 1.0),
            Op::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq, a, b) => self.of(a).or_else(|| self.of(b)),
            _ => self.of(node),
        }
    }

    /// Of two parts of a condition one alone decides with this value.
    fn either(&mut self, a: NodeId, b: NodeId, alone: f64) -> Option<NodeId> {
        let parts = [a, b].map(|part| (self.decides(part), (self.value)(part).map(|v| f64::from(u8::from(v != 0.0)))));
        let decided = |(broken, value): &(Option<NodeId>, Option<f64>)| broken.is_none() && *value == Some(alone);
        let open = parts.iter().any(|(_, value)| value.is_none());
        if open || parts.iter().any(decided) { None } else { parts[0].0.or(parts[1].0) }
    }

    fn of(&mut self, node: NodeId) -> Option<NodeId> {
        let known = (self.value)(node);
        if known.is_some_and(f64::is_finite) || self.left == 0 {
            return None;
        }
        self.left -= 1;
        let op = self.graph.op(node);
        if let Op::Select(c, a, b) = op {
            return match (self.decides(c), (self.value)(c)) {
                (None, Some(c)) if self.graph.is_gap(if c != 0.0 { a } else { b }) => Some(node),
                (None, Some(c)) => self.of(if c != 0.0 { a } else { b }),
                (broken, _) => broken,
            };
        }
        let operands: Vec<NodeId> = op.operands().collect();
        if operands.is_empty() {
            return None;
        }
        if let Some(found) = operands.iter().find_map(|n| self.of(*n)) {
            return Some(found);
        }
        let values: Option<Vec<f64>> = operands.iter().map(|n| (self.value)(*n)).collect();
        let values = values?;
        let at = |n: NodeId| operands.iter().position(|o| *o == n).map_or(f64::NAN, |i| values[i]);
        let result = apply(op, |_| f64::NAN, at);
        let all = |is: fn(f64) -> bool| values.iter().all(|v| is(*v));
        let made = (result.is_nan() && all(|v| !v.is_nan())) || (result.is_infinite() && all(f64::is_finite));
        made.then_some(node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Env;

    fn graph(build: impl FnOnce(&mut Graph, NodeId) -> NodeId, x: f64) -> Option<Op> {
        let mut graph = Graph::default();
        let state = graph.add(Op::State(0));
        let root = build(&mut graph, state);
        let env = Env { time: 0.0, states: &[x], params: &[], locals: &[], readings: &[] };
        undefined(&graph, root, &mut |n| Some(graph.eval(n, env))).map(|n| graph.op(n))
    }

    fn reciprocal(g: &mut Graph, x: NodeId) -> NodeId {
        let one = g.number(1.0);
        g.add(Op::Binary(BinaryOp::Div, one, x))
    }

    #[test]
    fn a_quotient_of_nothing_has_no_value() {
        let compared = |g: &mut Graph, x| {
            let (q, one) = (reciprocal(g, x), g.number(1.0));
            g.add(Op::Binary(BinaryOp::Lt, one, q))
        };
        assert!(matches!(graph(compared, 0.0), Some(Op::Binary(BinaryOp::Div, ..))));
        assert_eq!(graph(compared, 0.5), None);
    }

    #[test]
    fn what_is_not_asked_for_may_have_none() {
        let guarded = |g: &mut Graph, x| {
            let (q, zero) = (reciprocal(g, x), g.number(0.0));
            let there = g.add(Op::Binary(BinaryOp::Lt, zero, x));
            let large = g.add(Op::Binary(BinaryOp::Lt, zero, q));
            g.add(Op::Binary(BinaryOp::And, there, large))
        };
        assert_eq!(graph(guarded, 0.0), None);
        let chosen = |g: &mut Graph, x| {
            let (q, zero) = (reciprocal(g, x), g.number(0.0));
            let there = g.add(Op::Binary(BinaryOp::Lt, zero, x));
            g.add(Op::Select(there, q, zero))
        };
        assert_eq!(graph(chosen, 0.0), None);
    }

    #[test]
    fn no_limit_is_a_value() {
        assert_eq!(graph(|_, x| x, f64::INFINITY), None);
        assert!(graph(|g, x| g.add(Op::Unary(UnaryOp::Sqrt, x)), -1.0).is_some());
    }
}
