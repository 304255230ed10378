//! Values of nodes from what is known.

use std::collections::BTreeSet;
use std::rc::Rc;

use matterix_ir::graph::unary;
use matterix_ir::values::Rules;
use matterix_ir::{BinaryOp, NodeId, Op, Span, UnaryOp};

use super::bonds::Bonds;
use super::facts::{Decided, Facts};
use super::value::{Known, Why};
use super::{Flow, Raised};

/// So many cases are told apart.
const MOST_CASES: usize = 16;

/// So many states of one condition are narrowed to those of their few values that agree with it.
const MOST_SIFTED: usize = 4;

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
pub(super) struct Exact<'f> {
    pub params: &'f [Known],
    pub facts: &'f Facts,
}

impl Rules for Exact<'_> {
    type Value = f64;

    #[inline]
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

    #[inline]
    fn binary(&self, op: BinaryOp, a: f64, b: f64) -> Option<f64> {
        Known::exactly(op, a, b)
    }

    fn truth(&self, condition: f64) -> Option<bool> {
        Some(condition != 0.0)
    }
}

/// The same, with these numbers as the values of some states.
pub(super) struct Supposed<'f> {
    pub exact: Exact<'f>,
    pub states: &'f [(u32, f64)],
}

impl Rules for Supposed<'_> {
    type Value = f64;

    fn leaf(&self, op: Op) -> Option<f64> {
        let supposed = |state: u32| self.states.iter().find(|(s, _)| *s == state).map(|(_, value)| *value);
        match op {
            Op::State(i) => supposed(i).or_else(|| self.exact.leaf(op)),
            other => self.exact.leaf(other),
        }
    }

    fn unary(&self, op: UnaryOp, a: f64) -> Option<f64> {
        self.exact.unary(op, a)
    }

    fn binary(&self, op: BinaryOp, a: f64, b: f64) -> Option<f64> {
        self.exact.binary(op, a, b)
    }

    fn truth(&self, condition: f64) -> Option<bool> {
        self.exact.truth(condition)
    }
}

/// A sum of states that may hang together, as it was done last.
#[derive(Debug)]
pub struct Sum {
    /// The operations without operands that it rests on.
    leaves: Rc<[NodeId]>,
    /// How states hung together then. It is kept, so that no other one is taken for it.
    bonds: Option<Rc<Bonds>>,
}

/// Values of operations as they were when they were done last, and when that was.
#[derive(Debug)]
pub struct Values {
    known: Vec<Known>,
    /// When each was done last; 0 for never.
    done: Vec<u64>,
    /// When each has become another one.
    changed: Vec<u64>,
    now: u64,
}

impl Values {
    /// None yet, of so many operations.
    pub fn new(count: usize) -> Self {
        Values { known: vec![Known::Point(0.0); count], done: vec![0; count], changed: vec![0; count], now: 0 }
    }

    /// The last value of an operation.
    pub fn of(&self, node: NodeId) -> &Known {
        &self.known[node.0 as usize]
    }

    /// Whether an operation was done at all.
    fn is_done(&self, node: NodeId) -> bool {
        self.done[node.0 as usize] != 0
    }

    /// Takes in what an operation without operands is.
    fn leaf(&mut self, node: NodeId, value: &Known) {
        let at = node.0 as usize;
        if self.done[at] == 0 || !self.known[at].is(value) {
            self.set(at, value.clone());
        }
    }

    /// Does an operation, by the values of all, if one of its operands has changed since.
    fn result<const N: usize>(&mut self, node: NodeId, on: [NodeId; N], how: impl FnOnce(&[Known]) -> Known) {
        let at = node.0 as usize;
        let done = self.done[at];
        if done != 0 && on.iter().all(|a| self.changed[a.0 as usize] <= done) {
            return;
        }
        let value = how(&self.known);
        self.redo(node, value);
    }

    /// Whether one of the operations that an operation rests on has become another one since it was done.
    fn is_stale(&self, node: NodeId, on: &[NodeId]) -> bool {
        let done = self.done[node.0 as usize];
        done == 0 || on.iter().any(|a| self.changed[a.0 as usize] > done)
    }

    /// Takes in the value of an operation that was done again.
    fn redo(&mut self, node: NodeId, value: Known) {
        let at = node.0 as usize;
        if self.done[at] != 0 && self.known[at].is(&value) {
            self.now += 1;
            self.done[at] = self.now;
        } else {
            self.set(at, value);
        }
    }

