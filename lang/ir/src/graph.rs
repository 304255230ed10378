//! Expressions in static single assignment form: one list of operations, operands before their users.
//!
//! The graph knows numbers only. Truth is 1 or 0; an instance is its index in the scene, "nothing" is -1. It holds no
//! closures and no laws, so that it can be evaluated in bulk or compiled for other targets.

use std::collections::HashMap;
use std::fmt::Write;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::equilibrium::{Call, Part, System};
use crate::math;

/// An operation of a [`Graph`], by its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct NodeId(pub u32);

/// Operations on one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum UnaryOp {
    /// `-x`
    Neg,
    /// 1 if x is 0, else 0
    Not,
    /// `e^x`
    Exp,
    /// natural logarithm
    Ln,
    /// square root
    Sqrt,
    /// magnitude
    Abs,
    /// sine of radians
    Sin,
    /// cosine of radians
    Cos,
    /// arc tangent, radians
    Atan,
    /// largest whole number not above x
    Floor,
}

impl UnaryOp {
    /// All of them.
    pub const ALL: [UnaryOp; 10] = {
        use UnaryOp::{Abs, Atan, Cos, Exp, Floor, Ln, Neg, Not, Sin, Sqrt};
        [Neg, Not, Exp, Ln, Sqrt, Abs, Sin, Cos, Atan, Floor]
    };

    /// Whether its value goes from one to another in jumps, as a comparison's does.
    pub fn is_stepwise(self) -> bool {
        self == UnaryOp::Floor
    }

    /// Whether it may turn as often as it likes while its operand goes one way.
    pub fn is_wave(self) -> bool {
        matches!(self, UnaryOp::Sin | UnaryOp::Cos | UnaryOp::Floor)
    }
}

/// Operations on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BinaryOp {
    /// `a + b`
    Add,
    /// `a - b`
    Sub,
    /// `a * b`
    Mul,
    /// `a / b`
    Div,
    /// `a ^ b`
    Pow,
    /// the smaller
    Min,
    /// the larger
    Max,
    /// 1 if `a < b`
    Lt,
    /// 1 if `a <= b`
    Le,
    /// 1 if `a == b`
    Eq,
    /// 1 if both are not 0
    And,
    /// 1 if one is not 0
    Or,
}

impl BinaryOp {
    /// All of them.
    pub const ALL: [BinaryOp; 12] = {
        use BinaryOp::{Add, And, Div, Eq, Le, Lt, Max, Min, Mul, Or, Pow, Sub};
        [Add, Sub, Mul, Div, Pow, Min, Max, Lt, Le, Eq, And, Or]
    };
}

/// One operation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Op {
    /// A number.
    Const(f64),
    /// Seconds since the run began.
    Time,
    /// A state, by its index in the model.
    State(u32),
    /// A parameter, by its index in the model.
    Param(u32),
    /// A value the plan keeps (a `let`, a step's start), by its index in the plan.
    Local(u32),
    /// What a device reports, by its index in the model: the state with its declared imperfection.
    Reading(u32),
    /// An operation on one operand.
    Unary(UnaryOp, NodeId),
    /// An operation on two operands.
    Binary(BinaryOp, NodeId, NodeId),
    /// The second operand if the first is not 0, else the third. Both are evaluated.
    Select(NodeId, NodeId, NodeId),
    /// All that a list holds, and one value more: what something that takes many values rests on. Its own value only says whether they
    /// are the same as before.
    List(NodeId, NodeId),
    /// A number of a solution, by its index among the calls of the graph; the operand lists its arguments.
    Solved(u32, NodeId),
}

impl Op {
    /// The operands, in order.
    pub fn operands(&self) -> Operands {
        let (list, count) = match *self {
            Op::Unary(_, a) => ([a; 3], 1),
            Op::Binary(_, a, b) => ([a, b, b], 2),
            Op::Select(a, b, c) => ([a, b, c], 3),
            Op::List(a, b) => ([a, b, b], 2),
            Op::Solved(_, a) => ([a; 3], 1),
            _ => ([NodeId(0); 3], 0),
        };
        Operands { list, next: 0, count }
    }

