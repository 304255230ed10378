//! Checks that are stopped from outside.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::{Diagnostic, Span, codes};

/// Whether a check is of no use any more: shared with whoever may stop it.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// A stop that follows a flag.
    pub fn when(flag: &Arc<AtomicBool>) -> Self {
        Stop(flag.clone())
    }

    /// Whether it was asked for.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The finding of a check that was stopped from outside: what it would have found is not known.
pub fn stopped(at: Span) -> Diagnostic {
    Diagnostic::error(codes::BUDGET_SPENT, at, "the check ran out of time", "`check` stopped here")
        .help("allow more time, or check a smaller protocol")
}
