//! Values of nodes from what is known.

use std::rc::Rc;

use matterix_ir::equilibrium::Call;
use matterix_ir::graph::{digest, unary};
use matterix_ir::values::Rules;
use matterix_ir::{BinaryOp, NodeId, Op, Span, UnaryOp};
use rustc_hash::FxHashSet;

use super::bonds::Bonds;
use super::state::{AbstractState, Decided};
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, Raised};

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
/// [`AbstractValue`] makes of points.
pub(super) struct Exact<'f> {
    pub params: &'f [AbstractValue],
    pub facts: &'f AbstractState,
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
        AbstractValue::exactly(op, a, b)
    }

    fn truth(&self, condition: f64) -> Option<bool> {
        Some(condition != 0.0)
    }

    fn solved(&self, call: &Call, args: &[f64]) -> Option<f64> {
        Some(call.system.value(call.part, args)).filter(|v| !v.is_nan())
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

    fn solved(&self, call: &Call, args: &[f64]) -> Option<f64> {
        self.exact.solved(call, args)
    }
}

/// What the value of a node rests on besides numbers that never change; found once.
#[derive(Debug)]
pub struct Inputs {
    /// The operations without operands: states, kept values, readings and the time.
    leaves: Rc<[NodeId]>,
    /// Its operations that are sums of states which may hang together.
    sums: Rc<[NodeId]>,
}

/// Whether states hang together alike: it is the same object, or none.
fn alike(one: &Option<Rc<Bonds>>, other: &Option<Rc<Bonds>>) -> bool {
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => Rc::ptr_eq(one, other),
        _ => false,
    }
}

/// The last value of an operation.
#[derive(Clone, Debug)]
struct Slot {
    known: AbstractValue,
    /// When it was done last; 0 for never.
    done: u64,
    /// When it has become another one.
    changed: u64,
    /// When all that it rests on was last done; 0 for never.
    settled: u64,
}

/// Values of operations as they were when they were done last, and when that was.
#[derive(Debug)]
pub struct Values {
    slots: Vec<Slot>,
    now: u64,
}

impl Values {
    /// None yet, of so many operations.
    pub fn new(count: usize) -> Self {
        Values {
            slots: vec![Slot { known: AbstractValue::Point(0.0), done: 0, changed: 0, settled: 0 }; count],
            now: 0,
        }
    }

    /// The last value of an operation.
    pub fn of(&self, node: NodeId) -> &AbstractValue {
        &self.slots[node.0 as usize].known
    }

    /// Whether an operation was done at all.
    fn is_done(&self, node: NodeId) -> bool {
        self.slots[node.0 as usize].done != 0
    }

    /// When an operation has become another one.
    fn changed(&self, node: NodeId) -> u64 {
        self.slots[node.0 as usize].changed
    }

    /// When a node and all that it rests on was last done; 0 for never.
    fn settled(&self, node: NodeId) -> u64 {
        self.slots[node.0 as usize].settled
    }

    /// A node and all that it rests on is done.
    fn settle(&mut self, node: NodeId) {
        self.slots[node.0 as usize].settled = self.now;
    }

    /// Takes in what an operation without operands is.
    fn leaf(&mut self, node: NodeId, value: &AbstractValue) {
        let slot = &self.slots[node.0 as usize];
        if slot.done == 0 || !slot.known.is(value) {
            self.set(node, value.clone());
        }
    }

    /// Whether one of the operations that an operation rests on has become another one since it was done.
    fn is_stale(&self, node: NodeId, on: &[NodeId]) -> bool {
        let done = self.slots[node.0 as usize].done;
        done == 0 || on.iter().any(|a| self.changed(*a) > done)
    }

    /// Takes in the value of an operation that was done again.
    fn redo(&mut self, node: NodeId, value: AbstractValue) {
        let slot = &mut self.slots[node.0 as usize];
        if slot.done != 0 && slot.known.is(&value) {
            self.now += 1;
            slot.done = self.now;
        } else {
            self.set(node, value);
        }
    }

    fn set(&mut self, node: NodeId, value: AbstractValue) {
        self.now += 1;
        let slot = &mut self.slots[node.0 as usize];
        (slot.known, slot.done, slot.changed) = (value, self.now, self.now);
    }
}