    /// Whether this compares two numbers, so that its value jumps where they cross.
    pub fn is_comparison(&self) -> bool {
        matches!(self, Op::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq, _, _))
    }

    /// Whether its value goes from one to another in jumps.
    pub fn is_stepwise(&self) -> bool {
        self.is_comparison() || matches!(self, Op::Unary(op, _) if op.is_stepwise())
    }
}

/// The operands of an operation, in order. Every walk over a graph asks for them: this is cheaper than a chain of adapters.
#[derive(Clone, Debug)]
pub struct Operands {
    list: [NodeId; 3],
    next: u8,
    count: u8,
}

impl Iterator for Operands {
    type Item = NodeId;

    fn next(&mut self) -> Option<NodeId> {
        if self.next == self.count {
            return None;
        }
        let operand = self.list[self.next as usize];
        self.next += 1;
        Some(operand)
    }
}

/// The leaves' values at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Env<'a> {
    /// Seconds since the run began.
    pub time: f64,
    /// By state index, SI.
    pub states: &'a [f64],
    /// By parameter index, SI.
    pub params: &'a [f64],
    /// By local index, SI.
    pub locals: &'a [f64],
    /// By reading index, SI.
    pub readings: &'a [f64],
}

impl Env<'_> {
    /// The value of an operation without operands; not a number for others.
    #[inline]
    pub fn leaf(&self, op: Op) -> f64 {
        match op {
            Op::Const(v) => v,
            Op::Time => self.time,
            Op::State(i) => self.states[i as usize],
            Op::Param(i) => self.params[i as usize],
            // What a plan does not keep is no number.
            Op::Local(i) => self.locals.get(i as usize).copied().unwrap_or(f64::NAN),
            Op::Reading(i) => self.readings[i as usize],
            Op::Unary(..) | Op::Binary(..) | Op::Select(..) | Op::List(..) | Op::Solved(..) => f64::NAN,
        }
    }
}

/// Kinds of leaves that a value rests on and that only the run knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Leaves(u8);

impl Leaves {
    /// States.
    pub const STATE: Leaves = Leaves(1);
    /// The time.
    pub const TIME: Leaves = Leaves(1 << 1);
    /// Values that the plan keeps.
    pub const LOCAL: Leaves = Leaves(1 << 2);
    /// What devices report.
    pub const READING: Leaves = Leaves(1 << 3);
    /// All of them: without any, a value is known before the run.
    pub const LIVE: Leaves = Leaves(0b1111);

    /// Whether they have a kind in common.
    pub fn meets(self, other: Leaves) -> bool {
        self.0 & other.0 != 0
    }
}

/// A list of operations in which every operand stands before its user.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(from = "Ops")]
pub struct Graph {
    ops: Vec<Op>,
    /// What [`Op::Solved`] asks for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    calls: Vec<Call>,
    /// By operation, so that asking costs nothing.
    #[serde(skip)]
    leaves: Vec<Leaves>,
    #[serde(skip)]
    seen: HashMap<Key, NodeId, BuildHasherDefault<Mixer>>,
    /// The calls by what lists their arguments, and the part they ask for.
    #[serde(skip)]
    asked: HashMap<(NodeId, Part), Vec<u32>>,
}

/// A graph as it is written.
#[derive(Deserialize)]
#[serde(rename = "Graph")]
struct Ops {
    ops: Vec<Op>,
    #[serde(default)]
    calls: Vec<Call>,
}

impl From<Ops> for Graph {
    fn from(Ops { ops, calls }: Ops) -> Self {
        let mut graph = Graph { leaves: Vec::with_capacity(ops.len()), ..Graph::default() };
        for op in &ops {
            let leaves = graph.leaves_of(*op);
            graph.leaves.push(leaves);
        }
        Graph { ops, calls, ..graph }
    }
}

impl PartialEq for Graph {
    fn eq(&self, other: &Self) -> bool {
        self.ops == other.ops && self.calls == other.calls
    }
}

