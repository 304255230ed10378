//! Ledgers: what must stay the same over the whole lab, and what crosses its boundary.

use std::collections::BTreeMap;

use matterix_ir::model::{Balance, Derivative, Domain, State};
use matterix_ir::{NodeId, Op, UnaryOp, Unit};

use super::{Contribution, Elaborator};

impl Elaborator<'_> {
    /// Sums every derivative and adds the balances, with a state for each process that crosses the boundary.
    pub fn close(&mut self) -> (Vec<Derivative>, Vec<Balance>) {
        let mut derivatives = Vec::new();
        let rates = self.rates.clone();
        for (state, parts) in &rates {
            let rate = self.gated_sum(parts);
            if self.graph.constant(rate) != Some(0.0) {
                derivatives.push(Derivative { state: *state, rate });
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
        self.matter_balances(&mut balances);
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
            let rate = self.gated(&Contribution { process, node: sum });
            let index = self.states.len() as u32;
            let info = &self.processes[process];
            self.states.push(State {
                name: format!("{member} by {}", info.name),
                domain: Domain::Quantity(unit.clone()),
                initial: self.graph.number(0.0),
                scale,
                span: info.span,
            });
            self.state_owner.push(matterix_ir::scene::InstanceId(0));
            derivatives.push(Derivative { state: index, rate });
            exchanges.push(index);
        }
        let total = self.sum_states(states.iter().map(|s| (*s, 1.0)), false);
        let all = states.iter().chain(&exchanges).map(|s| (*s, 1.0)).collect::<Vec<_>>();
        let magnitude = self.sum_states(all.into_iter(), true);
        Balance { name: member.to_string(), total, exchanges, unit, magnitude }
    }

    /// Elements, charge and mass: nothing crosses the boundary.
    fn matter_balances(&mut self, balances: &mut Vec<Balance>) {
        let mut elements: BTreeMap<String, Vec<(u32, f64)>> = BTreeMap::new();
        let mut charge = Vec::new();
        let mut mass = Vec::new();
        for (key, index) in &self.extensive {
            let Some(s) = key.species else { continue };
            let def = self.tables.species.get(s);
            mass.push((*index, def.molar_mass));
            let Some(formula) = &def.formula else { continue };
            if formula.charge != 0 {
                charge.push((*index, f64::from(formula.charge)));
            }
            for (element, count) in &formula.elements {
                elements.entry(format!("element {element}")).or_default().push((*index, count.to_f64()));
            }
        }
        let mol = Unit::scaled("mol", 1.0);
        let mut add = |this: &mut Self, name: String, terms: Vec<(u32, f64)>, unit: Unit| {
            if terms.is_empty() {
                return;
            }
            let total = this.sum_states(terms.iter().copied(), false);
            let magnitude = this.sum_states(terms.into_iter(), true);
            balances.push(Balance { name, total, exchanges: Vec::new(), unit, magnitude });
        };
        for (name, terms) in elements {
            add(self, name, terms, mol.clone());
        }
        add(self, "charge".into(), charge, mol);
        add(self, "mass".into(), mass, Unit::scaled("g", 1e-3));
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
