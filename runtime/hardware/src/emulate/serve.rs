//! When an emulator ends, how fast its lab time passes, and its turns.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::Emulator;

/// How often the twin moves on where nothing comes in.
pub(super) const TICK: Duration = Duration::from_millis(5);

/// When to end, and how fast lab time passes.
#[derive(Clone, Copy, Debug)]
pub struct Stop<'c> {
    /// Set from outside.
    pub cancel: &'c AtomicBool,
    /// Seconds of lab time per second.
    pub speed: f64,
}

pub(super) struct Clock {
    begun: Instant,
    speed: f64,
}

impl Clock {
    #[allow(clippy::disallowed_methods, reason = "an emulator answers by the wall clock")]
    pub(super) fn new(speed: f64) -> Self {
        Clock { begun: Instant::now(), speed }
    }

    pub(super) fn now(&self) -> f64 {
        self.begun.elapsed().as_secs_f64() * self.speed
    }
}

/// Lets time pass to now and answers.
pub(super) fn turn(emulator: &mut Emulator<'_>, clock: &Clock, came: &[u8]) -> Result<Vec<u8>, String> {
    emulator.pass(clock.now()).map_err(|f| f.message)?;
    let mut out = emulator.spoken();
    if !came.is_empty() {
        out.extend(emulator.receive(came).map_err(|f| f.message)?);
    }
    Ok(out)
}
