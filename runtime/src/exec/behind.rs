//! Which uses of this instant a line of steps comes behind: those that have brought about what it waited for, and what came before them.
//! It uses the same things after them, not at the same time.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::NodeId;
use matterix_ir::plan::Step;

use super::Executor;
use super::claims::Use;
use super::frame::{FrameId, Kind};

/// By frame, the uses of one instant that what begins in it comes behind.
#[derive(Clone, Debug, Default)]
pub(super) struct Behind {
    /// The instant, s.
    time: f64,
    uses: BTreeMap<FrameId, BTreeSet<FrameId>>,
}

impl Executor<'_, '_> {
    /// A wait under `parent` is over: its line comes behind what has changed the condition at this instant.
    pub(super) fn comes_behind(&mut self, parent: Option<FrameId>, condition: NodeId) {
        let now: Vec<Use> = self.state.claims.all_uses(self.state.now).filter(|u| !u.running).cloned().collect();
        let mut past: BTreeSet<FrameId> = BTreeSet::new();
        for cause in now.iter().filter(|used| self.changes(used, condition)) {
            past.insert(cause.frame);
            past.extend(cause.within.iter().filter_map(|f| self.behind_now()?.get(f)).flatten());
            past.extend(
                now.iter().filter(|u| u.frame < cause.frame && !self.beside(&cause.within, u)).map(|u| u.frame),
            );
        }
        if past.is_empty() {
            return;
        }
        if self.state.behind.time != self.state.now {
            self.state.behind = Behind { time: self.state.now, uses: BTreeMap::new() };
        }
        let mut line = parent;
        while let Some(id) = line {
            let Some(frame) = self.state.frames.get(&id).filter(|f| !matches!(f.kind, Kind::Parallel { .. })) else {
                return;
            };
            let (job, outer) = (frame.job, frame.parent);
            self.state.behind.uses.entry(id).or_default().extend(&past);
            line = outer.filter(|_| !job);
        }
    }

    /// Whether a use may change how a condition comes out.
    fn changes(&self, used: &Use, condition: NodeId) -> bool {
        match &self.plan.get(used.step).step {
            Step::Operation(operation) => self.backend.may_change(operation, condition),
            _ => false,
        }
    }

    fn behind_now(&self) -> Option<&BTreeMap<FrameId, BTreeSet<FrameId>>> {
        (self.state.behind.time == self.state.now).then_some(&self.state.behind.uses)
    }

    /// Whether what begins within these frames comes behind a use.
    pub(super) fn is_behind(&self, within: &[FrameId], used: &Use) -> bool {
        let known = self.behind_now().filter(|known| !known.is_empty());
        let after = |known: &BTreeMap<FrameId, BTreeSet<FrameId>>| {
            within.iter().filter_map(|frame| known.get(frame)).any(|uses| uses.contains(&used.frame))
        };
        !used.running && known.is_some_and(after)
    }
}
