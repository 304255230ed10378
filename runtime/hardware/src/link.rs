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
    /// A frame has no room for what was to be said, and nothing was.
    Unsaid(String),
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
            Trouble::Lost(text) | Trouble::Garbled(text) | Trouble::Unsaid(text) | Trouble::Refused { text, .. } => {
                text
            }
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

    /// The newest of what the device says by itself, SI, by its line of the driver; one that is older than the driver waits for
    /// an answer is none, and the next is waited for as long.
    fn hear(&mut self, _line: usize, _driver: &Driver, _ear: &mut dyn Overhear) -> Result<f64, Trouble> {
        Err(Trouble::Lost("nothing is heard over this line".to_owned()))
    }

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
    /// What the device said by itself, by the line of its driver: when, and the value.
    heard: BTreeMap<usize, (Duration, f64)>,
    /// What answers said last that is kept, by its name.
    texts: BTreeMap<String, String>,
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
        Ok(Link { world, port, codec, timeout, buffer: Vec::new(), heard: BTreeMap::new(), texts: BTreeMap::new() })
    }

    fn send(&mut self, frame: &[u8], driver: &Driver, ear: &mut dyn Overhear) -> Result<(), Trouble> {
        // What is still there answers nothing that will be asked.
        loop {
            match self.port.receive(self.codec.silence()) {
                Ok(late) if late.is_empty() => break,
                Ok(late) => {
                    ear.back(&late);
                    self.buffer.extend(late);
                }
                Err(e) => return Err(Trouble::Lost(format!("the line is gone: {e}"))),
            }
        }
        if speaks_up(driver) {
            // A line that the device has begun by itself goes on.
            while let Some(reply) = self.codec.take_reply(&mut self.buffer) {
                if let Ok(reply) = reply {
                    self.overheard(&reply, driver);
                }
            }
        } else {
            self.buffer.clear();
        }
        ear.out(frame);
        self.codec.sent(frame);
        self.port.send(frame).map_err(|e| Trouble::Lost(format!("`{}` could not be sent: {e}", shown(frame))))
    }

    fn reply(&mut self, to: &[u8], driver: &Driver, ear: &mut dyn Overhear) -> Result<Reply, Trouble> {
        let begun = self.world.elapsed();
        let mut most = self.timeout;
        let mut hurried = false;
        loop {
            if let Some(reply) = self.codec.take_reply(&mut self.buffer) {
                if reply.as_ref().is_ok_and(|reply| self.overheard(reply, driver)) {
                    continue;
                }
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

    /// Takes what the device says by itself; false of an answer.
    fn overheard(&mut self, reply: &Reply, driver: &Driver) -> bool {
        for (line, told) in driver.told.iter().enumerate().filter(|(_, told)| told.heard.is_some()) {
            if let Some(value) = self.codec.matched(&told.expects, &reply.text).and_then(|n| n.first().copied()) {
                self.heard.insert(line, (self.world.elapsed(), value));
                return true;
            }
        }
        driver.ignores.iter().any(|pattern| self.codec.matched(pattern, &reply.text).is_some())
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
        ear: &mut dyn Overhear,
    ) -> Result<Vec<f64>, Trouble> {
        if let Some(refused) = self.refusal(driver, reply) {
            return Err(refused);
        }
        let Some(pattern) = expects else { return Ok(Vec::new()) };
        let said = self.codec.said(pattern, &reply.text).ok_or_else(|| {
            let (to, expected) = (shown(frame), written(pattern));
            let is = self.codec.shown_reply(None, &reply.text);
            Trouble::Garbled(format!("to `{to}` it answered `{is}`, not `{expected}`"))
        })?;
        for (word, text) in said.kept {
            if self.texts.get(&word) != Some(&text) {
                ear.kept(&word, &text);
                self.texts.insert(word, text);
            }
        }
        Ok(said.numbers)
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
        for frame in self.codec.say(texts).map_err(Trouble::Unsaid)? {
            self.send(&frame, driver, ear)?;
            if expects.is_none() && !self.codec.acknowledges() {
                continue;
            }
            let reply = self.reply(&frame, driver, ear)?;
            let before = self.kept();
            numbers = self.judged(&frame, &reply, expects, driver, ear)?;
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
        let frame = self.codec.ask(text).map_err(Trouble::Unsaid)?;
        self.send(&frame, driver, ear)?;
        let reply = self.reply(&frame, driver, ear)?;
        self.judged(&frame, &reply, Some(expects), driver, ear)
    }

    fn is_ready(
        &mut self,
        text: &str,
        until: &Until,
        driver: &Driver,
        ear: &mut dyn Overhear,
    ) -> Result<bool, Trouble> {
        let frame = self.codec.ask(text).map_err(Trouble::Unsaid)?;
        self.send(&frame, driver, ear)?;
        let reply = self.reply(&frame, driver, ear)?;
        if let Some(refused) = self.refusal(driver, &reply) {
            return Err(refused);
        }
        Ok(match &until.expects {
            Some(pattern) => self.codec.matched(pattern, &reply.text).is_some(),
            None => !reply.busy,
        })
    }

    fn hear(&mut self, line: usize, driver: &Driver, ear: &mut dyn Overhear) -> Result<f64, Trouble> {
        let begun = self.world.elapsed();
        loop {
            while let Some(reply) = self.codec.take_reply(&mut self.buffer) {
                if let Ok(reply) = reply {
                    self.overheard(&reply, driver);
                }
            }
            if let Some((_, value)) = self.heard.get(&line).filter(|(when, _)| self.passed(*when) <= self.timeout) {
                return Ok(*value);
            }
            let most = ear.patience().map_or(self.timeout, |patience| self.timeout.min(patience));
            let left = most.saturating_sub(self.passed(begun));
            if left.is_zero() {
                let wanted = driver.told.get(line).map(|told| written(&told.expects)).unwrap_or_default();
                let why = format!("it did not say anything like `{wanted}` for {} s", self.timeout.as_secs_f64());
                return Err(Trouble::Lost(why));
            }
            let bytes =
                self.port.receive(left.min(LOOK)).map_err(|e| Trouble::Lost(format!("the line is gone: {e}")))?;
            if !bytes.is_empty() {
                ear.back(&bytes);
            }
            self.buffer.extend(bytes);
        }
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

/// Whether a device says something by itself.
fn speaks_up(driver: &Driver) -> bool {
    !driver.ignores.is_empty() || driver.told.iter().any(|told| told.heard.is_some())
}
