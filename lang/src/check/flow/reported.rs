//! Failures that only a device reports: the way followed is the one without them, so what their handlers and the
//! `finally` behind them do is looked at beside it. What goes wrong there goes wrong on some ways only, and nothing of
//! it is known afterwards.

use matterix_ir::model::Domain;
use matterix_ir::plan::{Caught, Motion, Operation, Step, StepId};
use matterix_ir::scene::InstanceId;

use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, Raised};

/// What a motion fails with after which a hand is empty.
const LOST: &str = "dropped";
/// What a motion fails with after which a hand still holds what it held, or does not.
const MAY_LOSE: [&str; 5] = ["collision", "jammed", "missed", "slip", "toppled"];
/// The value of a state that points at nothing.
const NOTHING: f64 = -1.0;

impl Interpreter<'_, '_> {
    /// Notes what is known where a device may report a failure, or a motion fail.
    pub fn may_report(&mut self, operation: &Operation, facts: &AbstractState) {
        if self.reported.is_empty() {
            return;
        }
        // What must not be may come about at any step, and any motion may not be possible: that is followed where somebody has
        // thought of it.
        let named = self.caught.iter().flat_map(|net| &net.names).flatten();
        let by_motion = |name: &str| operation.motion.is_some() && Motion::FAILURES.contains(&name);
        let dangers = named.filter(|name| self.lab.tables.dangers().contains(*name) || by_motion(name));
        let names: Vec<String> = operation.fails.iter().chain(dangers).cloned().collect();
        let raised: Vec<Raised> =
            names.into_iter().map(|name| (name.clone(), self.as_it_failed(operation, &name, facts))).collect();
        if let Some(open) = self.reported.last_mut() {
            open.extend(raised);
        }
    }

    /// What is known where an operation has failed so: as before it, but for what a robot that moved may have lost.
    fn as_it_failed(&mut self, operation: &Operation, name: &str, facts: &AbstractState) -> AbstractState {
        let mut failed = facts.clone();
        let Some(motion) = operation.motion.as_ref().filter(|_| name == LOST || MAY_LOSE.contains(&name)) else {
            return failed;
        };
        let by = motion.mover();
        let points = |index: &usize| self.lab.states[*index].domain == Domain::Instance;
        let all: Vec<usize> = (0..self.lab.states.len()).filter(points).collect();
        let may_be = |index: usize, id: InstanceId| facts.states[index].may_be(f64::from(id.0));
        // What it carries points at it, and it at that.
        let borne: Vec<usize> = all.iter().copied().filter(|index| may_be(*index, by)).collect();
        let hands: Vec<usize> = all
            .into_iter()
            .filter(|index| self.lab.state_owner[*index] == by)
            .filter(|index| borne.iter().any(|item| may_be(*index, self.lab.state_owner[*item])))
            .collect();
        let held = |known: &AbstractValue| match name == LOST {
            true => AbstractValue::Point(NOTHING),
            false => known.join(&AbstractValue::Point(NOTHING), Imprecision::Paths),
        };
        let hands: Vec<(u32, AbstractValue)> =
            hands.into_iter().map(|index| (index as u32, held(&facts.states[index]))).collect();
        let borne = borne.into_iter().filter(|_| !hands.is_empty()).map(|index| (index as u32, AbstractValue::top()));
        let changes = borne.chain(hands.iter().cloned()).collect();
        self.overwrite(self.site(), changes, &mut failed);
        failed
    }

    /// Follows the handlers of what devices may have reported in a body, then its `finally`; what nothing takes goes on
    /// outwards.
    pub fn after_report(
        &mut self,
        base: &AbstractState,
        mut reported: Vec<Raised>,
        handlers: &[(Caught, StepId)],
        finally: Option<StepId>,
    ) {
        if reported.is_empty() || self.quiet > 0 {
            return;
        }
        let known = std::mem::take(&mut self.findings);
        self.doubt += 1;
        self.cleaning += 1;
        let mut names: Vec<String> = reported.iter().map(|(name, _)| name.clone()).collect();
        names.sort();
        names.dedup();
        for (caught, handler) in handlers {
            let takes = |name: &str| match caught {
                Caught::Named(n) => n == name,
                Caught::Any => true,
            };
            let (taken, rest): (Vec<_>, Vec<_>) = reported.into_iter().partition(|(name, _)| takes(name));
            reported = rest;
            let Some(mut entry) = self.joined(base, &taken) else { continue };
            entry.unsure = true;
            self.again.push(Vec::new());
            let end = self.walk(*handler, entry);
            self.again.pop();
            // When its turns are used up, the failure goes on.
            if self.retries(*handler) {
                reported.extend(taken);
            } else if let (Some(finally), Some(end)) = (finally, end) {
                self.unnoted(finally, end);
            }
        }
        if let (Some(finally), Some(entry)) = (finally, self.joined(base, &reported)) {
            let end = self.unnoted(finally, entry);
            reported = end.map_or(Vec::new(), |end| reported.into_iter().map(|(n, _)| (n, end.clone())).collect());
        }
        self.doubt -= 1;
        self.cleaning -= 1;
        let new = std::mem::replace(&mut self.findings, known);
        for mut finding in new {
            if !self.findings.iter().any(|f| f.is_like(&finding)) {
                finding.only_where_reported(&names);
                self.findings.push(finding);
            }
        }
        if let Some(outer) = self.reported.last_mut() {
            outer.extend(reported);
        }
    }

    /// Follows a `finally` without a note of what is known after it: what is told is the way without these failures.
    pub fn unnoted(&mut self, finally: StepId, facts: AbstractState) -> Option<AbstractState> {
        let notes = self.notes.take();
        let end = self.walk(finally, facts);
        self.notes = notes;
        end
    }

    pub fn joined(&self, base: &AbstractState, raised: &[Raised]) -> Option<AbstractState> {
        let facts = raised.iter().map(|(_, facts)| facts.clone());
        facts.reduce(|a, b| base.join(a, &b, self.site(), Imprecision::Paths))
    }

    /// Whether a handler begins its body again.
    pub(super) fn retries(&self, handler: StepId) -> bool {
        let mut todo = vec![handler];
        while let Some(id) = todo.pop() {
            match &self.plan.get(id).step {
                Step::Retry { .. } => return true,
                step => todo.extend(step.children()),
            }
        }
        false
    }
}