/// An operation as a hash key: constants by their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Key {
    Const(u64),
    Time,
    State(u32),
    Param(u32),
    Local(u32),
    Reading(u32),
    Unary(UnaryOp, NodeId),
    Binary(BinaryOp, NodeId, NodeId),
    Select(NodeId, NodeId, NodeId),
    List(NodeId, NodeId),
    Solved(u32, NodeId),
}

/// Mixes the few words of a [`Key`]. Programs are not written to make keys collide, and the map is never iterated, so
/// neither secrecy nor order matters; speed does.
#[derive(Clone, Copy, Debug, Default)]
struct Mixer(u64);

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|b| self.write_u64(u64::from(*b)));
    }

    fn write_u32(&mut self, word: u32) {
        self.write_u64(u64::from(word));
    }

    fn write_u64(&mut self, word: u64) {
        // The product's high half depends on all bits of the word, its low half on the low ones only.
        let product = u128::from(self.0.rotate_left(5) ^ word) * 0x9e37_79b9_7f4a_7c15;
        self.0 = (product >> 64) as u64 ^ product as u64;
    }

    fn write_isize(&mut self, word: isize) {
        self.write_u64(word as u64);
    }
}

fn key(op: Op) -> Key {
    match op {
        Op::Const(v) => Key::Const(v.to_bits()),
        Op::Time => Key::Time,
        Op::State(i) => Key::State(i),
        Op::Param(i) => Key::Param(i),
        Op::Local(i) => Key::Local(i),
        Op::Reading(i) => Key::Reading(i),
        Op::Unary(o, a) => Key::Unary(o, a),
        Op::Binary(o, a, b) => Key::Binary(o, a, b),
        Op::Select(a, b, c) => Key::Select(a, b, c),
        Op::List(a, b) => Key::List(a, b),
        Op::Solved(call, list) => Key::Solved(call, list),
    }
}

impl Graph {
    /// All operations, operands first.
    pub fn ops(&self) -> &[Op] {
        &self.ops
    }

    /// One operation.
    #[inline]
    pub fn op(&self, node: NodeId) -> Op {
        self.ops[node.0 as usize]
    }

    /// The constant this node is, if it is one.
    pub fn constant(&self, node: NodeId) -> Option<f64> {
        match self.op(node) {
            Op::Const(v) => Some(v),
            _ => None,
        }
    }

    /// Adds an operation, or finds the equal one; folds constants and neutral elements.
    pub fn add(&mut self, op: Op) -> NodeId {
        if let Some(node) = self.simplify(op) {
            return node;
        }
        let op = self.fold(op);
        let k = key(op);
        if let Some(&node) = self.seen.get(&k) {
            return node;
        }
        let node = NodeId(self.ops.len() as u32);
        self.leaves.push(self.leaves_of(op));
        self.ops.push(op);
        self.seen.insert(k, node);
        node
    }

    /// An operand that is not there has none.
    fn leaves_of(&self, op: Op) -> Leaves {
        match op {
            Op::Const(_) | Op::Param(_) => Leaves::default(),
            Op::Time => Leaves::TIME,
            Op::State(_) => Leaves::STATE,
            Op::Local(_) => Leaves::LOCAL,
            Op::Reading(_) => Leaves::READING,
            Op::Unary(..) | Op::Binary(..) | Op::Select(..) | Op::List(..) | Op::Solved(..) => {
                let mut all = 0;
                for operand in op.operands() {
                    all |= self.leaves.get(operand.0 as usize).map_or(0, |leaves| leaves.0);
                }
                Leaves(all)
            }
        }
    }

    /// The kinds of leaves that a value rests on.
    pub fn leaves(&self, node: NodeId) -> Leaves {
        self.leaves[node.0 as usize]
    }

    /// A constant.
    pub fn number(&mut self, value: f64) -> NodeId {
        self.add(Op::Const(value))
    }

    /// Whether a node is what a table has beyond its ends: no number, and meant to be none.
    pub fn is_gap(&self, node: NodeId) -> bool {
        self.constant(node).is_some_and(f64::is_nan)
    }

