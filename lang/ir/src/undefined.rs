//! Numbers that are none: a quotient of nothing, the root of what is below zero.

use std::collections::BTreeSet;

use crate::graph::{BinaryOp, Graph, NodeId, Op, UnaryOp, apply};
use crate::listing::joined;

/// So many operations are followed where values are not known.
const MOST_FOLLOWED: usize = 64;

/// The operation that leaves `node` without a value, among those that its value rests on: its operands are finite, its result is
/// not. A limit that is declared without bound is a value. `value` gives what is known of a node; of `a and b` and of `choose`
/// only the part that decides counts.
pub fn undefined(graph: &Graph, node: NodeId, value: &mut dyn FnMut(NodeId) -> Option<f64>) -> Option<NodeId> {
    Search { graph, value, left: MOST_FOLLOWED }.decides(node)
}

/// So many equilibria are named where they have no solution.
const MOST_NAMED: usize = 6;

/// Why an operation has no value, in words.
pub fn why(graph: &Graph, operation: NodeId) -> String {
    let text = match graph.op(operation) {
        Op::Binary(BinaryOp::Div, ..) => "division by 0",
        Op::Unary(UnaryOp::Sqrt, _) => "square root of a negative number",
        Op::Unary(UnaryOp::Ln, _) => "logarithm of 0 or of a negative number",
        Op::Binary(BinaryOp::Pow, ..) => "a power without a real value",
        Op::Select(..) => "a table is read outside its first and last point",
        Op::Solved(call, _) => {
            let equations = graph.call(call).system.equations();
            let mut names: Vec<String> = equations.iter().map(|e| format!("`{}`", e.name)).collect();
            if names.len() > MOST_NAMED {
                let more = names.split_off(MOST_NAMED - 1).len();
                names.push(format!("{more} more"));
            }
            return match names.as_slice() {
                [] => "no amounts satisfy the equilibria".into(),
                [one] => format!("no amounts meet the equilibrium {one}"),
                all => format!("no amounts satisfy the equilibria {} together", joined(all, "and")),
            };
        }
        _ => "the value is too large, or infinity minus infinity",
    };
    text.into()
}

/// The comparisons of a graph whose sides may be no number: a quotient, a root, what a table says. They are neither true nor false then.
#[derive(Clone, Debug, Default)]
pub struct Doubts {
    /// By operation, whether it rests on such a comparison.
    rests: Vec<bool>,
}

impl Doubts {
    /// Those of `graph`.
    pub fn new(graph: &Graph) -> Doubts {
        let (mut is_partial, mut rests) = (Vec::new(), Vec::new());
        for op in graph.ops() {
            let any = |marks: &[bool]| op.operands().any(|operand| marks[operand.0 as usize]);
            let below = any(&is_partial);
            rests.push(any(&rests) || (op.is_comparison() && below));
            is_partial.push(below || has_gaps(graph, *op));
        }
        Doubts { rests }
    }

    /// Whether `node` may rest on a comparison that is neither true nor false.
    pub fn concern(&self, node: NodeId) -> bool {
        self.rests.get(node.0 as usize).copied().unwrap_or_default()
    }

    /// The operation that leaves a comparison on which `root` rests neither true nor false: it is no number, and its operands are. As
    /// in [`undefined`] only what decides counts; what is endless is larger or smaller than any number. `value` gives the value of a node.
    pub fn undecided(&self, graph: &Graph, root: NodeId, value: &dyn Fn(NodeId) -> f64) -> Option<NodeId> {
        let (mut seen, mut todo) = (BTreeSet::new(), vec![root]);
        while let Some(node) = todo.pop() {
            if !self.concern(node) || !seen.insert(node) {
                continue;
            }
            match graph.op(node) {
                Op::Binary(op @ (BinaryOp::And | BinaryOp::Or), a, b) => {
                    let alone = op == BinaryOp::Or;
                    let found = [a, b].map(|part| self.undecided(graph, part, value));
                    let decides = |part: NodeId| (value(part) != 0.0) == alone;
                    let is_decided = (found[0].is_none() && decides(a)) || (found[1].is_none() && decides(b));
                    match found[0].or(found[1]) {
                        Some(found) if !is_decided => return Some(found),
                        _ => {}
                    }
                }
                Op::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq, a, b) => {
                    if let Some(side) = [a, b].into_iter().find(|side| value(*side).is_nan()) {
                        return Some(self.first_without(graph, side, value));
                    }
                    todo.extend([a, b]);
                }
                Op::Select(c, a, b) => match self.undecided(graph, c, value) {
                    Some(found) => return Some(found),
                    None => todo.push(if value(c) != 0.0 { a } else { b }),
                },
                op => todo.extend(op.operands()),
            }
        }
        None
    }

    /// The operation below `node` that is no number, as `node` is, though its operands are.
    fn first_without(&self, graph: &Graph, mut node: NodeId, value: &dyn Fn(NodeId) -> f64) -> NodeId {
        loop {
            let below = match graph.op(node) {
                Op::Select(c, a, b) => {
                    if let Some(found) = self.undecided(graph, c, value) {
                        return found;
                    }
                    Some(if value(c) != 0.0 { a } else { b }).filter(|taken| !graph.is_gap(*taken))
                }
                op => op.operands().find(|operand| value(*operand).is_nan()),
            };
            let Some(below) = below else { return node };
            node = below;
        }
    }
}

