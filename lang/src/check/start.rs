//! The values with which a run begins: one that is no number would end the run before its first step.

use std::collections::BTreeSet;

use matterix_ir::undefined::{undefined, why};
use matterix_ir::{Diagnostic, Leaves, NodeId, Op, Span, codes};

use crate::eval::lab::Elaborator;

/// Reports the first contents of each thing at the start for which equilibria have no solution.
pub fn unsolved(lab: &mut Elaborator<'_>) {
    // Without equilibria there is nothing to solve, and no initial value to look at.
    if lab.tables.equilibria.is_empty() {
        return;
    }
    let mut looked_at: BTreeSet<NodeId> = BTreeSet::new();
    let mut found: Vec<(Span, Diagnostic)> = Vec::new();
    for (key, state) in &lab.extensive {
        let initial = lab.states[*state as usize].initial;
        let is_known = !lab.graph.leaves(initial).meets(Leaves::LIVE);
        if !is_known || matches!(lab.graph.op(initial), Op::Const(_) | Op::Param(_)) || !looked_at.insert(initial) {
            continue;
        }
        if lab.glance(initial).is_none_or(f64::is_finite) {
            continue;
        }
        let Some(operation) = undefined(&lab.graph, initial, &mut |node| lab.glance(node)) else { continue };
        if !matches!(lab.graph.op(operation), Op::Solved(..)) {
            continue;
        }
        let whole = &lab.instances[lab.outermost(key.instance).0 as usize];
        if found.iter().any(|(span, _)| *span == whole.span) {
            continue;
        }
        let headline = format!("`{}` has no equilibrium at the start: {}", whole.name, why(&lab.graph, operation));
        let d = Diagnostic::error(codes::NOT_A_NUMBER, whole.span, headline, "holds this at the start")
            .help("the run would end before its first step: change what it holds, or leave out the equilibria that cannot hold together");
        found.push((whole.span, d));
    }
    found.into_iter().for_each(|(_, d)| lab.report(d));
}
