//! What things keep at all times, and which steps may break it.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::Op;
use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Limit, Refusal, Step};
use matterix_ir::scene::InstanceId;

use super::Planner;
use crate::ast::MemberKind;
use crate::eval::Scope;

impl Planner<'_, '_> {
    /// What the instances keep at all times, or what should hold `at_end`.
    pub fn limits(&mut self, at_end: bool) -> Vec<Limit> {
        let mut out = Vec::new();
        for i in 0..self.lab.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.lab.all_members(id) {
                let MemberKind::Limit { at_end: when, cond, failure, help } = &m.member.kind else { continue };
                if *when != at_end {
                    continue;
                }
                let Some(condition) = self.condition(cond, &mut Scope::of_member(id, m)) else { continue };
                if self.lab.graph.constant(condition.node).is_some_and(|v| v != 0.0) {
                    continue;
                }
                let refusal = failure.as_ref().map(|f| Refusal { failure: f.text.clone(), help: help.clone() });
                out.push(Limit { instance: id, condition: Condition { refusal, ..condition } });
            }
        }
        out
    }

    /// Notes at every operation the limits that its effects may pass.
    pub fn note_limits(&mut self, limits: &[Limit]) {
        let mut of: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (i, limit) in limits.iter().enumerate() {
            for node in self.lab.graph.schedule([limit.condition.node]) {
                if let Op::State(s) = self.lab.graph.op(node) {
                    of.entry(s).or_default().push(i as u32);
                }
            }
        }
        let mixtures: Vec<InstanceId> = (0..self.lab.instances.len() as u32)
            .map(InstanceId)
            .filter(|i| self.lab.per_species(*i).is_some())
            .collect();
        let held = |m: u32| {
            let id = mixtures.get(m as usize).copied();
            self.lab.extensive.iter().filter(move |(k, _)| Some(k.instance) == id).map(|(_, s)| *s)
        };
        for step in &mut self.steps {
            let Step::Operation(o) = &mut step.step else { continue };
            let mut states = BTreeSet::new();
            for action in o.at_start.iter().chain(&o.at_end) {
                match action {
                    Action::Assign { state, .. } => drop(states.insert(*state)),
                    Action::Move { from, to, .. } => states.extend(held(*from).chain(held(*to))),
                }
            }
            let due: BTreeSet<u32> = states.iter().filter_map(|s| of.get(s)).flatten().copied().collect();
            o.limits = due.into_iter().collect();
        }
    }
}
