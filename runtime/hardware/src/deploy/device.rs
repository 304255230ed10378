//! Devices of a lab as they are bound: to a line, or to a person's hands.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use matterix_ir::scene::InstanceId;
use matterix_ir::wire::Driver;
use matterix_ir::{Program, Span};

use super::Trace;
use super::journal::{Entry, Journal};
use crate::codec::{Codec, shown};
use crate::link::{Line, SECURING, STOPPING, WireTap};
use crate::place::Place;

/// What carries out what a device is told.
#[derive(Clone, Debug, PartialEq)]
pub enum Carrier {
    /// A device behind a line.
    Line {
        /// Index of the driver in the program.
        driver: usize,
        /// Where the line is.
        place: Place,
        /// The device's address on it, where it is another than the driver's.
        address: Option<String>,
    },
    /// A device over the line of another one.
    Shared {
        /// Index of the driver in the program.
        driver: usize,
        /// Place of the other among the devices.
        host: usize,
    },
    /// A person, who confirms.
    Hand,
}

/// An instance of the lab and what carries out what it is told.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// The instance.
    pub instance: InstanceId,
    /// Where the bindings say so.
    pub at: Span,
    /// What carries it out.
    pub carrier: Carrier,
    /// By how much what it tells may differ from the twin: member, SI.
    pub tolerances: Vec<(String, f64)>,
    /// What it says when it is asked who it is, where the bindings say so.
    pub identity: Option<String>,
}

/// When something that is repeated was last said.
#[derive(Clone, Copy, Debug)]
pub struct Beat {
    /// Lab time, s.
    pub at: f64,
    /// By the clock that never goes back.
    pub heard: Duration,
}

/// A bound device.
pub struct Device<'m> {
    /// Its name in the lab.
    pub name: &'m str,
    /// How it is bound.
    pub binding: Binding,
    /// How it is spoken to; none where hands do it.
    pub driver: Option<&'m Driver>,
    /// Place of the device whose line it is, where it has none of its own.
    pub host: Option<usize>,
    /// The open line, where it has one of its own.
    pub link: Option<Box<dyn Line>>,
    /// Frames for a dry run.
    pub codec: Option<Codec>,
    /// It has said over the line that is open that it is the one that is meant, or its driver does not ask.
    pub known: bool,
    /// Something was said over its line.
    pub said: bool,
    /// Something was said to it.
    pub told: bool,
    /// Why nothing more is said to it.
    pub lost: Option<String>,
    /// So many answers may still come over its line that nobody waits for any more.
    pub owed: u32,
    /// What a person did not confirm to have done to it.
    pub undone: Vec<String>,
    /// Its line was opened anew after it was lost.
    pub renewed: bool,
    /// When what is repeated was last said, by line of the driver.
    pub beats: Vec<Option<Beat>>,
}

impl<'m> Device<'m> {
    /// A device whose line is not open yet.
    pub fn new(program: &'m Program, binding: Binding) -> Result<Self, String> {
        let (driver, codec) = match &binding.carrier {
            Carrier::Hand => (None, None),
            Carrier::Shared { driver, .. } => {
                let driver = program.drivers.get(*driver).ok_or("the program has no such driver")?;
                (Some(driver), Some(Codec::new(&driver.framing, None)?))
            }
            Carrier::Line { driver, address, .. } => {
                let driver = program.drivers.get(*driver).ok_or("the program has no such driver")?;
                let address = address.as_deref().or(driver.address.as_deref());
                (Some(driver), Some(Codec::new(&driver.framing, address)?))
            }
        };
        let host = match &binding.carrier {
            Carrier::Shared { host, .. } => Some(*host),
            _ => None,
        };
        let name = &program.scene.get(binding.instance).name;
        let beats = vec![None; driver.map_or(0, |d| d.alive.len())];
        let (known, said, told, lost, renewed) = (false, false, false, None, false);
        let (link, owed, undone) = (None, 0, Vec::new());
        Ok(Device { name, binding, driver, host, link, codec, known, said, told, lost, owed, undone, renewed, beats })
    }
}

/// Writes down and shows what goes over a line.
pub(super) struct Listening<'e, 't> {
    pub time: f64,
    pub device: &'e str,
    pub journal: &'e mut Journal,
    pub trace: &'e mut Trace<'t>,
    pub cancel: &'e AtomicBool,
    pub securing: bool,
    /// What went over the line and is written down only if it made no sense: an answer that does is noted as what it tells.
    pub unsaid: Option<Vec<Entry>>,
}

impl Listening<'_, '_> {
    fn note(&mut self, entry: Entry) {
        match &mut self.unsaid {
            Some(unsaid) => unsaid.push(entry),
            None => self.journal.note(&entry),
        }
    }
}

impl WireTap for Listening<'_, '_> {
    fn out(&mut self, bytes: &[u8]) {
        (self.trace)(self.time, self.device, true, bytes);
        self.note(Entry::Out { t: self.time, device: self.device.to_owned(), bytes: shown(bytes) });
    }

    fn back(&mut self, bytes: &[u8]) {
        (self.trace)(self.time, self.device, false, bytes);
        self.note(Entry::Back { t: self.time, device: self.device.to_owned(), bytes: shown(bytes) });
    }

    fn kept(&mut self, word: &str, text: &str) {
        let (word, text) = (word.to_owned(), text.to_owned());
        self.journal.note(&Entry::Kept { t: self.time, device: self.device.to_owned(), word, text });
    }

    fn patience(&self) -> Option<Duration> {
        match (self.securing, self.cancel.load(Ordering::Relaxed)) {
            (true, _) => Some(SECURING),
            (false, true) => Some(STOPPING),
            (false, false) => None,
        }
    }

    fn must_speak(&self) -> bool {
        self.securing
    }
}
