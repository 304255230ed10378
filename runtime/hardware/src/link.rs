//! A device at the other end of a line: exchanges as its driver declares them.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use matterix_ir::wire::{Driver, Pattern, Transport, Until};

use crate::codec::{Codec, Reply, shown};
use crate::pattern::written;
use crate::place::{self, Place};
use crate::port::Port;
use crate::world::World;

/// Why a device did not do what it was told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// The line is gone, or nothing came in time.
    Lost(String),
    /// What came is no answer to what was said.
    Garbled(String),
    /// The device says no: the failure its driver names, and in words.
    Refused {
        /// As in `reply "..." fails NAME`.
        failure: String,
        /// What it said.
        text: String,
    },
}

impl Trouble {
    /// In words.
    pub fn text(&self) -> &str {
        match self {
            Trouble::Lost(text) | Trouble::Garbled(text) | Trouble::Refused { text, .. } => text,
        }
    }
}

/// Told of all that goes over a line.
pub trait Overhear {
    /// These bytes are about to go out.
    fn out(&mut self, bytes: &[u8]);
    /// These bytes have come in.
    fn back(&mut self, bytes: &[u8]);
    /// This is what an answer said that is put in later, under its word.
    fn kept(&mut self, word: &str, text: &str);
    /// How long an answer is waited for from now on, where that is less than the driver says: it is to end.
    fn patience(&self) -> Option<Duration> {
        None
    }
}

/// Longest wait for an answer once a run is to end.
pub const STOPPING: Duration = Duration::from_secs(10);

/// Longest wait for each answer while devices are made safe.
pub const SECURING: Duration = Duration::from_secs(5);

/// How often who waits for an answer looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// A device that is spoken to.
pub trait Line {
    /// Says commands one after the other; the numbers of the last answer, SI, where answers are expected.
    fn say(
        &mut self,
        texts: &[String],
        expects: Option<&Pattern>,
        driver: &Driver,
        ear: &mut dyn Overhear,
    ) -> Result<Vec<f64>, Trouble>;

    /// Asks; the numbers of the answer, SI.
    fn ask(
        &mut self,
        text: &str,
        expects: &Pattern,
        driver: &Driver,
        ear: &mut dyn Overhear,
    ) -> Result<Vec<f64>, Trouble>;

    /// Whether the device is ready.
    fn is_ready(&mut self, text: &str, until: &Until, driver: &Driver, ear: &mut dyn Overhear)
    -> Result<bool, Trouble>;

    /// What answers said that is put in later, by its word.
    fn kept(&self) -> BTreeMap<String, String> {
        BTreeMap::new()
    }

    /// Whether something is to be put in that no answer has said: what it is about has never begun.
    fn lacks(&self, _texts: &[String]) -> bool {
        false
    }

    /// Puts back what an answer said to an earlier process.
    fn keep(&mut self, _word: String, _text: String) {}
}

/// Opens the line to a device.
pub fn open(
    world: &Rc<dyn World>,
    place: &Place,
    driver: &Driver,
    address: Option<&str>,
) -> Result<Box<dyn Line>, Trouble> {
    if let (Place::Sila(server), Transport::Sila { feature }) = (place, &driver.transport) {
        return sila(server, feature, driver.timeout);
    }
    let opened = world.open(place, driver).map_err(|e| place::trouble(place, &e));
    let link = opened.and_then(|port| Link::new(Rc::clone(world), port, driver, address)).map_err(Trouble::Lost)?;
    Ok(Box::new(link))
}

#[cfg(feature = "sila")]
fn sila(server: &str, feature: &str, timeout: f64) -> Result<Box<dyn Line>, Trouble> {
    Ok(Box::new(crate::sila::Server::connect(server, feature, timeout)?))
}

#[cfg(not(feature = "sila"))]
fn sila(server: &str, _: &str, _: f64) -> Result<Box<dyn Line>, Trouble> {
    let why = "this build does not speak SiLA 2: build it with `--features sila`";
    Err(Trouble::Lost(format!("cannot connect to `{server}`: {why}")))
}

/// An open line to a device.
pub struct Link {
    world: Rc<dyn World>,
    port: Box<dyn Port>,
    codec: Codec,
    timeout: Duration,
    buffer: Vec<u8>,
}

impl Link {
    /// A line in use by a driver.
    pub fn new(
        world: Rc<dyn World>,
        port: Box<dyn Port>,
        driver: &Driver,
        address: Option<&str>,
    ) -> Result<Self, String> {
        let codec = Codec::new(&driver.framing, address.or(driver.address.as_deref()))?;
        let timeout =
            Duration::try_from_secs_f64(driver.timeout).map_err(|_| "the timeout is no duration".to_owned())?;
        Ok(Link { world, port, codec, timeout, buffer: Vec::new() })
    }

    fn send(&mut self, frame: &[u8], ear: &mut dyn Overhear) -> Result<(), Trouble> {
        // What is still there answers nothing that will be asked.
        loop {
            match self.port.receive(Duration::ZERO) {
                Ok(late) if late.is_empty() => break,
                Ok(late) => ear.back(&late),
                Err(e) => return Err(Trouble::Lost(format!("the line is gone: {e}"))),
            }
        }
        self.buffer.clear();
        ear.out(frame);
        self.port.send(frame).map_err(|e| Trouble::Lost(format!("`{}` could not be sent: {e}", shown(frame))))
    }

