//! Who uses which instance: blocks that claim and wait in turn, operations that use for their duration.

use std::collections::BTreeMap;

use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;

use super::frame::FrameId;

/// A request that waits.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Request {
    pub frame: FrameId,
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
}

impl Claims {
    /// Waits in turn.
    pub fn request(&mut self, request: Request) {
        self.queue.push(request);
    }

    /// Grants what can be granted, in order; `overtake` lets a request pass earlier ones that wait for the same.
    pub fn grant(&mut self, overtake: bool) -> Vec<FrameId> {
        let mut granted = Vec::new();
        if self.queue.is_empty() {
            return granted;
        }
        let mut waiting: Vec<Request> = Vec::new();
        for request in std::mem::take(&mut self.queue) {
            let passes = waiting.iter().any(|w| w.instances.iter().any(|i| request.instances.contains(i)));
            if (passes && !overtake) || self.blocker(&request).is_some() {
                waiting.push(request);
                continue;
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
