//! What things keep at all times, and which steps may break it.

use matterix_ir::Op;
use matterix_ir::plan::{Limit, Step};
use matterix_ir::scene::InstanceId;

use super::Planner;
use crate::ast::MemberKind;
use crate::elaborate::mixtures::written;
use crate::eval::Scope;

impl Planner<'_, '_> {
    /// What the instances keep at all times, or what should hold `at_end`.
    pub fn limits(&mut self, at_end: bool) -> Vec<Limit> {
        let mut out = Vec::new();
        for i in 0..self.lab.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.lab.all_members(id).iter().copied() {
                let MemberKind::Limit { at_end: when, cond, refusal } = &m.member.kind else { continue };
                if *when != at_end || self.is_drafted(cond.span) {
                    continue;
                }
                let scope = &mut Scope::of_member(id, m);
                let Some(condition) = self.demanded(cond, refusal.as_ref(), scope) else { continue };
                if self.lab.graph.constant(condition.node).is_some_and(|v| v != 0.0) {
                    continue;
                }
                out.push(Limit { instance: id, condition });
            }
        }
        out
    }

    /// Notes at every operation the limits that its effects may pass.
    pub fn note_limits(&mut self, limits: &[Limit]) {
        let mut of: Vec<Vec<u32>> = vec![Vec::new(); self.lab.states.len()];
        for (i, limit) in limits.iter().enumerate() {
            self.lab.graph.visit(limit.condition.node, |op| {
                if let Op::State(s) = op {
                    of[s as usize].push(i as u32);
                }
            });
        }
        let extensive = self.lab.extensive_by_mixture();
        for step in &mut self.steps {
            let Step::Operation(o) = &mut step.step else { continue };
            o.limits = written(o, &extensive).flat_map(|s| &of[s as usize]).copied().collect();
            o.limits.sort_unstable();
            o.limits.dedup();
        }
    }
}
