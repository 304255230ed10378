//! Operations of the graph in the words of whoever wrote the laws: what fails, and the values of what it is made of.

use matterix_ir::listing::joined;
use matterix_ir::model::Domain;
use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp, Unit, undefined};

use super::Engine;

/// So many values are shown.
const MOST_VALUES: usize = 3;

impl Engine<'_> {
    /// Why an operation has no finite value now.
    pub(super) fn why(&self, operation: NodeId) -> String {
        let text = match self.model.graph.op(operation) {
            Op::Binary(BinaryOp::Div, _, b) if self.eval(b) == 0.0 => "a division by zero",
            Op::Unary(UnaryOp::Ln, _) => "the logarithm of 0 or of a negative number",
            Op::Unary(UnaryOp::Sqrt, _) => "the square root of a negative number",
            Op::Binary(BinaryOp::Pow, a, _) if self.eval(a) < 0.0 => "a power of a negative number",
            Op::Binary(BinaryOp::Pow, a, _) if self.eval(a) == 0.0 => "a division by zero",
            Op::Solved(..) => return undefined::why(&self.model.graph, operation),
            Op::Select(..) => "a table that is read outside its first and last point",
            Op::Local(_) | Op::Reading(_) => "a value that is not set yet",
            _ => "a number too large",
        };
        text.into()
    }

    /// The values that the operand rests on which an operation fails by: `` , where `drum.load` is 0 g ``; empty where none has a name.
    pub(super) fn values_below(&self, operation: NodeId) -> String {
        let operand = match self.model.graph.op(operation) {
            Op::Binary(BinaryOp::Div, _, b) if self.eval(b) == 0.0 => b,
            Op::Binary(BinaryOp::Pow, a, _) | Op::Unary(_, a) | Op::Select(a, ..) => a,
            _ => operation,
        };
        let mut values = Vec::new();
        self.collect(operand, &mut values);
        let shown: Vec<String> = values.into_iter().map(|(name, value)| format!("`{name}` is {value}")).collect();
        match shown.as_slice() {
            [] => String::new(),
            all => format!(", where {}", joined(all, "and")),
        }
    }

    /// What has a name at a node or below, and its value; not below what has one.
    fn collect(&self, node: NodeId, values: &mut Vec<(String, String)>) {
        if values.len() >= MOST_VALUES {
            return;
        }
        match self.named(node) {
            Some(found) if values.iter().any(|(name, _)| *name == found.0) => {}
            Some(found) => values.push(found),
            None => self.model.graph.op(node).operands().for_each(|operand| self.collect(operand, values)),
        }
    }

    /// What a node is called and its value, as shown.
    fn named(&self, node: NodeId) -> Option<(String, String)> {
        let model = self.model;
        let in_unit = |name: &str, unit: &Unit| Some((name.to_owned(), shown(unit, self.eval(node))));
        match model.graph.op(node) {
            Op::Const(_) => None,
            Op::Time => Some(("elapsed".to_owned(), shown(&Unit::scaled("s", 1.0), self.time))),
            Op::State(i) => {
                let state = model.states.get(i as usize)?;
                let Domain::Quantity(unit) = &state.domain else { return None };
                in_unit(&state.name, unit)
            }
            Op::Param(i) => model.params.get(i as usize).and_then(|p| in_unit(&p.name, &p.unit)),
            Op::Reading(i) => model.readings.get(i as usize).and_then(|r| in_unit(&r.name, &r.unit)),
            _ => model.observables.iter().find(|o| o.value == [node]).and_then(|o| in_unit(&o.name, &o.unit)),
        }
    }
}

fn shown(unit: &Unit, value: f64) -> String {
    if value.is_finite() { unit.show(value) } else { "no finite number".to_owned() }
}
