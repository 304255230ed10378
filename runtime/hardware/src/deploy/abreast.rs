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

/// By such a share of it a wait may be shorter than it is written, or by so much, s by the clock.
const SHORTER: f64 = 0.01;
const LEAST: f64 = 1e-3;

impl Hardware<'_, '_> {
    /// Where the lab has to be for what begins or ends now, s, if it is behind the clock: as an earlier process has it, or by the
    /// clock.
    pub(super) fn late(&mut self, what: Turn) -> Option<f64> {
        self.late_by(what, BEHIND)
    }

    /// The same of a wait that lasts so long, s: it is to last that long by the clock.
    pub(super) fn late_for(&mut self, what: Turn, lasts: f64) -> Option<f64> {
        self.late_by(what, (SHORTER * lasts / self.settings.speed).clamp(LEAST, BEHIND))
    }

    /// The same where lab time and clock may differ by so much, s by the clock.
    fn late_by(&mut self, what: Turn, slack: f64) -> Option<f64> {
        if let Some(next) = self.front() {
            let Entry::Late { what: of, to, .. } = next else { return None };
            if of != what {
                return None;
            }
            self.replay.pop_front();
            return Some(to);
        }
        let (now, clock) = (self.twin.now(), self.clock());
        if self.is_dry() || !self.is_live() || clock - now <= slack * self.settings.speed {
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
