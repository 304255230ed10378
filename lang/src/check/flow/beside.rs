//! What notes leave open: what happens beside a statement, and in turns of a loop that are not followed.

use std::collections::BTreeSet;
use std::rc::Rc;

use matterix_ir::plan::{Step, StepId};
use matterix_ir::{NodeId, Span};
use rustc_hash::FxHashMap;

use super::Interpreter;
use super::jobs::Job;
use super::program_points::{Notes, at_least};
use super::state::AbstractState;
use super::value::AbstractValue;
use crate::elaborate::mixtures::written;

impl Notes {
    /// The innermost branch, or the job that is followed, has ended.
    fn idle(&mut self) {
        if let Some(last) = self.busy.iter().rposition(|(job, _)| job.is_none()) {
            self.busy.remove(last);
        }
    }
}

impl Interpreter<'_, '_> {
    /// The same steps are followed once more, or no longer.
    pub fn once_more(&mut self, more: bool) {
        if let Some(notes) = &mut self.notes {
            notes.again = if more { notes.again + 1 } else { notes.again.saturating_sub(1) };
        }
    }

    /// What other branches change is not known while one is followed.
    pub fn begin_branch(&mut self, others: &BTreeSet<u32>) {
        if self.notes.is_some() {
            let states = self.behind(others);
            self.notes.iter_mut().for_each(|n| n.busy.push((None, states.clone())));
        }
    }

    /// Where a branch has raised failures, how far the others had got is not known; `from` counts those that were raised before.
    pub(super) fn blur(&mut self, from: usize) {
        if self.guards.last().is_none_or(|guard| guard.len() <= from) {
            return;
        }
        let Some(others) = self.shared.last().cloned() else { return };
        let others = Rc::new(self.behind(&others));
        let raised = self.guards.last_mut().into_iter().flatten().skip(from);
        raised.for_each(|(_, facts)| {
            let before = facts.blurred.take();
            facts.blurred =
                Some(before.map_or_else(|| others.clone(), |b| Rc::new(b.union(&others).copied().collect())));
        });
    }

    /// What others changed beside those failures, and how long they went on with the step at hand, is not known where they are
    /// taken; what should be in order at the end is followed by itself.
    pub(super) fn cut_short(&mut self, from: usize) {
        let kept = self.ends_of();
        for (_, facts) in self.guards.last_mut().into_iter().flatten().skip(from) {
            let Some(blurred) = &facts.blurred else { continue };
            let states: Vec<u32> = blurred.iter().copied().filter(|s| !kept.contains_key(s)).collect();
            facts.forget(&states);
            facts.time = at_least(&facts.time);
        }
    }

    /// How far the jobs had got that a failure stops, those begun at this depth of handlers, is not known where it is taken; what should
    /// be in order at the end is followed by itself.
    pub(super) fn stop_short(&mut self, depth: usize, facts: &mut AbstractState) {
        let stopped = self.jobs.values().filter(|job| job.is_stopped_at(depth, self.in_jobs));
        let changed: BTreeSet<u32> = stopped.flat_map(Job::changes).collect();
        if changed.is_empty() {
            return;
        }
        let kept = self.ends_of();
        let states: Vec<u32> = self.behind(&changed).into_iter().filter(|s| !kept.contains_key(s)).collect();
        self.forget(&states, facts);
        facts.time = at_least(&facts.time);
    }

    /// The branch ends.
    pub fn end_branch(&mut self) {
        self.notes.iter_mut().for_each(Notes::idle);
    }

    /// A loop may go on for more turns than were followed: what its body changes then is not known, unless the turns
    /// are all alike.
    pub fn more_turns(&mut self, body: StepId, alike: bool, facts: &AbstractState) {
        if self.notes.is_none() {
            return;
        }
        let mut states = BTreeSet::new();
        if !alike {
            states = self.behind(&self.writes(body));
            states.extend(facts.moving.iter().map(|i| self.derivatives[*i as usize].state));
        }
        let states: Vec<u32> = states.into_iter().collect();
        let spans: BTreeSet<Span> = self.below(body).into_iter().map(|id| self.plan.get(id).span).collect();
        for span in spans {
            let Some(note) = self.notes.as_mut().and_then(|n| n.by_span.get_mut(&span)) else { continue };
            note.times = note.times.max(2);
            note.locals.values_mut().for_each(|known| *known = AbstractValue::top());
            let Some(mut after) = note.last.clone() else { continue };
            after.forget(&states);
            after.time = at_least(&after.time);
            self.known_after(span, None, after);
        }
    }

