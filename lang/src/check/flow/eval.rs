//! Values of nodes from what is known.

use std::rc::Rc;

use matterix_ir::graph::unary;
use matterix_ir::values::{Formula, Rules};
use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};

use super::facts::Facts;
use super::value::{Known, Why};
use super::{Flow, Raised};

/// What a node depends on.
#[derive(Debug, Default)]
pub struct Parts {
    /// States, those behind readings included.
    pub states: Vec<u32>,
    /// Whether time or a kept value is among them.
    pub timed: bool,
}

/// Numbers, as long as all are known exactly and no comparison hangs on rounding; what comes of them is what
/// [`Known`] makes of points.
struct Exact<'f> {
    params: &'f [Known],
    facts: &'f Facts,
}

impl Rules for Exact<'_> {
    type Value = f64;

    fn leaf(&self, op: Op) -> Option<f64> {
        match op {
            Op::Const(v) => Some(v).filter(|v| !v.is_nan()),
            Op::Time => self.facts.time.exact(),
            Op::State(i) => self.facts.states[i as usize].exact(),
            Op::Param(i) => self.params[i as usize].exact(),
            Op::Local(i) => self.facts.locals[i as usize].exact(),
            _ => None,
        }
    }

    fn unary(&self, op: UnaryOp, a: f64) -> Option<f64> {
        Some(unary(op, a)).filter(|v| !v.is_nan())
    }

    fn binary(&self, op: BinaryOp, a: f64, b: f64) -> Option<f64> {
        Known::points(op, a, b).exact()
    }

    fn select(&self, condition: f64, a: f64, b: f64) -> f64 {
        if condition != 0.0 { a } else { b }
    }
}

impl Flow<'_, '_> {
    /// What a node depends on; found once.
    pub fn parts(&mut self, node: NodeId) -> Rc<Parts> {
        if let Some(parts) = &self.parts[node.0 as usize] {
            return parts.clone();
        }
        let graph = &self.lab.graph;
        let mut parts = Parts::default();
        let mut readings = Vec::new();
        graph.visit(node, |op| match op {
            Op::State(s) => parts.states.push(s),
            Op::Reading(r) => readings.push(r),
            Op::Time | Op::Local(_) => parts.timed = true,
            _ => {}
        });
        for r in readings {
            let inner = self.parts(self.lab.readings[r as usize].value);
            parts.states.extend(&inner.states);
            parts.timed |= inner.timed;
        }
        parts.states.sort_unstable();
        parts.states.dedup();
        let parts = Rc::new(parts);
        self.parts[node.0 as usize] = Some(parts.clone());
        parts
    }

    /// The operations below a node, operands first; found once.
    pub fn order(&mut self, node: NodeId) -> Rc<[NodeId]> {
        let find = || self.lab.graph.schedule([node]).into();
        self.orders[node.0 as usize].get_or_insert_with(find).clone()
    }

    /// The value of a node: where all that it rests on is known exactly, by numbers alone.
    pub fn eval(&mut self, node: NodeId, facts: &Facts) -> Known {
        let find = || Formula::of(&self.lab.graph, node);
        let formula = self.formulas[node.0 as usize].get_or_insert_with(find);
        let exact = Exact { params: &self.params, facts };
        match formula.value(&exact, &mut self.numbers) {
            Some(value) => Known::Point(value),
            None => self.enclose(node, facts),
        }
    }

    /// The value of a node with those of all that it rests on, which stay in `values`.
    pub(super) fn enclose(&mut self, node: NodeId, facts: &Facts) -> Known {
        let order = self.order(node);
        for n in order.iter() {
            let value = match self.lab.graph.op(*n) {
                Op::Const(v) => Known::point(v),
                Op::Time => facts.time.clone(),
                Op::State(i) => facts.states[i as usize].clone(),
                Op::Param(i) => self.params[i as usize].clone(),
                Op::Local(i) => facts.locals[i as usize].clone(),
                Op::Reading(i) => self.reading(i, facts),
                Op::Unary(op, a) => Known::unary(op, &self.values[a.0 as usize]),
                Op::Binary(BinaryOp::Eq, a, b) if a == b => Known::Point(1.0),
                Op::Binary(op, a, b) => Known::binary(op, &self.values[a.0 as usize], &self.values[b.0 as usize]),
                Op::Select(c, a, b) => {
                    let [c, a, b] = [c, a, b].map(|n| &self.values[n.0 as usize]);
                    Known::select(c, a, b)
                }
            };
            self.values[n.0 as usize] = value;
        }
        self.values[node.0 as usize].clone()
    }

