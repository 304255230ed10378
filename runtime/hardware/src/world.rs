//! Everything outside of a deployment that it rests on: the time and the ports of the machine. Tests put a simulated world in its place.

use std::io;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use matterix_ir::wire::Driver;

use crate::place::Place;
use crate::port::{self, Port};

/// Clocks and ports.
pub trait World {
    /// Time since some moment; it never goes back.
    fn elapsed(&self) -> Duration;

    /// s since 1970, by the machine's clock, which may be set.
    fn wall(&self) -> f64;

    /// Lets so much time pass.
    fn sleep(&self, time: Duration);

    /// Opens a port; an error where nobody is there.
    fn open(&self, place: &Place, driver: &Driver) -> io::Result<Box<dyn Port>>;
}

/// The machine that the program runs on.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    begun: Instant,
}

impl Machine {
    /// From now on.
    #[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
    pub fn new() -> Self {
        Machine { begun: Instant::now() }
    }
}

impl Default for Machine {
    fn default() -> Self {
        Machine::new()
    }
}

impl World for Machine {
    fn elapsed(&self) -> Duration {
        self.begun.elapsed()
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
