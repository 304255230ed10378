//! What should hold when a workflow has come to its end, if it held at its start: nothing is left on or in hand.

use matterix_ir::codes;
use matterix_ir::plan::{Limit, Step, StepId};
use matterix_ir::scene::InstanceId;

use super::failure::FailureTrace;
use super::frame::End;
use super::{Executor, tree};
use crate::fault::Fault;

impl<'p> Executor<'p, '_> {
    /// What of it is to hold at the end: what holds now, at the start, and what a device tells no sense of now, as one that shows
    /// something else before it is told anything. Fails where a device does not answer at all.
    pub(super) fn in_order(&mut self) -> Result<Vec<&'p Limit>, Fault> {
        let mut begun = Vec::new();
        for end in &self.plan.ends {
            match self.ended(&end.condition) {
                Ok(Some(true)) => begun.push(end),
                Ok(_) => {}
                Err(fault) => match fault.code {
                    codes::DEVICE_GARBLED | codes::DEVICE_REFUSED => begun.push(end),
                    codes::NOT_A_NUMBER => {}
                    _ => return Err(fault),
                },
            }
        }
        Ok(begun)
    }

    /// Judges at the end what was in order at the start; a run that failed or was stopped leaves things as they are. Fails where
    /// it cannot be asked for: what nobody knows to be off may be on.
    pub(super) fn judge_ends(&mut self, begun: &[&Limit]) -> Result<(), Fault> {
        if self.state.abort.is_some() || !matches!(self.state.end, Some(End::Done)) {
            return Ok(());
        }
        for end in begun {
            if self.ended(&end.condition)? != Some(false) {
                continue;
            }
            let how = end.condition.refusal.as_ref().map_or("unfinished".to_owned(), |r| r.failure.replace('_', " "));
            let text = format!("`{}` is {how} after the end of `{}`", self.instance(end.instance), self.plan.workflow);
            let steps = self.last_use(end.instance);
            let trace = FailureTrace {
                name: codes::UNFINISHED.name.to_owned(),
                text,
                code: codes::UNFINISHED,
                fault: false,
                span: steps.first().map_or(end.condition.span, |s| self.plan.get(*s).span),
                time: self.state.now,
                measured: self.measured(&end.condition.compared),
                help: end.condition.advice().into_iter().collect(),
                because: Vec::new(),
                steps: steps
                    .into_iter()
                    .map(|s| {
                        FailureTrace::entry(
                            self.plan,
                            s,
                            self.state.steps[s.0 as usize].started.unwrap_or(self.state.now),
                        )
                    })
                    .collect(),
            };
            self.state.unfinished.push(trace);
        }
        Ok(())
    }

    /// The latest operation that used a thing and the steps around it, innermost first.
    fn last_use(&self, thing: InstanceId) -> Vec<StepId> {
        let owner = |id: &InstanceId| self.scene.instances.get(id.0 as usize).and_then(|i| i.owner);
        let wholes: Vec<InstanceId> = std::iter::successors(Some(thing), owner).collect();
        let mut above = vec![None; self.plan.steps.len()];
        let mut last: Option<(f64, StepId)> = None;
        for id in tree::subtree(self.plan, self.plan.root) {
            let step = &self.plan.get(id).step;
            step.children().into_iter().for_each(|c| above[c.0 as usize] = Some(id));
            let Step::Operation(operation) = step else { continue };
            let Some(started) = self.state.steps[id.0 as usize].started else { continue };
            let later = last.is_none_or(|(time, other)| (time, other) < (started, id));
            if later && operation.claims.iter().any(|c| wholes.contains(c)) {
                last = Some((started, id));
            }
        }
        let steps = std::iter::successors(last.map(|(_, id)| id), |id| above[id.0 as usize]);
        // The workflow itself says nothing.
        steps.filter(|id| *id != self.plan.root).collect()
    }
}