    fn set(&mut self, at: usize, value: Known) {
        self.now += 1;
        self.known[at] = value;
        self.done[at] = self.now;
        self.changed[at] = self.now;
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
        if let Op::State(state) = self.lab.graph.op(node) {
            return facts.states[state as usize].clone();
        }
        let formula = self.formulas.of(&self.lab.graph, node);
        let exact = Exact { params: &self.params, facts };
        match formula.value(&exact, &mut self.numbers) {
            Some(value) => Known::Point(value),
            None => {
                let told = self.by_case(node, facts).map(|(_, known)| known);
                let told = told.or_else(|| self.case_by_case(node, facts));
                told.unwrap_or_else(|| self.enclose(node, facts))
            }
        }
    }

    /// The value of a node that rests on one or two states which are one of a few numbers each, and else on what is known
    /// exactly: that of each case. What a state decides at several places of an expression it decides alike at all of them.
    fn case_by_case(&mut self, node: NodeId, facts: &Facts) -> Option<Known> {
        let parts = self.parts(node);
        let open: Vec<u32> =
            parts.states.iter().copied().filter(|s| facts.states[*s as usize].exact().is_none()).take(3).collect();
        let few = |state: &u32| match &facts.states[*state as usize] {
            Known::Few(all, why) => Some((all.clone(), *why)),
            _ => None,
        };
        let mut cases: Vec<Vec<(u32, f64)>> = vec![Vec::new()];
        let mut why = Why::Paths;
        for state in open.iter().filter(|_| open.len() < 3) {
            let (all, because) = few(state)?;
            why = why.max(because);
            let with = |case: Vec<(u32, f64)>| all.iter().map(move |v| [case.clone(), vec![(*state, *v)]].concat());
            cases = cases.into_iter().flat_map(with).collect();
        }
        if !(2..=MOST_CASES).contains(&cases.len()) {
            return None;
        }
        let formula = self.formulas.of(&self.lab.graph, node);
        let mut values = Vec::with_capacity(cases.len());
        for states in &cases {
            let exact = Exact { params: &self.params, facts };
            values.push(formula.value(&Supposed { exact, states }, &mut self.numbers)?);
        }
        Some(Known::of(values, why))
    }

    /// The value of a node with those of all that it rests on, which stay in `values`. Of its operations those are done again
    /// whose operands are no longer what they were.
    pub fn enclose(&mut self, node: NodeId, facts: &Facts) -> Known {
        let order = self.order(node);
        self.work_out(&order, facts);
        let known = self.values.of(node).clone();
        if facts.bonds.is_some() && matches!(self.lab.graph.op(node), Op::Binary(BinaryOp::Add | BinaryOp::Sub, ..)) {
            return self.together(node, known, facts);
        }
        known
    }

    /// The value of a node that was enclosed just before, now that of what is known one state alone has changed.
    pub fn enclose_again(&mut self, node: NodeId, state: u32, facts: &Facts) -> Known {
        let order = self.parts_on(node, state);
        self.work_out(&order, facts);
        self.values.of(node).clone()
    }

    /// The operations of a node that depend on a state; found once.
    fn parts_on(&mut self, node: NodeId, state: u32) -> Rc<[NodeId]> {
        if let Some(known) = self.parts_on.get(&(node, state)) {
            return known.clone();
        }
        let order = self.order(node);
        let mut on: BTreeSet<NodeId> = BTreeSet::new();
        for n in order.iter() {
            let op = self.lab.graph.op(*n);
            let depends = match op {
                Op::State(s) => s == state,
                Op::Reading(r) => self.parts(self.lab.readings[r as usize].value).states.contains(&state),
                _ => op.operands().any(|a| on.contains(&a)),
            };
            if depends {
                on.insert(*n);
            }
        }
        let found: Rc<[NodeId]> = order.iter().copied().filter(|n| on.contains(n)).collect();
        self.parts_on.insert((node, state), found.clone());
        found
    }