    /// Whether an operation reads off a table, and has no value beyond its ends.
    pub fn is_table(&self, op: Op) -> bool {
        matches!(op, Op::Select(_, _, beyond) if self.is_gap(beyond))
    }

    /// An operation on one operand.
    pub fn unary(&mut self, op: UnaryOp, a: NodeId) -> NodeId {
        self.add(Op::Unary(op, a))
    }

    /// An operation on two operands.
    pub fn binary(&mut self, op: BinaryOp, a: NodeId, b: NodeId) -> NodeId {
        self.add(Op::Binary(op, a, b))
    }

    /// `if c { a } else { b }`.
    pub fn select(&mut self, c: NodeId, a: NodeId, b: NodeId) -> NodeId {
        self.add(Op::Select(c, a, b))
    }

    /// A number of the solution of a system for these arguments.
    pub fn solved(&mut self, system: &Arc<System>, part: Part, args: &Arc<[NodeId]>) -> NodeId {
        let mut list = self.number(0.0);
        for arg in args.iter() {
            list = self.add(Op::List(list, *arg));
        }
        self.solved_of(list, system, part, || args.clone())
    }

    /// The same of arguments that are listed already.
    fn solved_of(
        &mut self,
        list: NodeId,
        system: &Arc<System>,
        part: Part,
        args: impl FnOnce() -> Arc<[NodeId]>,
    ) -> NodeId {
        let asked = self.asked.entry((list, part)).or_default();
        let is_same = |call: &u32| {
            let known = &self.calls[*call as usize].system;
            Arc::ptr_eq(known, system) || known == system
        };
        let call = asked.iter().copied().find(is_same).unwrap_or_else(|| {
            let call = self.calls.len() as u32;
            asked.push(call);
            self.calls.push(Call { system: system.clone(), part, args: args() });
            call
        });
        self.add(Op::Solved(call, list))
    }

    /// What [`Op::Solved`] asks for.
    pub fn call(&self, call: u32) -> &Call {
        &self.calls[call as usize]
    }

    /// The value of an operation, given what leaves and operands are worth.
    fn apply(&self, op: Op, leaf: impl Fn(Op) -> f64, at: impl Fn(NodeId) -> f64) -> f64 {
        match op {
            Op::Solved(call, _) => self.call(call).value(at),
            op => apply(op, leaf, at),
        }
    }

    /// Constants are worked out here; a quotient of nothing stays as it is written, for whoever asks for its value to report.
    fn fold(&self, op: Op) -> Op {
        let value = match op {
            Op::Unary(o, a) => self.constant(a).map(|a| (unary(o, a), a.is_finite())),
            Op::Binary(o, a, b) => {
                self.constant(a).zip(self.constant(b)).map(|(a, b)| (written(o, a, b), a.is_finite() && b.is_finite()))
            }
            _ => None,
        };
        value.filter(|(result, finite)| result.is_finite() || !finite).map_or(op, |(result, _)| Op::Const(result))
    }

