//! Other numbers of the workflow's parameters: a branch that a default does not take may go wrong, leave a device on, or throw away
//! what is used later. The plan is followed once more for each side of a condition on a parameter that has only its default.

use std::collections::BTreeMap;

use matterix_ir::plan::{Plan, Step, StepId};
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Severity, Span, codes};

use super::value::AbstractValue;
use super::{Interpreter, forbidden_on_any_way};
use crate::eval::lab::Elaborator;

/// So many steps are followed for other values; at least [`FEWEST_VALUES`] are tried.
const MOST_STEPS: usize = 400_000;

/// So many other values are tried however long the plan is.
const FEWEST_VALUES: usize = 8;

/// Another value of a parameter.
pub struct Other {
    pub param: u32,
    pub value: f64,
    /// Blocks that are done with it and not with the default.
    done: Vec<Span>,
}

/// Values of parameters that take the other side of a branch.
pub fn other_values(flow: &mut Interpreter<'_, '_>) -> Vec<Other> {
    let mut out: Vec<Other> = Vec::new();
    for (node, sides) in branches(flow.plan) {
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
                let kept = std::mem::replace(&mut flow.params[param as usize], AbstractValue::point(*value));
                let truth = flow.eval(node, &facts).truth();
                flow.params[param as usize] = kept;
                truth.is_some() && truth != usual
            };
            let Some(value) = around(limit, default).into_iter().find(flips) else { continue };
            let done =
                sides.iter().filter_map(|(then, otherwise)| if usual == Some(true) { *otherwise } else { *then });
            let done = done.map(|block| flow.plan.get(block).span);
            match out.iter_mut().find(|other| other.param == param && other.value == value) {
                Some(other) => other.done.extend(done),
                None => out.push(Other { param, value, done: done.collect() }),
            }
        }
    }
    let most = (MOST_STEPS / flow.steps.max(1)).max(FEWEST_VALUES);
    if out.len() > most {
        let headline = format!("`check` tried only {most} of {} other values of the parameters", out.len());
        let text = "branches that only the other values take are not checked".to_owned();
        let span = flow.plan.get(flow.plan.root).span;
        flow.found(Diagnostic::warning(codes::NOT_ANALYSED, span, headline, text), span);
    }
    out.truncate(most);
    out
}

/// What goes wrong with another value of a parameter: what is never right, whatever the ways; what is done with that value only; what
/// is left on at the end.
pub fn said_of(lab: &Elaborator<'_>, other: &Other, found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let p = &lab.params[other.param as usize];
    let help = format!("this also happens with `{}` = {}", p.name, p.unit.show(other.value));
    let within = |span: Span| {
        other.done.iter().any(|block| block.file == span.file && block.start <= span.start && span.end <= block.end)
    };
    let tells = |d: &Diagnostic| {
        forbidden_on_any_way(d.code) || d.code == codes::UNFINISHED || d.is_error() && within(d.span())
    };
    let said = |mut d: Diagnostic| {
        if !forbidden_on_any_way(d.code) {
            d.severity = Severity::Warning;
        }
        d.help(help.clone())
    };
    found.into_iter().filter(tells).map(said).collect()
}

/// Both sides of a branch.
type Sides = (Option<StepId>, Option<StepId>);

/// The conditions of branches, with their sides.
fn branches(plan: &Plan) -> BTreeMap<NodeId, Vec<Sides>> {
    let mut out: BTreeMap<NodeId, Vec<Sides>> = BTreeMap::new();
    for step in &plan.steps {
        if let Step::If { condition, then, otherwise } = &step.step {
            out.entry(condition.node).or_default().push((Some(*then), *otherwise));
        }
    }
    out
}

/// The parameters with their defaults among these operations, each with a number it is compared with.
fn compared(flow: &Interpreter<'_, '_>, order: &[NodeId]) -> Vec<(u32, f64)> {
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

/// A limit and values on either side of it, whole ones between whole numbers.
fn around(limit: f64, default: f64) -> [f64; 3] {
    let whole = limit.fract() == 0.0 && default.fract() == 0.0;
    let largest = limit.abs().max(default.abs());
    let step = if whole || largest == 0.0 { 1.0 } else { 0.1 * largest };
    [limit, limit + step, limit - step]
}
