//! Other values of the workflow's parameters: a branch that a default does not take may still throw away what is used
//! later. The plan is followed once more for each side of a condition on a parameter that has only its default.

use std::collections::BTreeSet;

use matterix_ir::plan::{Plan, Step};
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, codes};

use super::value::Known;
use super::{Flow, forbidden_on_any_way};
use crate::elaborate::Elaborator;

/// So many steps are followed for other values; at least [`FEWEST_VALUES`] are tried.
const MOST_STEPS: usize = 400_000;

/// So many other values are tried however long the plan is.
const FEWEST_VALUES: usize = 8;

/// Values of parameters, by index, that take the other side of a branch.
pub fn other_values(flow: &mut Flow<'_, '_>) -> Vec<(u32, f64)> {
    let mut out: Vec<(u32, f64)> = Vec::new();
    for node in branches(flow.plan) {
        let parts = flow.parts(node);
        if !parts.states.is_empty() || parts.timed {
            continue;
        }
        let facts = flow.start();
        let usual = flow.eval(node, &facts).truth();
        let order = flow.order(node);
        for (param, limit) in compared(flow, &order) {
            let default = flow.lab.params[param as usize].value;
            let flips = |value: &f64| {
                let kept = std::mem::replace(&mut flow.params[param as usize], Known::point(*value));
                let truth = flow.eval(node, &facts).truth();
                flow.params[param as usize] = kept;
                truth.is_some() && truth != usual
            };
            let other = around(limit, default).into_iter().find(flips);
            out.extend(other.map(|v| (param, v)).filter(|new| !out.contains(new)));
        }
    }
    let most = (MOST_STEPS / flow.steps.max(1)).max(FEWEST_VALUES);
    if out.len() > most {
        let headline = format!("{most} of {} other values of the parameters are tried", out.len());
        let text = "use after disposal is not checked for the others".to_owned();
        let span = flow.plan.get(flow.plan.root).span;
        flow.found(Diagnostic::warning(codes::NOT_ANALYSED, span, headline, text), span);
    }
    out.truncate(most);
    out
}

/// What is never right, whatever the ways, with another value of a parameter.
pub fn said_of(lab: &Elaborator<'_>, param: u32, value: f64, found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let p = &lab.params[param as usize];
    let help = format!("so it is with `{}` at {}", p.name, p.unit.show(value));
    found.into_iter().filter(|d| forbidden_on_any_way(d.code)).map(|d| d.help(help.clone())).collect()
}

/// The conditions of branches.
fn branches(plan: &Plan) -> BTreeSet<NodeId> {
    let conditions = plan.steps.iter().filter_map(|s| match &s.step {
        Step::If { condition, .. } => Some(condition.node),
        _ => None,
    });
    conditions.collect()
}

/// The parameters with their defaults among these operations, each with a number it is compared with.
fn compared(flow: &Flow<'_, '_>, order: &[NodeId]) -> Vec<(u32, f64)> {
    let graph = &flow.lab.graph;
    let mut out = Vec::new();
    for node in order {
        let Op::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq, a, b) = graph.op(*node) else { continue };
        for (x, y) in [(a, b), (b, a)] {
            let (Op::Param(p), Some(limit)) = (graph.op(x), graph.constant(y)) else { continue };
            if flow.lab.defaulted.contains(&p) {
                out.push((p, limit));
            }
        }
    }
    out
}

/// Values on either side of a limit, whole ones between whole numbers.
fn around(limit: f64, default: f64) -> [f64; 3] {
    let whole = limit.fract() == 0.0 && default.fract() == 0.0;
    let largest = limit.abs().max(default.abs());
    let step = if whole || largest == 0.0 { 1.0 } else { 0.1 * largest };
    [limit + step, limit - step, limit]
}
