//! What holds for the length of one segment: which states move, by which law, and which comparisons may end it.

use matterix_ir::graph::Env;
use matterix_ir::model::Model;
use matterix_ir::{NodeId, Op};

use super::analysis::Analysis;
use super::switch::Switches;
use super::tape::Tape;

/// The law of one segment.
#[derive(Clone, Debug)]
pub(super) struct Mode {
    /// The states that change, ascending.
    pub(super) moving: Vec<u32>,
    /// Their derivatives.
    pub(super) rates: Tape,
    /// What the model's own conditions depend on.
    pub(super) switches: Switches,
    /// What the limits depend on that may break.
    pub(super) limits: Switches,
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
    /// Collects derivatives, guards and event conditions of `model`.
    pub(super) fn new(model: &Model) -> Self {
        let rates = model.derivatives.iter().map(|d| d.rate);
        let guards = model.processes.iter().filter_map(|p| p.guard);
        let roots: Vec<NodeId> = rates.chain(guards).chain(model.events.iter().map(|e| e.when)).collect();
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
            let resting = |d: &&matterix_ir::model::Derivative| marked[d.state as usize] && analysis.is_zero(d.rate);
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
        let (moving, rates): (Vec<u32>, Vec<NodeId>) = laws.into_iter().unzip();
        let rates = analysis.rates(&rates, &moving);
        let switches = Switches::new(analysis, model.graph.ops(), self.roots.iter().copied(), &moving, time);
        Mode { moving, rates, switches, limits: Switches::none() }
    }
}

/// The comparisons that `nodes` depend on while `moving` change.
pub(super) fn watched(model: &Model, nodes: &[NodeId], moving: &[u32], env: Env<'_>) -> Switches {
    if nodes.is_empty() {
        return Switches::none();
    }
    let mut marked = vec![false; model.states.len()];
    for &state in moving {
        marked[state as usize] = true;
    }
    let schedule = model.graph.schedule(nodes.iter().copied());
    let analysis = Analysis::new(&model.graph, &schedule, env, &marked);
    Switches::new(&analysis, model.graph.ops(), nodes.iter().copied(), moving, env.time)
}