    /// A job begins: what the rest of the plan changes is not known in it.
    pub fn begin_job(&mut self, others: &BTreeSet<u32>) {
        if self.notes.is_none() {
            return;
        }
        let states = self.behind(others);
        if let Some(notes) = &mut self.notes {
            notes.untimed = true;
            notes.busy.push((None, states));
        }
    }

    /// The states that the plan changes without a job.
    pub fn beside(&self, job: StepId) -> BTreeSet<u32> {
        let below = self.below(job);
        let others = (0..self.plan.steps.len() as u32).map(StepId).filter(|id| !below.contains(id));
        let operations = others.filter_map(|id| match &self.plan.get(id).step {
            Step::Operation(o) => Some(o),
            _ => None,
        });
        operations.flat_map(|o| written(o, &self.mixtures)).collect()
    }

    /// Its steps have been followed: from now until it is waited for, what they change is not known, and what hangs on when they do.
    pub fn begun_job(&mut self, job: &str, body: StepId, raced: &BTreeSet<u32>) {
        if self.notes.is_none() {
            return;
        }
        let states = self.behind(&self.writes(body).union(raced).copied().collect());
        let moved: BTreeSet<u32> = self.derivatives.iter().map(|d| d.state).filter(|s| states.contains(s)).collect();
        if let Some(notes) = &mut self.notes {
            notes.idle();
            notes.lost.extend(moved);
            notes.busy.push((Some(job.to_string()), states));
        }
    }

    /// A job has been waited for.
    pub fn end_job(&mut self, job: &str) {
        if let Some(notes) = &mut self.notes {
            notes.busy.retain(|(name, _)| name.as_deref() != Some(job));
        }
    }

    pub(super) fn below(&self, id: StepId) -> BTreeSet<StepId> {
        let mut out = BTreeSet::new();
        let mut todo = vec![id];
        while let Some(id) = todo.pop() {
            todo.extend(self.plan.get(id).step.children());
            out.insert(id);
        }
        out
    }

    /// States, and all that laws and events change by them.
    pub(super) fn behind(&self, states: &BTreeSet<u32>) -> BTreeSet<u32> {
        closed(states, |state| self.led_on(state))
    }

    /// States, and all by which laws and events change them.
    pub(super) fn ahead_of(&self, states: &BTreeSet<u32>) -> BTreeSet<u32> {
        let led_by = self.led_by.get_or_init(|| {
            let mut led_by: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
            for state in self.rates_of.keys().chain(self.events_of.keys()) {
                self.led_on(*state).into_iter().for_each(|to| led_by.entry(to).or_default().push(*state));
            }
            led_by
        });
        closed(states, |state| led_by.get(&state).cloned().unwrap_or_default())
    }

    /// Whether steps beside the one that is followed change what a condition rests on, themselves or by events that they set off.
    pub(super) fn is_set_beside(&mut self, condition: NodeId) -> bool {
        if self.shared.is_empty() && self.jobs.is_empty() {
            return false;
        }
        let beside = self.shared.iter().chain(self.of_jobs()).flatten().copied().collect();
        let set = closed(&beside, |state| self.set_off_by(state).collect());
        self.parts(condition).states.iter().any(|state| set.contains(state))
    }

    /// What the whole plan changes, and what laws and events change by that.
    pub(super) fn behind_plan(&self) -> &BTreeSet<u32> {
        self.by_plan.get_or_init(|| self.behind(&self.writes(self.plan.root)))
    }

    /// The states that laws and events change by one at once.
    fn led_on(&self, state: u32) -> Vec<u32> {
        let rates = self.rates_of.get(&state).into_iter().flatten();
        let moved = rates.map(|i| self.derivatives[*i as usize].state);
        moved.chain(self.set_off_by(state)).collect()
    }

    /// The states that events change that one sets off.
    fn set_off_by(&self, state: u32) -> impl Iterator<Item = u32> {
        let events = self.events_of.get(&state).into_iter().flatten();
        events.flat_map(|i| self.changed_by(&self.events[*i as usize].actions))
    }
}

/// A set with all that it leads to.
fn closed(set: &BTreeSet<u32>, next: impl Fn(u32) -> Vec<u32>) -> BTreeSet<u32> {
    let mut out = set.clone();
    let mut todo: Vec<u32> = set.iter().copied().collect();
    while let Some(state) = todo.pop() {
        todo.extend(next(state).into_iter().filter(|s| out.insert(*s)));
    }
    out
}
