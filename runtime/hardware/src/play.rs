//! A file given to a device that runs it by itself: what its driver says for that, from uploading it to its end.

use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use matterix_ir::wire::{Driver, Exchange, Template};
use matterix_ir::{NodeId, Program};

use crate::link::{DeviceError, Line, Link, SECURING, STOPPING, WireTap};
use crate::place::{self, Place};
use crate::port;
use crate::template;
use crate::world::Machine;

/// Longest time until a device that took what makes it safe says that it is.
const SECURED: Duration = Duration::from_secs(30);

/// How often a device is asked whether it has come to the end.
const POLL: Duration = Duration::from_millis(200);

/// Why a file was not played to its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unplayed {
    /// The device or its line.
    DeviceError(DeviceError),
    /// It was ended early, and the device was told.
    Stopped,
}

/// A file with its name.
pub struct Sheet {
    /// As the device is told.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// A file that was not run to its end.
#[derive(Debug)]
pub struct Broken {
    /// Why.
    pub why: Unplayed,
    /// Nothing was said to the device.
    pub is_untouched: bool,
    /// Why the device may not be safe.
    pub left: Option<String>,
}

/// Gives a file to the device at a place and waits until it has run it. Ended early or in trouble, what its driver calls `safe`
/// is said.
pub fn play(
    program: &Program,
    driver: &Driver,
    place: &Place,
    sheet: Sheet,
    cancel: &AtomicBool,
    ear: &mut dyn WireTap,
) -> Result<(), Broken> {
    let opened = port::open(place, driver).and_then(|mut port| {
        port.attach(&sheet.name, sheet.bytes)?;
        Ok(port)
    });
    let lost =
        |why: String| Broken { why: Unplayed::DeviceError(DeviceError::Lost(why)), is_untouched: true, left: None };
    let port = opened.map_err(|e| lost(place::trouble(place, &e)))?;
    let link = Link::new(Rc::new(Machine::new()), port, driver, None).map_err(lost)?;
    let mut player = Player { program, driver, link, cancel };
    let ear = &mut Hasty { ear, cancel, securing: false };
    let played = driver.play.iter().try_for_each(|exchange| player.exchange(exchange, ear));
    ear.securing = true;
    played.map_err(|why| {
        let left = player.secure(ear).err().map(|trouble| trouble.text().to_owned());
        Broken { why, is_untouched: false, left }
    })
}

/// Hears what another one hears, and waits no longer than seconds for each answer once it is to end.
struct Hasty<'e> {
    ear: &'e mut dyn WireTap,
    cancel: &'e AtomicBool,
    securing: bool,
}

impl WireTap for Hasty<'_> {
    fn out(&mut self, bytes: &[u8]) {
        self.ear.out(bytes);
    }

    fn back(&mut self, bytes: &[u8]) {
        self.ear.back(bytes);
    }

    fn kept(&mut self, word: &str, text: &str) {
        self.ear.kept(word, text);
    }

    fn patience(&self) -> Option<Duration> {
        let stops = self.cancel.load(Ordering::Relaxed).then_some(STOPPING);
        if self.securing { Some(SECURING) } else { stops }
    }
}

struct Player<'p> {
    program: &'p Program,
    driver: &'p Driver,
    link: Link,
    cancel: &'p AtomicBool,
}

impl Player<'_> {
    #[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
    fn exchange(&mut self, exchange: &Exchange, ear: &mut dyn WireTap) -> Result<(), Unplayed> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(Unplayed::Stopped);
        }
        let said = self.link.say(&texts(&exchange.sends), exchange.expects.as_ref(), self.driver, ear);
        said.map_err(Unplayed::DeviceError)?;
        let Some(until) = &exchange.until else { return Ok(()) };
        let most = Duration::try_from_secs_f64(self.number(until.timeout)).unwrap_or(Duration::MAX);
        let begun = Instant::now();
        let question = texts(std::slice::from_ref(&until.asks)).concat();
        loop {
            match self.link.is_ready(&question, until, self.driver, ear) {
                Ok(true) => return Ok(()),
                Ok(false) if begun.elapsed() > most => {
                    return Err(Unplayed::DeviceError(DeviceError::Lost("it was not ready in time".to_owned())));
                }
                Ok(false) => {}
                Err(trouble) => return Err(Unplayed::DeviceError(trouble)),
            }
            if self.cancel.load(Ordering::Relaxed) {
                return Err(Unplayed::Stopped);
            }
            std::thread::sleep(POLL);
        }
    }

    /// Says what makes the device safe; why it may not be. What it tells in the end counts, not whether it took the command.
    #[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
    fn secure(&mut self, ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        for exchange in &self.driver.safe {
            let texts = texts(&exchange.sends);
            if self.link.lacks(self.driver, &texts) {
                continue;
            }
            let said = self.link.say(&texts, exchange.expects.as_ref(), self.driver, ear).map(|_| ());
            let Some(until) =
                exchange.until.as_ref().filter(|_| matches!(said, Ok(()) | Err(DeviceError::Refused { .. })))
            else {
                said?;
                continue;
            };
            let question = self::texts(std::slice::from_ref(&until.asks)).concat();
            let begun = Instant::now();
            while !self.link.is_ready(&question, until, self.driver, ear)? {
                if begun.elapsed() > SECURED {
                    return said.and(Err(DeviceError::Silent("it did not report in time that it is safe".to_owned())));
                }
                std::thread::sleep(POLL);
            }
        }
        Ok(())
    }

    fn number(&self, node: NodeId) -> f64 {
        self.program.model.graph.constant(node).unwrap_or(f64::INFINITY)
    }
}

/// Texts that have no values in them.
fn texts(sends: &[Template]) -> Vec<String> {
    sends.iter().map(|t| template::filled(t, |_| None).unwrap_or_else(|_| template::written(t))).collect()
}
