//! Lineage: which reagents the matter in a mixture came from and its walls have touched. It travels with every
//! transfer and stays when the matter leaves, until the walls are rinsed.
//!
//! States are made only where a law or a clause asks for them, and only for the reagents that can get there.

use matterix_ir::model::{Action, Domain, Event, State};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, NodeId, Op, Span, UnaryOp};

use super::Elaborator;

impl Elaborator<'_> {
    /// Whether a mixture has touched a reagent; absent where that reagent cannot get there.
    pub fn touched(&mut self, mixture: InstanceId, origin: &str) -> Option<NodeId> {
        if let Some(state) = self.lineage.get(&mixture).and_then(|of| of.get(origin)) {
            return Some(self.graph.add(Op::State(*state)));
        }
        if !self.reach.origins(&self.instances[mixture.0 as usize].name).any(|o| o == origin) {
            return None;
        }
        let inst = &self.instances[mixture.0 as usize];
        let (name, span) = (format!("{}.origins[{origin}]", inst.name), inst.span);
        let held = inst.origin.as_deref() == Some(origin);
        let initial = self.graph.number(f64::from(u8::from(held)));
        let state = State { name, domain: Domain::Bool, initial, scale: Some(1.0), span };
        let index = self.add_state(mixture, state);
        self.lineage.entry(mixture).or_default().insert(origin.to_string(), index);
        Some(self.graph.add(Op::State(index)))
    }

    /// Whether `a` has touched something that `b` has not.
    pub fn soils(&mut self, a: InstanceId, b: InstanceId) -> NodeId {
        self.follows_lineage = true;
        let mut any = self.graph.number(0.0);
        let reach = self.reach.clone();
        for origin in reach.origins(&self.instances[a.0 as usize].name) {
            let Some(mut foreign) = self.touched(a, origin) else { continue };
            if let Some(known) = self.touched(b, origin) {
                let unknown = self.graph.unary(UnaryOp::Not, known);
                foreign = self.graph.binary(BinaryOp::And, foreign, unknown);
            }
            any = self.graph.binary(BinaryOp::Or, any, foreign);
        }
        any
    }

    /// What a transfer does to the lineage of its destination.
    pub fn inherit(&mut self, from: InstanceId, to: InstanceId, span: Span) -> Vec<Action> {
        let mut out = Vec::new();
        let reach = self.reach.clone();
        for origin in reach.origins(&self.instances[from.0 as usize].name) {
            let (Some(there), Some(here)) = (self.touched(from, origin), self.touched(to, origin)) else { continue };
            let value = self.graph.binary(BinaryOp::Or, here, there);
            if let Op::State(state) = self.graph.op(here) {
                out.push(Action::Assign { state, value, span });
            }
        }
        out
    }

    /// What the flows of processes do to the lineage of where they go: as soon as something flows from where a reagent
    /// has been to where it has not.
    pub fn stream_events(&mut self) -> Vec<Event> {
        let mut out = Vec::new();
        for ((process, from, to), flows) in self.streams.clone() {
            let (name, span) = (format!("{}.origins", self.processes[process].name), self.processes[process].span);
            let mut new = self.graph.number(0.0);
            let reach = self.reach.clone();
            for origin in reach.origins(&self.instances[from.0 as usize].name) {
                let (Some(there), Some(here)) = (self.touched(from, origin), self.touched(to, origin)) else {
                    continue;
                };
                let clean = self.graph.unary(UnaryOp::Not, here);
                let comes = self.graph.binary(BinaryOp::And, there, clean);
                new = self.graph.binary(BinaryOp::Or, new, comes);
            }
            let runs = self.processes[process].guard.map_or(flows, |g| self.graph.binary(BinaryOp::And, g, flows));
            let when = self.graph.binary(BinaryOp::And, runs, new);
            let actions = self.inherit(from, to, span);
            if !actions.is_empty() && self.graph.constant(when) != Some(0.0) {
                out.push(Event { name, when, actions, span });
            }
        }
        out
    }

    /// Makes the walls of a mixture clean.
    pub fn rinse(&mut self, mixture: InstanceId, span: Span) -> Vec<Action> {
        let clean = self.graph.number(0.0);
        let mut out = Vec::new();
        let reach = self.reach.clone();
        for origin in reach.origins(&self.instances[mixture.0 as usize].name) {
            let node = self.touched(mixture, origin);
            if let Some(Op::State(state)) = node.map(|n| self.graph.op(n)) {
                out.push(Action::Assign { state, value: clean, span });
            }
        }
        out
    }
}