    fn reply(&mut self, to: &[u8], ear: &mut dyn Overhear) -> Result<Reply, Trouble> {
        let begun = self.world.elapsed();
        let mut most = self.timeout;
        let mut hurried = false;
        loop {
            if let Some(reply) = self.codec.take_reply(&mut self.buffer) {
                return reply
                    .map_err(|g| Trouble::Garbled(format!("its answer to `{}` makes no sense: {}", shown(to), g.why)));
            }
            if let Some(patience) = ear.patience().filter(|_| !hurried) {
                hurried = true;
                most = most.min(self.passed(begun) + patience);
            }
            let left = most.saturating_sub(self.passed(begun));
            if left.is_zero() {
                let seconds = if hurried { most.as_secs_f64().round() } else { most.as_secs_f64() };
                return Err(match self.buffer.as_slice() {
                    [] => Trouble::Lost(format!("it did not answer `{}` within {seconds} s", shown(to))),
                    half => Trouble::Garbled(format!(
                        "its answer to `{}` broke off after `{}`: nothing more came within {seconds} s",
                        shown(to),
                        shown(half)
                    )),
                });
            }
            let bytes =
                self.port.receive(left.min(LOOK)).map_err(|e| Trouble::Lost(format!("the line is gone: {e}")))?;
            if !bytes.is_empty() {
                ear.back(&bytes);
            }
            self.buffer.extend(bytes);
        }
    }

    fn passed(&self, since: Duration) -> Duration {
        self.world.elapsed().saturating_sub(since)
    }

    /// The numbers of an answer, unless it is a refusal or says something else.
    fn judged(
        &mut self,
        frame: &[u8],
        reply: &Reply,
        expects: Option<&Pattern>,
        driver: &Driver,
    ) -> Result<Vec<f64>, Trouble> {
        if let Some(refused) = self.refusal(driver, reply) {
            return Err(refused);
        }
        let Some(pattern) = expects else { return Ok(Vec::new()) };
        self.codec.matched(pattern, &reply.text).ok_or_else(|| {
            let (to, expected) = (shown(frame), written(pattern));
            let is = self.codec.shown_reply(None, &reply.text);
            Trouble::Garbled(format!("to `{to}` it answered `{is}`, not `{expected}`"))
        })
    }

    /// The failure that an answer means.
    fn refusal(&mut self, driver: &Driver, reply: &Reply) -> Option<Trouble> {
        let named = driver.refusals.iter().find(|r| self.codec.matched(&r.reply, &reply.text).is_some());
        let text = format!("it answered `{}`", self.codec.shown_reply(named.map(|n| &n.reply), &reply.text));
        match named {
            Some(named) => Some(Trouble::Refused { failure: named.failure.clone(), text }),
            None if reply.is_error => Some(Trouble::Refused { failure: "refused".to_owned(), text }),
            None => None,
        }
    }
}

impl Line for Link {
    fn say(
        &mut self,
        texts: &[String],
        expects: Option<&Pattern>,
        driver: &Driver,
        ear: &mut dyn Overhear,
    ) -> Result<Vec<f64>, Trouble> {
        let mut numbers = Vec::new();
        for frame in self.codec.say(texts) {
            self.send(&frame, ear)?;
            if expects.is_none() && !self.codec.acknowledges() {
                continue;
            }
            let reply = self.reply(&frame, ear)?;
            let before = self.kept();
            numbers = self.judged(&frame, &reply, expects, driver)?;
            for (word, text) in self.kept().iter().filter(|(word, text)| before.get(*word) != Some(*text)) {
                ear.kept(word, text);
            }
        }
        Ok(numbers)
    }

    fn ask(
        &mut self,
        text: &str,
        expects: &Pattern,
        driver: &Driver,
        ear: &mut dyn Overhear,
    ) -> Result<Vec<f64>, Trouble> {
        let frame = self.codec.ask(text);
        self.send(&frame, ear)?;
        let reply = self.reply(&frame, ear)?;
        self.judged(&frame, &reply, Some(expects), driver)
    }

    fn is_ready(
        &mut self,
        text: &str,
        until: &Until,
        driver: &Driver,
        ear: &mut dyn Overhear,
    ) -> Result<bool, Trouble> {
        let frame = self.codec.ask(text);
        self.send(&frame, ear)?;
        let reply = self.reply(&frame, ear)?;
        if let Some(refused) = self.refusal(driver, &reply) {
            return Err(refused);
        }
        Ok(match &until.expects {
            Some(pattern) => self.codec.matched(pattern, &reply.text).is_some(),
            None => !reply.busy,
        })
    }

    fn kept(&self) -> BTreeMap<String, String> {
        match &self.codec {
            Codec::Json(json) => json.kept().clone(),
            _ => BTreeMap::new(),
        }
    }

    fn lacks(&self, texts: &[String]) -> bool {
        matches!(&self.codec, Codec::Json(json) if texts.iter().any(|t| json.lacks(t)))
    }

    fn keep(&mut self, word: String, text: String) {
        if let Codec::Json(json) = &mut self.codec {
            json.keep(word, text);
        }
    }
}
