//! How values are looked at.

use super::Elaborator;

/// How values are looked at: those of now and true, if nothing else is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Mode {
    /// They are those at the start of the run.
    pub at_start: bool,
    /// Readings are what devices report, not the true values behind them.
    pub reported: bool,
    /// Amounts are those that were put there, before equilibria have moved them: what laws change, and what is conserved.
    pub pooled: bool,
}

impl Mode {
    /// As the run begins.
    pub const START: Mode = Mode { at_start: true, reported: false, pooled: false };
    /// As devices report them.
    pub const REPORTED: Mode = Mode { at_start: false, reported: true, pooled: false };
}

impl Elaborator<'_> {
    /// How values are looked at now.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Does something in a mode.
    pub fn in_mode<R>(&mut self, mode: Mode, work: impl FnOnce(&mut Self) -> R) -> R {
        let outer = self.enter_mode(mode);
        let result = work(self);
        self.enter_mode(outer);
        result
    }

    /// From now on values are looked at in a mode; the one before, for who goes back to it.
    pub fn enter_mode(&mut self, mode: Mode) -> Mode {
        std::mem::replace(&mut self.mode, mode)
    }
}
