//! What must be known before anything moves: who carries out each step, and what its conditions are judged by.

use std::collections::BTreeSet;

use matterix_ir::plan::{Operation, Plan, Step, StepId};
use matterix_ir::{Diagnostic, NodeId, Program, Span, codes};

use super::device::{Carrier, Device};
use super::observe::Observed;

/// Findings about a plan on these devices.
pub fn preflight(program: &Program, devices: &[Device<'_>], observed: &Observed) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (id, step) in reachable(&program.plan) {
        let node = program.plan.get(id);
        match step {
            Step::Operation(operation) if carrier(id, operation, devices).is_none() => {
                found.push(undriven(program, node.span, &node.label, operation, devices));
            }
            Step::WaitUntil { condition, .. } | Step::Hold { condition, .. } | Step::Keep { condition, .. } => {
                found.extend(unobserved(program, observed, condition.node, condition.span, &condition.text));
            }
            Step::If { condition, .. } | Step::RepeatWhile { condition, .. } => {
                found.extend(unobserved(program, observed, condition.node, condition.span, &condition.text));
            }
            Step::During { invariants, .. } => {
                found.extend(invariants.iter().filter_map(|c| unobserved(program, observed, c.node, c.span, &c.text)))
            }
            Step::Let { value, .. } => found.extend(unobserved(program, observed, *value, node.span, &node.label)),
            _ => {}
        }
    }
    let mut seen = BTreeSet::new();
    found.retain(|d| seen.insert((d.code.name, d.span(), d.headline.clone())));
    found
}

/// The device that carries out an operation.
pub fn carrier(step: StepId, operation: &Operation, devices: &[Device<'_>]) -> Option<usize> {
    let by_line = devices.iter().position(|d| d.driver.is_some_and(|driver| driver.call(step).is_some()));
    let by_hand = || {
        let is_hand = |d: &&Device<'_>| d.binding.carrier == Carrier::Hand;
        let is_its = |d: &Device<'_>| {
            operation.device == Some(d.binding.instance) || operation.claims.contains(&d.binding.instance)
        };
        devices.iter().position(|d| is_hand(&d) && is_its(d))
    };
    by_line.or_else(by_hand)
}

/// The steps that a run may come to.
fn reachable(plan: &Plan) -> Vec<(StepId, &Step)> {
    let mut out = Vec::new();
    let mut open = vec![plan.root];
    while let Some(id) = open.pop() {
        let step = &plan.get(id).step;
        out.push((id, step));
        open.extend(step.children());
    }
    out.sort_by_key(|(id, _)| *id);
    out
}

fn undriven(program: &Program, span: Span, label: &str, operation: &Operation, devices: &[Device<'_>]) -> Diagnostic {
    let name = operation.device.map(|id| program.scene.get(id).name.as_str());
    let bound = devices.iter().find(|d| Some(d.binding.instance) == operation.device);
    let headline = match (name, bound.and_then(|d| d.driver)) {
        (Some(name), Some(driver)) => {
            format!(
                "`{label}` cannot be told to `{name}`: the driver `{}` has no line for `{}`",
                driver.name, operation.verb
            )
        }
        (Some(name), None) => format!("nothing carries out `{label}`: `{name}` is bound to no line"),
        (None, _) => format!("nothing carries out `{label}`"),
    };
    let d = Diagnostic::error(codes::UNDRIVEN, span, headline, "nobody is told");
    let d = d.help("add a line to its driver, or let a person do it: `by = \"hand\"` in the bindings");
    let offered: Vec<String> = program
        .drivers
        .iter()
        .filter(|d| Some(d.instance) == operation.device)
        .map(|d| format!("`{}`", d.name))
        .collect();
    if bound.is_none() && !offered.is_empty() { d.help(format!("it has the driver {}", offered.join(", "))) } else { d }
}

fn unobserved(program: &Program, observed: &Observed, node: NodeId, span: Span, text: &str) -> Option<Diagnostic> {
    let (told, supposed) = observed.asks(&program.model, node);
    if !supposed {
        return None;
    }
    let headline = format!("no device tells what `{text}` depends on");
    let mut d = Diagnostic::error(codes::UNOBSERVED, span, headline, "only the model knows it");
    if !told.is_empty() {
        d = d.help("a part of it is told, but not all");
    }
    Some(d.help("wait for something that a device tells (a `reading` line of its driver), or for a time"))
}
