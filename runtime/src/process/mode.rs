//! The law of a segment, taken apart: states that depend on each other move together, apart from all others.
//!
//! What parts have in common rests within the segment: the room, a set point, a block that is switched off. So a beaker on one
//! hotplate has nothing to do with one on another, and a part whose law is the same after a discontinuity elsewhere goes on as if
//! nothing had happened (ARCHITECTURE.md, "Simulation").

use std::collections::BTreeMap;

use matterix_ir::graph::Env;
use matterix_ir::model::{Derivative, Model};
use matterix_ir::{NodeId, Op};

use super::analysis::Analysis;
use super::switch::Switches;
use super::tape::Tape;

/// A state that does not move is in no part.
pub(super) const NOWHERE: u32 = u32::MAX;

/// The law of one segment.
#[derive(Clone, Debug)]
pub(super) struct Mode {
    pub(super) pieces: Vec<Piece>,
    /// By state, the piece that moves it, or [`NOWHERE`].
    pub(super) piece_of: Vec<u32>,
    /// Comparisons of the model that rest on several pieces, or on none.
    pub(super) across: Vec<Group>,
}

/// States that move together.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Ascending.
    pub(super) moving: Vec<u32>,
    /// Their derivatives.
    pub(super) rates: Tape,
    /// What the model's own conditions depend on and only these states decide.
    pub(super) own: Group,
}

/// Comparisons that rest on the same pieces.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Ascending; none where they follow the time alone.
    pub(super) pieces: Vec<u32>,
    /// The states they rest on, ascending.
    pub(super) states: Vec<u32>,
    pub(super) switches: Switches,
}

impl Group {
    /// No comparison at all.
    fn none() -> Group {
        Group { pieces: Vec::new(), states: Vec::new(), switches: Switches::none() }
    }
}

/// The expressions of the model that decide how it evolves.
#[derive(Clone, Debug)]
pub(super) struct Law {
    roots: Vec<NodeId>,
    schedule: Vec<NodeId>,
    /// Whether locals or readings stand in them.
    pub(super) listens: bool,
}

impl Law {
    /// Collects derivatives, guards and event conditions of `model`, and the conditions `kept` that must hold all the time.
    pub(super) fn new(model: &Model, kept: impl IntoIterator<Item = NodeId>) -> Self {
        let rates = model.derivatives.iter().map(|d| d.rate);
        let guards = model.processes.iter().filter_map(|p| p.guard);
        let events = model.events.iter().map(|e| e.when);
        let roots: Vec<NodeId> = rates.chain(guards).chain(events).chain(kept).collect();
        let schedule = model.graph.schedule(roots.iter().copied());
        let listens = schedule.iter().any(|&n| matches!(model.graph.op(n), Op::Local(_) | Op::Reading(_)));
        Law { roots, schedule, listens }
    }

    /// The mode that holds from the instant `env` on.
    pub(super) fn mode(&self, model: &Model, env: Env<'_>) -> Mode {
        let mut marked = vec![false; model.states.len()];
        for derivative in &model.derivatives {
            marked[derivative.state as usize] = true;
        }
        loop {
            let analysis = Analysis::new(&model.graph, &self.schedule, env, &marked);
            let resting = |d: &&Derivative| marked[d.state as usize] && analysis.is_zero(d.rate);
            let rest: Vec<u32> = model.derivatives.iter().filter(resting).map(|d| d.state).collect();
            if rest.is_empty() {
                return self.fix(model, &analysis, &marked, env.time);
            }
            for state in rest {
                marked[state as usize] = false;
            }
        }
    }

    fn fix(&self, model: &Model, analysis: &Analysis<'_>, marked: &[bool], time: f64) -> Mode {
        let mut laws: Vec<(u32, NodeId)> = model.derivatives.iter().map(|d| (d.state, d.rate)).collect();
        laws.retain(|(state, _)| marked[*state as usize]);
        laws.sort_unstable();
        let mut piece_of = vec![NOWHERE; marked.len()];
        let mut pieces = Vec::new();
        for laws in together(analysis, &laws, marked.len()) {
            let (moving, rates): (Vec<u32>, Vec<NodeId>) = laws.into_iter().unzip();
            moving.iter().for_each(|&state| piece_of[state as usize] = pieces.len() as u32);
            let rates = analysis.rates(&rates, &moving);
            pieces.push(Piece { moving, rates, own: Group::none() });
        }
        let nodes = analysis.switches(self.roots.iter().copied());
        let mut across = groups(model, analysis, &nodes, &piece_of, time);
        for group in across.extract_if(.., |group| group.pieces.len() == 1) {
            let piece = group.pieces[0] as usize;
            pieces[piece].own = group;
        }
        Mode { pieces, piece_of, across }
    }
}

/// Laws whose states rest on each other, each list by state, in the order of their first states.
fn together(analysis: &Analysis<'_>, laws: &[(u32, NodeId)], states: usize) -> Vec<Vec<(u32, NodeId)>> {
    // Union by the lesser state: the root of a tree is the first state of its piece.
    let mut above: Vec<u32> = (0..states as u32).collect();
    fn root(above: &mut [u32], mut state: u32) -> u32 {
        while above[state as usize] != state {
            above[state as usize] = above[above[state as usize] as usize];
            state = above[state as usize];
        }
        state
    }
    for &(state, rate) in laws {
        for other in analysis.states_below(&[rate]) {
            let (a, b) = (root(&mut above, state), root(&mut above, other));
            above[a.max(b) as usize] = a.min(b);
        }
    }
    let mut found: BTreeMap<u32, Vec<(u32, NodeId)>> = BTreeMap::new();
    for &law in laws {
        found.entry(root(&mut above, law.0)).or_default().push(law);
    }
    found.into_values().collect()
}

/// Comparisons by the pieces that they rest on; those that cannot change as they are now are left out.
fn groups(model: &Model, analysis: &Analysis<'_>, nodes: &[NodeId], piece_of: &[u32], time: f64) -> Vec<Group> {
    let ops = model.graph.ops();
    let mut found: BTreeMap<Vec<u32>, (Vec<NodeId>, Vec<u32>)> = BTreeMap::new();
    for &node in nodes {
        let Op::Binary(_, a, b) = ops[node.0 as usize] else { continue };
        if !(analysis.varies(a) || analysis.varies(b)) {
            continue;
        }
        let states = analysis.states_below(&[a, b]);
        let mut pieces: Vec<u32> = states.iter().map(|s| piece_of[*s as usize]).collect();
        pieces.sort_unstable();
        pieces.dedup();
        let group = found.entry(pieces).or_default();
        group.0.push(node);
        group.1.extend(states);
    }
    let group = |(pieces, (nodes, mut states)): (Vec<u32>, (Vec<NodeId>, Vec<u32>))| {
        states.sort_unstable();
        states.dedup();
        let switches = Switches::new(analysis, ops, &nodes, &states, time);
        Group { pieces, states, switches }
    };
    found.into_iter().map(group).collect()
}

/// The comparisons that `nodes` depend on while the states move that are in a piece.
pub(super) fn watched(model: &Model, nodes: &[NodeId], piece_of: &[u32], env: Env<'_>) -> Vec<Group> {
    if nodes.is_empty() {
        return Vec::new();
    }
    let marked: Vec<bool> = piece_of.iter().map(|piece| *piece != NOWHERE).collect();
    let schedule = model.graph.schedule(nodes.iter().copied());
    let analysis = Analysis::new(&model.graph, &schedule, env, &marked);
    groups(model, &analysis, &analysis.switches(nodes.iter().copied()), piece_of, env.time)
}
