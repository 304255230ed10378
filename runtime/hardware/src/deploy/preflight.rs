//! What must be known before anything moves: who carries out each step, and what its conditions are judged by.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Operation, Plan, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, Program, Span, codes};

use super::device::{Carrier, Device};
use super::observe::Observed;
use super::unbound::{key, lines};

/// Findings about a plan on these devices.
pub fn preflight(program: &Program, devices: &[Device<'_>], observed: &Observed) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut unbound: BTreeMap<InstanceId, Vec<StepId>> = BTreeMap::new();
    for (id, step) in reachable(&program.plan) {
        let node = program.plan.get(id);
        match step {
            Step::Operation(operation) if carrier(id, operation, devices).is_none() => {
                if let Some(key) = key(program, devices, id, operation) {
                    unbound.entry(key).or_default().push(id);
                    continue;
                }
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
    found.extend(unbound.into_iter().map(|(key, steps)| not_bound(program, key, &steps)));
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

/// A device that the workflow uses and the bindings do not have, at the first step that needs it.
fn not_bound(program: &Program, key: InstanceId, steps: &[StepId]) -> Diagnostic {
    let name = &program.scene.get(key).name;
    let mut at: Vec<(Span, &str)> = steps.iter().map(|id| program.plan.get(*id)).map(|n| (n.span, &*n.label)).collect();
    at.sort();
    at.dedup_by_key(|(span, _)| *span);
    let (span, label) = at.first().copied().unwrap_or_default();
    let headline = format!("nothing carries out `{label}`: the bindings do not say where `{name}` is");
    let told = match at.len() {
        0 | 1 => "nobody is told".to_owned(),
        2 => "nobody is told this, nor at another place".to_owned(),
        n => format!("nobody is told this, nor at {} other places", n - 1),
    };
    Diagnostic::error(codes::UNDRIVEN, span, headline, told).help(lines(program, key))
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
    d.help("add a line to its driver, or let a person do it: `by = \"hand\"` in the bindings")
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
