//! Operations: their claims, their needs, their course on the backend.

use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Text, codes};

use super::Executor;
use super::claims::{Request, Use};
use super::frame::{End, Follower, FrameId, Kind, Stop};
use super::judge::{Raised, at};
use super::listener::OperationState;
use crate::backend::{Follow, Status};
use crate::fault::Fault;

impl<'p> Executor<'p, '_> {
    /// Begins a step that acts, or holds it back while nothing new may begin. What a `finally` does is never held back.
    pub(super) fn begin_act(&mut self, id: FrameId, step: StepId) -> Result<(), Fault> {
        let plan = self.plan;
        let finally = self.state.frames.get(&id).is_some_and(|f| f.finally);
        if !finally && !self.backend.admits() {
            self.set_kind(id, Kind::Held);
            return Ok(());
        }
        self.set_kind(id, Kind::Pass);
        match &plan.get(step).step {
            Step::Operation(operation) => self.begin_operation(id, operation),
            Step::Ask(text) => self.ask(id, step, text),
            _ => Ok(()),
        }
    }

    /// Puts a question; what follows begins when it has been answered.
    fn ask(&mut self, id: FrameId, step: StepId, text: &'p Text) -> Result<(), Fault> {
        let text = self.words(text)?;
        self.out.ask(self.state.now, step, &text);
        match self.backend.ask(step, &text, self.out)? {
            Some(ticket) => {
                self.set_kind(id, Kind::Asked { ticket });
                self.look_at_question(id)
            }
            None => {
                self.push_end(id, End::Done);
                Ok(())
            }
        }
    }

    /// Goes on where a question has been answered.
    pub(super) fn look_at_question(&mut self, id: FrameId) -> Result<(), Fault> {
        let Some(Kind::Asked { ticket }) = self.state.frames.get(&id).map(|f| &f.kind) else { return Ok(()) };
        let finally = self.state.frames.get(&id).is_some_and(|f| f.finally);
        match self.backend.answered(*ticket, self.out)? {
            // Who says no wants it to end; what leaves things as they should be goes on all the same.
            Some(yes) if yes || finally => {
                if !yes {
                    self.decline(id, "a person answered no".to_owned());
                }
                self.set_kind(id, Kind::Pass);
                self.push_end(id, End::Done);
            }
            Some(_) | None => {}
        }
        Ok(())
    }

    /// A person said no in a `finally`, which goes on with what comes next.
    fn decline(&mut self, id: FrameId, text: String) {
        let trace = self.trace(id, Raised::named("refused", text));
        self.out.failure(&trace);
        match self.state.declined {
            None => self.state.declined = Some(trace),
            Some(_) => self.state.suppressed.push(trace),
        }
    }

    /// Starts an operation unless something else uses what it writes; inside a `finally` it waits for that instead.
    pub(super) fn begin_operation(&mut self, id: FrameId, operation: &'p Operation) -> Result<(), Fault> {
        let finally = self.state.frames.get(&id).is_some_and(|f| f.finally);
        if finally {
            self.set_kind(id, Kind::Acquire);
            self.request(id, operation.claims.clone());
            return Ok(());
        }
        match self.conflict(id, operation) {
            Some(text) => {
                let raised = Raised { code: codes::CLAIMED_TWICE, ..Raised::named("claimed", text) };
                self.fail(id, raised);
                Ok(())
            }
            None => self.start_operation(id, operation),
        }
    }

    /// Asks for instances; what becomes free is granted in turn.
    pub(super) fn request(&mut self, id: FrameId, instances: Vec<InstanceId>) {
        let within = self.ancestors(id).collect();
        let claim = self
            .state
            .frames
            .get(&id)
            .and_then(|f| f.step)
            .filter(|s| matches!(self.plan.get(*s).step, Step::Claim { .. }));
        let turn = claim.and_then(|step| self.state.claims.turn_of(step));
        self.state.claims.request(Request { frame: id, turn, instances, within });
        self.grant(false);
    }

    /// Lets every request go on that can be granted; whether there was one.
    pub(super) fn grant(&mut self, overtake: bool) -> bool {
        let plan = self.plan;
        let granted = self.state.claims.grant(overtake, self.state.now);
        for &id in granted.iter().rev() {
            let Some(step) = self.state.frames.get(&id).filter(|f| f.stop.is_none()).and_then(|f| f.step) else {
                continue;
            };
            match &plan.get(step).step {
                Step::Claim { body, .. } => {
                    self.set_kind(id, Kind::Claim { granted: true });
                    self.spawn(id, *body);
                }
                Step::Operation(operation) => {
                    if let Err(fault) = self.start_operation(id, operation) {
                        self.fault(id, fault);
                    }
                }
                _ => {}
            }
        }
        !granted.is_empty()
    }

    /// Who else writes what the operation writes at this time, in words.
    fn conflict(&self, id: FrameId, operation: &Operation) -> Option<String> {
        let within: Vec<FrameId> = self.ancestors(id).collect();
        let own = self.label(id);
        operation.claims.iter().find_map(|&instance| {
            let name = self.instance(instance);
            if let Some(holder) = self.state.claims.foreign_holder(instance, &within) {
                return Some(format!("`{own}` uses `{name}` while `{}` has claimed it", self.label(holder)));
            }
            let exclusive = self.state.claims.own_holder(instance, &within);
            let independent = |u: &Use| match &self.plan.get(u.step).step {
                Step::Operation(other) => operation.is_independent_of(other),
                _ => false,
            };
            let mut others =
                self.state.claims.uses(instance, self.state.now).filter(|u| u.frame != id && !independent(u));
            let behind = |u: &Use| self.is_behind(&within, u);
            let other = others.find(|u| {
                u.running || (exclusive.is_none_or(|c| u.within.contains(&c)) && self.beside(&within, u) && !behind(u))
            })?;
            let other = &self.plan.get(other.step).label;
            Some(format!("`{own}` and `{other}` use `{name}` at the same time"))
        })
    }

    /// Whether the frames `within` run beside an earlier use, not after it.
    pub(super) fn beside(&self, within: &[FrameId], earlier: &Use) -> bool {
        let Some(position) = within.iter().position(|f| earlier.within.contains(f)) else { return false };
        let parallel =
            self.state.frames.get(&within[position]).is_some_and(|f| matches!(f.kind, Kind::Parallel { .. }));
        let is_job = |f: &FrameId| self.state.frames.get(f).is_some_and(|f| f.job);
        // What was done before a job was started is not beside it.
        let jobs = within[..position].iter().any(|f| is_job(f) && *f < earlier.frame)
            || earlier.within.iter().take_while(|f| !within.contains(f)).any(is_job);
        parallel || jobs
    }

    fn start_operation(&mut self, id: FrameId, operation: &'p Operation) -> Result<(), Fault> {
        let Some(step) = self.state.frames.get(&id).and_then(|f| f.step) else { return Ok(()) };
        if !self.needs_met(id, step, &operation.needs)? {
            return Ok(());
        }
        if let Some(alarm) = self.backend.foresee(step, operation, self.out) {
            self.sound(id, alarm);
            return Ok(());
        }
        if let Some(until) = &operation.until
            && self.backend.follow(until.node) == Follow::Assumed
        {
            self.assume(step, until);
        }
        let within: Vec<FrameId> = self.ancestors(id).collect();
        for &instance in &operation.claims {
            let new = Use { frame: id, step, within: within.clone(), running: true, time: self.state.now };
            self.state.claims.begin(instance, new);
        }
        let started = self.backend.start(step, operation, self.out);
        // Who was told may have taken time to say so.
        self.state.now = self.backend.now().max(self.state.now);
        let ticket = started?;
        self.set_kind(id, Kind::Operation { ticket, until: None, watch: None });
        self.out.operation(self.state.now, step, operation, OperationState::Started);
        self.changed();
        if self.state.frames.get(&id).is_none_or(|f| f.stop == Some(Stop::Now)) {
            return Ok(());
        }
        self.poll(id)
    }

    /// Asks the backend how an operation stands.
    pub(super) fn poll(&mut self, id: FrameId) -> Result<(), Fault> {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get(&id) else { return Ok(()) };
        let (Kind::Operation { ticket, .. }, Some(step)) = (&frame.kind, frame.step) else { return Ok(()) };
        let Step::Operation(operation) = &plan.get(step).step else { return Ok(()) };
        let ticket = *ticket;
        let status = self.backend.poll(ticket, self.out);
        self.state.now = self.backend.now().max(self.state.now);
        match status? {
            Status::Running { until, watch } => {
                self.set_kind(id, Kind::Operation { ticket, until, watch });
                self.alarmed_by(id);
            }
            Status::Done => {
                self.set_kind(id, Kind::Pass);
                self.out.operation(self.state.now, step, operation, OperationState::Ended);
                self.changed();
                if !self.alarmed_by(id) && self.within_limits(id, operation)? && !self.went_beyond(id, operation) {
                    self.push_end(id, End::Done);
                }
            }
            Status::Declined { text } => {
                self.set_kind(id, Kind::Pass);
                self.out.operation(self.state.now, step, operation, OperationState::Failed);
                self.changed();
                match self.state.frames.get(&id).is_some_and(|f| f.finally) {
                    true => {
                        self.decline(id, text);
                        self.push_end(id, End::Done);
                    }
                    false => self.fail(id, Raised::named("refused", text)),
                }
            }
            Status::Failed { name, text } => {
                self.set_kind(id, Kind::Pass);
                self.out.operation(self.state.now, step, operation, OperationState::Failed);
                self.changed();
                self.fail(id, Raised::named(&name, text));
            }
        }
        Ok(())
    }

    /// Raises a failure for the first limit that an operation has passed; whether all hold.
    fn within_limits(&mut self, id: FrameId, operation: &Operation) -> Result<bool, Fault> {
        let plan = self.plan;
        let Some(step) = self.state.frames.get(&id).and_then(|f| f.step) else { return Ok(true) };
        for &index in &operation.limits {
            let Some(limit) = plan.limits.get(index as usize).map(|l| &l.condition) else { continue };
            let holds = self.backend.limit(index, limit.node, self.out).map_err(|f| at(f, limit.span))?;
            if holds.is_none() {
                self.assume(step, limit);
            }
            if holds == Some(false) {
                let label = self.label(id).to_owned();
                let text = format!("`{label}` makes `{}` false", limit.text);
                let raised = self.refused(limit, &label, text);
                self.fail(id, raised);
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The world changed within this instant: invariants are looked at before anything else happens.
    fn changed(&mut self) {
        let watched: Vec<(FrameId, usize, Follower)> = self
            .state
            .frames
            .iter()
            .filter(|(_, f)| f.stop.is_none())
            .filter_map(|(&id, f)| match &f.kind {
                Kind::Monitored { monitors, breach: None } => Some((id, monitors)),
                _ => None,
            })
            .flat_map(|(id, monitors)| monitors.iter().map(move |m| (id, m.index, m.follower.clone())))
            .filter(|(_, _, follower)| matches!(follower.follow, Follow::Watch(_)))
            .collect();
        for (id, index, follower) in watched {
            match self.follower_holds(&follower) {
                Ok(true) => {}
                Ok(false) => self.breach(id, index),
                Err(fault) => self.fault(id, fault),
            }
        }
    }

    pub(super) fn label(&self, id: FrameId) -> &str {
        self.state.frames.get(&id).and_then(|f| f.step).map_or("", |s| &self.plan.get(s).label)
    }

    pub(super) fn instance(&self, id: InstanceId) -> &str {
        self.scene.instances.get(id.0 as usize).map_or("?", |i| &i.name)
    }

    /// Who waits for what, in words.
    pub(super) fn standstill(&self) -> String {
        let claims = self.state.claims.waiting().iter().filter_map(|request| {
            let (instance, holder) = self.state.claims.blocker(request)?;
            let (waiter, holder, name) = (self.label(request.frame), self.label(holder), self.instance(instance));
            Some(format!("`{waiter}` waits for `{name}`, which `{holder}` has claimed"))
        });
        let jobs = self.state.frames.iter().filter_map(|(&id, f)| match f.kind {
            Kind::Await { .. } => {
                let Step::Await { job } = &self.plan.get(f.step?).step else { return None };
                Some(format!("`{}` waits for job `{job}`", self.label(id)))
            }
            _ => None,
        });
        let all: Vec<String> = claims.chain(jobs).collect();
        format!(
            "all steps wait for each other: {}",
            if all.is_empty() { "no step is running".into() } else { all.join("; ") }
        )
    }
}
