//! What of all that moves rests on each other, while what does not move is as it is: a beaker on one hotplate has nothing to do with one on
//! another. Where something is changed, what has nothing to do with it keeps the bounds that were found before.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};
use rustc_hash::FxHashSet;

use super::Interpreter;
use super::evolve::InvariantBox;
use super::state::AbstractState;

/// What a derivative has to do with others.
#[derive(Clone, Debug, Default)]
pub(super) struct Ties {
    /// Derivatives of the states that it rests on.
    rests_on: Vec<u32>,
    /// Fluxes of matter that may go on in it.
    fluxes: Vec<usize>,
}

impl Interpreter<'_, '_> {
    /// The derivatives whose bounds for all time to come still hold, with what they have to do with others: nothing with any that may
    /// have changed since.
    pub(super) fn unaffected(&mut self, known: &InvariantBox, facts: &AbstractState) -> BTreeMap<u32, Rc<Ties>> {
        let moved: BTreeMap<u32, u32> =
            known.states.keys().filter_map(|state| Some((self.derivative_of(*state)?, *state))).collect();
        let mut changed = facts.unsettled.clone();
        changed.extend(facts.moving.iter().filter(|i| !moved.contains_key(i)));
        changed.extend(moved.iter().filter(|(_, state)| !known.contains(**state, facts)).map(|(i, _)| *i));
        if let Some(bonds) = &facts.bonds {
            let states: Vec<u32> = bonds.loose(facts).collect();
            changed.extend(states.iter().filter_map(|state| self.derivative_of(*state)));
        }
        let mut ties = BTreeMap::new();
        for i in changed.iter().chain(moved.keys()) {
            let of = known.ties.get(i).filter(|_| !changed.contains(i)).cloned();
            ties.insert(*i, of.unwrap_or_else(|| Rc::new(self.ties(*i, facts))));
        }
        let affected = together(&ties, &changed);
        ties.retain(|i, _| moved.contains_key(i) && facts.moving.contains(i) && !affected.contains(i));
        ties
    }

    /// What a derivative has to do with others as things are.
    pub(super) fn ties(&mut self, derivative: u32, facts: &AbstractState) -> Ties {
        let stoichiometry = self.stoichiometry();
        let row = stoichiometry.rows.get(derivative as usize).cloned().flatten();
        let mut fluxes = Vec::new();
        for (flux, _) in row.iter().flat_map(|row| &row.fluxes) {
            let of = &stoichiometry.fluxes[*flux];
            if self.may_go(of, facts) && !self.is_shut(of.rate, facts) {
                fluxes.push(*flux);
            }
        }
        Ties { rests_on: self.rests_on(derivative, facts), fluxes }
    }

    /// The derivatives of the states on which a derivative rests, whatever these are: what is multiplied by nothing does not count, nor
    /// does the branch that a condition leaves out, as far as nothing that moves decides that.
    fn rests_on(&mut self, derivative: u32, facts: &AbstractState) -> Vec<u32> {
        let mut todo = vec![self.derivatives[derivative as usize].rate];
        let mut seen = FxHashSet::default();
        let mut found = BTreeSet::new();
        while let Some(node) = todo.pop() {
            if !self.moves(node) || !seen.insert(node) || self.is_shut(node, facts) {
                continue;
            }
            match self.lab.graph.op(node) {
                Op::State(state) => found.extend(self.derivative_of(state)),
                Op::Reading(reading) => todo.push(self.lab.readings[reading as usize].value),
                Op::Select(when, a, b) => match self.settled_truth(when, facts) {
                    Some(holds) => todo.push(if holds { a } else { b }),
                    None => todo.extend([when, a, b]),
                },
                Op::Solved(call, _) => todo.extend(self.lab.graph.call(call).args.iter().copied()),
                op => todo.extend(op.operands()),
            }
        }
        found.into_iter().collect()
    }

    /// Whether an operation is nothing for as long as what does not move stays as it is: a flow through a valve that is shut.
    fn is_shut(&mut self, node: NodeId, facts: &AbstractState) -> bool {
        match self.lab.graph.op(node) {
            _ if !self.moves(node) => self.eval(node, facts).exact() == Some(0.0),
            Op::Binary(BinaryOp::Mul, a, b) => self.is_shut(a, facts) || self.is_shut(b, facts),
            Op::Binary(BinaryOp::Div, a, _) | Op::Unary(UnaryOp::Neg, a) => self.is_shut(a, facts),
            Op::Select(when, a, b) => match self.settled_truth(when, facts) {
                Some(holds) => self.is_shut(if holds { a } else { b }, facts),
                None => false,
            },
            _ => false,
        }
    }

    /// How a condition comes out for as long as what does not move stays as it is.
    fn settled_truth(&mut self, when: NodeId, facts: &AbstractState) -> Option<bool> {
        if self.moves(when) { None } else { self.eval(when, facts).truth() }
    }

    /// The derivative of a state, if a law moves it.
    pub(super) fn derivative_of(&self, state: u32) -> Option<u32> {
        self.led.get(&state).copied()
    }

    /// Whether time or a law may move what a node is.
    fn moves(&mut self, node: NodeId) -> bool {
        if self.nodes.moving.is_empty() {
            self.nodes.moving = self.all_moving();
        }
        self.nodes.moving[node.0 as usize]
    }

    /// By node, whether time or a law may move it.
    fn all_moving(&mut self) -> Vec<bool> {
        let graph = &self.lab.graph;
        let mut all: Vec<bool> = Vec::with_capacity(graph.ops().len());
        for op in graph.ops() {
            // Operands have smaller numbers.
            let moves = match *op {
                Op::Time | Op::Local(_) | Op::Reading(_) => true,
                Op::State(state) => self.led.contains_key(&state),
                _ => op.operands().any(|a| all[a.0 as usize]),
            };
            all.push(moves);
        }
        all
    }
}

/// Whether any of some derivatives has to do with any of others.
pub(super) fn are_tied(some: &BTreeMap<u32, Rc<Ties>>, others: &BTreeMap<u32, Rc<Ties>>) -> bool {
    let all = others.iter().chain(some).map(|(i, ties)| (*i, ties.clone())).collect();
    together(&all, &some.keys().copied().collect()).iter().any(|i| others.contains_key(i))
}

/// All that has to do with any of these, by what each rests on and the fluxes of matter that it shares.
fn together(ties: &BTreeMap<u32, Rc<Ties>>, these: &BTreeSet<u32>) -> BTreeSet<u32> {
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut sharing: BTreeMap<usize, u32> = BTreeMap::new();
    for (i, of) in ties {
        let shared = of.fluxes.iter().map(|flux| *sharing.entry(*flux).or_insert(*i));
        for j in of.rests_on.iter().copied().filter(|j| ties.contains_key(j)).chain(shared).filter(|j| j != i) {
            next.entry(*i).or_default().push(j);
            next.entry(j).or_default().push(*i);
        }
    }
    let mut found = these.clone();
    let mut todo: Vec<u32> = these.iter().copied().collect();
    while let Some(i) = todo.pop() {
        todo.extend(next.get(&i).into_iter().flatten().copied().filter(|j| found.insert(*j)));
    }
    found
}