    /// Exact identities only: nothing here changes a finite result's bits, except that `x - x` and `-x + x` become 0.
    fn simplify(&mut self, op: Op) -> Option<NodeId> {
        let zero = |g: &Graph, n| g.constant(n) == Some(0.0);
        let one = |g: &Graph, n| g.constant(n) == Some(1.0);
        match op {
            Op::Binary(BinaryOp::Add, a, b) if zero(self, a) => Some(b),
            Op::Binary(BinaryOp::Add | BinaryOp::Sub, a, b) if zero(self, b) => Some(a),
            Op::Binary(BinaryOp::Sub, a, b) if zero(self, a) => Some(self.unary(UnaryOp::Neg, b)),
            Op::Binary(BinaryOp::Sub, a, b) if a == b => Some(self.number(0.0)),
            Op::Binary(BinaryOp::Add, a, b)
                if self.op(a) == Op::Unary(UnaryOp::Neg, b) || self.op(b) == Op::Unary(UnaryOp::Neg, a) =>
            {
                Some(self.number(0.0))
            }
            Op::Binary(BinaryOp::Mul, a, b) if one(self, a) => Some(b),
            Op::Binary(BinaryOp::Mul | BinaryOp::Div | BinaryOp::Pow, a, b) if one(self, b) => Some(a),
            Op::Binary(BinaryOp::Mul, a, b) if zero(self, a) || zero(self, b) => Some(self.number(0.0)),
            Op::Binary(BinaryOp::Pow, _, b) if zero(self, b) => Some(self.number(1.0)),
            Op::Binary(BinaryOp::Pow, a, b) if self.constant(b) == Some(-1.0) => {
                let one = self.number(1.0);
                Some(self.binary(BinaryOp::Div, one, a))
            }
            Op::Binary(BinaryOp::And, a, b) => match (self.constant(a), self.constant(b)) {
                (Some(x), _) => Some(if x == 0.0 { a } else { b }),
                (_, Some(y)) => Some(if y == 0.0 { b } else { a }),
                _ => None,
            },
            Op::Binary(BinaryOp::Or, a, b) => match (self.constant(a), self.constant(b)) {
                (Some(x), _) => Some(if x == 0.0 { b } else { a }),
                (_, Some(y)) => Some(if y == 0.0 { a } else { b }),
                _ => None,
            },
            Op::Unary(UnaryOp::Neg, a) => match self.op(a) {
                Op::Unary(UnaryOp::Neg, inner) => Some(inner),
                _ => None,
            },
            Op::Select(c, a, b) => match self.constant(c) {
                Some(0.0) => Some(b),
                Some(_) => Some(a),
                None if a == b => Some(a),
                None => None,
            },
            _ => None,
        }
    }

    /// A value as it would be if some states had other values, by their indices; the rest stays as it is.
    pub fn with_states(&mut self, node: NodeId, states: &HashMap<u32, NodeId>) -> NodeId {
        let order = self.schedule([node]);
        let mut now: HashMap<NodeId, NodeId> = HashMap::with_capacity(order.len());
        for n in order {
            let at = |operand: NodeId| now.get(&operand).copied().unwrap_or(operand);
            let made = match self.op(n) {
                Op::State(s) => states.get(&s).copied().unwrap_or(n),
                Op::Unary(op, a) => self.unary(op, at(a)),
                Op::Binary(op, a, b) => self.binary(op, at(a), at(b)),
                Op::Select(c, a, b) => self.select(at(c), at(a), at(b)),
                Op::List(a, b) => self.add(Op::List(at(a), at(b))),
                Op::Solved(call, list) => {
                    let Call { system, part, args } = self.call(call).clone();
                    self.solved_of(at(list), &system, part, || args.iter().map(|arg| at(*arg)).collect())
                }
                Op::Const(_) | Op::Time | Op::Param(_) | Op::Local(_) | Op::Reading(_) => n,
            };
            now.insert(n, made);
        }
        now.get(&node).copied().unwrap_or(node)
    }

    /// Evaluates every operation in order into `out`, which is resized to fit. The reference semantics of the graph.
    pub fn eval_all(&self, env: Env<'_>, out: &mut Vec<f64>) {
        out.clear();
        out.reserve(self.ops.len());
        for &op in &self.ops {
            let value = self.apply(op, |leaf| env.leaf(leaf), |n| out[n.0 as usize]);
            out.push(value);
        }
    }

    /// Evaluates one node by evaluating what it depends on. For occasional use; hot paths keep a schedule of their own.
    pub fn eval(&self, node: NodeId, env: Env<'_>) -> f64 {
        self.eval_on(node, |leaf| env.leaf(leaf))
    }

    /// The same on leaves that are asked for one by one. Costs nothing for the rest of the graph.
    pub fn eval_on(&self, node: NodeId, leaf: impl Fn(Op) -> f64) -> f64 {
        let op = self.op(node);
        if op.operands().next().is_none() {
            return leaf(op);
        }
        let order = self.schedule([node]);
        let mut values: Vec<f64> = Vec::with_capacity(order.len());
        for n in &order {
            // Operands stand before their user.
            let value = self.apply(self.op(*n), &leaf, |o| values[order.partition_point(|other| *other < o)]);
            values.push(value);
        }
        values.last().copied().unwrap_or(f64::NAN)
    }

