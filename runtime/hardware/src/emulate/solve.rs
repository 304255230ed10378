//! Which arguments of a command a message gives: its templates solved for them.

use matterix_ir::wire::Served;
use matterix_ir::{NodeId, Op};
use matterix_runtime::process::Engine;

use crate::template::Found;

/// Sets the arguments of a command as the values in its messages say; false where they do not fit each other.
pub fn solve(served: &Served, found: &[Found], engine: &mut Engine<'_>) -> bool {
    let mut open: Vec<u32> = served.arguments.iter().map(|(_, local)| *local).collect();
    let mut rest: Vec<&Found> = found.iter().collect();
    while !rest.is_empty() {
        let free = |f: &Found| locals(f.node, engine).into_iter().filter(|l| open.contains(l)).collect();
        let next = rest.iter().position(|f| {
            let free: Vec<u32> = free(f);
            free.len() <= 1
        });
        let Some(at) = next else { return false };
        let one = rest.remove(at);
        let free: Vec<u32> = free(one);
        let fits = match free.first() {
            None => {
                let value = engine.eval(one.node);
                one.fits(value)
            }
            Some(local) => {
                open.retain(|l| l != local);
                straight(one, *local, engine)
            }
        };
        if !fits {
            return false;
        }
    }
    open.is_empty()
}

/// Where a line is laid through what depends on one argument: some have another meaning at zero, such as the usual rate.
const POINTS: [(f64, f64); 2] = [(0.0, 1.0), (1.0, 2.0)];

/// Solves for one argument what is straight in it, beside zero or with it.
fn straight(found: &Found, local: u32, engine: &mut Engine<'_>) -> bool {
    let mut at = |x: f64| {
        engine.set_local(local, x);
        engine.eval(found.node)
    };
    POINTS.into_iter().any(|(near, far)| {
        let (first, second) = (at(near), at(far));
        let slope = (second - first) / (far - near);
        if !slope.is_finite() || slope == 0.0 {
            return false;
        }
        let x = near + (found.value - first) / slope;
        (at(x) - found.value).abs() <= found.precision.max(1e-9 * found.value.abs()) + 1e-12
    })
}

/// The locals that a node depends on.
fn locals(node: NodeId, engine: &Engine<'_>) -> Vec<u32> {
    let graph = &engine.model().graph;
    let local = |n: NodeId| match graph.op(n) {
        Op::Local(l) => Some(l),
        _ => None,
    };
    let mut out: Vec<u32> = graph.schedule([node]).into_iter().filter_map(local).collect();
    out.sort_unstable();
    out.dedup();
    out
}
