//! One value of a graph at one point, for those who ask for the same ones again and again.

use crate::graph::{BinaryOp, Graph, NodeId, Op, UnaryOp, binary, unary};

/// How operations come out; none where it cannot be said, which leaves what was asked for open.
pub trait Rules {
    /// What values are.
    type Value: Copy;
    /// The value of an operation without operands.
    fn leaf(&self, op: Op) -> Option<Self::Value>;
    /// An operation on one value.
    fn unary(&self, op: UnaryOp, a: Self::Value) -> Option<Self::Value>;
    /// An operation on two values.
    fn binary(&self, op: BinaryOp, a: Self::Value, b: Self::Value) -> Option<Self::Value>;
    /// One of two by a condition.
    fn select(&self, condition: Self::Value, a: Self::Value, b: Self::Value) -> Self::Value;
}

/// Numbers by the reference semantics, with what is known of operations without operands.
pub struct Numbers<L>(pub L);

impl<L: Fn(Op) -> Option<f64>> Rules for Numbers<L> {
    type Value = f64;

    fn leaf(&self, op: Op) -> Option<f64> {
        self.0(op)
    }

    fn unary(&self, op: UnaryOp, a: f64) -> Option<f64> {
        Some(unary(op, a))
    }

    fn binary(&self, op: BinaryOp, a: f64, b: f64) -> Option<f64> {
        Some(binary(op, a, b))
    }

    fn select(&self, condition: f64, a: f64, b: f64) -> f64 {
        if condition != 0.0 { a } else { b }
    }
}

/// What a node of a graph is made of, by itself: operations, operands first, which name these by their position in it.
#[derive(Clone, Debug)]
pub struct Formula(Box<[Op]>);

/// Formulas of a graph that does not change any more, each made once.
#[derive(Clone, Debug, Default)]
pub struct Formulas {
    made: Vec<Option<Formula>>,
    /// Where each node stands in the formula that is being made, with the number of that.
    places: Vec<(u32, u32)>,
    number: u32,
}

impl Formulas {
    /// The formula of a node.
    pub fn of(&mut self, graph: &Graph, node: NodeId) -> &Formula {
        let count = graph.ops().len();
        if self.made.len() != count {
            *self = Formulas { made: vec![None; count], places: vec![(0, 0); count], number: 0 };
        }
        let at = node.0 as usize;
        let formula = self.made[at].take().unwrap_or_else(|| self.make(graph, node));
        self.made[at].insert(formula)
    }

    fn make(&mut self, graph: &Graph, node: NodeId) -> Formula {
        self.number += 1;
        let mut ops: Vec<Op> = Vec::new();
        let mut todo = vec![node];
        while let Some(&next) = todo.last() {
            if self.place(next).is_some() {
                todo.pop();
                continue;
            }
            let before = todo.len();
            let op = graph.op(next);
            for operand in op.operands() {
                if self.place(operand).is_none() {
                    todo.push(operand);
                }
            }
            if todo.len() > before {
                continue;
            }
            let at = |n: NodeId| NodeId(self.places[n.0 as usize].1);
            let op = match op {
                Op::Unary(op, a) => Op::Unary(op, at(a)),
                Op::Binary(op, a, b) => Op::Binary(op, at(a), at(b)),
                Op::Select(c, a, b) => Op::Select(at(c), at(a), at(b)),
                leaf => leaf,
            };
            self.places[next.0 as usize] = (self.number, ops.len() as u32);
            ops.push(op);
            todo.pop();
        }
        Formula(ops.into())
    }

    fn place(&self, node: NodeId) -> Option<u32> {
        let (number, place) = self.places[node.0 as usize];
        (number == self.number).then_some(place)
    }
}

impl Formula {
    /// Its operations, operands first.
    pub fn ops(&self) -> &[Op] {
        &self.0
    }

    /// Its value by some rules; `room` is for values in between, and may be kept from one question to the next.
    pub fn value<R: Rules>(&self, rules: &R, room: &mut Vec<R::Value>) -> Option<R::Value> {
        room.clear();
        room.reserve(self.0.len());
        for op in &self.0 {
            let at = |n: NodeId| room.get(n.0 as usize).copied();
            let value = match *op {
                Op::Unary(op, a) => rules.unary(op, at(a)?)?,
                Op::Binary(op, a, b) => rules.binary(op, at(a)?, at(b)?)?,
                Op::Select(c, a, b) => rules.select(at(c)?, at(a)?, at(b)?),
                leaf => rules.leaf(leaf)?,
            };
            room.push(value);
        }
        room.last().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Env;

    /// The state 9 is not known.
    fn known(op: Op) -> Option<f64> {
        match op {
            Op::Const(v) => Some(v),
            Op::State(9) => None,
            Op::State(s) => Some(f64::from(s)),
            _ => None,
        }
    }

    #[test]
    fn a_formula_gives_what_its_graph_gives() {
        let mut graph = Graph::default();
        let (two, five, unknown) = (graph.add(Op::State(2)), graph.add(Op::State(5)), graph.add(Op::State(9)));
        let less = graph.binary(BinaryOp::Lt, two, five);
        let chosen = graph.select(less, five, two);
        let root = graph.unary(UnaryOp::Sqrt, chosen);
        let sum = graph.binary(BinaryOp::Sub, root, two);
        let other = graph.binary(BinaryOp::Mul, sum, unknown);
        let mut room = Vec::new();
        let states = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let env = Env { time: 0.0, states: &states, params: &[], locals: &[], readings: &[] };
        let mut formulas = Formulas::default();
        assert_eq!(formulas.of(&graph, sum).value(&Numbers(known), &mut room), Some(graph.eval(sum, env)));
        assert_eq!(formulas.of(&graph, other).value(&Numbers(known), &mut room), None);
        assert_eq!(formulas.of(&graph, sum).value(&Numbers(known), &mut room), Some(graph.eval(sum, env)));
    }
}
