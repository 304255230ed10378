//! What each operation of the graph is between two discontinuities: a constant, or something that varies.
//!
//! Between them comparisons keep the truth they had at the first, and whole numbers their value. Whatever follows from them, from parameters and
//! from states at rest is a constant then; the rest is put on a [`Tape`]. A discontinuity concerns some of the law only: there
//! facts are looked at anew, all others stand.

use std::cell::RefCell;
use std::collections::BTreeMap;

use matterix_ir::graph::{binary, digest, unary};
use matterix_ir::{BinaryOp, Graph, NodeId, Op, UnaryOp};

use super::tape::{Call, Step, Tape, Term};

/// Largest whole number that a term of a sum is a multiple by: its product is exact in two doubles.
const LARGEST_FACTOR: f64 = 1e6;

/// A sum is taken apart no further: one written in terms of itself doubles with every line.
const MOST_TERMS: usize = 1000;

/// What one operation is between two discontinuities.
#[derive(Clone, Copy, Debug, Default)]
struct Fact {
    /// Its value at the start of the segment.
    now: f64,
    /// Whether its value changes within the segment.
    varies: bool,
    /// Whether time stands anywhere below it.
    feels_time: bool,
    /// Whether a moving state stands anywhere below it.
    feels_state: bool,
    /// The operation whose value it passes on, itself if none.
    same: u32,
    /// The operands that can change it while the others stay, a bit each.
    live: u8,
}

impl Fact {
    /// Takes in that the operation has this operand.
    fn rest_on(&mut self, operand: Fact) {
        self.varies |= operand.varies;
        self.feels_time |= operand.feels_time;
        self.feels_state |= operand.feels_state;
    }
}

/// A number that follows time and nothing else: `rate * time + offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    pub(super) rate: f64,
    pub(super) offset: f64,
}

impl Clock {
    /// One that stands.
    pub(super) fn standing(offset: f64) -> Clock {
        Clock { rate: 0.0, offset }
    }

    /// What it shows at `time`, s.
    pub(super) fn at(&self, time: f64) -> f64 {
        self.rate * time + self.offset
    }
}

/// The facts about the operations of a graph, as they were last looked at.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    facts: Vec<Fact>,
    /// By operation, the instant at which it was looked at; 0 never, [`OUTDATED`] before what it rests on has changed.
    looked: Vec<u32>,
    /// By operation, the instant at which its tape was last found to be another one.
    altered: Vec<u32>,
    instant: u32,
    scratch: RefCell<Scratch>,
}

/// What has been looked at once, but not since something below it changed.
const OUTDATED: u32 = 1;

/// A look at the facts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Analysis<'g> {
    graph: &'g Graph,
    facts: &'g [Fact],
    scratch: &'g RefCell<Scratch>,
}

/// What walks over the graph write down, kept from one to the next so that a walk costs no more than what it comes by.
#[derive(Clone, Debug, Default)]
struct Scratch {
    /// By operation, the last walk that came by.
    seen: Vec<u32>,
    walk: u32,
    /// By operation, its register.
    place: Vec<u32>,
}

impl Scratch {
    /// Begins another walk over so many operations.
    fn begin(&mut self, size: usize) {
        self.seen.resize(size, 0);
        self.place.resize(size, 0);
        self.walk += 1;
    }

    /// Whether the present walk comes by for the first time.
    fn is_new(&mut self, at: usize) -> bool {
        std::mem::replace(&mut self.seen[at], self.walk) != self.walk
    }
}

impl Facts {
    /// Nothing is known of `graph`.
    pub(super) fn new(graph: &Graph) -> Self {
        let size = graph.ops().len();
        Facts {
            facts: vec![Fact::default(); size],
            looked: vec![0; size],
            altered: vec![0; size],
            instant: OUTDATED,
            scratch: RefCell::default(),
        }
    }

    /// What is known.
    pub(super) fn of<'g>(&'g self, graph: &'g Graph) -> Analysis<'g> {
        Analysis { graph, facts: &self.facts, scratch: &self.scratch }
    }

    /// Another instant: everything may be looked at again.
    pub(super) fn begin(&mut self) {
        self.instant += 1;
    }