/// Whether an operation may be no number though its operands are.
fn has_gaps(graph: &Graph, op: Op) -> bool {
    match op {
        Op::Unary(UnaryOp::Sqrt | UnaryOp::Ln, _) => true,
        Op::Binary(BinaryOp::Div, a, b) => {
            !(graph.constant(a).is_some_and(|a| a != 0.0) || graph.constant(b).is_some_and(|b| b != 0.0))
        }
        Op::Binary(BinaryOp::Pow, _, b) => graph.constant(b).is_none_or(|b| b.fract() != 0.0),
        Op::Solved(..) => true,
        _ => graph.is_table(op),
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
        if matches!(op, Op::Solved(..)) {
            return known.is_some_and(f64::is_nan).then_some(node);
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

    fn undecided(build: impl FnOnce(&mut Graph, NodeId) -> NodeId, x: f64) -> Option<Op> {
        let mut graph = Graph::default();
        let state = graph.add(Op::State(0));
        let root = build(&mut graph, state);
        let env = Env { time: 0.0, states: &[x], params: &[], locals: &[], readings: &[] };
        let doubts = Doubts::new(&graph);
        doubts.undecided(&graph, root, &|n| graph.eval(n, env)).map(|n| graph.op(n))
    }

    fn root_below(g: &mut Graph, x: NodeId, most: f64) -> NodeId {
        let (root, most) = (g.unary(UnaryOp::Sqrt, x), g.number(most));
        g.add(Op::Binary(BinaryOp::Lt, root, most))
    }

    #[test]
    fn a_condition_by_the_root_of_a_negative_number_is_not_decided() {
        let not = |g: &mut Graph, x| {
            let below = root_below(g, x, 2.0);
            g.unary(UnaryOp::Not, below)
        };
        assert!(matches!(undecided(not, -1.0), Some(Op::Unary(UnaryOp::Sqrt, _))));
        assert_eq!(undecided(not, 1.0), None);
        // In a number that a condition picks, which is finite either way.
        let rate = |g: &mut Graph, x| {
            let (below, one, two) = (root_below(g, x, 2.0), g.number(1.0), g.number(2.0));
            let picked = g.select(below, one, two);
            g.binary(BinaryOp::Add, picked, two)
        };
        assert!(undecided(rate, -1.0).is_some());
        assert_eq!(undecided(rate, 4.0), None);
    }

    #[test]
    fn one_part_may_decide_whichever_stands_first() {
        for is_first in [true, false] {
            let both = |op, least: f64| {
                move |g: &mut Graph, x: NodeId| {
                    let (root, least) = (root_below(g, x, 2.0), g.number(least));
                    let above = g.add(Op::Binary(BinaryOp::Lt, least, x));
                    if is_first { g.binary(op, root, above) } else { g.binary(op, above, root) }
                }
            };
            assert_eq!(undecided(both(BinaryOp::And, 0.0), -1.0), None, "false and unknown is false");
            assert!(undecided(both(BinaryOp::And, -2.0), -1.0).is_some(), "true and unknown is unknown");
            assert_eq!(undecided(both(BinaryOp::Or, -2.0), -1.0), None, "true or unknown is true");
            assert!(undecided(both(BinaryOp::Or, 0.0), -1.0).is_some(), "false or unknown is unknown");
        }
    }

    #[test]
    fn what_is_endless_is_larger_than_any_number() {
        let large = |g: &mut Graph, x| {
            let (q, three) = (reciprocal(g, x), g.number(3.0));
            g.add(Op::Binary(BinaryOp::Lt, three, q))
        };
        assert_eq!(undecided(large, 0.0), None);
        let share = |g: &mut Graph, x| {
            let (q, half) = (g.binary(BinaryOp::Div, x, x), g.number(0.5));
            g.add(Op::Binary(BinaryOp::Lt, half, q))
        };
        assert!(undecided(share, 0.0).is_some());
        assert_eq!(undecided(share, 1.0), None);
    }
}
