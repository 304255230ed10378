//! `choose(condition, a, b)`: a number that a run picks, or anything at all where the condition is known before it.

use matterix_ir::{Diagnostic, Leaves, NodeId, Span, codes};

use super::{Decided, Num, Value};
use crate::eval::lab::Elaborator;

impl Elaborator<'_> {
    /// One of two values by a condition. Numbers are chosen in a run; other things before it, as what is done with them depends on which
    /// they are.
    pub fn choose(&mut self, c: NodeId, a: Value, b: Value, at: Span) -> Value {
        match (self.listed(a), self.listed(b)) {
            (Value::Error, _) | (_, Value::Error) => Value::Error,
            (Value::Num(a), Value::Num(b)) => self.choose_number(c, a, b, at),
            (Value::Bool(a), Value::Bool(b)) => Value::Bool(self.graph.select(c, a, b)),
            (Value::Tuple(a), Value::Tuple(b)) if a.len() == b.len() => {
                let pairs: Vec<_> = a.into_iter().zip(b).collect();
                Value::Tuple(pairs.into_iter().map(|(a, b)| self.choose(c, a, b, at)).collect())
            }
            (a, b) if is_instance(&a) && is_instance(&b) => self.choose_instance(c, a, b),
            (a, b) if a.what() == b.what() => self.choose_before_run(c, a, b, at),
            (a, b) => {
                let (x, y) = (a.what(), b.what());
                let headline = format!("both choices must be alike, not {x} and {y}");
                self.report(Diagnostic::error(codes::TYPE_MISMATCH, at, headline, "different things"));
                Value::Error
            }
        }
    }

    fn choose_number(&mut self, c: NodeId, a: Num, b: Num, at: Span) -> Value {
        if !a.dimension.agrees(&b.dimension) || (a.point != b.point && !a.dimension.is_any() && !b.dimension.is_any()) {
            let (x, y) = (self.describe(&a), self.describe(&b));
            self.report(Diagnostic::error(
                codes::UNIT_MISMATCH,
                at,
                format!("both choices must have the same dimension, not {x} and {y}"),
                "different dimensions",
            ));
            return Value::Error;
        }
        let node = self.graph.select(c, a.node, b.node);
        let dimension = if a.dimension.is_any() { b.dimension } else { a.dimension };
        Value::Num(Num { node, dimension, point: a.point || b.point, unit: a.unit, literal: false })
    }

    /// An instance: the one that it is where that is known, else one known when running.
    fn choose_instance(&mut self, c: NodeId, a: Value, b: Value) -> Value {
        match self.before_run(c) {
            Decided::Now(truth) => return if truth != 0.0 { a } else { b },
            // Either may come; a stand-in shows what both can do.
            Decided::Later if self.prototype && !self.graph.leaves(c).meets(Leaves::LIVE) => {
                return if a == Value::Nothing { b } else { a };
            }
            Decided::Later if !self.prototype => return Value::Error,
            Decided::Later | Decided::ByRun => {}
        }
        let (Some(a), Some(b)) = (self.value_node(&a), self.value_node(&b)) else { return Value::Error };
        Value::InstanceNode(self.graph.select(c, a, b))
    }

    fn choose_before_run(&mut self, c: NodeId, a: Value, b: Value, at: Span) -> Value {
        match self.before_run(c) {
            Decided::Now(truth) => {
                if truth != 0.0 {
                    a
                } else {
                    b
                }
            }
            Decided::Later if self.prototype => a,
            Decided::Later => Value::Error,
            Decided::ByRun => {
                let headline = format!("which of two this is must be known before the run: {} cannot change", a.what());
                let d = Diagnostic::error(codes::TYPE_MISMATCH, at, headline, "chosen during the run");
                self.report(d.help(BY_IF));
                Value::Error
            }
        }
    }
}

/// A thing that only the run knows, where it must be known before; `what` names it.
pub fn known_too_late(what: &str, at: Span) -> Diagnostic {
    let headline = format!("{what} must be known before the run");
    Diagnostic::error(codes::UNSUPPORTED, at, headline, "only the run knows which thing this is").help(BY_IF)
}

/// What to write in place of a choice during the run.
const BY_IF: &str = "name it directly; to choose by a measured value, use `if` with the step in each branch";

/// Whether a value is an instance, or none, known now or when running.
fn is_instance(value: &Value) -> bool {
    matches!(value, Value::Instance(_) | Value::Qualified(..) | Value::InstanceNode(_) | Value::Nothing)
}
