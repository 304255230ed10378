//! Values of the graph at one instant, each computed once, and again only where what it depends on has changed: of a
//! deck with hundreds of wells a step changes two.

use matterix_ir::graph::{Env, eval_op};
use matterix_ir::{Graph, NodeId, Op};

/// Remembers values until [`Memo::forget`].
#[derive(Clone, Debug, Default)]
pub(super) struct Memo {
    values: Vec<f64>,
    /// Whether the value is that of the present leaves. Whoever uses an unknown value is unknown, or pinned.
    known: Vec<bool>,
    /// Operations without operands whose value can change.
    leaves: Vec<NodeId>,
    /// Who uses an operation: `users[first[n] .. first[n + 1]]`.
    first: Vec<u32>,
    users: Vec<NodeId>,
    /// Values taken instead of computed.
    pinned: Vec<NodeId>,
    is_pinned: Vec<bool>,
    /// The leaves may have changed.
    stale: bool,
    todo: Vec<NodeId>,
}

impl Memo {
    /// Room for every operation of `graph`.
    pub(super) fn new(graph: &Graph) -> Self {
        let ops = graph.ops();
        let size = ops.len();
        let mut first = vec![0; size + 1];
        for op in ops {
            op.operands().for_each(|o| first[o.0 as usize + 1] += 1);
        }
        for i in 0..size {
            first[i + 1] += first[i];
        }
        let mut next = first.clone();
        let mut users = vec![NodeId(0); first[size] as usize];
        for (i, op) in ops.iter().enumerate() {
            for operand in op.operands() {
                let slot = &mut next[operand.0 as usize];
                users[*slot as usize] = NodeId(i as u32);
                *slot += 1;
            }
        }
        let changes = |n: &NodeId| matches!(graph.op(*n), Op::Time | Op::State(_) | Op::Local(_) | Op::Reading(_));
        let leaves = (0..size as u32).map(NodeId).filter(changes).collect();
        let (values, known, is_pinned) = (vec![0.0; size], vec![false; size], vec![false; size]);
        let (pinned, todo) = (Vec::new(), Vec::new());
        Memo { values, known, leaves, first, users, pinned, is_pinned, stale: true, todo }
    }

    /// The leaves may have changed; pins are taken out.
    pub(super) fn forget(&mut self) {
        self.stale = true;
        for node in std::mem::take(&mut self.pinned) {
            self.is_pinned[node.0 as usize] = false;
            self.lose(node);
        }
    }

    /// Takes `value` for `node` until it forgets.
    pub(super) fn pin(&mut self, node: NodeId, value: f64) {
        self.lose(node);
        self.pinned.push(node);
        self.is_pinned[node.0 as usize] = true;
        self.keep(node, value);
    }

    fn keep(&mut self, node: NodeId, value: f64) {
        self.values[node.0 as usize] = value;
        self.known[node.0 as usize] = true;
    }

    /// The value of `node`, and what follows from it, is not known any more.
    fn lose(&mut self, node: NodeId) {
        self.known[node.0 as usize] = false;
        let before = self.todo.len();
        self.todo.push(node);
        while self.todo.len() > before {
            let Some(next) = self.todo.pop() else { return };
            let (from, to) = (self.first[next.0 as usize] as usize, self.first[next.0 as usize + 1] as usize);
            for user in &self.users[from..to] {
                let at = user.0 as usize;
                if self.known[at] && !self.is_pinned[at] {
                    self.known[at] = false;
                    self.todo.push(*user);
                }
            }
        }
    }

    /// Takes the present leaves; what follows from those that changed is lost.
    fn refresh(&mut self, graph: &Graph, env: Env<'_>) {
        self.stale = false;
        for i in 0..self.leaves.len() {
            let leaf = self.leaves[i];
            let at = leaf.0 as usize;
            let value = eval_op(graph.op(leaf), env, &[]);
            if self.is_pinned[at] || (self.known[at] && self.values[at].to_bits() == value.to_bits()) {
                continue;
            }
            self.lose(leaf);
            self.keep(leaf, value);
        }
    }

    /// The value of `node`, the same as [`Graph::eval`] gives.
    pub(super) fn eval(&mut self, graph: &Graph, node: NodeId, env: Env<'_>) -> f64 {
        if self.stale {
            self.refresh(graph, env);
        }
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
                let value = eval_op(op, env, &self.values);
                self.keep(next, value);
            }
        }
        self.values[node.0 as usize]
    }
}
