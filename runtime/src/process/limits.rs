//! Limits that things keep at all times: which of them what moves may break, and which are broken.

use std::collections::BTreeSet;

use matterix_ir::model::Model;
use matterix_ir::{BinaryOp, Graph, NodeId, Op, UnaryOp};

use super::Engine;
use super::index::Index;

/// A limit that depends on what moves is broken where it is passed by more than this share: ten times the relative error that
/// a step may have. So one that is only touched holds.
const SLACK: f64 = 1e-7;

/// A condition that must hold all the time, with what it rests on.
#[derive(Clone, Debug)]
struct Kept {
    /// Not 0 while it holds.
    node: NodeId,
    /// The states below it, ascending.
    states: Vec<u32>,
}

/// The limits of a plan, made ready for watching.
#[derive(Clone, Debug, Default)]
pub struct Keeps {
    kept: Vec<Kept>,
}

impl Keeps {
    /// These conditions; those that depend on what moves get operations of their own in the graph of `model`.
    pub fn new(model: &mut Model, conditions: impl IntoIterator<Item = NodeId>) -> Self {
        let mut moving = vec![false; model.states.len()];
        for derivative in model.derivatives.iter().filter(|d| model.graph.constant(d.rate) != Some(0.0)) {
            moving[derivative.state as usize] = true;
        }
        let mut keeps = Keeps::default();
        for condition in conditions {
            let mut kept = Kept { node: condition, states: Vec::new() };
            model.graph.visit(condition, |op| {
                if let Op::State(s) = op {
                    kept.states.push(s);
                }
            });
            kept.states.sort_unstable();
            if kept.states.iter().any(|&s| moving[s as usize]) {
                kept.node = with_slack(&mut model.graph, condition);
            }
            keeps.kept.push(kept);
        }
        keeps
    }

    /// The condition of a limit as it is judged.
    pub fn node(&self, limit: u32) -> Option<NodeId> {
        self.kept.get(limit as usize).map(|kept| kept.node)
    }

    /// The states that decide how those of a limit change: what their rates rest on, then what the rates of these rest on, and so
    /// on; at last those of the limit itself.
    pub fn decide(&self, model: &Model, limit: u32) -> Vec<Vec<u32>> {
        let own = self.kept.get(limit as usize).map(|kept| kept.states.clone()).unwrap_or_default();
        let mut seen: BTreeSet<u32> = own.iter().copied().collect();
        let (mut layers, mut last) = (Vec::new(), own.clone());
        while !last.is_empty() {
            let mut next = BTreeSet::new();
            for derivative in model.derivatives.iter().filter(|d| last.contains(&d.state)) {
                model.graph.visit(derivative.rate, |op| {
                    if let Op::State(s) = op {
                        next.insert(s);
                    }
                });
            }
            last = next.into_iter().filter(|s| seen.insert(*s)).collect();
            layers.push(last.clone());
        }
        layers.push(own);
        layers
    }
}

/// A condition whose comparisons hold up to [`SLACK`] beyond where they are met.
fn with_slack(graph: &mut Graph, node: NodeId) -> NodeId {
    match graph.op(node) {
        Op::Binary(op @ (BinaryOp::And | BinaryOp::Or), a, b) => {
            let (a, b) = (with_slack(graph, a), with_slack(graph, b));
            graph.binary(op, a, b)
        }
        Op::Binary(op @ (BinaryOp::Lt | BinaryOp::Le), a, b) => {
            let size = magnitude(graph, a, b);
            let share = graph.number(SLACK);
            let slack = graph.binary(BinaryOp::Mul, share, size);
            let most = graph.binary(BinaryOp::Add, b, slack);
            graph.binary(op, a, most)
        }
        _ => node,
    }
}

/// How large two values that are compared are: as large as the one that is fixed, or else the larger of both. Nothing in it turns round as
/// they move, as an absolute value would.
fn magnitude(graph: &mut Graph, a: NodeId, b: NodeId) -> NodeId {
    if let Some(fixed) = graph.constant(a).or(graph.constant(b)) {
        return graph.number(fixed.abs());
    }
    let mut size = |a: NodeId| {
        let opposite = graph.unary(UnaryOp::Neg, a);
        graph.binary(BinaryOp::Max, a, opposite)
    };
    let (a, b) = (size(a), size(b));
    graph.binary(BinaryOp::Max, a, b)
}

/// Where the limits of a run stand.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits<'m> {
    all: Option<&'m Keeps>,
    /// Whether each was broken when last looked at.
    broken: Vec<bool>,
    /// Those to look at before time goes on.
    pub(super) due: BTreeSet<u32>,
}

impl<'m> Engine<'m> {
    /// Watches these limits from now on.
    pub fn keep(&mut self, all: &'m Keeps) {
        let broken = vec![false; all.kept.len()];
        self.limits = Limits { all: Some(all), broken, ..Limits::default() };
        self.index = Index::new(self.model, all.kept.iter().map(|kept| kept.node));
        self.concern_all();
    }

    /// Notes whether a limit holds, as someone has just seen: what is known to be broken is not told again.
    pub fn note_limit(&mut self, limit: u32, holds: bool) {
        if let Some(broken) = self.limits.broken.get_mut(limit as usize) {
            *broken = !holds;
        }
    }

    /// The limits that did not hold when they were last looked at.
    pub fn broken_limits(&self) -> Vec<u32> {
        let all = self.limits.broken.iter().enumerate();
        all.filter(|(_, broken)| **broken).map(|(i, _)| i as u32).collect()
    }

    /// The limits that have been broken since they were last looked at.
    pub(super) fn newly_broken(&mut self) -> Vec<u32> {
        let due = std::mem::take(&mut self.limits.due);
        let mut found = Vec::new();
        for i in due {
            let Some(node) = self.limits.all.and_then(|all| all.node(i)) else { continue };
            let holds = self.truth(node) && !self.is_undecided(node);
            let before = std::mem::replace(&mut self.limits.broken[i as usize], !holds);
            if !holds && !before {
                found.push(i);
            }
        }
        found
    }
}
