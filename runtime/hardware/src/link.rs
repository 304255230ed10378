//! A device at the other end of a line: exchanges as its driver declares them.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use matterix_ir::form::plain;
use matterix_ir::quantity::show_number;
use matterix_ir::scene::InstanceId;
use matterix_ir::wire::{Driver, Pattern, Slot, Told, Transport, Until};
use matterix_ir::{Code, codes};

use crate::codec::{Codec, Kept, Reply, shown};
use crate::debt::Debt;
use crate::pattern::written;
use crate::place::{self, Place, SilaServer};
use crate::port::Port;
use crate::world::World;

/// Why a device did not do what it was told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceError {
    /// The line is gone.
    Lost(String),
    /// Nothing came in time over a line that stands, as far as is known.
    Silent(String),
    /// What came is no answer to what was said.
    Garbled(String),
    /// A frame has no room for what was to be said, and nothing was.
    Unsaid(String),
    /// It says that it is another device than the one that is meant.
    Mistaken(String),
    /// The device says no: the failure its driver names, and in words.
    Refused {
        /// As in `reply "..." fails NAME`.
        failure: String,
        /// What it said.
        text: String,
    },
}

impl DeviceError {
    /// The code of a finding about it.
    pub fn code(&self) -> Code {
        match self {
            DeviceError::Lost(_) | DeviceError::Silent(_) => codes::DEVICE_LOST,
            DeviceError::Garbled(_) => codes::DEVICE_GARBLED,
            DeviceError::Unsaid(_) => codes::UNSENDABLE,
            DeviceError::Mistaken(_) => codes::OTHER_DEVICE,
            DeviceError::Refused { .. } => codes::DEVICE_REFUSED,
        }
    }

    /// In words.
    pub fn text(&self) -> &str {
        match self {
            DeviceError::Lost(text)
            | DeviceError::Silent(text)
            | DeviceError::Garbled(text)
            | DeviceError::Unsaid(text)
            | DeviceError::Mistaken(text)
            | DeviceError::Refused { text, .. } => text,
        }
    }
}

/// Told of all that goes over a line.
pub trait WireTap {
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
    /// Whether what is said now must be said, whatever else may still come: it makes a device safe.
    fn must_speak(&self) -> bool {
        false
    }
}

/// Longest wait for an answer once a run is to end.
pub const STOPPING: Duration = Duration::from_secs(10);

/// Longest wait for each answer while devices are made safe.
pub const SECURING: Duration = Duration::from_secs(5);

/// Longest silence after which nothing more is taken for an answer to a question that was given up.
const QUIET: Duration = Duration::from_secs(1);

/// Longest time in which a line that does not fall silent is listened to.
const RESTLESS: Duration = Duration::from_secs(5);

/// So often in a row a line is looked at on which something waits, before others have their turn.
const MOST_WAITING: u32 = 256;

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
        ear: &mut dyn WireTap,
    ) -> Result<Vec<f64>, DeviceError>;

    /// Whether the device takes a command, as far as that is known without saying it; why not.
    fn judge(&self, _text: &str) -> Result<(), String> {
        Ok(())
    }

    /// The same of a question.
    fn judge_question(&self, _text: &str) -> Result<(), String> {
        Ok(())
    }

    /// Asks for a quantity; what the answer says of it, SI.
    fn ask(&mut self, text: &str, told: &Told, driver: &Driver, ear: &mut dyn WireTap) -> Result<f64, DeviceError>;

    /// Whether the device is ready.
    fn is_ready(
        &mut self,
        text: &str,
        until: &Until,
        driver: &Driver,
        ear: &mut dyn WireTap,
    ) -> Result<bool, DeviceError>;

    /// The newest of what the device says by itself, SI, by its line of the driver; one that is older than the driver waits for
    /// an answer is none, or that came before what was done last, and the next is waited for as long.
    fn hear(&mut self, _line: usize, _driver: &Driver, _ear: &mut dyn WireTap) -> Result<f64, DeviceError> {
        Err(DeviceError::Lost("this line receives nothing".to_owned()))
    }

    /// Takes in what the device has said by itself: what waits on a line is as old as nobody looked.
    fn take_in(&mut self, _driver: &Driver, _ear: &mut dyn WireTap) {}

    /// Something was done: what was heard before it says nothing of what is now.
    fn forget_heard(&mut self) {}

    /// What a line of the driver tells, SI: asked for, or heard.
    fn tell(
        &mut self,
        line: usize,
        text: &str,
        told: &Told,
        driver: &Driver,
        ear: &mut dyn WireTap,
    ) -> Result<f64, DeviceError> {
        match told.heard {
            Some(_) => self.hear(line, driver, ear),
            None => self.ask(text, told, driver, ear),
        }
    }

    /// Lets go by what may still come in answer to a question that is given up, before it is put again.
    fn settle(&mut self, _driver: &Driver, _ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        Ok(())
    }

    /// So many answers may still come that nobody waits for any more.
    fn owed(&self) -> u32 {
        0
    }

    /// Whether the device has to hear soon that somebody is there, whatever the plan says to it.
    fn is_to_be_held(&self) -> bool {
        false
    }

    /// Lets it hear that.
    fn hold(&mut self, _driver: &Driver, _ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        Ok(())
    }

    /// What answers said that is put in later.
    fn kept(&self) -> Kept {
        Kept::new()
    }

    /// What answers of a device said last under this word, if any did.
    fn word(&self, _device: InstanceId, _word: &str) -> Option<String> {
        None
    }

    /// Whether something is to be put in that no answer has said: what it is about has never begun.
    fn lacks(&mut self, _driver: &Driver, _texts: &[String]) -> bool {
        false
    }

    /// Puts back what an answer for a device said, to an earlier process or before others spoke.
    fn keep(&mut self, _device: InstanceId, _word: String, _text: String) {}
}

