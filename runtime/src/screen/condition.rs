//! Conditions that are asked for at every moment of a run: worked out again only where something that they rest on has changed.

use matterix_ir::values::{Formula, Formulas, Numbers};
use matterix_ir::{BinaryOp, Graph, NodeId, Op};

use crate::process::Engine;

/// A condition, as parts that must all hold.
pub(super) struct Condition {
    node: NodeId,
    /// The shortest first.
    parts: Vec<Part>,
}

/// A part of a condition, as it came out last.
struct Part {
    formula: Formula,
    /// What it rests on that can change, with the values of then.
    leaves: Vec<(Op, f64)>,
    /// None before the first look.
    holds: Option<bool>,
}

impl Condition {
    /// A condition of a graph; `formulas` are those of the same graph.
    pub(super) fn new(graph: &Graph, formulas: &mut Formulas, node: NodeId) -> Condition {
        let mut parts = Vec::new();
        let mut todo = vec![node];
        while let Some(next) = todo.pop() {
            match graph.op(next) {
                Op::Binary(BinaryOp::And, a, b) => todo.extend([b, a]),
                _ => parts.push(Part::new(formulas.of(graph, next).clone())),
            }
        }
        parts.sort_by_key(|part| part.formula.ops().len());
        Condition { node, parts }
    }

    /// Whether it holds now; `room` is for values in between.
    pub(super) fn holds(&mut self, engine: &Engine<'_>, room: &mut Vec<f64>) -> bool {
        if engine.is_touching() {
            return engine.truth(self.node);
        }
        self.parts.iter_mut().all(|part| part.holds(engine, room))
    }
}

impl Part {
    fn new(formula: Formula) -> Part {
        let changes = |op: &&Op| matches!(op, Op::Time | Op::State(_) | Op::Local(_) | Op::Reading(_));
        let leaves = formula.ops().iter().filter(changes).map(|op| (*op, f64::NAN)).collect();
        Part { formula, leaves, holds: None }
    }

    fn holds(&mut self, engine: &Engine<'_>, room: &mut Vec<f64>) -> bool {
        let mut same = true;
        for (op, before) in &mut self.leaves {
            let now = engine.leaf(*op);
            same &= now.to_bits() == before.to_bits();
            *before = now;
        }
        match self.holds.filter(|_| same) {
            Some(holds) => holds,
            None => {
                let now = Numbers(|leaf| Some(engine.leaf(leaf)));
                let holds = self.formula.value(&now, room).is_some_and(|value| value != 0.0);
                *self.holds.insert(holds)
            }
        }
    }
}
