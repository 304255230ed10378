//! Ledgers: what must stay the same over the whole lab, and what crosses its boundary.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Balance, Derivative, Domain, Doubt, State};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op, UnaryOp, Unit};

use crate::declare::SpeciesId;
use crate::eval::lab::origin;
use crate::eval::lab::{Contribution, Elaborator};

/// What matters of what a process may make or lose, mol or kg.
const DOUBT_SCALE: f64 = 1e-6;

impl Elaborator<'_> {
    /// Sums every derivative and adds the balances, with a state for each process that crosses the boundary.
    pub fn close(&mut self) -> (Vec<Derivative>, Vec<Balance>) {
        let mut derivatives = Vec::new();
        let rates = self.rates.clone();
        for (state, parts) in &rates {
            let rate = self.gated_sum(parts);
            if self.graph.constant(rate) != Some(0.0) {
                derivatives.push(Derivative { state: *state, rate, terms: origin::terms(parts) });
            }
        }
        let mut balances = Vec::new();
        let mut scalars: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for (key, index) in &self.extensive {
            if key.species.is_none() {
                scalars.entry(key.member.clone()).or_default().push(*index);
            }
        }
        for (member, states) in scalars {
            balances.push(self.scalar_balance(&member, &states, &rates, &mut derivatives));
        }
        self.matter_balances(&mut balances, &mut derivatives);
        (derivatives, balances)
    }

    /// A scalar such as enthalpy: a process whose contributions cancel stays inside, any other exchanges with outside.
    fn scalar_balance(
        &mut self,
        member: &str,
        states: &[u32],
        rates: &BTreeMap<u32, Vec<Contribution>>,
        derivatives: &mut Vec<Derivative>,
    ) -> Balance {
        let mut by_process: BTreeMap<usize, Vec<NodeId>> = BTreeMap::new();
        for state in states {
            for c in rates.get(state).into_iter().flatten() {
                match self.flow_sums.get(&c.node) {
                    Some(parts) if self.processes[c.process].guard.is_none() => {
                        for part in parts {
                            by_process.entry(part.process).or_default().push(part.node);
                        }
                    }
                    _ => by_process.entry(c.process).or_default().push(c.node),
                }
            }
        }
        let Domain::Quantity(unit) = self.states[states[0] as usize].domain.clone() else {
            return Balance {
                name: member.into(),
                total: self.graph.number(0.0),
                exchanges: Vec::new(),
                unit: Unit::one(),
                magnitude: self.graph.number(0.0),
                terms: Vec::new(),
                doubts: Vec::new(),
            };
        };
        let mut exchanges = Vec::new();
        let scale = self.states[states[0] as usize].scale;
        for (process, nodes) in by_process {
            let mut sum = self.graph.number(0.0);
            for node in nodes {
                sum = self.plus(sum, node);
            }
            if self.graph.constant(sum) == Some(0.0) {
                continue;
            }
            let all = Contribution { process, node: sum, span: self.processes[process].span };
            let rate = self.gated(&all);
            let info = &self.processes[process];
            let (name, span) = (format!("{member} by {}", info.name), info.span);
            let (domain, initial) = (Domain::Quantity(unit.clone()), self.graph.number(0.0));
            let index = self.add_state(InstanceId(0), State { name, domain, initial, scale, span });
            derivatives.push(Derivative { state: index, rate, terms: origin::terms(&[all]) });
            exchanges.push(index);
        }
        let total = self.sum_states(states.iter().map(|s| (*s, 1.0)), false);
        let all = states.iter().chain(&exchanges).map(|s| (*s, 1.0)).collect::<Vec<_>>();
        let magnitude = self.sum_states(all.into_iter(), true);
        let terms = states.iter().map(|s| (*s, 1.0)).collect();
        Balance { name: member.to_string(), total, exchanges, unit, magnitude, terms, doubts: Vec::new() }
    }

    /// Species of which an amount that was put somewhere may fall below 0: laws take out of all mixtures what equilibria make of others.
    pub fn overdrawn(&self) -> BTreeSet<SpeciesId> {
        let is_taken =
            |(s, state): &&(SpeciesId, u32)| self.rates.contains_key(state) && !self.tables.species.get(*s).is_water;
        self.outside.iter().filter(is_taken).map(|(s, _)| *s).collect()
    }

    /// Elements, charge and mass: nothing crosses the boundary.
    fn matter_balances(&mut self, balances: &mut Vec<Balance>, derivatives: &mut Vec<Derivative>) {
        let amounts: Vec<(SpeciesId, u32)> = self
            .extensive
            .iter()
            .filter_map(|(key, index)| Some((key.matter()?, *index)))
            .chain(self.outside.iter().copied())
            .collect();
        let of = self.quantities(amounts.iter().map(|a| a.0).collect::<BTreeSet<_>>().into_iter());
        let doubtful = self.doubtful();
        let elements = of.keys().filter(|name| name.starts_with("element"));
        let names: Vec<String> = elements.cloned().chain(["charge".into(), "mass".into()]).collect();
        for name in names {
            let Some(factors) = of.get(&name) else { continue };
            let terms: Vec<(u32, f64)> =
                amounts.iter().filter_map(|(s, index)| Some((*index, *factors.get(s)?))).collect();
            let unit = if name == "mass" { Unit::scaled("g", 1e-3) } else { Unit::scaled("mol", 1.0) };
            let total = self.sum_states(terms.iter().copied(), false);
            let magnitude = self.sum_states(terms.iter().copied(), true);
            let doubts = doubtful.iter().filter_map(|(process, changes)| {
                let changes = changes.iter().filter_map(|(s, node)| Some((*node, *factors.get(s)?)));
                self.doubt(&name, &unit, *process, changes.collect(), derivatives)
            });
            let doubts = doubts.collect();
            balances.push(Balance { name, total, exchanges: Vec::new(), unit, magnitude, terms, doubts });
        }
    }

    /// A state for what a process does to a sum, from its rates with their factors.
    fn doubt(
        &mut self,
        balance: &str,
        unit: &Unit,
        process: usize,
        changes: Vec<(NodeId, f64)>,
        derivatives: &mut Vec<Derivative>,
    ) -> Option<Doubt> {
        let mut sum = self.graph.number(0.0);
        for (node, factor) in changes {
            let factor = self.graph.number(factor);
            let term = self.times(node, factor);
            sum = self.plus(sum, term);
        }
        if self.graph.constant(sum) == Some(0.0) {
            return None;
        }
        let all = Contribution { process, node: sum, span: self.processes[process].span };
        let rate = self.gated(&all);
        let info = &self.processes[process];
        let (name, span) = (format!("{balance} by {}", info.name), info.span);
        let (domain, initial) = (Domain::Quantity(unit.clone()), self.graph.number(0.0));
        let state = self.add_state(InstanceId(0), State { name, domain, initial, scale: Some(DOUBT_SCALE), span });
        derivatives.push(Derivative { state, rate, terms: origin::terms(&[all]) });
        Some(Doubt { process: process as u32, state })
    }

    fn sum_states(&mut self, terms: impl Iterator<Item = (u32, f64)>, magnitude: bool) -> NodeId {
        let mut sum = self.graph.number(0.0);
        for (state, weight) in terms {
            let mut node = self.graph.add(Op::State(state));
            if magnitude {
                node = self.graph.unary(UnaryOp::Abs, node);
            }
            let weight = self.graph.number(if magnitude { weight.abs() } else { weight });
            let term = self.times(node, weight);
            sum = self.plus(sum, term);
        }
        sum
    }
}