/// Opens the line to a device.
pub fn open(
    world: &Rc<dyn World>,
    place: &Place,
    driver: &Driver,
    address: Option<&str>,
) -> Result<Box<dyn Line>, DeviceError> {
    if let (Place::Sila(server), Transport::Sila { feature, definition }) = (place, &driver.transport) {
        return sila(server, feature, definition.as_deref(), driver.timeout);
    }
    let opened = world.open(place, driver).map_err(|e| place::trouble(place, &e));
    let link = opened.and_then(|port| Link::new(Rc::clone(world), port, driver, address)).map_err(DeviceError::Lost)?;
    Ok(Box::new(link))
}

#[cfg(feature = "sila")]
fn sila(
    server: &SilaServer,
    feature: &str,
    definition: Option<&str>,
    timeout: f64,
) -> Result<Box<dyn Line>, DeviceError> {
    Ok(Box::new(crate::sila::Server::connect(server, feature, definition, timeout)?))
}

#[cfg(not(feature = "sila"))]
fn sila(server: &SilaServer, _: &str, _: Option<&str>, _: f64) -> Result<Box<dyn Line>, DeviceError> {
    let why = "this build has no SiLA 2: build it with `--features sila`";
    Err(DeviceError::Lost(format!("cannot connect to `{}`: {why}", server.at)))
}

