//! Values of the graph at one instant, each computed once, and again only where what it depends on has changed: of a
//! deck with hundreds of wells a step changes two.

use matterix_ir::graph::apply;
use matterix_ir::{Graph, NodeId, Op};

use super::index::Lists;

/// The value of an operation without operands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub(super) value: f64,
    /// Whether it is another one as soon as time passes.
    pub(super) flows: bool,
}

/// Remembers values until their leaves change.
#[derive(Clone, Debug, Default)]
pub(super) struct Memo {
    values: Vec<f64>,
    /// Whether the value is that of the present leaves. Whoever uses an unknown value is unknown, or pinned.
    known: Vec<bool>,
    /// Known leaves that are others as soon as time passes.
    flowing: Vec<NodeId>,
    /// Values taken instead of computed.
    pinned: Vec<NodeId>,
    is_pinned: Vec<bool>,
    todo: Vec<NodeId>,
}

impl Memo {
    /// Room for every operation of `graph`.
    pub(super) fn new(graph: &Graph) -> Self {
        let size = graph.ops().len();
        let (values, known, is_pinned) = (vec![0.0; size], vec![false; size], vec![false; size]);
        Memo { values, known, is_pinned, ..Memo::default() }
    }

    /// Time has passed.
    pub(super) fn pass(&mut self, users: &Lists<NodeId>) {
        let flowing = std::mem::take(&mut self.flowing);
        self.change_all(users, &flowing);
    }

    /// Leaves have changed.
    pub(super) fn change_all(&mut self, users: &Lists<NodeId>, leaves: &[NodeId]) {
        leaves.iter().for_each(|leaf| self.change(users, *leaf));
    }

    /// A leaf has changed.
    pub(super) fn change(&mut self, users: &Lists<NodeId>, leaf: NodeId) {
        if !self.is_pinned[leaf.0 as usize] {
            self.lose(users, leaf);
        }
    }

    /// Takes values as they are computed again.
    pub(super) fn unpin(&mut self, users: &Lists<NodeId>) {
        for node in std::mem::take(&mut self.pinned) {
            self.is_pinned[node.0 as usize] = false;
            self.lose(users, node);
        }
    }

    /// Takes `value` for `node` from now on.
    pub(super) fn pin(&mut self, users: &Lists<NodeId>, node: NodeId, value: f64) {
        self.lose(users, node);
        self.pinned.push(node);
        self.is_pinned[node.0 as usize] = true;
        self.keep(node, value);
    }

    fn keep(&mut self, node: NodeId, value: f64) {
        self.values[node.0 as usize] = value;
        self.known[node.0 as usize] = true;
    }

    /// The value of `node`, and what follows from it, is not known any more.
    fn lose(&mut self, users: &Lists<NodeId>, node: NodeId) {
        self.known[node.0 as usize] = false;
        let before = self.todo.len();
        self.todo.push(node);
        while self.todo.len() > before {
            let Some(next) = self.todo.pop() else { return };
            for user in users.at(next.0 as usize) {
                let at = user.0 as usize;
                if self.known[at] && !self.is_pinned[at] {
                    self.known[at] = false;
                    self.todo.push(*user);
                }
            }
        }
    }

    /// The value of `node`, the same as [`Graph::eval`] gives.
    pub(super) fn eval(&mut self, graph: &Graph, node: NodeId, leaf: impl Fn(Op) -> Leaf) -> f64 {
        if !self.known[node.0 as usize] {
            self.todo.push(node);
        }
        while let Some(&next) = self.todo.last() {
            let op = graph.op(next);
            let before = self.todo.len();
            for operand in op.operands() {
                if !self.known[operand.0 as usize] {
                    self.todo.push(operand);
                }
            }
            if self.todo.len() == before {
                self.todo.pop();
                let at = |o: NodeId| self.values[o.0 as usize];
                let value = match op {
                    Op::Solved(call, _) => graph.call(call).value(at),
                    op if op.operands().next().is_some() => apply(op, |_| f64::NAN, at),
                    op => self.take(next, leaf(op)),
                };
                self.keep(next, value);
            }
        }
        self.values[node.0 as usize]
    }

    fn take(&mut self, node: NodeId, leaf: Leaf) -> f64 {
        if leaf.flows {
            self.flowing.push(node);
        }
        leaf.value
    }
}
