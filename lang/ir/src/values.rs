//! One value of a graph at one point, for those who ask for the same ones again and again.

mod lazy;

use crate::equilibrium::Call;
use crate::graph::{BinaryOp, Graph, NodeId, Op, UnaryOp, binary, unary};
use crate::interval::{Interval, decided, of_binary, of_select, of_unary};

use lazy::Skip;

/// How operations come out; none where it cannot be said, which leaves what was asked for open.
pub trait Rules {
    /// What values are.
    type Value: Copy + Default;
    /// The value of an operation without operands.
    fn leaf(&self, op: Op) -> Option<Self::Value>;
    /// An operation on one value.
    fn unary(&self, op: UnaryOp, a: Self::Value) -> Option<Self::Value>;
    /// An operation on two values.
    fn binary(&self, op: BinaryOp, a: Self::Value, b: Self::Value) -> Option<Self::Value>;
    /// Whether a condition holds, if that is settled: what is not needed then is not worked out.
    fn truth(&self, condition: Self::Value) -> Option<bool>;
    /// A number of a solution; one that rests on some that are not known is left open where nothing is said here.
    fn solved(&self, _call: &Call, _args: &[Self::Value]) -> Option<Self::Value> {
        None
    }
    /// One of two by a condition that is not settled.
    fn either(&self, _condition: Self::Value, _a: Self::Value, _b: Self::Value) -> Option<Self::Value> {
        None
    }
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

    fn truth(&self, condition: f64) -> Option<bool> {
        Some(condition != 0.0)
    }

    fn solved(&self, call: &Call, args: &[f64]) -> Option<f64> {
        Some(call.system.value(call.part, args))
    }
}

/// Bounds of what numbers within bounds give, with those of operations without operands.
pub struct Bounds<L>(pub L);

impl<L: Fn(Op) -> Interval> Rules for Bounds<L> {
    type Value = Interval;

    fn leaf(&self, op: Op) -> Option<Interval> {
        Some(self.0(op))
    }

    fn unary(&self, op: UnaryOp, a: Interval) -> Option<Interval> {
        Some(of_unary(op, a))
    }

    fn binary(&self, op: BinaryOp, a: Interval, b: Interval) -> Option<Interval> {
        Some(of_binary(op, a, b))
    }

    fn truth(&self, condition: Interval) -> Option<bool> {
        decided(condition)
    }

    fn either(&self, condition: Interval, a: Interval, b: Interval) -> Option<Interval> {
        Some(of_select(condition, a, b))
    }

    fn solved(&self, call: &Call, args: &[Interval]) -> Option<Interval> {
        Some(call.system.bounds(call.part, args))
    }
}

/// What a node of a graph is made of, by itself.
#[derive(Clone, Debug)]
pub struct Formula {
    /// Operations, operands first, which name these by their position here.
    ops: Box<[Op]>,
    /// What conditions leave out, in the order of the operations.
    skips: Box<[Skip]>,
    /// What [`Op::Solved`] asks for, its arguments by their position here.
    calls: Box<[Call]>,
}

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
        let (mut ops, mut calls): (Vec<Op>, Vec<Call>) = (Vec::new(), Vec::new());
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
                Op::List(a, b) => Op::List(at(a), at(b)),
                Op::Solved(call, list) => {
                    let call = graph.call(call);
                    calls.push(Call { args: call.args.iter().map(|arg| at(*arg)).collect(), ..call.clone() });
                    Op::Solved(calls.len() as u32 - 1, at(list))
                }
                leaf => leaf,
            };
            self.places[next.0 as usize] = (self.number, ops.len() as u32);
            ops.push(op);
            todo.pop();
        }
        lazy::formula(ops, calls)
    }

    fn place(&self, node: NodeId) -> Option<u32> {
        let (number, place) = self.places[node.0 as usize];
        (number == self.number).then_some(place)
    }
}

impl Formula {
    /// Its operations, operands first.
    pub fn ops(&self) -> &[Op] {
        &self.ops
    }