/// An open line to a device.
pub struct Link {
    world: Rc<dyn World>,
    port: Box<dyn Port>,
    codec: Codec,
    timeout: Duration,
    buffer: Vec<u8>,
    /// Answers that may still come to what was given up.
    debt: Rc<Debt>,
    /// What was asked last, and when it went out.
    asked: (String, Duration),
    /// What was asked last is to be asked once more.
    is_again: bool,
    /// What the device of this line says by itself, whoever speaks over it: the line of its driver, what it looks like, what is told.
    by_itself: Vec<(usize, Told)>,
    /// What it says by itself and nobody needs.
    ignored: Vec<Pattern>,
    /// Whose line it is.
    own: InstanceId,
    /// What devices said by themselves, by the line of their driver: since when it may have been there, and the value.
    heard: BTreeMap<(InstanceId, usize), (Duration, f64)>,
    /// What was heard before says nothing of what is now.
    done: Duration,
    /// When nothing waited on the line: what comes in next came after that.
    emptied: Duration,
    /// Why the line is gone, where that was seen when nobody waited for anything.
    gone: Option<String>,
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
            Duration::try_from_secs_f64(driver.timeout).map_err(|_| "the timeout is not a duration".to_owned())?;
        let (buffer, heard, texts) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
        let (debt, asked, is_again) = (port.debt(), (String::new(), Duration::ZERO), false);
        let (done, emptied, gone) = (Duration::ZERO, Duration::ZERO, None);
        let by_itself = driver.heard().map(|(line, told)| (line, told.clone())).collect();
        let (ignored, own) = (driver.ignores.clone(), driver.instance);
        Ok(Link {
            world,
            port,
            codec,
            timeout,
            buffer,
            debt,
            asked,
            is_again,
            by_itself,
            ignored,
            own,
            heard,
            done,
            emptied,
            gone,
            texts,
        })
    }

    /// Makes ready to say this. Nothing is said to a device that owes answers but the same once more.
    fn turn_to(&mut self, text: &str, driver: &Driver, ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        if !(std::mem::take(&mut self.is_again) && self.debt.is_for(text)) {
            self.collect(driver, ear)?;
        }
        text.clone_into(&mut self.asked.0);
        Ok(())
    }

    /// Waits until the answers have come that are owed, or the line was silent for so long that they are taken to be lost: one that is
    /// late would be taken for that to what is said next.
    fn collect(&mut self, driver: &Driver, ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        let begun = self.world.elapsed();
        while self.owed() > 0 {
            self.pick_up(driver);
            let silence = self.debt.silence(self.timeout);
            if self.debt.is_over(self.timeout, self.world.elapsed()) {
                self.debt.forget();
            }
            let most = ear.patience().unwrap_or(silence + RESTLESS);
            if self.owed() > 0 && self.passed(begun) >= most {
                if ear.must_speak() {
                    return Ok(());
                }
                let (n, seconds) = (self.owed(), silence.as_secs_f64());
                let what = if n == 1 { "a reply".to_owned() } else { format!("{n} replies") };
                return Err(DeviceError::Garbled(format!(
                    "it still owes {what} to `{}`: nothing else is sent before its line is silent for {} s",
                    self.debt.asked(),
                    show_number(seconds)
                )));
            }
            if self.owed() > 0 {
                self.listen(LOOK, ear)?;
            }
        }
        Ok(())
    }

    /// Lets go by what has come in answer to what was given up; each answer is one that is owed no more.
    fn pick_up(&mut self, driver: &Driver) {
        while let Some(late) = self.codec.take_reply(&mut self.buffer) {
            if late.as_ref().is_ok_and(|late| self.overheard(late, driver)) {
                continue;
            }
            self.debt.heard(self.world.elapsed());
            self.debt.paid();
        }
    }

    fn send(&mut self, frame: &[u8], driver: &Driver, ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        // What is still there answers nothing that will be asked.
        while self.receive(self.codec.silence(), ear).map_err(DeviceError::Lost)? {
            self.pick_up(driver);
        }
        self.pick_up(driver);
        // A line that the device has begun by itself goes on.
        if !self.speaks_up(driver) {
            self.buffer.clear();
        }
        self.asked.1 = self.world.elapsed();
        self.debt.stirs(self.asked.1);
        ear.out(frame);
        self.codec.sent(frame);
        self.port.send(frame).map_err(|e| DeviceError::Lost(format!("`{}` could not be sent: {e}", shown(frame))))
    }

    fn reply(&mut self, to: &[u8], driver: &Driver, ear: &mut dyn WireTap) -> Result<Reply, DeviceError> {
        let begun = self.world.elapsed();
        let mut most = self.timeout;
        let mut hurried = false;
        loop {
            if let Some(reply) = self.codec.take_reply(&mut self.buffer) {
                if reply.as_ref().is_ok_and(|reply| self.overheard(reply, driver)) {
                    continue;
                }
                self.debt.heard(self.world.elapsed());
                self.sift(driver);
                return reply
                    .map_err(|g| DeviceError::Garbled(format!("its reply to `{}` is invalid: {}", shown(to), g.why)));
            }
            if let Some(patience) = ear.patience().filter(|_| !hurried) {
                hurried = true;
                most = most.min(self.passed(begun) + patience);
            }
            let left = most.saturating_sub(self.passed(begun));
            if left.is_zero() {
                let seconds = if hurried { most.as_secs_f64().round() } else { most.as_secs_f64() };
                self.debt.owes(&self.asked.0, self.asked.1);
                return Err(match self.buffer.as_slice() {
                    [] => DeviceError::Silent(format!("it did not reply to `{}` within {seconds} s", shown(to))),
                    half => DeviceError::Garbled(format!(
                        "its reply to `{}` stopped after `{}`: nothing more came within {seconds} s",
                        shown(to),
                        shown(half)
                    )),
                });
            }
            self.listen(left.min(LOOK), ear).inspect_err(|_| self.debt.owes(&self.asked.0, self.asked.1))?;
        }
    }

    /// What comes in meanwhile; whether something did.
    fn listen(&mut self, within: Duration, ear: &mut dyn WireTap) -> Result<bool, DeviceError> {
        let came = self.receive(within, ear).map_err(|why| match self.port.renews() {
            true => DeviceError::Silent(why),
            false => DeviceError::Lost(why),
        })?;
        if came {
            self.debt.stirs(self.world.elapsed());
        }
        Ok(came)
    }

    /// Takes in what waits on the line, or the first that comes within this time; whether there was anything.
    fn receive(&mut self, within: Duration, ear: &mut dyn WireTap) -> Result<bool, String> {
        if let Some(why) = self.gone.take() {
            return Err(why);
        }
        let bytes = self.port.receive(within).map_err(|e| format!("the line was lost: {e}"))?;
        if bytes.is_empty() {
            self.emptied = self.world.elapsed();
            return Ok(false);
        }
        ear.back(&bytes);
        self.buffer.extend(bytes);
        Ok(true)
    }

    /// Takes what the device has said by itself behind an answer.
    fn sift(&mut self, driver: &Driver) {
        while self.speaks_up(driver) && !self.buffer.is_empty() {
            let mut rest = self.buffer.clone();
            match self.codec.take_reply(&mut rest) {
                Some(Ok(reply)) if self.overheard(&reply, driver) => self.buffer = rest,
                _ => return,
            }
        }
    }

    /// Whether more of what is late may come over a line that is listened to since `begun`, on which something was last heard then.
    fn may_come(&self, begun: Duration, heard: Duration) -> bool {
        self.passed(heard) < self.timeout.min(QUIET) && self.passed(begun) < RESTLESS
    }

    /// The answer to a question. Where some before it were not answered in time, the first that comes may be to one of those: the last is
    /// to this one, as far as all come before the line falls silent for a while.
    fn answer(&mut self, to: &[u8], driver: &Driver, ear: &mut dyn WireTap) -> Result<Reply, DeviceError> {
        let mut reply = self.reply(to, driver, ear)?;
        let begun = self.world.elapsed();
        let mut heard = begun;
        while self.owed() > 0 && self.may_come(begun, heard) {
            if self.listen(LOOK.min(self.timeout), ear)? {
                heard = self.world.elapsed();
            }
            while let Some(later) = self.codec.take_reply(&mut self.buffer) {
                let later = later
                    .map_err(|g| DeviceError::Garbled(format!("its reply to `{}` is invalid: {}", shown(to), g.why)))?;
                if !self.overheard(&later, driver) {
                    self.debt.heard(self.world.elapsed());
                    self.debt.paid();
                    reply = later;
                }
            }
        }
        Ok(reply)
    }

    /// Takes what the device says by itself; false of an answer.
    fn overheard(&mut self, reply: &Reply, driver: &Driver) -> bool {
        for (line, told) in &self.by_itself {
            if let Some(value) = self.codec.matched(&told.expects, &reply.text).and_then(|n| n.first().copied()) {
                // What its instrument cannot show is nothing that was said.
                if showable(told, &[value], &told.expects, told.shows).is_ok() {
                    self.heard.insert((self.own, *line), (self.emptied, value));
                }
                return true;
            }
        }
        let mut ignored = self.ignored.iter().chain(&driver.ignores);
        ignored.any(|pattern| self.codec.matched(pattern, &reply.text).is_some())
    }

    /// Whether something may come that nobody asked for.
    fn speaks_up(&self, driver: &Driver) -> bool {
        !(self.by_itself.is_empty() && self.ignored.is_empty() && driver.ignores.is_empty())
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
        ear: &mut dyn WireTap,
    ) -> Result<Vec<f64>, DeviceError> {
        if let Some(refused) = self.refusal(driver, reply) {
            return Err(refused);
        }
        let Some(pattern) = expects else { return Ok(Vec::new()) };
        let said = self.codec.said(pattern, &reply.text).ok_or_else(|| {
            let (to, expected) = (shown(frame), written(pattern));
            let is = self.codec.shown_reply(None, &reply.text);
            DeviceError::Garbled(format!("it replied `{is}` to `{to}`, not `{expected}`"))
        })?;
        self.note_texts(said.kept, ear);
        Ok(said.numbers)
    }

    /// Tells what an answer said that a journal keeps, where it is new.
    fn note_texts(&mut self, kept: Vec<(String, String)>, ear: &mut dyn WireTap) {
        for (word, text) in kept {
            if self.texts.get(&word) != Some(&text) {
                ear.kept(&word, &text);
                self.texts.insert(word, text);
            }
        }
    }

    /// Who speaks from here on, where the framing puts in what answers said.
    fn speak_for(&mut self, driver: &Driver) {
        if let Codec::Json(json) = &mut self.codec {
            json.speak_for(driver);
        }
    }

    /// Tells what an answer said that is put in later.
    fn note_kept(&self, before: &Kept, ear: &mut dyn WireTap) {
        for ((_, word), text) in self.kept().iter().filter(|(word, text)| before.get(*word) != Some(*text)) {
            ear.kept(word, text);
        }
    }

    /// The failure that an answer means.
    fn refusal(&mut self, driver: &Driver, reply: &Reply) -> Option<DeviceError> {
        let named = driver.refusals.iter().find(|r| self.codec.matched(&r.reply, &reply.text).is_some());
        let text = format!("it replied `{}`", self.codec.shown_reply(named.map(|n| &n.reply), &reply.text));
        match named {
            Some(named) => Some(DeviceError::Refused { failure: named.failure.clone(), text }),
            None if reply.is_error => Some(DeviceError::Refused { failure: "refused".to_owned(), text }),
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
        ear: &mut dyn WireTap,
    ) -> Result<Vec<f64>, DeviceError> {
        let mut numbers = Vec::new();
        self.speak_for(driver);
        let frames = self.codec.say(texts).map_err(DeviceError::Unsaid)?;
        self.turn_to(&texts.concat(), driver, ear)?;
        for (place, frame) in frames.into_iter().enumerate() {
            self.send(&frame, driver, ear)?;
            if expects.is_none() && !self.codec.acknowledges() {
                continue;
            }
            let reply = self.reply(&frame, driver, ear)?;
            let before = self.kept();
            numbers = self.judged(&frame, &reply, expects.map(|e| e.of(place)), driver, ear)?;
            self.note_kept(&before, ear);
        }
        Ok(numbers)
    }

    fn ask(&mut self, text: &str, told: &Told, driver: &Driver, ear: &mut dyn WireTap) -> Result<f64, DeviceError> {
        self.speak_for(driver);
        let frame = self.codec.ask(text).map_err(DeviceError::Unsaid)?;
        self.turn_to(text, driver, ear)?;
        self.send(&frame, driver, ear)?;
        let reply = self.answer(&frame, driver, ear)?;
        if let Some(refused) = self.refusal(driver, &reply) {
            return Err(refused);
        }
        let codec = &mut self.codec;
        let found = told.forms().find_map(|(form, shows)| Some((codec.said(form, &reply.text)?, form, shows)));
        let Some((said, form, shows)) = found else {
            let (to, is) = (shown(&frame), self.codec.shown_reply(None, &reply.text));
            return Err(DeviceError::Garbled(format!("it replied `{is}` to `{to}`, not `{}`", forms(told))));
        };
        self.note_texts(said.kept, ear);
        showable(told, &said.numbers, form, shows)
    }

    fn settle(&mut self, driver: &Driver, ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        self.is_again = true;
        let begun = self.world.elapsed();
        let mut heard = begun;
        while self.may_come(begun, heard) {
            if self.listen(LOOK.min(self.timeout), ear)? {
                heard = self.world.elapsed();
            }
        }
        self.pick_up(driver);
        self.buffer.clear();
        Ok(())
    }

    fn is_ready(
        &mut self,
        text: &str,
        until: &Until,
        driver: &Driver,
        ear: &mut dyn WireTap,
    ) -> Result<bool, DeviceError> {
        self.speak_for(driver);
        let frame = self.codec.ask(text).map_err(DeviceError::Unsaid)?;
        self.turn_to(text, driver, ear)?;
        self.send(&frame, driver, ear)?;
        let reply = self.answer(&frame, driver, ear)?;
        // What is waited for may be what else means a failure: that a run is stopped, where it is to stop.
        let before = self.kept();
        if let Some(pattern) = &until.expects
            && self.codec.matched(pattern, &reply.text).is_some()
        {
            self.note_kept(&before, ear);
            return Ok(true);
        }
        match self.refusal(driver, &reply) {
            Some(refused) => Err(refused),
            None => Ok(until.expects.is_none() && !reply.busy),
        }
    }

    fn hear(&mut self, line: usize, driver: &Driver, ear: &mut dyn WireTap) -> Result<f64, DeviceError> {
        let begun = self.world.elapsed();
        loop {
            self.take_in(driver, ear);
            if let Some((since, value)) = self.heard.get(&(driver.instance, line))
                && *since >= self.done
                && self.passed(*since) <= self.timeout
            {
                return Ok(*value);
            }
            let most = ear.patience().map_or(self.timeout, |patience| self.timeout.min(patience));
            let left = most.saturating_sub(self.passed(begun));
            if left.is_zero() {
                let wanted = driver.told.get(line).map(|told| written(&told.expects)).unwrap_or_default();
                let why = format!("it sent nothing like `{wanted}` for {} s", self.timeout.as_secs_f64());
                return Err(DeviceError::Silent(why));
            }
            self.listen(left.min(LOOK), ear)?;
        }
    }

    fn take_in(&mut self, driver: &Driver, ear: &mut dyn WireTap) {
        if self.by_itself.is_empty() {
            return;
        }
        for _ in 0..MOST_WAITING {
            self.pick_up(driver);
            match self.receive(Duration::ZERO, ear) {
                Ok(true) => self.debt.stirs(self.world.elapsed()),
                Ok(false) => return,
                Err(why) => {
                    self.gone = Some(why);
                    return;
                }
            }
        }
    }

    fn forget_heard(&mut self) {
        self.done = self.world.elapsed();
    }

    fn owed(&self) -> u32 {
        if self.codec.keeps_answers_apart() { 0 } else { self.debt.answers() }
    }

    fn kept(&self) -> Kept {
        match &self.codec {
            Codec::Json(json) => json.kept().clone(),
            _ => Kept::new(),
        }
    }

    fn word(&self, device: InstanceId, word: &str) -> Option<String> {
        match &self.codec {
            Codec::Json(json) => json.kept().get(&(device, word.to_owned())).cloned(),
            _ => self.texts.get(word).cloned(),
        }
    }

    fn lacks(&mut self, driver: &Driver, texts: &[String]) -> bool {
        self.speak_for(driver);
        matches!(&self.codec, Codec::Json(json) if texts.iter().any(|t| json.lacks(t)))
    }

    fn keep(&mut self, device: InstanceId, word: String, text: String) {
        if let Codec::Json(json) = &mut self.codec {
            json.keep(device, word, text);
        }
    }
}