    /// The operations `roots` depend on, operands first, each once.
    pub fn schedule(&self, roots: impl IntoIterator<Item = NodeId>) -> Vec<NodeId> {
        let mut found = Vec::new();
        self.below(roots, |node| {
            found.push(node);
            false
        });
        found.sort_unstable();
        found
    }

    /// Visits the operations that a value rests on, each once, in no particular order.
    pub fn visit(&self, node: NodeId, mut visit: impl FnMut(Op)) {
        self.below([node], |n| {
            visit(self.op(n));
            false
        });
    }

    /// Whether `node` depends on an operation for which `test` holds.
    pub fn depends(&self, node: NodeId, test: impl Fn(&Op) -> bool) -> bool {
        self.below([node], |n| test(&self.op(n)))
    }

    /// Visits what `roots` depend on, each once, in no particular order, until a visit gives true. Costs nothing for
    /// the rest of the graph: most questions are about a small part of a large one.
    fn below(&self, roots: impl IntoIterator<Item = NodeId>, mut visit: impl FnMut(NodeId) -> bool) -> bool {
        let mut todo: Vec<NodeId> = roots.into_iter().collect();
        // Operands stand before their user.
        let Some(last) = todo.iter().max() else { return false };
        let mut seen = vec![0u64; last.0 as usize / 64 + 1];
        while let Some(node) = todo.pop() {
            let (word, bit) = (node.0 as usize / 64, 1 << (node.0 % 64));
            if seen[word] & bit != 0 {
                continue;
            }
            seen[word] |= bit;
            if visit(node) {
                return true;
            }
            for operand in self.op(node).operands() {
                todo.push(operand);
            }
        }
        false
    }

    /// One line per operation: `%12 = mul %3 %7`.
    pub fn print(&self) -> String {
        let mut out = String::new();
        for (i, op) in self.ops.iter().enumerate() {
            let _ = match op {
                Op::Const(v) => writeln!(out, "%{i} = const {v:e}"),
                Op::Time => writeln!(out, "%{i} = time"),
                Op::State(s) => writeln!(out, "%{i} = state {s}"),
                Op::Param(p) => writeln!(out, "%{i} = param {p}"),
                Op::Local(l) => writeln!(out, "%{i} = local {l}"),
                Op::Reading(r) => writeln!(out, "%{i} = reading {r}"),
                Op::Unary(o, a) => writeln!(out, "%{i} = {} %{}", format!("{o:?}").to_lowercase(), a.0),
                Op::Binary(o, a, b) => writeln!(out, "%{i} = {} %{} %{}", format!("{o:?}").to_lowercase(), a.0, b.0),
                Op::Select(c, a, b) => writeln!(out, "%{i} = select %{} %{} %{}", c.0, a.0, b.0),
                Op::List(a, b) => writeln!(out, "%{i} = list %{} %{}", a.0, b.0),
                Op::Solved(call, a) => writeln!(out, "%{i} = solved {:?} %{}", self.call(*call).part, a.0),
            };
        }
        out
    }
}

/// The value of one operation, given the leaves and the values of all operations before it.
pub fn eval_op(op: Op, env: Env<'_>, values: &[f64]) -> f64 {
    apply(op, |leaf| env.leaf(leaf), |n| values[n.0 as usize])
}

/// The value of one operation, given what leaves and operands are worth.
#[inline]
pub fn apply(op: Op, leaf: impl Fn(Op) -> f64, at: impl Fn(NodeId) -> f64) -> f64 {
    match op {
        Op::Unary(o, a) => unary(o, at(a)),
        Op::Binary(o, a, b) => binary(o, at(a), at(b)),
        Op::Select(c, a, b) => {
            if at(c) != 0.0 {
                at(a)
            } else {
                at(b)
            }
        }
        Op::List(a, b) => digest(at(a), at(b)),
        other => leaf(other),
    }
}

