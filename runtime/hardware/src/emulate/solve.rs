//! Which arguments of a command a message gives: its templates solved for them.

use matterix_ir::model::Action;
use matterix_ir::plan::Operation;
use matterix_ir::wire::Served;
use matterix_ir::{NodeId, Op};
use matterix_runtime::process::Engine;

use crate::template::Found;

/// Sets the arguments of a command as the values in its messages say; false where they do not fit each other.
pub fn solve(served: &Served, found: &[Found], engine: &mut Engine<'_>) -> bool {
    let mut open: Vec<u32> = served.arguments.iter().map(|(_, local)| *local).collect();
    let mut rest: Vec<&Found> = found.iter().collect();
    while !rest.is_empty() {
        let free =
            |f: &Found| locals(f.node, &served.operation, engine).into_iter().filter(|l| open.contains(l)).collect();
        let next = rest.iter().position(|f| {
            let free: Vec<u32> = free(f);
            free.len() <= 1
        });
        let Some(at) = next else { return false };
        let one = rest.remove(at);
        let free: Vec<u32> = free(one);
        let fits = match free.first() {
            None => {
                let value = value(one.node, &served.operation, engine);
                (value - one.value).abs() <= one.precision * (1.0 + 1e-9) + 1e-12 * one.value.abs()
            }
            Some(local) => {
                open.retain(|l| l != local);
                straight(one, *local, &served.operation, engine)
            }
        };
        if !fits {
            return false;
        }
    }
    open.is_empty()
}

/// Solves for one argument what is straight in it.
fn straight(found: &Found, local: u32, operation: &Operation, engine: &mut Engine<'_>) -> bool {
    let mut at = |x: f64| {
        engine.set_local(local, x);
        value(found.node, operation, engine)
    };
    let (zero, one) = (at(0.0), at(1.0));
    let slope = one - zero;
    if !slope.is_finite() || slope == 0.0 {
        return false;
    }
    let x = (found.value - zero) / slope;
    let back = at(x);
    (back - found.value).abs() <= found.precision.max(1e-9 * found.value.abs()) + 1e-12
}

/// The value of a node when the command has begun.
fn value(node: NodeId, operation: &Operation, engine: &Engine<'_>) -> f64 {
    let mut states = engine.states().to_vec();
    for action in &operation.at_start {
        let Action::Assign { state, value, .. } = action else { continue };
        let value = engine.eval_with(*value, &states);
        if let Some(slot) = states.get_mut(*state as usize) {
            *slot = value;
        }
    }
    engine.eval_with(node, &states)
}

/// The locals that a node depends on, through what the command sets.
fn locals(node: NodeId, operation: &Operation, engine: &Engine<'_>) -> Vec<u32> {
    let graph = &engine.model().graph;
    let mut out = Vec::new();
    let mut open = vec![node];
    let mut seen = Vec::new();
    while let Some(node) = open.pop() {
        if seen.contains(&node) {
            continue;
        }
        seen.push(node);
        for n in graph.schedule([node]) {
            match graph.op(n) {
                Op::Local(l) => out.push(l),
                Op::State(s) => open.extend(operation.at_start.iter().filter_map(|a| match a {
                    Action::Assign { state, value, .. } if *state == s => Some(*value),
                    _ => None,
                })),
                _ => {}
            }
        }
    }
    out.sort_unstable();
    out.dedup();
    out
}
