//! Who uses which instance: blocks that claim and wait in turn, operations that use for their duration.

use std::collections::{BTreeMap, VecDeque};

use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;

use super::frame::FrameId;

/// One turn of a schedule: a claiming block that has its instances before every later turn that shares one.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// The `claim`.
    pub step: StepId,
    /// Which time that step is reached, from 0.
    pub occurrence: u32,
    /// What it claims.
    pub instances: Vec<InstanceId>,
    /// It begins no earlier than this, s, so that a window can be kept.
    pub not_before: Option<f64>,
}

/// A request that waits.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Request {
    pub frame: FrameId,
    /// Its turn, where the run follows a schedule that has one for it.
    pub turn: Option<usize>,
    pub instances: Vec<InstanceId>,
    /// Frames whose holdings count as the requester's own.
    pub within: Vec<FrameId>,
}

/// An operation's latest use of an instance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Use {
    pub frame: FrameId,
    /// The operation.
    pub step: StepId,
    /// The frames it stood in, innermost first.
    pub within: Vec<FrameId>,
    /// Whether it goes on.
    pub running: bool,
    /// When it began, s.
    pub time: f64,
}

/// The instances in use and the requests for them.
#[derive(Clone, Debug, Default)]
pub(super) struct Claims {
    /// Claiming blocks by instance, the outermost first.
    held: BTreeMap<InstanceId, Vec<FrameId>>,
    used: BTreeMap<InstanceId, Vec<Use>>,
    queue: Vec<Request>,
    turns: Vec<Turn>,
    /// Turns still to come, by instance.
    order: BTreeMap<InstanceId, VecDeque<usize>>,
    /// How often each step has asked.
    asked: BTreeMap<StepId, u32>,
}

impl Claims {
    /// Claims that follow the turns of a schedule.
    pub fn with_turns(turns: &[Turn]) -> Self {
        let mut order: BTreeMap<InstanceId, VecDeque<usize>> = BTreeMap::new();
        for (index, turn) in turns.iter().enumerate() {
            turn.instances.iter().for_each(|i| order.entry(*i).or_default().push_back(index));
        }
        Claims { turns: turns.to_vec(), order, ..Claims::default() }
    }

    /// The turn of a step that asks now.
    pub fn turn_of(&mut self, step: StepId) -> Option<usize> {
        if self.turns.is_empty() {
            return None;
        }
        let asked = self.asked.entry(step).or_default();
        let found = self.turns.iter().position(|t| t.step == step && t.occurrence == *asked);
        *asked += 1;
        found
    }

    /// Whether it is a request's turn.
    fn is_due(&self, request: &Request, now: f64) -> bool {
        let Some(turn) = request.turn else { return true };
        let first = |i: &InstanceId| self.order.get(i).is_none_or(|o| o.front() == Some(&turn));
        let held_back = self.turns.get(turn).and_then(|t| t.not_before).is_some_and(|t| t > now);
        !held_back && request.instances.iter().all(first)
    }

    /// The next time, s, at which a request that waits is held back no longer.
    pub fn next_due(&self, now: f64) -> Option<f64> {
        let times = self.queue.iter().filter_map(|r| self.turns.get(r.turn?)?.not_before).filter(|t| *t > now);
        times.min_by(f64::total_cmp)
    }

    /// Waits in turn.
    pub fn request(&mut self, request: Request) {
        self.queue.push(request);
    }

    /// Grants what can be granted, in order; `overtake` lets a request pass earlier ones that wait for the same, and
    /// turns that have not come.
    pub fn grant(&mut self, overtake: bool, now: f64) -> Vec<FrameId> {
        let mut granted = Vec::new();
        if self.queue.is_empty() {
            return granted;
        }
        let mut waiting: Vec<Request> = Vec::new();
        for request in std::mem::take(&mut self.queue) {
            let passes = waiting.iter().any(|w| w.instances.iter().any(|i| request.instances.contains(i)));
            let waits = !overtake && (!self.is_due(&request, now) || (passes && request.turn.is_none()));
            if waits || self.blocker(&request).is_some() {
                waiting.push(request);
                continue;
            }
            if let Some(turn) = request.turn {
                self.order.values_mut().for_each(|o| o.retain(|t| *t != turn));
            }
            for &instance in &request.instances {
                self.held.entry(instance).or_default().push(request.frame);
            }
            granted.push(request.frame);
        }
        self.queue = waiting;
        granted
    }

    /// Who has what this request waits for.
    pub fn blocker(&self, request: &Request) -> Option<(InstanceId, FrameId)> {
        request.instances.iter().find_map(|&instance| {
            let holder = self.held.get(&instance).and_then(|h| h.last()).filter(|h| !request.within.contains(h));
            let user = self.used.get(&instance).and_then(|u| u.iter().find(|u| u.running)).map(|u| &u.frame);
            holder.or(user).map(|&frame| (instance, frame))
        })
    }

    /// The requests that wait, in order.
    pub fn waiting(&self) -> &[Request] {
        &self.queue
    }

    /// The block that holds an instance and is none of `within`.
    pub fn foreign_holder(&self, instance: InstanceId, within: &[FrameId]) -> Option<FrameId> {
        self.held.get(&instance).and_then(|h| h.last()).filter(|h| !within.contains(h)).copied()
    }

    /// The innermost of `within` that holds an instance.
    pub fn own_holder(&self, instance: InstanceId, within: &[FrameId]) -> Option<FrameId> {
        self.held.get(&instance).and_then(|h| h.last()).filter(|h| within.contains(h)).copied()
    }

    /// The uses of an instance that go on or began at `now`.
    pub fn uses(&self, instance: InstanceId, now: f64) -> impl Iterator<Item = &Use> {
        self.used.get(&instance).into_iter().flatten().filter(move |u| u.running || u.time >= now)
    }

    /// The uses of all instances that go on or began at `now`.
    pub fn all_uses(&self, now: f64) -> impl Iterator<Item = &Use> {
        self.used.values().flatten().filter(move |u| u.running || u.time >= now)
    }

    /// An operation begins to use an instance.
    pub fn begin(&mut self, instance: InstanceId, new: Use) {
        let uses = self.used.entry(instance).or_default();
        uses.retain(|u| u.running || u.time >= new.time);
        uses.push(new);
    }

    /// A frame has ended: it holds, uses and waits for nothing more.
    pub fn release(&mut self, frame: FrameId) {
        for holders in self.held.values_mut() {
            holders.retain(|&h| h != frame);
        }
        for one in self.used.values_mut().flatten().filter(|u| u.frame == frame) {
            one.running = false;
        }
        self.queue.retain(|r| r.frame != frame);
    }
}
