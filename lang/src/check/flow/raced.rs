//! What hangs on when concurrent steps do something: a sample taken from a vessel while another branch fills it. Each order of
//! whole branches gives one value, and a run one in between, or another.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Domain};
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op};

use super::Interpreter;

/// What steps change.
struct Doing {
    /// States.
    written: BTreeSet<u32>,
    /// Mixtures into which something is brought, by index, with what is claimed wherever that is done.
    filled: BTreeMap<u32, BTreeSet<InstanceId>>,
}

/// An operation with what is claimed around it.
type Claimed<'p> = (&'p Operation, BTreeSet<InstanceId>);

/// States and kept values that hang on when steps do something.
#[derive(Default)]
struct Raced {
    states: BTreeSet<u32>,
    locals: BTreeSet<u32>,
}

impl<'p> Interpreter<'p, '_> {
    /// For each branch the states that it changes depending on when the others do something.
    pub(super) fn raced_in_branches(&mut self, branches: &[StepId]) -> Vec<BTreeSet<u32>> {
        let one = |own: usize, flow: &mut Self| {
            let others = branches.iter().enumerate().filter(|(other, _)| *other != own);
            let others: Vec<StepId> = others.map(|(_, id)| *id).collect();
            flow.raced(&branches[own..=own], &others)
        };
        (0..branches.len()).map(|own| one(own, self)).collect()
    }

    /// The states that a job, or what goes on beside it, changes depending on when the other one does something.
    pub(super) fn raced_by_job(&mut self, body: StepId) -> BTreeSet<u32> {
        let beside = self.concurrent(body);
        let mut out = self.raced(&[body], &beside);
        out.extend(self.raced(&beside, &[body]));
        out
    }

    /// Whether other branches or jobs that go on now may change what a value follows from.
    pub(super) fn is_raced(&mut self, node: NodeId) -> bool {
        if self.meets.is_empty() && self.jobs.is_empty() {
            return false;
        }
        let parts = self.parts(node);
        self.meets.iter().chain(self.of_jobs()).any(|set| parts.states.iter().any(|s| set.contains(s)))
    }

    /// The steps that may go on while a job does: those behind its `start`, up to where it is waited for, and other jobs.
    pub(super) fn concurrent(&self, body: StepId) -> Vec<StepId> {
        let plan = self.plan;
        let ids = || (0..plan.steps.len() as u32).map(StepId);
        let mut out: Vec<StepId> = self.jobs.values().map(|job| job.body()).filter(|other| *other != body).collect();
        let begun = |id: &StepId| match &plan.get(*id).step {
            Step::Start { job, body: own } if *own == body => Some(job.as_str()),
            _ => None,
        };
        let Some((mut at, job)) = ids().find_map(|id| Some((id, begun(&id)?))) else { return out };
        while let Some(around) = ids().find(|id| plan.get(*id).step.children().contains(&at)) {
            match &plan.get(around).step {
                Step::Sequence(steps) => {
                    for id in steps.iter().skip_while(|id| **id != at).skip(1) {
                        let waits = self.awaits(*id, job);
                        if waits != Some(true) {
                            out.push(*id);
                        }
                        if waits.is_some() {
                            return out;
                        }
                    }
                }
                Step::Parallel(branches) => out.extend(branches.iter().filter(|id| **id != at)),
                // The next turn goes on beside it.
                Step::Repeat { .. } | Step::RepeatWhile { .. } => out.push(at),
                step if step.waits_for_jobs() => return out,
                _ => {}
            }
            at = around;
        }
        out
    }

    /// Whether a step waits for a job before it does anything; none where it may not wait for it.
    fn awaits(&self, id: StepId, job: &str) -> Option<bool> {
        match &self.plan.get(id).step {
            Step::Await { job: name } if name == job => Some(true),
            Step::Sequence(steps) => {
                let at = steps.iter().position(|id| self.awaits(*id, job).is_some())?;
                Some(at == 0 && self.awaits(steps[0], job) == Some(true))
            }
            Step::Guarded { body, .. }
            | Step::Named { body, .. }
            | Step::Skill { body, .. }
            | Step::Keep { body, .. }
            | Step::Claim { body, .. } => self.awaits(*body, job),
            _ => None,
        }
    }

    /// The states that steps change depending on when `others` do something.
    fn raced(&mut self, own: &[StepId], others: &[StepId]) -> BTreeSet<u32> {
        let others = self.doing(others);
        if others.written.is_empty() {
            return BTreeSet::new();
        }
        let operations = self.operations(own);
        let lets: Vec<(u32, NodeId)> = own.iter().flat_map(|id| self.lets(*id)).collect();
        let streams = self.streams_of(&operations);
        let mut raced = Raced::default();
        loop {
            let before = (raced.states.len(), raced.locals.len());
            for (local, value) in &lets {
                if self.follows(*value, &others, &BTreeSet::new(), &raced) {
                    raced.locals.insert(*local);
                }
            }
            for (operation, claims) in &operations {
                for action in operation.at_start.iter().chain(&operation.at_end) {
                    self.race(action, claims, &others, &mut raced);
                }
            }
            for (from, to) in &streams {
                let met = others.filled.contains_key(from) || self.holds_any(*from, &raced.states);
                if met {
                    self.add_held(&[*from, *to], &mut raced.states);
                }
            }
            if before == (raced.states.len(), raced.locals.len()) {
                return raced.states;
            }
        }
    }

    /// Notes what an action changes, where that hangs on when others do something.
    fn race(&mut self, action: &Action, claims: &BTreeSet<InstanceId>, others: &Doing, raced: &mut Raced) {
        match action {
            Action::Assign { state, value, .. } => {
                if !matches!(self.lab.states[*state as usize].domain, Domain::Quantity(_)) {
                    return;
                }
                // What adds to a state adds the same whenever it does so.
                let added = self.form(*value).filter(|form| form.terms.contains(&(*state, 1.0)));
                let met = match added {
                    Some(form) => form.terms.iter().any(|(s, _)| s != state && self.is_met(*s, others, claims, raced)),
                    None => self.follows(*value, others, claims, raced),
                };
                if met {
                    raced.states.insert(*state);
                }
            }
            Action::Move { from, to, .. } => {
                let held: BTreeSet<u32> = self.mixtures[*from as usize].iter().map(|(_, s)| *s).collect();
                let reads: BTreeSet<u32> = action.sources().flat_map(|node| self.parts(node).states.clone()).collect();
                let filled = others.filled.get(from).is_some_and(|around| around.is_disjoint(claims));
                // A share of a volume is the same matter, however much others have taken; half of what is there is not.
                let shared = !reads.iter().any(|s| held.contains(s)) && held.iter().any(|s| others.written.contains(s));
                let beside = reads.iter().any(|s| !held.contains(s) && self.is_met(*s, others, claims, raced));
                let kept = action.sources().any(|node| self.names(node, &raced.locals));
                let drawn = shared && others.filled.get(from).is_none_or(|around| around.is_disjoint(claims));
                if filled || drawn || beside || kept || !held.is_disjoint(&raced.states) {
                    self.add_held(&[*from, *to], &mut raced.states);
                }
            }
        }
    }

    /// Whether a value follows from what others change, or from what hangs on that.
    fn follows(&mut self, value: NodeId, others: &Doing, claims: &BTreeSet<InstanceId>, raced: &Raced) -> bool {
        let parts = self.parts(value);
        parts.states.iter().any(|s| self.is_met(*s, others, claims, raced)) || self.names(value, &raced.locals)
    }

    /// Whether others change a state meanwhile, or it hangs on that. What is claimed has one user at a time.
    fn is_met(&self, state: u32, others: &Doing, claims: &BTreeSet<InstanceId>, raced: &Raced) -> bool {
        let claimed = || claims.contains(&self.lab.state_owner[state as usize]);
        raced.states.contains(&state) || (others.written.contains(&state) && !claimed())
    }

    fn names(&self, node: NodeId, locals: &BTreeSet<u32>) -> bool {
        !locals.is_empty() && self.lab.graph.depends(node, |op| matches!(op, Op::Local(l) if locals.contains(l)))
    }

    fn holds_any(&self, mixture: u32, states: &BTreeSet<u32>) -> bool {
        self.mixtures[mixture as usize].iter().any(|(_, s)| states.contains(s))
    }

    fn add_held(&self, mixtures: &[u32], states: &mut BTreeSet<u32>) {
        states.extend(mixtures.iter().flat_map(|m| &self.mixtures[*m as usize]).map(|(_, s)| *s));
    }

    /// What steps change.
    fn doing(&mut self, steps: &[StepId]) -> Doing {
        let written = steps.iter().flat_map(|id| self.writes(*id)).collect();
        let written = self.sets_going(written);
        let mut filled: BTreeMap<u32, BTreeSet<InstanceId>> = BTreeMap::new();
        let operations = self.operations(steps);
        for (operation, claims) in &operations {
            for action in operation.at_start.iter().chain(&operation.at_end) {
                if let Action::Move { to, .. } = action {
                    let around = filled.entry(*to).or_insert_with(|| claims.clone());
                    around.retain(|i| claims.contains(i));
                }
            }
        }
        for (_, to) in self.streams_of(&operations) {
            filled.insert(to, BTreeSet::new());
        }
        Doing { written, filled }
    }

    /// The operations in steps.
    fn operations(&self, steps: &[StepId]) -> Vec<Claimed<'p>> {
        let plan = self.plan;
        let mut out = Vec::new();
        let mut todo: Vec<(StepId, BTreeSet<InstanceId>)> = steps.iter().map(|id| (*id, BTreeSet::new())).collect();
        while let Some((id, mut claims)) = todo.pop() {
            let step = &plan.get(id).step;
            match step {
                Step::Operation(operation) => out.push((operation.as_ref(), claims.clone())),
                Step::Claim { claims: more, .. } => claims.extend(more),
                _ => {}
            }
            todo.extend(step.children().into_iter().map(|child| (child, claims.clone())));
        }
        out
    }

    /// The values that are kept in a step.
    fn lets(&self, id: StepId) -> Vec<(u32, NodeId)> {
        let kept = |id: StepId| match &self.plan.get(id).step {
            Step::Let { local, value } => Some((*local, *value)),
            _ => None,
        };
        self.below(id).into_iter().filter_map(kept).collect()
    }

    /// The streams that operations set going, or stop, from one mixture to another.
    fn streams_of(&self, operations: &[Claimed<'_>]) -> Vec<(u32, u32)> {
        if self.lab.streams.is_empty() {
            return Vec::new();
        }
        let actions = operations.iter().flat_map(|(o, _)| o.at_start.iter().chain(&o.at_end));
        let assigned = actions.filter_map(Action::assigned);
        let rates = assigned.filter_map(|s| self.rates_of.get(&s)).flatten();
        let moved: BTreeSet<u32> =
            rates.map(|i| self.derivatives[*i as usize].state).filter(|s| self.amounts.contains(s)).collect();
        let index = |id: &InstanceId| Some(self.lab.mixtures.binary_search(id).ok()? as u32);
        let ends = self.lab.streams.keys().filter_map(|(_, from, to)| Some((index(from)?, index(to)?)));
        ends.filter(|(_, to)| self.holds_any(*to, &moved)).collect()
    }
}
