//! Between what a plan says: devices still are as they were told to be. One that switched itself off while nothing was said to it would
//! else be noticed by nobody.

use std::time::Duration;

use matterix_runtime::backend::Backend;
use matterix_runtime::fault::Fault;

use super::hardware::Hardware;
use super::journal::Entry;

/// How often they are asked.
const EVERY: Duration = Duration::from_secs(10);

impl Hardware<'_, '_> {
    /// Asks devices from time to time for what they were set to, as long as nothing has failed: a `finally` that waits is not broken
    /// off by what it is there for.
    pub(super) fn look_between(&mut self) -> Result<(), Fault> {
        let now = self.settings.world.elapsed();
        if self.is_troubled || self.cancelled || now.saturating_sub(self.looked) < EVERY {
            return Ok(());
        }
        let done = self.check_settings();
        self.looked = self.settings.world.elapsed();
        if done.is_err() {
            let t = self.twin.now();
            self.journal.note(&Entry::Looked { t });
        }
        done
    }

    /// What an earlier process met when it asked them at this moment.
    pub(super) fn looked_before(&mut self) -> Result<(), Fault> {
        match self.front() {
            Some(Entry::Looked { t }) if t <= self.twin.now() => {
                self.replay.pop_front();
                self.replayed_fault().map_or(Ok(()), Err)
            }
            _ => Ok(()),
        }
    }
}