/// What may be answered, as it was written, for messages.
pub(crate) fn forms(told: &Told) -> String {
    told.forms().map(|(form, _)| written(form)).collect::<Vec<_>>().join("` or `")
}

/// What is told, where its instrument can show that.
pub(crate) fn showable(
    told: &Told,
    numbers: &[f64],
    form: &Pattern,
    shows: Option<[f64; 2]>,
) -> Result<f64, DeviceError> {
    let value = *numbers.first().ok_or_else(|| DeviceError::Garbled("the reply has no number".to_owned()))?;
    let Some([least, most]) = shows.filter(|[least, most]| !(*least..=*most).contains(&value)) else {
        return Ok(value);
    };
    let unit = form.slots.iter().find_map(|s| match s {
        Slot::Number(unit, _) => Some(unit),
        _ => None,
    });
    let unit = unit.unwrap_or(&told.unit);
    let range = match (least.is_finite(), most.is_finite()) {
        (true, true) => format!("{} to {}", unit.show(least), unit.show(most)),
        (true, false) => format!("{} and more", unit.show(least)),
        _ => format!("at most {}", show_number(unit.of_si(most))),
    };
    let mut is = unit.show(value);
    if range.contains(&is) {
        is = format!("{} {}", plain(unit.of_si(value)), unit.symbol);
    }
    Err(DeviceError::Garbled(format!("its reply gives `{}` as {}, but its range is {range}", told.name, is.trim())))
}