    /// What is known of an operation is not so any more.
    pub(super) fn outdate(&mut self, node: NodeId) {
        let looked = &mut self.looked[node.0 as usize];
        *looked = (*looked).min(OUTDATED);
    }

    /// Whether `node` has been found to be something else at this instant: whoever computes it has to do so in another way.
    pub(super) fn is_altered(&self, node: NodeId) -> bool {
        self.altered[node.0 as usize] == self.instant
    }

    /// Looks at all that `roots` depend on, once an instant, when the states marked in `moving` change with time. Returns the
    /// comparisons and whole numbers that are others than they were.
    pub(super) fn look(
        &mut self,
        graph: &Graph,
        roots: impl Iterator<Item = NodeId>,
        leaf: impl Fn(Op) -> f64,
        moving: &[bool],
    ) -> Vec<NodeId> {
        let (mut todo, mut seen): (Vec<NodeId>, Vec<(NodeId, u32)>) = (roots.collect(), Vec::new());
        while let Some(node) = todo.pop() {
            let looked = &mut self.looked[node.0 as usize];
            if *looked != self.instant {
                seen.push((node, *looked));
                *looked = self.instant;
                todo.extend(graph.op(node).operands());
            }
        }
        seen.sort_unstable();
        let mut flipped = Vec::new();
        for (node, looked) in seen {
            let at = node.0 as usize;
            let (was, is) = (self.facts[at], self.of(graph).look(node, &leaf, moving));
            let is_other = looked == 0 || !was.computes_like(&is);
            self.facts[at] = is;
            if is_other || was.live != is.live || self.rests_on_altered(graph, node) {
                self.altered[at] = self.instant;
            }
            if looked != 0 && is_other && graph.op(node).is_stepwise() {
                flipped.push(node);
            }
        }
        flipped
    }

    /// Whether something that can change `node` within the segment is altered.
    fn rests_on_altered(&self, graph: &Graph, node: NodeId) -> bool {
        let fact = self.facts[node.0 as usize];
        (fact.feels_time || fact.feels_state) && self.of(graph).influences(node).any(|n| self.is_altered(n))
    }
}

impl Fact {
    /// Whether a tape computes both alike.
    fn computes_like(&self, other: &Fact) -> bool {
        self.varies == other.varies
            && self.same == other.same
            && (self.varies || self.now.to_bits() == other.now.to_bits())
    }
}

