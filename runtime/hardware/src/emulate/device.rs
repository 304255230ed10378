//! One emulated device at a line: requests in, answers out, the twin in between.

use std::collections::BTreeMap;

use matterix_ir::plan::{Condition, Operation};
use matterix_ir::wire::{Driver, Exchange, Pattern, Served, Slot, Template, Told, Until};
use matterix_ir::{Span, codes};
use matterix_runtime::backend::{Backend, Sim, Status, Ticket};
use matterix_runtime::fault::Fault;

use super::solve::solve;
use crate::codec::{Codec, Reply, Request};
use crate::pattern::Shown;
use crate::template::{self, Found};

/// The failure that a driver gives to what its device does not understand.
const NOT_UNDERSTOOD: &str = "not_understood";
/// The failure that a driver gives to what comes while its device is busy.
const BUSY: &str = "busy";

/// Most characters of a message that is not understood.
const SHOWN: usize = 200;

/// A device at a line.
pub(super) struct Unit<'m> {
    /// The device's, then those over its line.
    drivers: Vec<&'m Driver>,
    codec: Codec,
    running: Vec<(Ticket, &'m Operation)>,
    /// The last message of each form, by driver, command and its place among what that sends.
    heard: BTreeMap<(usize, usize, usize), Vec<Found>>,
    /// What was said last: what is asked then is asked about it.
    said: Option<&'m Exchange>,
    /// What was answered last.
    last: Vec<u8>,
    input: Vec<u8>,
    /// When it says next what it says by itself, in the order of its lines, s.
    due: Vec<(&'m Told, f64)>,
    /// Why commands were refused that the device understands, for people.
    refused: Vec<String>,
}

impl<'m> Unit<'m> {
    /// The device of the first of these drivers; the others speak over its line.
    pub(super) fn new(drivers: Vec<&'m Driver>, address: Option<&str>) -> Result<Self, String> {
        let first = drivers.first().ok_or("it has no driver")?;
        let codec = Codec::new(&first.framing, address.or(first.address.as_deref()))?;
        let told = drivers.iter().flat_map(|d| &d.told).filter_map(|t| t.heard.map(|every| (t, every)));
        let (due, running, heard) = (told.collect(), Vec::new(), BTreeMap::new());
        let (last, input, refused) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Unit { drivers, codec, running, heard, said: None, last, input, due, refused })
    }

    /// The device with what stands behind it.
    pub(super) fn with<'e>(&'e mut self, sim: &'e mut Sim<'m>) -> Device<'e, 'm> {
        let Unit { drivers, codec, running, heard, said, last, input, due, refused } = self;
        Device { sim, drivers, codec, running, heard, said, last, input, due, refused }
    }

    /// Changes to the line of another master, and takes what has come in over that of a request that is not whole.
    pub(super) fn change_line(&mut self, input: &mut Vec<u8>) {
        std::mem::swap(&mut self.input, input);
    }

    /// Why commands were refused since that was last asked for.
    pub(super) fn refused(&mut self) -> Vec<String> {
        std::mem::take(&mut self.refused)
    }

    /// What it does.
    pub(super) fn running(&self) -> impl Iterator<Item = Ticket> {
        self.running.iter().map(|(ticket, _)| *ticket)
    }

    /// When it says something by itself at the earliest, s.
    pub(super) fn next_due(&self) -> f64 {
        self.due.iter().fold(f64::INFINITY, |next, (_, due)| next.min(*due))
    }
}

/// A device at a line, with the model behind it.
pub(super) struct Device<'e, 'm> {
    sim: &'e mut Sim<'m>,
    drivers: &'e [&'m Driver],
    codec: &'e mut Codec,
    running: &'e mut Vec<(Ticket, &'m Operation)>,
    heard: &'e mut BTreeMap<(usize, usize, usize), Vec<Found>>,
    said: &'e mut Option<&'m Exchange>,
    last: &'e mut Vec<u8>,
    input: &'e mut Vec<u8>,
    due: &'e mut Vec<(&'m Told, f64)>,
    refused: &'e mut Vec<String>,
}

