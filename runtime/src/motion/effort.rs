//! How long a way is looked for: what is looked at is counted, not time, so that every machine gives up at the same point.

use matterix_motion::plan::Settings;
use matterix_motion::spheres::Checker;

use super::stage::Stage;

/// What one motion may look at before it counts as without a way, in the unit of [`Checker::effort`]: about a second.
pub(super) const EFFORT: u64 = 1_000_000;
/// What share of what is left one search may take, so that some is left for other goals.
const SHARE: u64 = 2;
/// Samples drawn before a way counts as not found.
const SAMPLES: usize = 60_000;

impl Stage<'_> {
    /// A motion begins that may look at so much.
    pub(super) fn refresh(&self, effort: u64) {
        self.effort.set(effort);
    }

    /// Whether nothing more is looked at for this motion.
    pub(super) fn is_weary(&self) -> bool {
        self.effort.get() == 0
    }

    /// So much has been looked at.
    pub(super) fn spend(&self, effort: u64) {
        self.effort.set(self.effort.get().saturating_sub(effort));
    }

    /// What a checker has looked at since its effort was `before`.
    pub(super) fn spent_on(&self, checker: &Checker<'_>, before: u64) {
        self.spend(checker.effort().saturating_sub(before));
    }

    /// Tries something that may look at no more than this share of what is left.
    pub(super) fn within_share<T>(&mut self, share: u64, act: impl FnOnce(&mut Self) -> T) -> T {
        let left = self.effort.get();
        self.effort.set(left / share);
        let out = act(self);
        let spent = (left / share).saturating_sub(self.effort.get());
        self.effort.set(left.saturating_sub(spent));
        out
    }

    /// How long one way is looked for.
    pub(super) fn search(&self) -> Settings {
        let effort = (self.effort.get() / SHARE).max(1);
        Settings { iterations: self.samples(SAMPLES), effort, ..Settings::default() }
    }

    /// Everything as it was, but for what has been looked at.
    pub(super) fn back_to(&mut self, before: &Self) {
        let left = self.effort.get();
        self.clone_from(before);
        self.effort.set(left);
    }
}