impl Analysis<'_> {
    /// The operation.
    pub(super) fn op(&self, node: NodeId) -> Op {
        self.graph.op(node)
    }

    /// The operations that a value is computed from within the segment; none where it is a leaf, or does not change.
    pub(super) fn below(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        // What is solved rests on its arguments themselves, not on their list.
        let (operands, args) = match self.graph.op(node) {
            _ if !self.varies(node) => (None, &[][..]),
            Op::Solved(call, _) => (None, &self.graph.call(call).args[..]),
            op => (Some(op.operands()), &[][..]),
        };
        operands.into_iter().flatten().chain(args.iter().copied()).map(|operand| self.same(operand))
    }

    /// The operation that has the value of this one throughout the segment.
    pub(super) fn same(&self, node: NodeId) -> NodeId {
        NodeId(self.fact(node).same)
    }

    /// The moving state that an operation is.
    pub(super) fn moving_state(&self, node: NodeId) -> Option<u32> {
        match self.graph.op(node) {
            Op::State(state) if self.varies(node) => Some(state),
            _ => None,
        }
    }

    fn fact(&self, node: NodeId) -> Fact {
        self.facts[node.0 as usize]
    }

    fn look(&self, node: NodeId, leaf: impl Fn(Op) -> f64, moving: &[bool]) -> Fact {
        let op = self.graph.op(node);
        let mut fact = Fact { same: node.0, live: self.live(op), ..Fact::default() };
        match op {
            Op::Time => (fact.varies, fact.feels_time) = (true, true),
            Op::State(s) if moving[s as usize] => (fact.varies, fact.feels_state) = (true, true),
            Op::Unary(kind, a) => {
                fact.rest_on(self.fact(a));
                fact.varies &= !kind.is_stepwise();
            }
            Op::Binary(kind, a, b) => {
                let (a, b) = (self.fact(a), self.fact(b));
                fact.rest_on(a);
                fact.rest_on(b);
                fact.varies &= !op.is_comparison() && !decided(kind, a) && !decided(kind, b);
            }
            Op::Select(..) | Op::List(..) | Op::Solved(..) => {
                op.operands().for_each(|operand| fact.rest_on(self.fact(operand)));
            }
            _ => {}
        }
        if let Some(other) = self.passes_on(op) {
            let other = self.fact(other);
            (fact.now, fact.varies, fact.same) = (other.now, other.varies, other.same);
            return fact;
        }
        let settled = |a: NodeId, b: NodeId| !fact.varies && (self.fact(a).varies || self.fact(b).varies);
        fact.now = match op {
            Op::Unary(kind, a) => unary(kind, self.now(a)),
            Op::Binary(BinaryOp::Mul, a, b) if settled(a, b) => 0.0,
            Op::Binary(kind, a, b) => binary(kind, self.now(a), self.now(b)),
            Op::Select(c, a, b) => self.now(if self.now(c) != 0.0 { a } else { b }),
            Op::List(a, b) => digest(self.now(a), self.now(b)),
            Op::Solved(call, _) => self.graph.call(call).value(|arg| self.now(arg)),
            other => leaf(other),
        };
        fact
    }

    /// The operand whose value this operation has throughout the segment.
    fn passes_on(&self, op: Op) -> Option<NodeId> {
        let is = |n: NodeId, v: f64| !self.fact(n).varies && self.fact(n).now == v;
        match op {
            Op::Select(c, a, b) if !self.fact(c).varies => Some(if self.fact(c).now != 0.0 { a } else { b }),
            Op::Binary(BinaryOp::Add | BinaryOp::Sub, a, b) if is(b, 0.0) => Some(a),
            Op::Binary(BinaryOp::Add, a, b) if is(a, 0.0) => Some(b),
            Op::Binary(BinaryOp::Mul | BinaryOp::Div, a, b) if is(b, 1.0) => Some(a),
            Op::Binary(BinaryOp::Mul, a, b) if is(a, 1.0) => Some(b),
            _ => None,
        }
    }

    /// The value when it was last looked at: of what does not vary, and of what goes in jumps, that is its value now.
    pub(super) fn now(&self, node: NodeId) -> f64 {
        self.fact(node).now
    }

    /// Whether it changes with the time or with a state that moves, at least by a comparison.
    pub(super) fn feels(&self, node: NodeId) -> bool {
        let fact = self.fact(node);
        fact.feels_time || fact.feels_state
    }

    /// Whether the value is 0 throughout the segment.
    pub(super) fn is_zero(&self, node: NodeId) -> bool {
        !self.fact(node).varies && self.fact(node).now == 0.0
    }

    /// The moving states that values rest on, ascending.
    pub(super) fn states_below(&self, nodes: &[NodeId]) -> Vec<u32> {
        let state = |i: usize| self.moving_state(NodeId(i as u32));
        let mut states: Vec<u32> = self.needed(nodes).into_iter().filter_map(state).collect();
        states.sort_unstable();
        states
    }

    /// Whether the value changes within the segment.
    pub(super) fn varies(&self, node: NodeId) -> bool {
        self.fact(node).varies
    }

    /// The comparisons and whole numbers that may change and whose change `roots` would notice, in order.
    pub(super) fn switches(&self, roots: impl IntoIterator<Item = NodeId>) -> Vec<NodeId> {
        let scratch = &mut *self.scratch.borrow_mut();
        scratch.begin(self.facts.len());
        let mut found = Vec::new();
        let mut todo: Vec<NodeId> = roots.into_iter().collect();
        while let Some(node) = todo.pop() {
            let fact = self.fact(node);
            if !(fact.feels_time || fact.feels_state) || !scratch.is_new(node.0 as usize) {
                continue;
            }
            found.extend(Some(node).filter(|n| self.graph.op(*n).is_stepwise()));
            todo.extend(self.influences(node));
        }
        found.sort_unstable();
        found
    }

    /// The operands that can change `node` while the others stay.
    fn influences(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        let live = self.fact(node).live;
        self.graph.op(node).operands().enumerate().filter(move |(i, _)| live & (1 << i) != 0).map(|(_, n)| n)
    }

    /// The same, a bit each: what a false condition hides is left out.
    fn live(&self, op: Op) -> u8 {
        match op {
            Op::Select(c, ..) if !self.fact(c).varies => {
                if self.now(c) != 0.0 {
                    0b011
                } else {
                    0b101
                }
            }
            Op::Binary(kind, a, _) if decided(kind, self.fact(a)) => 0b01,
            Op::Binary(kind, _, b) if decided(kind, self.fact(b)) => 0b10,
            _ => 0b111,
        }
    }

    /// The number as a clock, if it is one.
    pub(super) fn clock(&self, node: NodeId) -> Option<Clock> {
        if !self.fact(node).varies {
            return Some(Clock::standing(self.now(node)));
        }
        let node = NodeId(self.fact(node).same);
        match self.graph.op(node) {
            Op::Time => Some(Clock { rate: 1.0, offset: 0.0 }),
            Op::Unary(UnaryOp::Neg, a) => self.clock(a).map(|c| Clock { rate: -c.rate, offset: -c.offset }),
            Op::Binary(BinaryOp::Add, a, b) => {
                let (a, b) = (self.clock(a)?, self.clock(b)?);
                Some(Clock { rate: a.rate + b.rate, offset: a.offset + b.offset })
            }
            Op::Binary(BinaryOp::Sub, a, b) => {
                let (a, b) = (self.clock(a)?, self.clock(b)?);
                Some(Clock { rate: a.rate - b.rate, offset: a.offset - b.offset })
            }
            _ => None,
        }
    }

    /// The terms of a sum, with whole numbers as factors.
    fn terms(&self, node: NodeId, factor: f64, out: &mut Vec<(f64, NodeId)>) {
        let node = NodeId(self.fact(node).same);
        let whole = |n: NodeId| {
            let Fact { varies, now, .. } = self.fact(n);
            (!varies && now.fract() == 0.0 && (now * factor).abs() <= LARGEST_FACTOR).then_some(now * factor)
        };
        match self.graph.op(node) {
            _ if !self.fact(node).varies || out.len() >= MOST_TERMS => out.push((factor, node)),
            Op::Binary(BinaryOp::Add, a, b) => {
                self.terms(a, factor, out);
                self.terms(b, factor, out);
            }
            Op::Binary(BinaryOp::Sub, a, b) => {
                self.terms(a, factor, out);
                self.terms(b, -factor, out);
            }
            Op::Unary(UnaryOp::Neg, a) => self.terms(a, -factor, out),
            Op::Binary(BinaryOp::Mul, a, b) => match (whole(a), whole(b)) {
                (Some(factor), _) => self.terms(b, factor, out),
                (_, Some(factor)) => self.terms(a, factor, out),
                _ => out.push((factor, node)),
            },
            _ => out.push((factor, node)),
        }
    }

    /// A term as a multiple of one of `fluxes`, if it is: the heat of a reaction of what the reaction turns over.
    fn multiple(&self, (factor, node): (f64, NodeId), fluxes: &[NodeId]) -> (f64, NodeId) {
        let Op::Binary(BinaryOp::Mul, a, b) = self.graph.op(node) else { return (factor, node) };
        for (constant, flux) in [(a, b), (b, a)] {
            let flux = NodeId(self.fact(flux).same);
            if factor.abs() == 1.0 && !self.fact(constant).varies && fluxes.binary_search(&flux).is_ok() {
                return (factor * self.fact(constant).now, flux);
            }
        }
        (factor, node)
    }

    /// The tape that computes rates of change: as [`Analysis::tape`], but sums of many terms are as good as exact, so that
    /// what one state loses others gain to the last digit.
    pub(super) fn rates(&self, outputs: &[NodeId], moving: &[u32]) -> Tape {
        let mut all: Vec<Vec<(f64, NodeId)>> = Vec::new();
        for &output in outputs {
            let mut terms = Vec::new();
            self.terms(output, 1.0, &mut terms);
            all.push(terms);
        }
        let mut fluxes: Vec<NodeId> = all.iter().flatten().map(|t| t.1).collect();
        fluxes.sort_unstable();
        fluxes.dedup();
        let sums = all.into_iter().map(|mut terms| {
            for term in &mut terms {
                *term = self.multiple(*term, &fluxes);
            }
            let plain = terms.len() < 2 || (terms.len() == 2 && terms.iter().all(|t| t.0.abs() == 1.0));
            if plain { Vec::new() } else { terms }
        });
        let sums: Vec<_> = sums.collect();
        let summed = outputs.iter().zip(&sums).flat_map(|(&output, terms)| match terms.as_slice() {
            [] => vec![output],
            terms => terms.iter().map(|t| t.1).collect(),
        });
        let roots: Vec<NodeId> = summed.collect();
        let mut tape = self.tape(&roots, moving);
        let registers = std::mem::take(&mut tape.outputs);
        let mut next = registers.into_iter();
        for terms in sums {
            let output = if terms.is_empty() {
                next.next()
            } else {
                let first = tape.terms.len() as u32;
                let terms = terms.iter().zip(&mut next);
                tape.terms.extend(terms.map(|(&(factor, _), register)| Term { factor, register }));
                tape.steps.push(Step::Sum(first, tape.terms.len() as u32 - first));
                Some((tape.first_result() + tape.steps.len() - 1) as u32)
            };
            tape.outputs.extend(output);
        }
        tape
    }

    /// The tape that computes `outputs`; `moving` lists the moving states in the order of its inputs.
    pub(super) fn tape(&self, outputs: &[NodeId], moving: &[u32]) -> Tape {
        let needed = self.needed(outputs);
        let mut tape = Tape { inputs: moving.len(), ..Tape::default() };
        let mut scratch = self.scratch.borrow_mut();
        let place = &mut scratch.place;
        let mut known = BTreeMap::new();
        for i in needed.iter().copied().filter(|&i| !self.facts[i].varies) {
            place[i] = *known.entry(self.facts[i].now.to_bits()).or_insert_with(|| {
                tape.constants.push(self.facts[i].now);
                tape.constants.len() as u32 - 1
            });
        }
        for i in needed.into_iter().filter(|&i| self.facts[i].varies) {
            let at = |n: NodeId| place[self.same(n).0 as usize];
            let step = match self.graph.op(NodeId(i as u32)) {
                Op::Unary(op, a) => Step::Unary(op, at(a)),
                Op::Binary(op, a, b) => Step::Binary(op, at(a), at(b)),
                Op::Select(c, a, b) => Step::Select(at(c), at(a), at(b)),
                Op::Solved(call, _) => {
                    let call = self.graph.call(call);
                    let args = call.args.iter().map(|arg| at(*arg)).collect();
                    tape.calls.push(Call { system: call.system.clone(), part: call.part, args });
                    Step::Solved(tape.calls.len() as u32 - 1)
                }
                Op::State(s) => {
                    let position = moving.partition_point(|&m| m < s);
                    place[i] = (tape.time() + 1 + position) as u32;
                    continue;
                }
                _ => {
                    place[i] = tape.time() as u32;
                    continue;
                }
            };
            place[i] = (tape.first_result() + tape.steps.len()) as u32;
            tape.steps.push(step);
        }
        tape.outputs = outputs.iter().map(|&n| place[self.same(n).0 as usize]).collect();
        tape
    }

    /// The operations that `outputs` are computed from, by index, in order.
    fn needed(&self, outputs: &[NodeId]) -> Vec<usize> {
        let scratch = &mut *self.scratch.borrow_mut();
        scratch.begin(self.facts.len());
        let mut needed = Vec::new();
        let mut todo: Vec<NodeId> = outputs.iter().map(|&n| self.same(n)).collect();
        while let Some(node) = todo.pop() {
            let i = node.0 as usize;
            if scratch.is_new(i) {
                needed.push(i);
                todo.extend(self.below(node));
            }
        }
        needed.sort_unstable();
        needed
    }
}

/// Whether an operand alone settles the result for the segment.
fn decided(kind: BinaryOp, operand: Fact) -> bool {
    !operand.varies
        && match kind {
            BinaryOp::And | BinaryOp::Mul => operand.now == 0.0,
            BinaryOp::Or => operand.now != 0.0,
            _ => false,
        }
}