    /// Its value by some rules; `room` is for values in between, and may be kept from one question to the next.
    pub fn value<R: Rules>(&self, rules: &R, room: &mut Vec<R::Value>) -> Option<R::Value> {
        if room.len() < self.ops.len() {
            room.resize(self.ops.len(), R::Value::default());
        }
        let (mut next, mut skip) = (0, 0);
        while let Some(op) = self.ops.get(next) {
            if let Some(s) = self.skips.get(skip).filter(|s| s.at == next) {
                let left_out = rules.truth(*room.get(s.on.0 as usize)?) == Some(s.when);
                (next, skip) = if left_out { (s.to, s.rest) } else { (next, skip + 1) };
                continue;
            }
            let at = |n: NodeId| room.get(n.0 as usize).copied();
            let value = match *op {
                Op::Unary(op, a) => rules.unary(op, at(a)?)?,
                Op::Binary(op @ (BinaryOp::And | BinaryOp::Or), a, b) => match rules.truth(at(a)?) {
                    Some(settled) if settled == (op == BinaryOp::Or) => at(a)?,
                    _ => rules.binary(op, at(a)?, at(b)?)?,
                },
                Op::Binary(op, a, b) => rules.binary(op, at(a)?, at(b)?)?,
                Op::Select(c, a, b) => match rules.truth(at(c)?) {
                    Some(true) => at(a)?,
                    Some(false) => at(b)?,
                    None => rules.either(at(c)?, at(a)?, at(b)?)?,
                },
                Op::List(..) => R::Value::default(),
                Op::Solved(call, _) => {
                    let call = self.calls.get(call as usize)?;
                    let args: Option<Vec<R::Value>> = call.args.iter().map(|arg| at(*arg)).collect();
                    rules.solved(call, &args?)?
                }
                leaf => rules.leaf(leaf)?,
            };
            *room.get_mut(next)? = value;
            next += 1;
        }
        room.get(self.ops.len().checked_sub(1)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Env;

    /// The states from 9 on are not known.
    fn known(op: Op) -> Option<f64> {
        match op {
            Op::Const(v) => Some(v),
            Op::State(9..) => None,
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

    #[test]
    fn what_is_not_chosen_is_not_worked_out() {
        let mut graph = Graph::default();
        let states: Vec<NodeId> = (0..9).map(|s| graph.add(Op::State(s))).collect();
        let unknown = graph.add(Op::State(9));
        let long = |graph: &mut Graph, from: NodeId| {
            states[2..8].iter().fold(from, |sum, state| graph.binary(BinaryOp::Add, sum, *state))
        };
        let (there, away) = (long(&mut graph, states[8]), long(&mut graph, unknown));
        let other = graph.add(Op::State(10));
        let elsewhere = long(&mut graph, other);
        let less = graph.binary(BinaryOp::Lt, states[0], states[1]);
        let chosen = graph.select(less, there, away);
        let two = graph.number(35.0);
        let is_small = graph.binary(BinaryOp::Lt, chosen, two);
        let of_unknown = graph.binary(BinaryOp::Lt, elsewhere, two);
        let either = graph.binary(BinaryOp::Or, less, of_unknown);
        let both = graph.binary(BinaryOp::And, either, is_small);
        let mut room = Vec::new();
        let mut formulas = Formulas::default();
        let asked = std::cell::Cell::new(0);
        let counting = Numbers(|op| {
            asked.set(asked.get() + 1);
            known(op)
        });
        assert_eq!(formulas.of(&graph, both).value(&counting, &mut room), Some(0.0));
        // The nine known states and the number, which some lines stand for; nothing of what hangs on the unknown one.
        assert!(asked.get() <= 10, "{}", asked.get());
        assert_eq!(formulas.of(&graph, away).value(&counting, &mut room), None);
    }

    #[test]
    fn random_formulas_give_what_their_graphs_give() {
        let mut seed = 7_u64;
        let mut draw = move |count: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as usize % count
        };
        let values = [0.0, 1.0, 2.0, -1.0];
        let env = Env { time: 0.0, states: &values, params: &[], locals: &[], readings: &[] };
        let state = |op: Op| match op {
            Op::State(s) => values.get(s as usize).copied(),
            Op::Const(v) => Some(v),
            _ => None,
        };
        let mut room = Vec::new();
        for _ in 0..300 {
            let mut graph = Graph::default();
            let mut nodes: Vec<NodeId> = (0..4).map(|s| graph.add(Op::State(s))).collect();
            let mut truths: Vec<NodeId> = vec![graph.binary(BinaryOp::Lt, nodes[0], nodes[1])];
            for _ in 0..60 {
                let (a, b) = (nodes[draw(nodes.len())], nodes[draw(nodes.len())]);
                let (c, d) = (truths[draw(truths.len())], truths[draw(truths.len())]);
                match draw(6) {
                    0 => nodes.push(graph.binary(BinaryOp::Add, a, b)),
                    1 => nodes.push(graph.binary(BinaryOp::Min, a, b)),
                    2 => truths.push(graph.binary(BinaryOp::Le, a, b)),
                    3 => truths.push(graph.binary(BinaryOp::And, c, d)),
                    4 => truths.push(graph.binary(BinaryOp::Or, c, d)),
                    _ => nodes.push(graph.select(c, a, b)),
                }
            }
            let mut formulas = Formulas::default();
            for node in nodes.into_iter().chain(truths) {
                assert_eq!(formulas.of(&graph, node).value(&Numbers(state), &mut room), Some(graph.eval(node, env)));
            }
        }
    }
}
