//! What must be known before anything moves: who carries out each step, and what its conditions are judged by.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::codes::Code;
use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Plan, PlanStep, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, Program, Span, codes};

use super::alike::alike;
use super::device::{Carrier, Device};
use super::observe::Observed;
use super::unbound::{key, lines, teller};

/// Findings about a plan on these devices.
pub fn preflight(program: &Program, devices: &[Device<'_>], observed: &Observed) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut untold: BTreeMap<InstanceId, Vec<(Span, &str)>> = BTreeMap::new();
    let mut unasked: BTreeMap<InstanceId, Vec<(Span, &str)>> = BTreeMap::new();
    for (id, step) in reachable(&program.plan) {
        let node = program.plan.get(id);
        if let Step::Operation(operation) = step
            && carrier(id, operation, devices).is_none()
        {
            match key(program, devices, id, operation) {
                Some(key) => untold.entry(key).or_default().push((node.span, &node.label)),
                None => found.push(undriven(program, node.span, &node.label, operation, devices)),
            }
        }
        for (value, span, text) in judged(node) {
            let (told, supposed) = observed.asks(&program.model, value);
            match teller(program, devices, value) {
                _ if !supposed => {}
                Some(key) => unasked.entry(key).or_default().push((span, text)),
                None => found.push(unobserved(!told.is_empty(), span, text)),
            }
        }
    }
    // A device that is told nothing is not asked either.
    unasked.retain(|key, _| !untold.contains_key(key));
    found.extend(untold.into_iter().map(|(key, places)| not_bound(program, key, places, codes::UNDRIVEN)));
    found.extend(unasked.into_iter().map(|(key, places)| not_bound(program, key, places, codes::UNOBSERVED)));
    found.extend(alike(devices));
    let mut seen = BTreeSet::new();
    found.retain(|d| seen.insert((d.code.name, d.span(), d.headline.clone())));
    found
}

/// What a step is decided by: nodes, with their places and texts.
fn judged(node: &PlanStep) -> Vec<(NodeId, Span, &str)> {
    match &node.step {
        Step::WaitUntil { condition, .. }
        | Step::Hold { condition, .. }
        | Step::Keep { condition, .. }
        | Step::If { condition, .. }
        | Step::RepeatWhile { condition, .. } => vec![(condition.node, condition.span, &condition.text)],
        Step::During { invariants, .. } => invariants.iter().map(|c| (c.node, c.span, &*c.text)).collect(),
        Step::Let { value, .. } => vec![(*value, node.span, &node.label)],
        _ => Vec::new(),
    }
}

/// What devices are asked for in the course of a plan: nodes that a driver has a reading of.
pub(super) fn asked_for(program: &Program, observed: &Observed) -> BTreeSet<NodeId> {
    let nodes = reachable(&program.plan).into_iter().flat_map(|(id, _)| looked_at(program.plan.get(id)));
    nodes.flat_map(|node| observed.asks(&program.model, node).0).collect()
}

/// The nodes whose values a step asks for.
fn looked_at(node: &PlanStep) -> Vec<NodeId> {
    let judged = judged(node).into_iter().map(|(node, ..)| node);
    let more: Vec<NodeId> = match &node.step {
        Step::Expect(conditions) => conditions.iter().map(|c| c.node).collect(),
        Step::Record { value, .. } => value.clone(),
        Step::Note(text) | Step::Ask(text) | Step::Fail { text, .. } => text.nodes().collect(),
        Step::Operation(operation) => {
            let needs = operation.needs.iter().map(|c| c.node);
            needs.chain(operation.at_start.iter().chain(&operation.at_end).map(Action::source)).collect()
        }
        _ => Vec::new(),
    };
    judged.chain(more).collect()
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
pub(super) fn reachable(plan: &Plan) -> Vec<(StepId, &Step)> {
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

/// A device that the workflow uses and the bindings do not have, at the first place that needs it.
fn not_bound(program: &Program, key: InstanceId, mut at: Vec<(Span, &str)>, code: Code) -> Diagnostic {
    let name = &program.scene.get(key).name;
    at.sort();
    at.dedup_by_key(|(span, _)| *span);
    let (span, text) = at.first().copied().unwrap_or_default();
    let (what, who) = match code == codes::UNDRIVEN {
        true => (format!("no device carries out `{text}`"), "no device receives"),
        false => (format!("no device reports the values in `{text}`"), "no device is asked for"),
    };
    let label = match at.len() {
        0 | 1 => format!("{who} this"),
        2 => format!("{who} this; the same at another place"),
        n => format!("{who} this; the same at {} other places", n - 1),
    };
    let headline = format!("{what}: `{name}` has no binding");
    Diagnostic::error(code, span, headline, label).help(lines(program, key))
}

fn undriven(program: &Program, span: Span, label: &str, operation: &Operation, devices: &[Device<'_>]) -> Diagnostic {
    let name = operation.device.map(|id| program.scene.get(id).name.as_str());
    let bound = devices.iter().find(|d| Some(d.binding.instance) == operation.device);
    let headline = match (name, bound.and_then(|d| d.driver)) {
        (Some(name), Some(driver)) => {
            format!(
                "`{name}` cannot carry out `{label}`: its driver `{}` has no line for `{}`",
                driver.name, operation.verb
            )
        }
        (Some(name), None) => format!("no device carries out `{label}`: `{name}` has no line"),
        (None, _) => format!("no device carries out `{label}`"),
    };
    let d = Diagnostic::error(codes::UNDRIVEN, span, headline, "no device receives this");
    d.help("add a line to its driver, or let a person do it: `by = \"hand\"` in the bindings")
}

fn unobserved(is_partly_told: bool, span: Span, text: &str) -> Diagnostic {
    let headline = format!("no device reports the values in `{text}`");
    let mut d = Diagnostic::error(codes::UNOBSERVED, span, headline, "only the model has these values");
    if is_partly_told {
        d = d.help("devices report only some of these values");
    }
    d.help("wait for a value that a device reports (a `reading` line of its driver), or for a fixed time")
}