impl<'m> Device<'_, 'm> {
    /// What is over is forgotten.
    pub(super) fn sweep(&mut self) -> Result<(), Fault> {
        let mut left = Vec::new();
        for (ticket, operation) in std::mem::take(self.running) {
            if matches!(self.sim.poll(ticket, &mut ())?, Status::Running { .. }) {
                left.push((ticket, operation));
            }
        }
        *self.running = left;
        Ok(())
    }

    /// What it says by itself now.
    pub(super) fn speak(&mut self) -> Result<Vec<u8>, Fault> {
        let mut out = Vec::new();
        for at in 0..self.due.len() {
            let (told, due) = self.due[at];
            if due > self.sim.now() {
                continue;
            }
            self.due[at].1 = self.sim.now() + told.heard.unwrap_or(f64::INFINITY);
            if told.condition.is_some_and(|c| self.sim.engine().eval(c) == 0.0) {
                continue;
            }
            let reply = Reply::of(self.tells(told)?);
            out.extend(self.codec.answer(&reply).map_err(|why| untold(Some(told.span), self.sim.now(), why))?);
        }
        Ok(out)
    }

    /// Bytes that have come in; the bytes that are answered.
    pub(super) fn receive(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Fault> {
        self.input.extend_from_slice(bytes);
        let mut out = Vec::new();
        while let Some(request) = self.codec.take_request(self.input) {
            let reply = match request {
                Ok(Request::Says(words)) => self.obey(&words)?,
                Ok(Request::Again) => {
                    out.extend_from_slice(self.last);
                    continue;
                }
                Ok(Request::Other) => continue,
                Err(garbled) => self.refuse(NOT_UNDERSTOOD, &garbled.why),
            };
            if let Some(reply) = reply {
                let reply = Reply { busy: !self.running.is_empty(), ..reply };
                *self.last = self.codec.answer(&reply).map_err(|why| untold(None, self.sim.now(), why))?;
                out.extend_from_slice(self.last);
            }
        }
        Ok(out)
    }

    /// An answer to what is no message at all; none where the driver knows none.
    pub(super) fn complaint(&mut self, why: &str) -> Option<Vec<u8>> {
        let reply = self.refuse(NOT_UNDERSTOOD, why)?;
        self.codec.answer(&reply).ok()
    }

    /// Does what a string of commands says; what is answered, if something is.
    fn obey(&mut self, words: &[String]) -> Result<Option<Reply>, Fault> {
        let mut reply = None;
        for word in words {
            reply = self.word(word)?;
            if reply.as_ref().is_some_and(|r| r.is_error) {
                break;
            }
        }
        Ok(reply.or_else(|| self.codec.acknowledges().then(Reply::default)))
    }

    fn word(&mut self, word: &str) -> Result<Option<Reply>, Fault> {
        if let Some(text) = self.asked_by_several(word)? {
            return Ok(Some(Reply::of(text)));
        }
        if let Some(told) = self.asked(word) {
            self.speak_for(|driver| driver.told.iter().any(|of| std::ptr::eq(of, told)));
            return Ok(Some(Reply::of(self.tells(told)?)));
        }
        // What is asked for the end of something that was never said asks for something else.
        let endings = self.drivers.iter().flat_map(|d| d.served.iter().map(|s| &s.exchange).chain(&d.open));
        let endings = (*self.said).into_iter().chain(endings);
        let endings: Vec<_> = endings.filter_map(|e| e.until.as_ref()).collect();
        let answer = self.answer(word);
        for until in endings {
            if self.codec.found(&until.asks, word).is_some() {
                self.speak_for(|driver| is_of(driver, until));
                let text = match &until.expects {
                    Some(pattern) if self.running.is_empty() => self.plain(pattern),
                    Some(_) => answer.transpose()?.unwrap_or_else(|| "BUSY".to_owned()),
                    None => String::new(),
                };
                return Ok(Some(Reply::of(text)));
            }
        }
        if let Some(reply) = self.command(word)? {
            return Ok(reply);
        }
        if let Some(text) = answer.transpose()? {
            return Ok(Some(text).filter(|t| !t.is_empty()).map(Reply::of));
        }
        for (exchange, halts) in self.drivers.iter().flat_map(|d| fixed(d)).collect::<Vec<(&'m Exchange, bool)>>() {
            let mut is_it = |t: &Template| self.codec.is_word(&template::written(t), word) || self.says(t, word);
            if let Some(place) = exchange.sends.iter().position(&mut is_it) {
                if halts {
                    self.running.drain(..).for_each(|(ticket, _)| self.sim.halt(ticket));
                }
                *self.said = Some(exchange);
                self.speak_for(|driver| fixed(driver).any(|(of, _)| std::ptr::eq(of, exchange)));
                return Ok(exchange.expects.as_ref().map(|p| Reply::of(self.plain(p.of(place)))));
            }
        }
        Ok(self.refuse(NOT_UNDERSTOOD, &format!("the driver has no line like `{}`", cut(word))))
    }

    /// What is said next is for the device of the driver to which this applies.
    fn speak_for(&mut self, applies: impl Fn(&Driver) -> bool) {
        if let Some(driver) = self.drivers.iter().find(|driver| applies(driver)) {
            self.codec.speak_for(driver);
        }
    }

    /// The answer of a server to a question that several devices at it ask, or one for several reasons: that of each.
    fn asked_by_several(&mut self, word: &str) -> Result<Option<String>, Fault> {
        if !matches!(self.codec, Codec::Json(_)) {
            return Ok(None);
        }
        let mut asking = Vec::new();
        for driver in self.drivers {
            let told = driver.told.iter().filter(|t| t.heard.is_none() && self.codec.found(&t.asks, word).is_some());
            let asks = |e: &&Exchange| match e.sends.as_slice() {
                [sent] => e.until.is_none() && self.codec.is_word(&template::written(sent), word),
                _ => false,
            };
            let opens = driver.open.iter().filter(asks).filter_map(|e| e.expects.as_ref());
            let of_told = told.map(|told| (driver, Some(told), None));
            asking.extend(of_told.chain(opens.map(|expects| (driver, None, Some(expects.of(0))))));
        }
        if asking.len() < 2 {
            return Ok(None);
        }
        let mut answers = Vec::new();
        for (driver, told, expects) in asking {
            self.codec.speak_for(driver);
            answers.extend(told.map(|told| self.tells(told)).transpose()?);
            answers.extend(expects.map(|expects| self.plain(expects)));
        }
        Ok(Codec::joined(&answers))
    }

    /// An answer without numbers of its own.
    fn plain(&mut self, pattern: &Pattern) -> String {
        self.codec.rendered(pattern, |_| Shown::default()).unwrap_or_default()
    }

    /// Whether a message is this one with the values that it has now.
    fn says(&mut self, template: &Template, word: &str) -> bool {
        let Some(found) = self.codec.found(template, word) else { return false };
        let engine = self.sim.engine();
        found.iter().all(|f| f.fits(engine.eval(f.node)))
    }

    /// What is answered apart from commands and readings.
    fn answer(&mut self, word: &str) -> Option<Result<String, Fault>> {
        let answers = self.drivers.iter().flat_map(|d| &d.answers);
        let (_, with) = answers.into_iter().find(|(asked, _)| self.codec.asked(asked, word))?;
        let engine = self.sim.engine();
        let text = template::filled(with, |n| Some(engine.eval(n)));
        Some(text.map_err(|why| untold(Some(with.span), self.sim.now(), why)))
    }

    /// The quantity a message asks for.
    fn asked(&mut self, word: &str) -> Option<&'m Told> {
        let told = self.drivers.iter().flat_map(|d| &d.told);
        let asked = told.filter(|t| t.heard.is_none() && self.codec.found(&t.asks, word).is_some());
        let all: Vec<&Told> = asked.collect();
        let holds = |sim: &mut Sim<'m>, t: &Told| t.condition.is_none_or(|c| sim.engine().eval(c) != 0.0);
        all.iter().find(|t| t.condition.is_some() && holds(self.sim, t)).or_else(|| all.first()).copied()
    }

    fn tells(&mut self, told: &'m Told) -> Result<String, Fault> {
        let value = self.sim.value(told.value, &mut ())?.unwrap_or(0.0);
        let form = self.form(told);
        let digits = self.digits(told, form);
        let text = self.codec.rendered(form, |_| Shown { value, digits });
        text.map_err(|why| untold(Some(told.span), self.sim.now(), why))
    }

    /// The form that it answers in: the last one whose condition holds, or else the first.
    fn form(&mut self, told: &'m Told) -> &'m Pattern {
        let engine = self.sim.engine();
        let holds = told.also.iter().rfind(|form| form.condition.is_some_and(|c| engine.eval(c) != 0.0));
        holds.map_or(&told.expects, |form| &form.expects)
    }

    /// Digits after the point of what a reading shows, in the unit it is told in.
    fn digits(&mut self, told: &Told, form: &Pattern) -> Option<u8> {
        let reading = self.sim.engine().model().readings.get(told.reading? as usize)?;
        let unit = form.slots.iter().find_map(|s| match s {
            Slot::Number(unit, _) => Some(unit),
            _ => None,
        })?;
        let step = reading.resolution? / unit.factor.abs();
        (step > 0.0).then(|| (-step.log10()).ceil().clamp(0.0, 9.0) as u8)
    }

    /// Carries out the command that a message completes; nothing where it belongs to none.
    fn command(&mut self, word: &str) -> Result<Option<Option<Reply>>, Fault> {
        let (mut part, mut complete) = (None, Vec::new());
        let served =
            self.drivers.iter().enumerate().flat_map(|(d, driver)| {
                driver.served.iter().enumerate().map(move |(index, served)| (d, index, served))
            });
        for (driver, index, served) in served {
            for (place, template) in served.exchange.sends.iter().enumerate() {
                let Some(found) = self.codec.found(template, word) else { continue };
                if word.is_empty() && served.exchange.sends.len() > 1 {
                    continue;
                }
                part = part.or_else(|| Some((served, place, found.clone())));
                self.heard.insert((driver, index, place), found);
                let sends = &served.exchange.sends;
                let whole = place + 1 == sends.len();
                // A blank line between others only ends what may have gone before it.
                let says = |p: &usize| sends.len() == 1 || !sends[*p].is_blank();
                let all: Option<Vec<Found>> = (0..sends.len())
                    .filter(says)
                    .map(|p| self.heard.get(&(driver, index, p)).cloned())
                    .collect::<Option<Vec<_>>>()
                    .map(|all| all.concat());
                if let (true, Some(all)) = (whole, all) {
                    complete.push((served, all));
                }
            }
        }
        let Some((part, place, found)) = part else { return Ok(None) };
        if complete.is_empty() {
            // The first part of something.
            let Some(expects) = &part.exchange.expects else { return Ok(Some(None)) };
            return Ok(Some(Some(Reply::of(self.echo(expects.of(place), &found)?))));
        }
        let mut unmet: Option<(&Served, usize)> = None;
        for (served, all) in complete {
            if !solve(served, &all, self.sim.engine()) {
                continue;
            }
            let needs = &served.operation.needs;
            if let Some(at) = needs.iter().position(|n| self.sim.engine().eval(n.node) == 0.0) {
                // Of commands that are said alike, that is meant which is farthest from being nonsense.
                if unmet.is_none_or(|(_, before)| at >= before) {
                    unmet = Some((served, at));
                }
                continue;
            }
            if served.exchange.until.is_some() && !self.running.is_empty() {
                return Ok(Some(self.refuse(BUSY, "it is busy")));
            }
            return self.begin(served, &all, word).map(Some);
        }
        let Some((served, need)) = unmet.and_then(|(s, at)| Some((s, s.operation.needs.get(at)?))) else {
            return Ok(Some(self.refuse(NOT_UNDERSTOOD, &format!("`{}` is unknown here", cut(word)))));
        };
        self.refused.push(refusal(word, &served.operation.verb, need));
        let failure = need.refusal.as_ref().map_or(NOT_UNDERSTOOD, |r| r.failure.as_str());
        Ok(Some(self.refuse(failure, &format!("`{}` is false", need.text))))
    }

    fn begin(&mut self, served: &'m Served, found: &[Found], word: &str) -> Result<Option<Reply>, Fault> {
        let reply = match &served.exchange.expects {
            Some(pattern) => {
                let last = pattern.of(served.exchange.sends.len().saturating_sub(1));
                Some(Reply::of(self.echo(last, found)?))
            }
            None => None,
        };
        *self.said = Some(&served.exchange);
        let ticket = self.sim.begin(&served.operation, &mut ())?;
        if matches!(self.sim.poll(ticket, &mut ())?, Status::Running { .. }) {
            self.running.push((ticket, &served.operation));
        }
        // What the driver says that is answered comes before what it expects.
        Ok(self.answer(word).transpose()?.filter(|text| !text.is_empty()).map(Reply::of).or(reply))
    }

    /// An answer that says numbers as they were sent, or else as they are told.
    fn echo(&mut self, pattern: &Pattern, found: &[Found]) -> Result<String, Fault> {
        let is_value = |s: &&Slot| matches!(s, Slot::Number(..) | Slot::Word(_));
        let mut values = Vec::new();
        for slot in pattern.slots.iter().filter(is_value) {
            let told = self.drivers.iter().flat_map(|d| &d.told).find(|t| t.expects.slots.contains(slot));
            let shown = match (found.first(), told) {
                (Some(sent), _) if matches!(slot, Slot::Number(..)) => Shown { value: sent.value, digits: None },
                (_, Some(told)) => Shown {
                    value: self.sim.value(told.value, &mut ())?.unwrap_or(0.0),
                    digits: self.digits(told, &told.expects),
                },
                (_, None) => Shown::default(),
            };
            values.push((slot, shown));
        }
        let shown =
            |slot: &Slot| values.iter().find(|(of, _)| *of == slot).map(|(_, shown)| *shown).unwrap_or_default();
        self.codec.rendered(pattern, shown).map_err(|why| untold(Some(pattern.span), self.sim.now(), why))
    }

    /// The answer that means a failure; none where the driver knows none, as devices do that ignore what they do not understand.
    fn refuse(&mut self, failure: &str, why: &str) -> Option<Reply> {
        let named = |name: &str| self.drivers.iter().flat_map(|d| &d.refusals).find(|r| r.failure == name);
        let Some(refusal) = named(failure).or_else(|| named(NOT_UNDERSTOOD)) else {
            return self.codec.unknown().map(|text| Reply { is_error: true, ..Reply::of(text) });
        };
        let text = self.codec.refused(&refusal.reply, &refusal.failure, why);
        Some(Reply { is_error: self.codec.acknowledges(), ..Reply::of(text) })
    }
}

