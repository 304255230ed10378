//! Conditions that are asked for at every moment of a run: worked out again only where something that they rest on has changed.

use matterix_ir::values::{Formula, Formulas, Numbers};
use matterix_ir::{BinaryOp, Graph, NodeId, Op};

use crate::process::Engine;

/// A condition, as parts that must all hold.
#[derive(Clone)]
pub(super) struct Condition {
    node: NodeId,
    /// The shortest first.
    parts: Vec<Part>,
}

/// A part of a condition, as it came out last.
#[derive(Clone)]
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

#[cfg(test)]
mod tests {
    use matterix_ir::model::{Derivative, Domain, Model, State};
    use matterix_ir::{Span, UnaryOp, Unit};

    use super::*;
    use crate::process::Options;

    /// Two states: `x` rises by 1 every second from 0, `y` falls by 1 from 10.
    fn model() -> (Model, NodeId, NodeId) {
        let mut model = Model::default();
        let mut moving = |initial: f64, rate: f64| {
            let state = model.states.len() as u32;
            let (initial, rate) = (model.graph.number(initial), model.graph.number(rate));
            let domain = Domain::Quantity(Unit::one());
            let name = format!("s{state}");
            model.states.push(State { name, domain, initial, scale: Some(1.0), span: Span::default() });
            model.derivatives.push(Derivative::new(state, rate));
            model.graph.add(Op::State(state))
        };
        let (x, y) = (moving(0.0, 1.0), moving(10.0, -1.0));
        (model, x, y)
    }

    fn less(model: &mut Model, a: NodeId, than: f64) -> NodeId {
        let than = model.graph.number(than);
        model.graph.binary(BinaryOp::Lt, a, than)
    }

    fn both(model: &mut Model, a: NodeId, b: NodeId) -> NodeId {
        model.graph.binary(BinaryOp::And, a, b)
    }

    /// Whether a condition holds at each of these times, by its parts; and that the engine says the same.
    fn course(model: &Model, node: NodeId, times: &[f64]) -> Vec<bool> {
        let mut engine = Engine::new(model, Vec::new(), 0, Options::default()).expect("numbers");
        engine.start(&mut ()).expect("it starts");
        let (mut condition, mut room) = (Condition::new(&model.graph, &mut Formulas::default(), node), Vec::new());
        let look = |time: &f64| {
            engine.advance(*time, &[], &mut ()).expect("it goes on");
            let holds = condition.holds(&engine, &mut room);
            assert_eq!(holds, engine.truth(node), "at {time} s");
            assert_eq!(holds, condition.holds(&engine, &mut room), "asked again at {time} s");
            holds
        };
        times.iter().map(look).collect()
    }

    #[test]
    fn parts_that_change_at_different_times_hold_together_in_between() {
        let (mut model, x, y) = model();
        let (early, late) = (less(&mut model, x, 6.0), less(&mut model, y, 7.0));
        let node = both(&mut model, early, late);
        assert_eq!(course(&model, node, &[1.0, 4.0, 5.0, 8.0]), [false, true, true, false]);
    }

    #[test]
    fn nested_ands_are_parts_of_one() {
        let (mut model, x, y) = model();
        let (first, second, third) = (less(&mut model, x, 6.0), less(&mut model, y, 7.0), less(&mut model, y, 9.0));
        let inner = both(&mut model, first, second);
        let node = both(&mut model, inner, third);
        assert_eq!(Condition::new(&model.graph, &mut Formulas::default(), node).parts.len(), 3);
        assert_eq!(course(&model, node, &[0.5, 2.0, 4.0, 7.0]), [false, false, true, false]);
    }

    #[test]
    fn either_of_two_is_one_part() {
        let (mut model, x, y) = model();
        let (early, late) = (less(&mut model, x, 2.0), less(&mut model, y, 5.0));
        let node = model.graph.binary(BinaryOp::Or, early, late);
        assert_eq!(Condition::new(&model.graph, &mut Formulas::default(), node).parts.len(), 1);
        assert_eq!(course(&model, node, &[1.0, 3.0, 6.0]), [true, false, true]);
    }

    #[test]
    fn what_is_no_number_is_not_below_anything() {
        let (mut model, x, _) = model();
        let three = model.graph.number(3.0);
        let gap = model.graph.binary(BinaryOp::Sub, three, x);
        let root = model.graph.unary(UnaryOp::Sqrt, gap);
        let node = less(&mut model, root, 1.0);
        assert_eq!(course(&model, node, &[1.0, 2.5, 4.0]), [false, true, false]);
    }

    #[test]
    fn a_condition_of_constants_never_changes() {
        let (mut model, ..) = model();
        let one = model.graph.number(1.0);
        let node = less(&mut model, one, 2.0);
        assert_eq!(course(&model, node, &[0.0, 1.0]), [true, true]);
    }
}