    fn work_out(&mut self, order: &[NodeId], facts: &Facts) {
        for n in order {
            match self.lab.graph.op(*n) {
                Op::Const(_) if self.values.is_done(*n) => {}
                Op::Const(v) => self.values.leaf(*n, &Known::point(v)),
                Op::Time => self.values.leaf(*n, &facts.time),
                Op::State(i) => self.values.leaf(*n, &facts.states[i as usize]),
                Op::Param(i) => self.values.leaf(*n, &self.params[i as usize]),
                Op::Local(i) => self.values.leaf(*n, &facts.locals[i as usize]),
                Op::Reading(i) => {
                    let value = self.reading(i, facts);
                    self.values.leaf(*n, &value);
                }
                Op::Unary(op, a) => self.values.result(*n, [a], |known| Known::unary(op, &known[a.0 as usize])),
                Op::Binary(BinaryOp::Eq, a, b) if a == b => self.values.leaf(*n, &Known::Point(1.0)),
                // What is known of a sum hangs on more than what is known of its parts.
                Op::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), a, b) if self.is_outer_sum(*n) => {
                    self.outer_sum(*n, op, [a, b], facts);
                }
                Op::Binary(op, a, b) => self
                    .values
                    .result(*n, [a, b], |known| Known::binary(op, &known[a.0 as usize], &known[b.0 as usize])),
                Op::Select(c, a, b) => self.values.result(*n, [c, a, b], |known| {
                    Known::select(&known[c.0 as usize], &known[a.0 as usize], &known[b.0 as usize])
                }),
            }
        }
    }

    /// Does a sum of states that may hang together if one of them or how they hang together has changed since.
    fn outer_sum(&mut self, node: NodeId, op: BinaryOp, [a, b]: [NodeId; 2], facts: &Facts) {
        let same = |bonds: &Option<Rc<Bonds>>| match (bonds, &facts.bonds) {
            (None, None) => true,
            (Some(one), Some(other)) => Rc::ptr_eq(one, other),
            _ => false,
        };
        let sum = match self.sums.remove(&node) {
            Some(sum) if same(&sum.bonds) && !self.values.is_stale(node, &sum.leaves) => sum,
            known => {
                let apart = Known::binary(op, self.values.of(a), self.values.of(b));
                let value = self.together(node, apart, facts);
                self.values.redo(node, value);
                let leaves = known.map_or_else(|| self.leaves(node), |sum| sum.leaves);
                Sum { leaves, bonds: facts.bonds.clone() }
            }
        };
        self.sums.insert(node, sum);
    }

    /// The operations without operands below a node.
    fn leaves(&mut self, node: NodeId) -> Rc<[NodeId]> {
        let order = self.order(node);
        order.iter().copied().filter(|n| self.lab.graph.op(*n).operands().next().is_none()).collect()
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

    /// How a condition comes out: by what is known, or as it came out before on this way.
    pub fn truth(&mut self, node: NodeId, facts: &Facts) -> Option<bool> {
        let known = self.eval(node, facts).truth();
        if known.is_some() || facts.decided.is_empty() {
            return known;
        }
        let (opposite, turned) = self.turned(node);
        facts.decided.iter().find_map(|before| {
            let op = self.lab.graph.op(before.node);
            let against =
                Some(before.node) == turned || op == Op::Unary(UnaryOp::Not, node) || opposite.is_some_and(|o| op == o);
            if before.node == node { Some(before.holds) } else { against.then_some(!before.holds) }
        })
    }

    /// What is true where a condition is false, as an operation or a node of its own.
    fn turned(&self, node: NodeId) -> (Option<Op>, Option<NodeId>) {
        match self.lab.graph.op(node) {
            Op::Unary(UnaryOp::Not, a) => (None, Some(a)),
            Op::Binary(BinaryOp::Lt, a, b) => (Some(Op::Binary(BinaryOp::Le, b, a)), None),
            Op::Binary(BinaryOp::Le, a, b) => (Some(Op::Binary(BinaryOp::Lt, b, a)), None),
            _ => (None, None),
        }
    }

    /// Takes a branch: its condition is decided on this way until something it depends on changes.
    pub fn decide(&mut self, node: NodeId, holds: bool, facts: &mut Facts) {
        if self.truth(node, facts).is_none() && !self.is_shared(node) {
            let graph = &self.lab.graph;
            let order = graph.schedule([node]);
            // A reading is another one the next time, and time goes on.
            if !order.iter().any(|n| matches!(graph.op(*n), Op::Reading(_) | Op::Time)) {
                let of = |kind: fn(Op) -> Option<u32>| order.iter().filter_map(|n| kind(graph.op(*n))).collect();
                let states = of(|op| if let Op::State(s) = op { Some(s) } else { None });
                let locals = of(|op| if let Op::Local(l) = op { Some(l) } else { None });
                facts.decided.push(Decided { node, holds, states, locals });
            }
        }
        self.assume(node, holds, facts);
    }

    /// Takes a condition for true or false, as far as that says something of single states.
    pub fn assume(&mut self, node: NodeId, holds: bool, facts: &mut Facts) {
        self.choose_ways(node, holds, facts);
        match self.lab.graph.op(node) {
            Op::Unary(UnaryOp::Not, a) => self.assume(a, !holds, facts),
            Op::Binary(BinaryOp::And, a, b) if holds => {
                self.assume(a, true, facts);
                self.assume(b, true, facts);
            }
            Op::Binary(BinaryOp::Or, a, b) if !holds => {
                self.assume(a, false, facts);
                self.assume(b, false, facts);
            }
            Op::Local(i) => {
                if let Some(slot) = facts.locals.get_mut(i as usize).filter(|known| known.bounds() == (0.0, 1.0)) {
                    *slot = Known::Point(f64::from(u8::from(holds)));
                }
            }
            Op::State(s) if self.is_truth(s) => facts.states[s as usize] = Known::Point(f64::from(u8::from(holds))),
            Op::Binary(op @ (BinaryOp::Eq | BinaryOp::Lt | BinaryOp::Le), a, b) => {
                self.assume_compared(op, (a, b), holds, facts);
                self.sift(node, holds, facts);
            }
            _ => self.sift(node, holds, facts),
        }
    }

    /// Takes a comparison of a state with a number for true or false.
    fn assume_compared(&self, op: BinaryOp, (a, b): (NodeId, NodeId), holds: bool, facts: &mut Facts) {
        let graph = &self.lab.graph;
        let number = |n: NodeId| match graph.op(n) {
            Op::Const(v) => Some(v),
            Op::Param(i) => self.params[i as usize].exact(),
            Op::State(s) => facts.states[s as usize].exact(),
            _ => None,
        };
        let (s, v, left) = match (graph.op(a), graph.op(b), number(a), number(b)) {
            (Op::State(s), _, None, Some(v)) => (s, v, true),
            (_, Op::State(s), Some(v), None) => (s, v, false),
            _ => return,
        };
        let mut known = facts.states[s as usize].clone();
        cut(&mut known, op, v, holds, left);
        facts.narrow(s, known);
    }

    /// Of states that are one of a few numbers each, those numbers stay with which a condition may come out so.
    fn sift(&mut self, node: NodeId, holds: bool, facts: &mut Facts) {
        let parts = self.parts(node);
        let few = |s: &u32| matches!(facts.states[*s as usize], Known::Few(..)) && !facts.hangs(*s);
        let open: Vec<u32> = parts.states.iter().copied().filter(few).take(MOST_SIFTED).collect();
        if open.is_empty() || self.is_shared(node) {
            return;
        }
        for state in open {
            let Known::Few(all, why) = facts.states[state as usize].clone() else { continue };
            let mut supposed = facts.clone();
            let mut may = |value: &f64| {
                supposed.states[state as usize] = Known::Point(*value);
                self.eval(node, &supposed).truth() != Some(!holds)
            };
            let stay: Vec<f64> = all.iter().copied().filter(|value| may(value)).collect();
            if !stay.is_empty() && stay.len() < all.len() {
                facts.narrow(state, Known::of(stay, why));
            }
        }
    }

    fn is_truth(&self, state: u32) -> bool {
        self.lab.states[state as usize].domain == matterix_ir::model::Domain::Bool
    }

    /// Notes a failure that the text writes at a place of the user's.
    pub fn raise_written(&mut self, name: &str, span: Span, mut facts: Facts) {
        // Not where only what a device reports, or what goes on beside, leads there.
        facts.written = Some(span).filter(|span| !facts.unsure && !self.in_library(*span));
        for (name, facts) in self.stop_jobs(vec![(name.to_owned(), facts)], self.guards.len()) {
            self.raise(&name, facts);
        }
    }

    /// Notes a failure for the handlers around.
    pub fn raise(&mut self, name: &str, mut facts: Facts) {
        if !self.jobs.is_empty() {
            self.stop_short(self.guards.len(), &mut facts);
        }
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
