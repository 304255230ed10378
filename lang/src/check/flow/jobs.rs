//! Jobs that `start` begins: their steps are followed where they begin, and once more where they are waited for. What goes wrong in
//! one order only may be right in the order of the run.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Step, StepId};
use matterix_ir::{BinaryOp, codes};

use super::Flow;
use super::facts::Facts;
use super::interference::Rival;
use super::report::Finding;
use super::value::Known;
use super::{left, parted};

/// A job that was started and not waited for yet.
#[derive(Clone, Debug)]
pub(super) struct Job {
    body: StepId,
    /// When it began, s.
    start: Known,
    /// When it ended, s; not yet where its steps are followed when it is waited for.
    end: Option<Known>,
    /// The states that it changes.
    writes: BTreeSet<u32>,
}

impl Job {
    /// Its steps.
    pub(super) fn body(&self) -> StepId {
        self.body
    }

    /// When it began, s.
    pub(super) fn start(&self) -> &Known {
        &self.start
    }
}

/// Jobs that go on, by name.
pub(super) type Jobs = BTreeMap<String, Job>;

/// Follows a plan way by way, and in both orders where it starts jobs; `begin` gives one that was not followed yet.
pub(super) fn follow<'l, 'a>(begin: impl Fn() -> Flow<'l, 'a>) -> Flow<'l, 'a> {
    let mut flow = parted::follow(&begin);
    left::on_some_way(&mut flow, &begin);
    if flow.plan.steps.iter().any(|s| matches!(s.step, Step::Start { .. })) {
        let mut late = begin();
        late.notes = None;
        late.late = true;
        late.follow();
        left::on_some_way(&mut late, &begin);
        let first = std::mem::take(&mut flow.findings);
        flow.findings = in_both(first, &late.findings);
        // What was not looked at for a mistake that is none after all.
        if !flow.ended && late.ended {
            flow.findings.extend(late.findings.into_iter().filter(|f| f.is(codes::UNFINISHED)));
        }
    }
    flow
}

impl Flow<'_, '_> {
    /// Starts a job.
    pub(super) fn start_job(&mut self, name: &str, body: StepId, mut facts: Facts) -> Option<Facts> {
        let (start, writes) = (facts.time.clone(), self.writes(body));
        let end = match self.late {
            true => None,
            false => {
                let after = self.job(body, facts);
                self.begun_job(name, body);
                facts = after?;
                Some(std::mem::replace(&mut facts.time, start.clone()))
            }
        };
        facts.begun.insert(name.to_owned(), true);
        self.jobs.insert(name.to_owned(), Job { body, start, end, writes });
        Some(facts)
    }

    /// Waits for a job.
    pub(super) fn await_job(&mut self, name: &str, facts: Facts) -> Option<Facts> {
        match facts.begun.get(name) {
            Some(true) => {}
            begun => {
                let some = begun.is_some();
                if !self.is_taken("job") {
                    self.never_began(name, some);
                }
                self.raise("job", facts.clone());
                if !some {
                    return None;
                }
            }
        }
        self.end_of_job(name, facts)
    }

    fn end_of_job(&mut self, name: &str, mut facts: Facts) -> Option<Facts> {
        self.end_job(name);
        let Some(Job { body, start, end, .. }) = self.jobs.remove(name) else { return Some(facts) };
        let now = facts.time.clone();
        let end = match end {
            Some(end) => end,
            None => {
                facts.time = start;
                facts = self.job(body, facts)?;
                facts.time.clone()
            }
        };
        facts.time = Known::binary(BinaryOp::Max, &now, &end);
        Some(facts)
    }

    /// The jobs that nothing waits for: a run ends when they have.
    pub(super) fn await_all(&mut self, mut facts: Facts) -> Option<Facts> {
        while let Some(name) = self.jobs.keys().next().cloned() {
            facts = self.end_of_job(&name, facts)?;
        }
        Some(facts)
    }

    fn job(&mut self, body: StepId, facts: Facts) -> Option<Facts> {
        let others = self.beside(body);
        self.begin_job(&others);
        self.shared.push(others);
        let rival = Rival { steps: self.after_start(body), start: facts.time.clone(), later: false };
        self.rivals.push(vec![rival]);
        let raised = self.guards.last().map_or(0, Vec::len);
        let after = self.walk(body, facts);
        self.blur(raised);
        self.rivals.pop();
        self.shared.pop();
        after
    }

    /// The states that jobs which go on change.
    pub(super) fn of_jobs(&self) -> impl Iterator<Item = &BTreeSet<u32>> {
        self.jobs.values().map(|job| &job.writes)
    }
}

/// What goes wrong in both orders. Where it does in either, if nowhere in both, the first order tells it: two that put something
/// in one place. What goes wrong in turns of a loop may be right turn by turn.
pub(super) fn in_both(first: Vec<Finding>, second: &[Finding]) -> Vec<Finding> {
    let both = first.iter().any(|f| second.iter().any(|o| o.is_like(f)));
    let wrong = |found: &[Finding]| found.iter().any(|f| f.is_error() && !f.in_turn());
    let either = !both && wrong(&first) && wrong(second);
    let stays = |f: &Finding| (either && !f.in_turn()) || second.iter().any(|o| o.is_like(f));
    first.into_iter().filter(stays).collect()
}