/// A number that is another one where one of two is; none where one is none.
pub fn digest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        return f64::NAN;
    }
    let mut mixer = Mixer(0);
    mixer.write_u64(a.to_bits());
    mixer.write_u64(b.to_bits());
    f64::from_bits(mixer.finish() >> 12 | 1f64.to_bits())
}

/// The value of an operation on one number.
#[inline]
pub fn unary(op: UnaryOp, a: f64) -> f64 {
    match op {
        UnaryOp::Neg => -a,
        UnaryOp::Not => truth(a == 0.0),
        UnaryOp::Exp => math::exp(a),
        UnaryOp::Ln => math::ln(a),
        UnaryOp::Sqrt => a.sqrt(),
        UnaryOp::Abs => a.abs(),
        UnaryOp::Sin => math::sin(a),
        UnaryOp::Cos => math::cos(a),
        UnaryOp::Atan => math::atan(a),
        UnaryOp::Floor => a.floor(),
    }
}

/// The value of an operation on two numbers.
#[inline]
pub fn binary(op: BinaryOp, a: f64, b: f64) -> f64 {
    match op {
        BinaryOp::Add => a + b,
        BinaryOp::Sub => a - b,
        BinaryOp::Mul => a * b,
        BinaryOp::Div => a / b,
        BinaryOp::Pow => math::pow(a, b),
        BinaryOp::Min => a.min(b),
        BinaryOp::Max => a.max(b),
        BinaryOp::Lt => truth(a < b),
        BinaryOp::Le => truth(a <= b),
        BinaryOp::Eq => truth(a == b),
        BinaryOp::And => truth(a != 0.0 && b != 0.0),
        BinaryOp::Or => truth(a != 0.0 || b != 0.0),
    }
}

/// Constants that are closer than this share of them are one number: `10 mL / (2 mL/min)` and `5 min` differ by the rounding of
/// their units.
const ROUNDING: f64 = 1e-14;

/// The same on two numbers that the text gives. Where rounding alone parts them, they compare as equal.
fn written(op: BinaryOp, a: f64, b: f64) -> f64 {
    // What has no end is close to nothing else.
    let most = a.abs().max(b.abs());
    let same = a == b || most.is_finite() && (a - b).abs() <= ROUNDING * most;
    match op {
        BinaryOp::Lt if same => truth(false),
        BinaryOp::Le | BinaryOp::Eq if same => truth(true),
        _ => binary(op, a, b),
    }
}

fn truth(b: bool) -> f64 {
    f64::from(u8::from(b))
}

#[cfg(test)]
mod tests {
    use super::{BinaryOp, Env, Graph, HashMap, Op, UnaryOp};

    #[test]
    fn a_value_with_other_states_is_that_at_their_values() {
        let mut graph = Graph::default();
        let [a, b, c] = [0, 1, 2].map(|s| graph.add(Op::State(s)));
        let (square, sine) = (graph.binary(BinaryOp::Mul, a, a), graph.unary(UnaryOp::Sin, b));
        let sum = graph.binary(BinaryOp::Add, square, sine);
        let less = graph.binary(BinaryOp::Lt, a, b);
        let value = graph.select(less, sum, square);
        let share = graph.number(0.5);
        let comes = graph.binary(BinaryOp::Mul, share, c);
        let states = HashMap::from([(0, graph.binary(BinaryOp::Add, a, comes)), (1, c)]);
        let then = graph.with_states(value, &states);
        let at = |graph: &Graph, node, states: &[f64]| {
            graph.eval(node, Env { time: 0.0, states, params: &[], locals: &[], readings: &[] })
        };
        for [x, y, z] in [[1.0, 2.0, 3.0], [2.0, 0.5, -1.0], [0.0, 0.0, 4.0]] {
            let (found, wanted) = (at(&graph, then, &[x, y, z]), at(&graph, value, &[x + 0.5 * z, z, z]));
            assert!((found - wanted).abs() < 1e-15, "{found} {wanted}");
        }
        assert_eq!(graph.with_states(value, &HashMap::new()), value);
    }
}
