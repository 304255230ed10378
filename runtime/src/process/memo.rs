//! Values of the graph at one instant, each computed once.

use matterix_ir::graph::{Env, eval_op};
use matterix_ir::{Graph, NodeId};

/// Remembers values until [`Memo::forget`].
#[derive(Clone, Debug, Default)]
pub(super) struct Memo {
    values: Vec<f64>,
    /// The round in which a value was computed.
    computed: Vec<u32>,
    round: u32,
    todo: Vec<NodeId>,
}

impl Memo {
    /// Room for every operation of `graph`.
    pub(super) fn new(graph: &Graph) -> Self {
        let size = graph.ops().len();
        Memo { values: vec![0.0; size], computed: vec![0; size], round: 1, todo: Vec::new() }
    }

    /// Forgets everything: the leaves have changed.
    pub(super) fn forget(&mut self) {
        self.round = self.round.wrapping_add(1);
        if self.round == 0 {
            self.computed.fill(0);
            self.round = 1;
        }
    }

    /// Takes `value` for `node` until it forgets.
    pub(super) fn pin(&mut self, node: NodeId, value: f64) {
        self.values[node.0 as usize] = value;
        self.computed[node.0 as usize] = self.round;
    }

    fn knows(&self, node: NodeId) -> bool {
        self.computed[node.0 as usize] == self.round
    }

    /// The value of `node`, the same as [`Graph::eval`] gives.
    pub(super) fn eval(&mut self, graph: &Graph, node: NodeId, env: Env<'_>) -> f64 {
        if !self.knows(node) {
            self.todo.push(node);
        }
        while let Some(&next) = self.todo.last() {
            let op = graph.op(next);
            let before = self.todo.len();
            for operand in op.operands() {
                if !self.knows(operand) {
                    self.todo.push(operand);
                }
            }
            if self.todo.len() == before {
                self.todo.pop();
                let value = eval_op(op, env, &self.values);
                self.pin(next, value);
            }
        }
        self.values[node.0 as usize]
    }
}
