//! Which temperatures a run has to watch: those of mixtures that laws or effects of the user's own change.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Drained, Event, Suspect, Temperatures};
use matterix_ir::plan::{Plan, Step};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Span, codes};

use super::library;
use crate::ast::{MemberKind, Role};
use crate::declare::Type;
use crate::eval::lab::{Elaborator, ExtensiveKey};
use crate::eval::{Num, Value};

impl<'a> Elaborator<'a> {
    /// The temperatures that must stay physical, with the laws that may spoil them; none where only the library has laws.
    pub fn temperatures(&mut self, events: &[Event], plan: &Plan) -> Temperatures {
        let blamed = self.blamed(events, plan);
        if blamed.is_empty() {
            return Temperatures::default();
        }
        let reacting = self.reacting();
        let mut out = Temperatures { drained: self.drained(events, plan), ..Temperatures::default() };
        for index in 0..self.instances.len() as u32 {
            let id = InstanceId(index);
            for (name, value) in self.temperatures_of(id) {
                match blamed.get(&id) {
                    Some((law, span)) => {
                        let left = self.diagnostics.iter();
                        let left = left.filter(|d| d.code == codes::HEAT_LEFT_BEHIND).any(|d| d.span() == *span);
                        let heatless = left && !reacting.contains(&id);
                        let name = format!("{}.{name}", self.instances[index as usize].name);
                        out.suspects.push(Suspect { name, value, law: law.clone(), span: *span, heatless });
                    }
                    None => out.others.push(value),
                }
            }
        }
        let settings = self.settings.values().filter_map(|v| match v {
            Value::Num(n) if self.is_temperature(n) => Some(n.node),
            _ => None,
        });
        out.others.extend(settings);
        out
    }

    /// Mixtures and bodies whose extensive states own laws change, with one such law.
    fn blamed(&self, events: &[Event], plan: &Plan) -> BTreeMap<InstanceId, (String, Span)> {
        let library = library(self);
        let mut out = BTreeMap::new();
        let extensive: BTreeSet<u32> = self.extensive.values().copied().collect();
        let mut blame = |state: u32, law: &str, span: Span| {
            if !library.contains(&span.file) && extensive.contains(&state) {
                let owner = self.state_owner[state as usize];
                out.entry(owner).or_insert_with(|| (law.to_string(), span));
            }
        };
        for (state, parts) in &self.rates {
            for c in parts {
                let process = &self.processes[c.process];
                blame(*state, &process.name, process.span);
            }
        }
        for ((id, ..), parts) in &self.flows {
            for c in parts {
                let process = &self.processes[c.process];
                if library.contains(&process.span.file) {
                    continue;
                }
                let scalar = |k: &ExtensiveKey| k.instance == *id && k.species.is_none();
                for (_, state) in self.extensive.iter().filter(|(k, _)| scalar(k)) {
                    blame(*state, &process.name, process.span);
                }
            }
        }
        let assigned =
            |a: &Action| if let Action::Assign { state, span, .. } = a { Some((*state, *span)) } else { None };
        for event in events {
            for (state, _) in event.actions.iter().filter_map(assigned) {
                blame(state, &event.name, event.span);
            }
        }
        for step in &plan.steps {
            let Step::Operation(o) = &step.step else { continue };
            for (state, span) in o.at_start.iter().chain(&o.at_end).filter_map(assigned) {
                blame(state, &step.label, span);
            }
        }
        out
    }

    /// Amounts that own laws change, each with one of them.
    fn drained(&self, events: &[Event], plan: &Plan) -> Vec<Drained> {
        let library = library(self);
        let own = |span: &Span| !library.contains(&span.file);
        let amounts: BTreeSet<u32> = self.extensive.iter().filter(|(k, _)| k.matter).map(|(_, s)| *s).collect();
        let mut out: BTreeMap<u32, Drained> = BTreeMap::new();
        let mut add = |state: u32, law: &str, span: Span| {
            if amounts.contains(&state) && own(&span) {
                out.entry(state).or_insert_with(|| Drained { state, law: law.to_string(), span });
            }
        };
        for (state, parts) in &self.rates {
            for p in parts.iter().map(|c| &self.processes[c.process]) {
                add(*state, &p.name, p.span);
            }
        }
        let written =
            |a: &Action| if let Action::Assign { state, span, .. } = a { Some((*state, *span)) } else { None };
        for event in events {
            event.actions.iter().filter_map(written).for_each(|(state, _)| add(state, &event.name, event.span));
        }
        for step in &plan.steps {
            let Step::Operation(o) = &step.step else { continue };
            let actions = o.at_start.iter().chain(&o.at_end);
            actions.filter_map(written).for_each(|(state, span)| add(state, &step.label, span));
        }
        out.into_values().collect()
    }

    /// What may get warm or cold by a reaction.
    fn reacting(&self) -> BTreeSet<InstanceId> {
        let scalar = self.extensive.iter().filter(|(k, _)| k.species.is_none());
        let reacts = scalar.filter(|(_, state)| {
            let parts = self.rates.get(state).into_iter().flatten();
            parts
                .into_iter()
                .any(|c| self.processes[c.process].reaction.is_some() && self.graph.constant(c.node) != Some(0.0))
        });
        reacts.map(|(k, _)| k.instance).collect()
    }

    /// The derived temperatures of a thing.
    fn temperatures_of(&mut self, id: InstanceId) -> Vec<(String, NodeId)> {
        let mut out = Vec::new();
        for m in self.derived_members(id) {
            let MemberKind::Value { role: Role::Derived, name, ty, .. } = &m.member.kind else { continue };
            if !matches!(self.resolve_type(ty, m.module), Type::Quantity { point: true, .. }) {
                continue;
            }
            if let Value::Num(n) = self.member_value(id, m, name.span)
                && self.is_temperature(&n)
            {
                out.push((name.text.clone(), n.node));
            }
        }
        out
    }

    fn is_temperature(&self, n: &Num) -> bool {
        n.point && self.tables.units.dimension("Temperature").is_some_and(|t| t.dimension == n.dimension)
    }
}
