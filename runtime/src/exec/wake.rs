//! Time: what the frames wait for, how far the clock may go, who is looked at afterwards.

use std::collections::BTreeMap;

use matterix_ir::NodeId;
use matterix_ir::codes;
use matterix_ir::plan::Step;
use matterix_ir::quantity::show_number;

use super::Executor;
use super::frame::{End, Follower, FrameId, Kind};
use super::judge::Raised;
use crate::backend::Follow;
use crate::fault::Fault;
use crate::process::{Advance, Watch};

/// What is waited for.
struct Agenda {
    /// The earliest timer or report, s.
    next: f64,
    watches: Vec<Watch>,
    /// By watch.
    owners: Vec<FrameId>,
    /// Whether anything but monitors is waited for.
    progress: bool,
}

impl Agenda {
    fn at(&mut self, time: f64) {
        self.next = self.next.min(time);
    }

    fn watch(&mut self, owner: FrameId, node: NodeId, value: bool) {
        self.watches.push(Watch { node, value });
        self.owners.push(owner);
    }

    fn follow(&mut self, owner: FrameId, follower: &Follower, value: bool) {
        match follower.follow {
            Follow::Watch(node) => self.watch(owner, node, value),
            _ => self.at(follower.next),
        }
    }
}

/// By frame, the nodes whose watches fired.
type Fired = BTreeMap<FrameId, Vec<NodeId>>;

impl Executor<'_, '_> {
    /// Advances to the next instant at which something may happen, and lets it happen.
    pub(super) fn pass_time(&mut self) {
        self.state.taken += 1;
        let agenda = self.agenda();
        let fired = if !agenda.progress { self.unblock() } else { self.advance(&agenda) };
        let looked = fired.and_then(|fired| self.sample().map(|()| fired));
        match looked {
            // Nothing new begins at the instant at which it was ended early.
            Ok(_) if self.is_to_end() => {}
            Ok(fired) => {
                self.alarmed();
                self.look_at_all(&fired);
            }
            Err(fault) => {
                self.fault_everywhere(fault);
                self.drain();
            }
        }
    }

    fn agenda(&self) -> Agenda {
        let mut agenda = Agenda { next: f64::INFINITY, watches: Vec::new(), owners: Vec::new(), progress: false };
        for (&id, frame) in &self.state.frames {
            let mut waits = true;
            match &frame.kind {
                Kind::Wait { at } => agenda.at(*at),
                Kind::WaitUntil { follower, deadline } => {
                    agenda.follow(id, follower, true);
                    agenda.at(*deadline);
                }
                Kind::Hold { follower, end, deadline, .. } => {
                    agenda.follow(id, follower, end.is_none());
                    agenda.at(end.unwrap_or(f64::INFINITY).min(*deadline));
                }
                Kind::Operation { until, watch, .. } => {
                    agenda.at(until.unwrap_or(f64::INFINITY));
                    if let Some(node) = watch {
                        agenda.watch(id, *node, true);
                    }
                }
                Kind::Held | Kind::Asked { .. } => {}
                Kind::Monitored { monitors, breach: None } if frame.stop.is_none() => {
                    monitors.iter().for_each(|m| agenda.follow(id, &m.follower, false));
                    waits = false;
                }
                _ => waits = false,
            }
            agenda.progress |= waits;
        }
        if let Some(due) = self.state.claims.next_due(self.state.now) {
            agenda.at(due);
            agenda.progress = true;
        }
        agenda
    }

    /// Lets time pass.
    fn advance(&mut self, agenda: &Agenda) -> Result<Fired, Fault> {
        if self.state.taken > self.limits.steps_per_instant {
            self.state.taken = 0;
            let limit = self.limits.steps_per_instant;
            let message = format!("the run takes more than {limit} steps at one instant");
            return Err(self.run_fault(codes::ENDLESS_INSTANT, message));
        }
        let recordings = self.state.recordings.values().map(super::Recording::due).fold(f64::INFINITY, f64::min);
        let look = self.limits.looks.times.get(self.state.looked).copied().unwrap_or(f64::INFINITY);
        let until = agenda.next.min(recordings).min(look).min(self.state.horizon).min(self.until).max(self.state.now);
        let before = self.state.now;
        let advance = self.backend.advance(until, &agenda.watches, self.out);
        self.state.now = self.backend.now().max(before);
        let fired = match advance? {
            Advance::Reached => {
                self.state.now = self.state.now.max(until);
                Fired::new()
            }
            Advance::Watch(indices) => fired(agenda, indices),
            Advance::Broken(limits) => {
                self.limits_broken(&limits);
                Fired::new()
            }
        };
        if self.state.now > before {
            self.state.taken = 0;
        }
        if self.state.now >= self.state.horizon && fired.is_empty() && agenda.next > self.state.horizon {
            return Err(self.out_of_time());
        }
        Ok(fired)
    }

    /// Nothing waits for time: requests may overtake each other; if that does not help the run is stuck.
    fn unblock(&mut self) -> Result<Fired, Fault> {
        if self.grant(true) {
            self.drain();
            return Ok(Fired::new());
        }
        let mut fault = self.run_fault(codes::DEADLOCK, self.standstill());
        fault.help.push("claim all of them in one `claim`, or in the same order everywhere".to_owned());
        Err(fault)
    }

