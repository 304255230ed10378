//! Everything outside of a deployment that it rests on: the time and the ports of the machine. Tests put a simulated world in its place.

use std::io;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use matterix_ir::wire::Driver;

use crate::place::Place;
use crate::port::{self, Port};

/// Clocks and ports.
pub trait World {
    /// Time since some moment; it never goes back, and goes on while the machine sleeps.
    fn elapsed(&self) -> Duration;

    /// s since 1970, by the machine's clock, which may be set.
    fn wall(&self) -> f64;

    /// Lets so much time pass.
    fn sleep(&self, time: Duration);

    /// Opens a port; an error where nobody is there.
    fn open(&self, place: &Place, driver: &Driver) -> io::Result<Box<dyn Port>>;

    /// How long this process was held up since this was last asked, beside what it waits for: it was stopped, or the machine was
    /// asleep or busy.
    fn held_up(&self) -> Duration {
        Duration::ZERO
    }

    /// What was done until now took its time by right.
    fn excuse(&self) {}
}

/// Time since the machine was started. What the standard library offers stands still on some machines while they sleep, and
/// devices go on.
#[cfg(unix)]
fn awake_or_not() -> Duration {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    const CLOCK: rustix::time::ClockId = rustix::time::ClockId::Boottime;
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    const CLOCK: rustix::time::ClockId = rustix::time::ClockId::Monotonic;
    let now = rustix::time::clock_gettime(CLOCK);
    Duration::new(u64::try_from(now.tv_sec).unwrap_or(0), u32::try_from(now.tv_nsec).unwrap_or(0))
}

/// Time since the first call.
#[cfg(not(unix))]
#[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
fn awake_or_not() -> Duration {
    static BEGUN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    BEGUN.get_or_init(std::time::Instant::now).elapsed()
}

/// The machine that the program runs on.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    begun: Duration,
}

impl Machine {
    /// From now on.
    pub fn new() -> Self {
        Machine { begun: awake_or_not() }
    }
}

impl Default for Machine {
    fn default() -> Self {
        Machine::new()
    }
}

impl World for Machine {
    fn elapsed(&self) -> Duration {
        awake_or_not().saturating_sub(self.begun)
    }

    #[allow(clippy::disallowed_methods, reason = "a journal says when things were done")]
    fn wall(&self) -> f64 {
        SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64())
    }

    fn sleep(&self, time: Duration) {
        std::thread::sleep(time);
    }

    fn open(&self, place: &Place, driver: &Driver) -> io::Result<Box<dyn Port>> {
        port::open(place, driver)
    }
}
