//! Which devices are in a state that a run has brought them to, for who has no time to make them safe.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Devices that were told something and have not been made safe since, by name.
#[derive(Debug, Default)]
pub struct Exposed(Mutex<BTreeSet<String>>);

impl Exposed {
    /// None yet.
    pub const fn new() -> Self {
        Exposed(Mutex::new(BTreeSet::new()))
    }

    /// Their names, in order.
    pub fn names(&self) -> Vec<String> {
        self.all().iter().cloned().collect()
    }

    pub(super) fn told(&self, name: &str) {
        self.all().insert(name.to_owned());
    }

    pub(super) fn safe(&self, name: &str) {
        self.all().remove(name);
    }

    fn all(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