impl Interpreter<'_, '_> {
    /// What a node depends on; found once.
    pub fn parts(&mut self, node: NodeId) -> Rc<Parts> {
        if let Some(parts) = &self.nodes.parts[node.0 as usize] {
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
        self.nodes.parts[node.0 as usize] = Some(parts.clone());
        parts
    }

    /// The operations below a node, operands first; found once.
    pub fn order(&mut self, node: NodeId) -> Rc<[NodeId]> {
        let find = || self.lab.graph.schedule([node]).into();
        self.nodes.orders[node.0 as usize].get_or_insert_with(find).clone()
    }

    /// The value of a node: where all that it rests on is known exactly, by numbers alone.
    pub fn eval(&mut self, node: NodeId, facts: &AbstractState) -> AbstractValue {
        if let Op::State(state) = self.lab.graph.op(node) {
            return facts.states[state as usize].clone();
        }
        let formula = self.nodes.formulas.of(&self.lab.graph, node);
        let exact = Exact { params: &self.params, facts };
        match formula.value(&exact, &mut self.numbers) {
            Some(value) => AbstractValue::Point(value),
            None => {
                let told = self.by_case(node, facts).map(|(_, known)| known);
                let told = told.or_else(|| self.case_by_case(node, facts));
                told.unwrap_or_else(|| self.enclose(node, facts))
            }
        }
    }

    /// The value of a node that rests on one or two states which are one of a few numbers each, and else on what is known
    /// exactly: that of each case. What a state decides at several places of an expression it decides alike at all of them.
    fn case_by_case(&mut self, node: NodeId, facts: &AbstractState) -> Option<AbstractValue> {
        let parts = self.parts(node);
        let open: Vec<u32> =
            parts.states.iter().copied().filter(|s| facts.states[*s as usize].exact().is_none()).take(3).collect();
        let few = |state: &u32| match &facts.states[*state as usize] {
            AbstractValue::Few(all, why) => Some((all.clone(), *why)),
            _ => None,
        };
        let mut cases: Vec<Vec<(u32, f64)>> = vec![Vec::new()];
        let mut why = Imprecision::Paths;
        for state in open.iter().filter(|_| open.len() < 3) {
            let (all, because) = few(state)?;
            why = why.max(because);
            let with = |case: Vec<(u32, f64)>| all.iter().map(move |v| [case.clone(), vec![(*state, *v)]].concat());
            cases = cases.into_iter().flat_map(with).collect();
        }
        if !(2..=MOST_CASES).contains(&cases.len()) {
            return None;
        }
        let formula = self.nodes.formulas.of(&self.lab.graph, node);
        let mut values = Vec::with_capacity(cases.len());
        for states in &cases {
            let exact = Exact { params: &self.params, facts };
            values.push(formula.value(&Supposed { exact, states }, &mut self.numbers)?);
        }
        Some(AbstractValue::of(values, why))
    }

    /// The value of a node with those of all that it rests on, which stay in `values`. Of its operations those are done again
    /// whose operands are no longer what they were.
    pub fn enclose(&mut self, node: NodeId, facts: &AbstractState) -> AbstractValue {
        self.bring_up_to_date(node, facts);
        let known = self.values.of(node).clone();
        if facts.bonds.is_some() && matches!(self.lab.graph.op(node), Op::Binary(BinaryOp::Add | BinaryOp::Sub, ..)) {
            return self.together(node, known, facts);
        }
        known
    }

    /// Does those operations of a node again that rest on something that has changed since they were done.
    fn bring_up_to_date(&mut self, node: NodeId, facts: &AbstractState) {
        let inputs = self.inputs(node);
        inputs.leaves.iter().for_each(|leaf| self.take(*leaf, facts));
        let since = self.values.settled(node);
        let order = if since == 0 {
            self.order(node)
        } else {
            let is_new = |n: &&NodeId| self.values.changed(**n) > since;
            let is_new_sum =
                |n: &&NodeId| is_new(n) || !self.sums.get(n).is_some_and(|bonds| alike(bonds, &facts.bonds));
            let sums = inputs.sums.iter().filter(is_new_sum);
            let changed: Vec<NodeId> = inputs.leaves.iter().filter(is_new).chain(sums).copied().collect();
            if changed.is_empty() {
                return;
            }
            self.above_all(node, &changed)
        };
        self.work_out(&order, facts);
        self.values.settle(node);
    }

    /// The operations of a node that depend on some of those it rests on, operands first; all of it where these are not known yet
    /// or not much less.
    fn above_all(&mut self, node: NodeId, leaves: &[NodeId]) -> Rc<[NodeId]> {
        let order = self.order(node);
        let mut found: Vec<NodeId> = Vec::new();
        let mut known = true;
        for leaf in leaves {
            match self.above(node, *leaf, &order) {
                Some(above) => found.extend(above.iter()),
                None => known = false,
            }
            if !known || 2 * found.len() > order.len() {
                return order;
            }
        }
        // Operands have smaller numbers. Runs that are in order stay so: a merge.
        found.sort();
        found.dedup();
        found.into()
    }

    /// The operations of a node that depend on one of them, itself among them. They are found when they are asked for again.
    fn above(&mut self, node: NodeId, leaf: NodeId, order: &[NodeId]) -> Option<Rc<[NodeId]>> {
        match self.nodes.above.get(&(node, leaf)) {
            None => {
                self.nodes.above.insert((node, leaf), None);
                None
            }
            Some(Some(known)) => Some(known.clone()),
            Some(None) => {
                // Operands have smaller numbers: nothing before it depends on it.
                let later = &order[order.partition_point(|n| *n < leaf)..];
                let mut on = vec![false; (node.0 - leaf.0) as usize + 1];
                let depends = |n: &&NodeId| {
                    let is_on = |a: NodeId| a >= leaf && on[(a.0 - leaf.0) as usize];
                    let is = **n == leaf || self.lab.graph.op(**n).operands().any(is_on);
                    on[(n.0 - leaf.0) as usize] = is;
                    is
                };
                let found: Rc<[NodeId]> = later.iter().filter(depends).copied().collect();
                self.nodes.above.insert((node, leaf), Some(found.clone()));
                Some(found)
            }
        }
    }

    /// What a node rests on; found once.
    fn inputs(&mut self, node: NodeId) -> Rc<Inputs> {
        if let Some(known) = self.nodes.inputs.get(&node) {
            return known.clone();
        }
        let order = self.order(node);
        let op = |n: &NodeId| self.lab.graph.op(*n);
        let is_leaf = |n: &NodeId| op(n).operands().next().is_none() && !matches!(op(n), Op::Const(_));
        let leaves = order.iter().copied().filter(is_leaf).collect();
        let sums = order.iter().copied().filter(|n| self.is_outer_sum(*n)).collect();
        let inputs = Rc::new(Inputs { leaves, sums });
        self.nodes.inputs.insert(node, inputs.clone());
        inputs
    }

    /// The value of a node that was enclosed just before, now that of what is known one state alone has changed.
    pub fn enclose_again(&mut self, node: NodeId, state: u32, facts: &AbstractState) -> AbstractValue {
        let order = self.parts_on(node, state);
        for n in order.iter().take_while(|n| self.lab.graph.op(**n).operands().next().is_none()) {
            self.take(*n, facts);
        }
        self.work_out(&order, facts);
        self.values.of(node).clone()
    }

    /// The operations of a node that depend on a state, those without operands first; found once.
    fn parts_on(&mut self, node: NodeId, state: u32) -> Rc<[NodeId]> {
        if let Some(known) = self.nodes.parts_on.get(&(node, state)) {
            return known.clone();
        }
        let order = self.order(node);
        let mut on: FxHashSet<NodeId> = FxHashSet::default();
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
        let depend = || order.iter().copied().filter(|n| on.contains(n));
        let is_leaf = |n: &NodeId| self.lab.graph.op(*n).operands().next().is_none();
        let found: Rc<[NodeId]> = depend().filter(is_leaf).chain(depend().filter(|n| !is_leaf(n))).collect();
        self.nodes.parts_on.insert((node, state), found.clone());
        found
    }

    /// Does operations again of which an operand has changed; those without operands are taken in already.
    fn work_out(&mut self, order: &[NodeId], facts: &AbstractState) {
        for n in order {
            let op = self.lab.graph.op(*n);
            let stale = match op {
                Op::Const(_) => !self.values.is_done(*n),
                Op::Time | Op::State(_) | Op::Param(_) | Op::Local(_) | Op::Reading(_) => false,
                // What is known of a sum hangs on more than what is known of its parts.
                Op::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), a, b) if self.is_outer_sum(*n) => {
                    self.outer_sum(*n, op, [a, b], facts);
                    false
                }
                Op::Unary(_, a) => self.values.is_stale(*n, &[a]),
                Op::Binary(_, a, b) => self.values.is_stale(*n, &[a, b]),
                Op::Select(c, a, b) => self.values.is_stale(*n, &[c, a, b]),
                Op::List(a, b) => self.values.is_stale(*n, &[a, b]),
                // What is known of a list may be the same where what it holds is not.
                Op::Solved(call, _) => self.values.is_stale(*n, &self.lab.graph.call(call).args),
            };
            if stale {
                let value = self.done_again(op);
                self.values.redo(*n, value);
            }
        }
    }

    /// An operation by the last values of its operands.
    fn done_again(&self, op: Op) -> AbstractValue {
        let of = |n| self.values.of(n);
        match op {
            Op::Const(v) => AbstractValue::point(v),
            Op::Unary(op, a) => AbstractValue::unary(op, of(a)),
            Op::Binary(BinaryOp::Eq, a, b) if a == b => AbstractValue::Point(1.0),
            Op::Binary(op, a, b) => AbstractValue::binary(op, of(a), of(b)),
            Op::Select(c, a, b) => AbstractValue::select(of(c), of(a), of(b)),
            Op::List(a, b) => match (of(a).exact(), of(b).exact()) {
                (Some(a), Some(b)) => AbstractValue::point(digest(a, b)),
                _ => AbstractValue::top(),
            },
            Op::Solved(call, _) => {
                let call = self.lab.graph.call(call);
                let args: Vec<(f64, f64)> = call.args.iter().map(|arg| of(*arg).bounds()).collect();
                let (low, high) = call.system.bounds(call.part, &args);
                if low == high {
                    AbstractValue::point(low)
                } else {
                    AbstractValue::Range(low, high, Imprecision::Unknown)
                }
            }
            Op::Time | Op::State(_) | Op::Param(_) | Op::Local(_) | Op::Reading(_) => AbstractValue::top(),
        }
    }

    /// Takes in the value of an operation without operands; a number never changes.
    fn take(&mut self, leaf: NodeId, facts: &AbstractState) {
        match self.lab.graph.op(leaf) {
            Op::Time => self.values.leaf(leaf, &facts.time),
            Op::State(i) => self.values.leaf(leaf, &facts.states[i as usize]),
            Op::Param(i) => self.values.leaf(leaf, &self.params[i as usize]),
            Op::Local(i) => self.values.leaf(leaf, &facts.locals[i as usize]),
            Op::Reading(i) => {
                let value = self.reading(i, facts);
                self.values.leaf(leaf, &value);
            }
            Op::Const(_) | Op::Unary(..) | Op::Binary(..) | Op::Select(..) | Op::List(..) | Op::Solved(..) => {}
        }
    }

    /// Does a sum of states that may hang together if one of them or how they hang together has changed since.
    fn outer_sum(&mut self, node: NodeId, op: BinaryOp, [a, b]: [NodeId; 2], facts: &AbstractState) {
        let inputs = self.inputs(node);
        let is_same = self.sums.get(&node).is_some_and(|bonds| alike(bonds, &facts.bonds));
        if is_same && !self.values.is_stale(node, &inputs.leaves) {
            return;
        }
        let apart = AbstractValue::binary(op, self.values.of(a), self.values.of(b));
        let value = self.together(node, apart, facts);
        self.values.redo(node, value);
        self.sums.insert(node, facts.bonds.clone());
    }

    /// What a device shows: the true value, give or take its imperfection.
    fn reading(&mut self, index: u32, facts: &AbstractState) -> AbstractValue {
        let reading = &self.lab.readings[index as usize];
        let (resolution, noise) = (reading.resolution.unwrap_or(0.0), reading.noise.unwrap_or(0.0));
        // A node's value depends on what is known alone: to evaluate it in between disturbs nothing.
        let value = self.eval(reading.value, facts);
        let slack = resolution / 2.0 + 6.0 * noise;
        if slack == 0.0 {
            return value;
        }
        let (low, high) = value.bounds();
        AbstractValue::Range(low - slack, high + slack, Imprecision::Unknown)
    }

    /// How a condition comes out: by what is known, or as it came out before on this way.
    pub fn truth(&mut self, node: NodeId, facts: &AbstractState) -> Option<bool> {
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
    pub fn decide(&mut self, node: NodeId, holds: bool, facts: &mut AbstractState) {
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
    pub fn assume(&mut self, node: NodeId, holds: bool, facts: &mut AbstractState) {
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
                    *slot = AbstractValue::Point(f64::from(u8::from(holds)));
                }
            }
            Op::State(s) if self.is_truth(s) => {
                facts.states[s as usize] = AbstractValue::Point(f64::from(u8::from(holds)))
            }
            Op::Binary(op @ (BinaryOp::Eq | BinaryOp::Lt | BinaryOp::Le), a, b) => {
                self.assume_compared(op, (a, b), holds, facts);
                self.sift(node, holds, facts);
            }
            _ => self.sift(node, holds, facts),
        }
    }

    /// Takes a comparison of a state with a number for true or false.
    fn assume_compared(&self, op: BinaryOp, (a, b): (NodeId, NodeId), holds: bool, facts: &mut AbstractState) {
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
    fn sift(&mut self, node: NodeId, holds: bool, facts: &mut AbstractState) {
        let parts = self.parts(node);
        let few = |s: &u32| matches!(facts.states[*s as usize], AbstractValue::Few(..)) && !facts.hangs(*s);
        let open: Vec<u32> = parts.states.iter().copied().filter(few).take(MOST_SIFTED).collect();
        if open.is_empty() || self.is_shared(node) {
            return;
        }
        for state in open {
            let AbstractValue::Few(all, why) = facts.states[state as usize].clone() else { continue };
            let mut supposed = facts.clone();
            let mut may = |value: &f64| {
                supposed.states[state as usize] = AbstractValue::Point(*value);
                self.eval(node, &supposed).truth() != Some(!holds)
            };
            let stay: Vec<f64> = all.iter().copied().filter(|value| may(value)).collect();
            if !stay.is_empty() && stay.len() < all.len() {
                facts.narrow(state, AbstractValue::of(stay, why));
            }
        }
    }

    fn is_truth(&self, state: u32) -> bool {
        self.lab.states[state as usize].domain == matterix_ir::model::Domain::Bool
    }

    /// Notes a failure that the text writes at a place of the user's.
    pub fn raise_written(&mut self, name: &str, span: Span, mut facts: AbstractState) {
        // Not where only what a device reports, or what goes on beside, leads there.
        facts.written = Some(span).filter(|span| !facts.unsure && !self.in_library(*span));
        for (name, facts) in self.stop_jobs(vec![(name.to_owned(), facts)], self.guards.len()) {
            self.raise(&name, facts);
        }
    }

    /// Notes a failure for the handlers around.
    pub fn raise(&mut self, name: &str, mut facts: AbstractState) {
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
fn cut(x: &mut AbstractValue, op: BinaryOp, v: f64, holds: bool, left: bool) {
    if op == BinaryOp::Eq {
        match (holds, &*x) {
            (true, _) => *x = AbstractValue::Point(v),
            (false, AbstractValue::Few(all, why)) => {
                let rest: Vec<f64> = all.iter().copied().filter(|o| *o != v).collect();
                *x = match rest.as_slice() {
                    [] => AbstractValue::top(),
                    [one] => AbstractValue::Point(*one),
                    _ => AbstractValue::Few(rest.into(), *why),
                };
            }
            _ => {}
        }
        return;
    }
    let AbstractValue::Range(low, high, why) = *x else { return };
    let below = holds == left;
    let (low, high) = if below { (low, high.min(v)) } else { (low.max(v), high) };
    if low <= high {
        *x = AbstractValue::Range(low, high, why);
    }
}