    /// What a device shows: the true value, give or take its imperfection.
    fn reading(&mut self, index: u32, facts: &Facts) -> Known {
        let reading = &self.lab.readings[index as usize];
        let (resolution, noise) = (reading.resolution.unwrap_or(0.0), reading.noise.unwrap_or(0.0));
        // A node's value depends on what is known alone: to evaluate it in between disturbs nothing.
        let value = self.eval(reading.value, facts);
        let slack = resolution / 2.0 + 6.0 * noise;
        if slack == 0.0 {
            return value;
        }
        let (low, high) = value.bounds();
        Known::Range(low - slack, high + slack, Why::Unknown)
    }

    /// Takes a condition for true or false, as far as that says something of single states.
    pub fn assume(&self, node: NodeId, holds: bool, facts: &mut Facts) {
        let graph = &self.lab.graph;
        match graph.op(node) {
            Op::Unary(UnaryOp::Not, a) => self.assume(a, !holds, facts),
            Op::Binary(BinaryOp::And, a, b) if holds => {
                self.assume(a, true, facts);
                self.assume(b, true, facts);
            }
            Op::Binary(BinaryOp::Or, a, b) if !holds => {
                self.assume(a, false, facts);
                self.assume(b, false, facts);
            }
            Op::State(s) if self.is_truth(s) => facts.states[s as usize] = Known::Point(f64::from(u8::from(holds))),
            Op::Binary(op @ (BinaryOp::Eq | BinaryOp::Lt | BinaryOp::Le), a, b) => {
                let number = |n: NodeId| match graph.op(n) {
                    Op::Const(v) => Some(v),
                    Op::Param(i) => self.params[i as usize].exact(),
                    Op::State(s) => facts.states[s as usize].exact(),
                    _ => None,
                };
                match (graph.op(a), graph.op(b), number(a), number(b)) {
                    (Op::State(s), _, None, Some(v)) => cut(&mut facts.states[s as usize], op, v, holds, true),
                    (_, Op::State(s), Some(v), None) => cut(&mut facts.states[s as usize], op, v, holds, false),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    fn is_truth(&self, state: u32) -> bool {
        self.lab.states[state as usize].domain == matterix_ir::model::Domain::Bool
    }

    /// Notes a failure for the handlers around.
    pub fn raise(&mut self, name: &str, facts: Facts) {
        if let Some(guard) = self.guards.last_mut() {
            let raised: Raised = (name.to_string(), facts);
            guard.push(raised);
        }
    }
}

/// Cuts what is known of `x` by `x op v` (or `v op x` where it is the right operand) being true or false.
fn cut(x: &mut Known, op: BinaryOp, v: f64, holds: bool, left: bool) {
    if op == BinaryOp::Eq {
        match (holds, &*x) {
            (true, _) => *x = Known::Point(v),
            (false, Known::Few(all, why)) => {
                let rest: Vec<f64> = all.iter().copied().filter(|o| *o != v).collect();
                *x = match rest.as_slice() {
                    [] => Known::nothing(),
                    [one] => Known::Point(*one),
                    _ => Known::Few(rest.into(), *why),
                };
            }
            _ => {}
        }
        return;
    }
    let Known::Range(low, high, why) = *x else { return };
    let below = holds == left;
    let (low, high) = if below { (low, high.min(v)) } else { (low.max(v), high) };
    if low <= high {
        *x = Known::Range(low, high, why);
    }
}