    /// The fault of waiting beyond the horizon, which moves on so that what is left can still be done.
    fn out_of_time(&mut self) -> Fault {
        let days = show_number(self.limits.horizon / 86_400.0);
        self.state.horizon = self.state.now + self.limits.horizon;
        let waits = self.state.frames.values().filter_map(|f| f.step.filter(|_| f.children.is_empty()));
        let (mut span, mut what) = (None, None);
        for step in waits {
            let node = self.plan.get(step);
            let condition = match &node.step {
                Step::WaitUntil { condition, .. } | Step::Hold { condition, .. } => Some(condition),
                Step::Operation(operation) => operation.until.as_ref(),
                _ => None,
            };
            span = span.or(condition.map(|c| c.span)).or(Some(node.span));
            what = what.or(condition.map(|c| format!("`{}`", c.text))).or(Some(format!("`{}`", node.label)));
        }
        let what = what.unwrap_or_else(|| "its end".to_owned());
        let message = format!("the run still waits for {what} after {days} days of lab time");
        Fault { span, ..Fault::new(codes::WAITS_FOR_EVER, self.state.now, message).help("give it a `timeout`") }
    }

    /// Looks at every frame in the order in which they began; what follows from one happens before the next.
    fn look_at_all(&mut self, fired: &Fired) {
        self.grant(false);
        self.drain();
        let ids: Vec<FrameId> = self.state.frames.keys().copied().collect();
        for id in ids {
            let nodes = fired.get(&id).map_or(&[][..], Vec::as_slice);
            if let Err(fault) = self.look(id, nodes) {
                self.fault(id, fault);
            }
            self.drain();
        }
    }

    fn look(&mut self, id: FrameId, fired: &[NodeId]) -> Result<(), Fault> {
        let Some(frame) = self.state.frames.get(&id) else { return Ok(()) };
        let stopped = frame.stop.is_some();
        match &frame.kind {
            Kind::Held if !stopped => {
                if let Some(step) = frame.step {
                    self.begin_act(id, step)?;
                }
            }
            Kind::Asked { .. } => self.look_at_question(id)?,
            Kind::Wait { at } if self.state.now >= *at => self.push_end(id, End::Done),
            Kind::WaitUntil { .. } => self.look_at_wait(id, fired)?,
            Kind::Hold { .. } => self.look_at_hold(id, fired)?,
            Kind::Operation { until, .. }
                if !fired.is_empty() || until.is_some_and(|u| self.state.now >= u) || self.backend.has_befallen() =>
            {
                self.poll(id)?;
            }
            Kind::Monitored { .. } if !stopped => self.look_at_monitors(id, fired)?,
            _ => {}
        }
        Ok(())
    }

    /// Whether a condition holds, if this is known anew: its watch for `value` fired, or a reading has reported.
    pub(super) fn news(
        &mut self,
        follower: &mut Follower,
        value: bool,
        fired: &[NodeId],
    ) -> Result<Option<bool>, Fault> {
        if fired.contains(&follower.node()) {
            self.backend.defined(follower.node())?;
            return Ok(Some(value));
        }
        if self.state.now < follower.next {
            return Ok(None);
        }
        follower.looked(self.state.now);
        self.follower_holds(follower).map(Some)
    }

    fn look_at_wait(&mut self, id: FrameId, fired: &[NodeId]) -> Result<(), Fault> {
        let Some(Kind::WaitUntil { follower, deadline }) = self.state.frames.get(&id).map(|f| f.kind.clone()) else {
            return Ok(());
        };
        let mut follower = follower;
        let news = self.news(&mut follower, true, fired)?;
        self.set_kind(id, Kind::WaitUntil { follower, deadline });
        if news == Some(true) {
            self.push_end(id, End::Done);
        } else if self.state.now >= deadline {
            self.time_out(id);
        }
        Ok(())
    }

    fn look_at_hold(&mut self, id: FrameId, fired: &[NodeId]) -> Result<(), Fault> {
        let Some(Kind::Hold { follower, duration, end, deadline }) = self.state.frames.get(&id).map(|f| f.kind.clone())
        else {
            return Ok(());
        };
        if end.is_some_and(|e| self.state.now >= e) {
            self.push_end(id, End::Done);
            return Ok(());
        }
        let (mut follower, mut end) = (follower, end);
        match self.news(&mut follower, end.is_none(), fired)? {
            Some(true) => end = end.or_else(|| Some(self.backend.moment_after(duration))),
            Some(false) => end = None,
            None => {}
        }
        self.set_kind(id, Kind::Hold { follower, duration, end, deadline });
        if end.is_some_and(|e| self.state.now >= e) {
            self.push_end(id, End::Done);
        } else if self.state.now >= deadline {
            self.time_out(id);
        }
        Ok(())
    }

    fn time_out(&mut self, id: FrameId) {
        let plan = self.plan;
        let Some(frame) = self.state.frames.get(&id) else { return };
        let waited = show_number(self.state.now - frame.started);
        let condition = frame.step.and_then(|s| match &plan.get(s).step {
            Step::WaitUntil { condition, .. } | Step::Hold { condition, .. } => Some(condition),
            _ => None,
        });
        let raised = match condition {
            Some(c) => {
                let text = format!("`{}` did not become true within {waited} s", c.text);
                self.unmet(c, "timeout", codes::RUN_FAILED, text)
            }
            None => Raised::named("timeout", format!("still not done after {waited} s")),
        };
        self.fail(id, raised);
    }
}

fn fired(agenda: &Agenda, indices: Vec<usize>) -> Fired {
    let mut all = Fired::new();
    for index in indices {
        if let (Some(owner), Some(watch)) = (agenda.owners.get(index), agenda.watches.get(index)) {
            all.entry(*owner).or_default().push(watch.node);
        }
    }
    all
}
