//! Answers that are still owed over a wire: to questions that were given up, where nothing in an answer says what it answers. All that
//! speak over the wire know of them.

use std::cell::{Cell, RefCell};
use std::time::Duration;

/// What is owed over one wire.
#[derive(Debug, Default)]
pub struct Debt {
    answers: Cell<u32>,
    /// The question that was given up last.
    asked: RefCell<String>,
    /// When the first of those was put whose answers have not come.
    since: Cell<Duration>,
    /// The longest that an answer may have taken so far.
    slowest: Cell<Duration>,
    /// An answer has come since the first of those was put.
    has_come: Cell<bool>,
    /// When something went over the wire last, one way or the other.
    stirred: Cell<Duration>,
}

impl Debt {
    /// So many answers.
    pub fn answers(&self) -> u32 {
        self.answers.get()
    }

    /// A question that was put then is given up.
    pub fn owes(&self, asked: &str, put: Duration) {
        if self.answers.get() == 0 {
            self.since.set(put);
            self.has_come.set(false);
        }
        self.answers.set(self.answers.get() + 1);
        asked.clone_into(&mut self.asked.borrow_mut());
    }

    /// Whether this is the question that was given up last.
    pub fn is_for(&self, asked: &str) -> bool {
        self.answers.get() > 0 && *self.asked.borrow() == asked
    }

    /// The question that was given up last.
    pub fn asked(&self) -> String {
        self.asked.borrow().clone()
    }

    /// An answer has come now, which may be to the first of what was asked.
    pub fn heard(&self, now: Duration) {
        if self.answers.get() > 0 {
            self.has_come.set(true);
            self.slowest.set(self.slowest.get().max(now.saturating_sub(self.since.get())));
        }
    }

    /// One of those has come that are owed.
    pub fn paid(&self) {
        self.answers.set(self.answers.get().saturating_sub(1));
    }

    /// Something goes over the wire now.
    pub fn stirs(&self, now: Duration) {
        self.stirred.set(now);
    }

    /// Whether nothing more is taken to come, for a device that has so long for an answer; what was lost is never answered.
    pub fn is_over(&self, timeout: Duration, now: Duration) -> bool {
        now.saturating_sub(self.stirred.get()) >= self.silence(timeout)
    }

    /// How long the wire must be silent for that: as long as any answer may have taken, and twice as long as an answer may take where none
    /// has come that would show how slow the device is.
    pub fn silence(&self, timeout: Duration) -> Duration {
        let least = if self.has_come.get() { timeout } else { timeout.saturating_mul(2) };
        least.max(self.slowest.get())
    }

    /// Nothing more is owed.
    pub fn forget(&self) {
        self.answers.set(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_owed_is_over_when_it_came_or_after_a_silence_as_long_as_the_slowest_answer() {
        let at = Duration::from_millis;
        let debt = Debt::default();
        for put in [0, 2000, 4000] {
            debt.stirs(at(put));
            debt.owes("T?", at(put));
        }
        assert!(debt.is_for("T?") && !debt.is_for("L?"));
        assert_eq!(debt.silence(at(1000)), at(2000));
        debt.stirs(at(5100));
        debt.heard(at(5100));
        debt.paid();
        assert_eq!((debt.answers(), debt.silence(at(1000))), (2, at(5100)));
        assert!(!debt.is_over(at(1000), at(10_000)) && debt.is_over(at(1000), at(10_200)));
        debt.paid();
        debt.paid();
        debt.paid();
        assert_eq!(debt.answers(), 0);
        assert!(!debt.is_for("T?"));
    }
}