/// The beginning of a message, for people.
fn cut(word: &str) -> &str {
    word.char_indices().nth(SHOWN).map_or(word, |(at, _)| &word[..at])
}

/// Why a command is refused whose need does not hold, for people: many a device says no more than a number.
fn refusal(word: &str, verb: &str, need: &Condition) -> String {
    let help = need.refusal.as_ref().and_then(|r| r.help.as_ref()).map_or(String::new(), |help| format!(": {help}"));
    let failure = need.failure().replace('_', " ");
    format!("`{}`, `{verb}`, is refused: {failure}{help} (`{}` is false)", cut(word), need.text)
}

/// Whether it is for the end of something that a driver says.
fn is_of(driver: &Driver, until: &Until) -> bool {
    let served = driver.served.iter().map(|s| &s.exchange);
    served.chain(&driver.open).any(|e| e.until.as_ref().is_some_and(|of| std::ptr::eq(of, until)))
}

/// What is said apart from commands, and whether it breaks off what the device does.
fn fixed(driver: &Driver) -> impl Iterator<Item = (&Exchange, bool)> {
    let asked = driver.identity.iter().map(|identity| &identity.exchange);
    let quiet = asked.chain(&driver.open).chain(&driver.close).chain(&driver.play).map(|e| (e, false));
    driver.halt.iter().chain(&driver.safe).map(|e| (e, true)).chain(quiet)
}

/// What the device would say has no room in the form that its driver declares.
fn untold(span: Option<Span>, time: f64, message: String) -> Fault {
    Fault { span, ..Fault::new(codes::UNSENDABLE, time, message) }
}
