//! What is known before the run of a number by which something is chosen: an element of a list, a place, one of two things, a branch.

use matterix_ir::{Diagnostic, NodeId, Op, Span, codes};

use crate::eval::lab::Elaborator;

/// What is known of a value while a plan is written out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decided {
    /// The value.
    Now(f64),
    /// A parameter that it depends on has no value yet.
    Later,
    /// It depends on the run.
    ByRun,
}

impl Elaborator<'_> {
    /// A value known before the run, if all parameters that it depends on have one.
    pub fn before_run(&self, node: NodeId) -> Decided {
        if let Some(value) = self.graph.constant(node) {
            return Decided::Now(value);
        }
        self.open.fix(&self.graph, node);
        let is_open = |n: NodeId| matches!(self.graph.op(n), Op::Param(i) if self.params[i as usize].value.is_nan());
        // Of a stand-in nothing is known yet.
        if self.prototype || self.graph.schedule([node]).into_iter().any(is_open) {
            return Decided::Later;
        }
        self.known(node).map_or(Decided::ByRun, Decided::Now)
    }

    /// The number by which something is chosen before the run; a report where only the run will know it.
    pub fn number_before_run(&mut self, node: NodeId, what: &str, at: Span) -> Decided {
        let decided = self.before_run(node);
        if decided == Decided::ByRun {
            let d = Diagnostic::error(
                codes::TYPE_MISMATCH,
                at,
                format!("{what} must be known before the run"),
                "depends on the run",
            );
            self.report(d.help("use a number, a parameter, a value of a table, or a `var` that counts"));
        }
        decided
    }
}
