//! The lab keeps abreast of the clock where something begins or ends: a device that took its time to answer has not stopped the
//! clock, so that a wait behind it is as long as it says, and a window that has passed has passed.

use matterix_runtime::backend::Backend;
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;
use matterix_runtime::process::Advance;

use super::hardware::Hardware;
use super::journal::{Entry, Turn};

/// Lab time and clock may differ by so much where something begins, s by the clock.
const BEHIND: f64 = 0.05;

impl Hardware<'_, '_> {
    /// Where the lab has to be for what begins or ends now, s, if it is behind the clock: as an earlier process has it, or by the
    /// clock.
    pub(super) fn late(&mut self, what: Turn) -> Option<f64> {
        if let Some(next) = self.front() {
            let Entry::Late { what: of, to, .. } = next else { return None };
            if of != what {
                return None;
            }
            self.replay.pop_front();
            return Some(to);
        }
        let (now, clock) = (self.twin.now(), self.clock());
        if self.is_dry() || !self.is_live() || clock - now <= BEHIND * self.settings.speed {
            return None;
        }
        self.journal.note(&Entry::Late { t: now, to: clock, what });
        Some(clock)
    }

    /// The lab comes to where the clock is. Limits that break meanwhile are told when time passes next.
    pub(super) fn keep_abreast(&mut self, what: Turn, out: &mut dyn Listener) -> Result<(), Fault> {
        let Some(to) = self.late(what) else { return Ok(()) };
        while self.twin.now() < to {
            if let Advance::Broken(limits) = self.twin.advance(to, &[], out)? {
                self.broken_meanwhile.extend(limits);
            }
        }
        Ok(())
    }
}
