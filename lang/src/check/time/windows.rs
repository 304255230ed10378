//! S1: windows, timeouts and promises that no run can keep, with the steps whose time adds up.

use std::collections::BTreeSet;

use matterix_ir::plan::{Plan, StepId};
use matterix_ir::quantity::show_duration;
use matterix_ir::{Diagnostic, Severity, codes};
use matterix_timing::network::{BEGIN, WHOLE};
use matterix_timing::{Edge, Network, Scope, Timing, Why};

use super::{expected, show};

/// Contradictions at most; the first ones are what a reader mends.
const MOST: usize = 50;

/// The contradictions, and the network without what is contradicted.
pub(super) fn findings(plan: &Plan, timing: &Timing) -> (Vec<Diagnostic>, Network) {
    let mut network = timing.network.clone();
    let mut found = Vec::new();
    let limited = network.edges.iter().filter(|e| limit(e).is_some()).map(|e| e.scope);
    let scopes: BTreeSet<Scope> = std::iter::once(WHOLE).chain(limited).collect();
    for scope in scopes {
        while let Err(cycle) = network.least_from(BEGIN, &[scope]) {
            // The last limit of the cycle gives way, so that what else is wrong shows.
            let Some(blamed) = cycle.iter().rev().find(|e| limit(e).is_some()).or(cycle.first()).copied() else {
                break;
            };
            network.edges.retain(|e| *e != blamed);
            if limit(&blamed).is_some() && found.len() < MOST {
                found.push(finding(plan, timing, &cycle, &blamed));
            }
        }
    }
    (found, network)
}

/// A limit that someone set, s.
fn limit(edge: &Edge) -> Option<f64> {
    let set = matches!(edge.reason.why, Why::Window(_) | Why::Timeout(_) | Why::Promised(_));
    (set && edge.weight <= 0.0).then_some(-edge.weight)
}

fn finding(plan: &Plan, timing: &Timing, cycle: &[Edge], blamed: &Edge) -> Diagnostic {
    let step = blamed.reason.step;
    let node = plan.get(step);
    let spent: f64 = cycle.iter().filter(|e| e.weight > 0.0).map(|e| e.weight).sum();
    let (spent, allowed) = (show_duration(spent), show_duration(-blamed.weight));
    let (code, headline, label, failure) = match blamed.reason.why {
        Why::Timeout(_) => (
            codes::WINDOW_UNMEETABLE,
            format!("`{}` always times out: it takes at least {spent}", node.label),
            format!("waits at most {allowed}"),
            "timeout",
        ),
        Why::Promised(_) => (
            codes::TAKES_CONTRADICTED,
            format!("the steps of `{}` take at least {spent}, but its bounds allow at most {allowed}", node.label),
            "outside its bounds".to_owned(),
            "promise",
        ),
        _ => (
            codes::WINDOW_UNMEETABLE,
            format!("`{}` always starts too late: at least {spent} pass before it", node.label),
            format!("must start within {allowed}"),
            "late",
        ),
    };
    let own = show::own(plan, timing, step);
    let mut d = Diagnostic::error(code, plan.get(own).span, headline, label);
    if blamed.scope != WHOLE || expected(plan, timing, step, failure) {
        d.severity = Severity::Warning;
    }
    for (step, seconds, why) in causes(plan, timing, cycle, own) {
        let time = show_duration(seconds);
        let text = match why {
            Why::NotBefore(_) => format!("starts only after {time}"),
            _ => format!("takes at least {time}"),
        };
        d = d.because(plan.get(step).span, text);
    }
    let help = match blamed.reason.why {
        Why::Timeout(_) => "allow a longer timeout, or wait for less",
        Why::Promised(_) => "widen the bounds in `takes`, or change the steps",
        _ => "allow more time, or move the long steps before or after the window",
    };
    d.help(help)
}

/// The steps of the workflow whose time adds up, in the order of the text.
fn causes(plan: &Plan, timing: &Timing, cycle: &[Edge], blamed: StepId) -> Vec<(StepId, f64, Why)> {
    let mut sums: Vec<(StepId, f64, Why)> = Vec::new();
    for edge in cycle.iter().filter(|e| e.weight > 0.0) {
        let own = show::own(plan, timing, edge.reason.step);
        match sums.iter_mut().find(|s| s.0 == own) {
            Some(sum) => sum.1 += edge.weight,
            None => sums.push((own, edge.weight, edge.reason.why)),
        }
    }
    sums.retain(|s| s.0 != blamed);
    sums.sort_by_key(|s| plan.get(s.0).span);
    sums
}
