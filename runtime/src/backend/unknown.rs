//! Evaluation where some leaves are not known: an answer where one follows nevertheless.

use std::collections::BTreeMap;

use matterix_ir::graph::{Env, digest, eval_op};
use matterix_ir::{BinaryOp, Graph, Leaves, NodeId, Op};

/// The leaves' values at one instant; `None` is not known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known<'a> {
    pub time: f64,
    pub states: &'a [Option<f64>],
    pub params: &'a [f64],
    pub locals: &'a [Option<f64>],
    /// What each reading measures.
    pub readings: &'a [NodeId],
}

/// The value of `node`, if it follows from what is known.
pub(crate) fn eval(graph: &Graph, node: NodeId, known: Known<'_>) -> Option<f64> {
    let mut values: BTreeMap<NodeId, Option<f64>> = BTreeMap::new();
    for n in graph.schedule(roots(graph, node, known)) {
        let value = one(graph, graph.op(n), known, &values);
        values.insert(n, value);
    }
    // A reading may stand before what it measures; it was not known then.
    if values.get(&node).copied().flatten().is_none() && graph.leaves(node).meets(Leaves::READING) {
        for n in graph.schedule([node]) {
            let value = one(graph, graph.op(n), known, &values);
            values.insert(n, value);
        }
    }
    values.get(&node).copied().flatten()
}

/// The node and what its readings measure.
fn roots(graph: &Graph, node: NodeId, known: Known<'_>) -> Vec<NodeId> {
    let measured = graph.schedule([node]).into_iter().filter_map(|n| match graph.op(n) {
        Op::Reading(r) => known.readings.get(r as usize).copied(),
        _ => None,
    });
    std::iter::once(node).chain(measured).collect()
}

fn one(graph: &Graph, op: Op, known: Known<'_>, values: &BTreeMap<NodeId, Option<f64>>) -> Option<f64> {
    let at = |n: NodeId| values.get(&n).copied().flatten();
    match op {
        Op::State(i) => known.states.get(i as usize).copied().flatten(),
        Op::Local(i) => known.locals.get(i as usize).copied().flatten(),
        Op::Reading(i) => known.readings.get(i as usize).and_then(|&n| at(n)),
        Op::Param(i) => known.params.get(i as usize).copied(),
        Op::Time => Some(known.time),
        Op::Const(v) => Some(v),
        Op::List(a, b) => at(a).zip(at(b)).map(|(a, b)| digest(a, b)),
        Op::Solved(call, list) => at(list).map(|_| graph.call(call).value(|arg| at(arg).unwrap_or(f64::NAN))),
        Op::Unary(o, a) => at(a).map(|a| apply(Op::Unary(o, NodeId(0)), &[a])),
        Op::Binary(o, a, b) => match (o, at(a), at(b)) {
            (BinaryOp::And, Some(0.0), _) | (BinaryOp::And, _, Some(0.0)) => Some(0.0),
            (BinaryOp::Or, Some(x), _) | (BinaryOp::Or, _, Some(x)) if x != 0.0 => Some(1.0),
            (_, Some(a), Some(b)) => Some(apply(Op::Binary(o, NodeId(0), NodeId(1)), &[a, b])),
            _ => None,
        },
        Op::Select(c, a, b) => match at(c) {
            Some(c) => at(if c != 0.0 { a } else { b }),
            None => at(a).filter(|x| at(b) == Some(*x)),
        },
    }
}

/// The reference semantics of an operation whose operands are `operands`, in order.
fn apply(op: Op, operands: &[f64]) -> f64 {
    let none = Env { time: 0.0, states: &[], params: &[], locals: &[], readings: &[] };
    eval_op(op, none, operands)
}
