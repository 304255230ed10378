//! The room: emulated devices behind lines that lose, delay, double, tear and garble, a clock that only waiting moves, and people.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::rc::Rc;
use std::time::Duration;

use matterix_hardware::deploy::{Answer, Control, Gate};
use matterix_hardware::emulate::Emulator;
use matterix_hardware::place::Place;
use matterix_hardware::port::Port;
use matterix_hardware::world::World;
use matterix_ir::wire::Driver;
use matterix_runtime::backend::Sim;
use matterix_runtime::process::{Engine, Options};
use matterix_soundness::random::Random;

use crate::disk::Disk;
use crate::labs::{Compiled, Part};

/// Seconds of lab time per second.
pub const SPEED: f64 = 20.0;

/// What happens to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It never comes to the device.
    Lost,
    /// The device does not understand it.
    Garbled,
    /// The device's answer never comes back.
    AnswerLost,
    /// It comes after nobody waits for it any more.
    AnswerLate,
    /// It comes twice.
    AnswerDoubled,
    /// Its end is missing.
    AnswerTorn,
    /// It makes no sense.
    AnswerGarbled,
    /// The line is gone, for some seconds.
    Cut,
}

const FAULTS: [Fault; 8] = [
    Fault::Lost,
    Fault::Garbled,
    Fault::AnswerLost,
    Fault::AnswerLate,
    Fault::AnswerDoubled,
    Fault::AnswerTorn,
    Fault::AnswerGarbled,
    Fault::Cut,
];

/// How a process dies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Death {
    /// It is killed.
    Killed,
    /// The machine loses its power.
    Power,
}

/// What will happen, drawn beforehand.
#[derive(Clone, Debug)]
pub struct Fate {
    /// By number of the frame.
    pub faults: Vec<(usize, Fault)>,
    /// When processes die, by the clock.
    pub deaths: VecDeque<(Duration, Death)>,
    /// What people do: pause, step, go on (or stop, where nothing is said), by the clock.
    pub people: VecDeque<(Duration, Option<Gate>)>,
    /// How long people take to answer.
    pub hesitation: Duration,
    /// Whether they say yes.
    pub agree: bool,
    /// By how much the clock of the machine is set at each death, s.
    pub set: f64,
    /// Bytes that fit on the disk.
    pub disk: usize,
}

impl Fate {
    /// Nothing happens.
    pub fn calm() -> Fate {
        Fate {
            faults: Vec::new(),
            deaths: VecDeque::new(),
            people: VecDeque::new(),
            hesitation: Duration::from_millis(100),
            agree: true,
            set: 0.0,
            disk: usize::MAX,
        }
    }

    /// By lot: most of what may happen does not.
    pub fn drawn(random: &mut Random, frames: usize, lasts: Duration) -> Fate {
        let faults = if random.chance(60) { random.within(1, 3) } else { 0 };
        let mut faults: Vec<(usize, Fault)> =
            (0..faults).map(|_| (random.below(frames), FAULTS[random.below(FAULTS.len())])).collect();
        faults.sort_by_key(|(at, _)| *at);
        let moment = |random: &mut Random| lasts.mul_f64(random.below(1000) as f64 / 1000.0);
        let deaths = if random.chance(50) { random.within(1, 3) } else { 0 };
        let mut deaths: Vec<(Duration, Death)> = (0..deaths)
            .map(|_| (moment(random), if random.chance(30) { Death::Power } else { Death::Killed }))
            .collect();
        deaths.sort_by_key(|(at, _)| *at);
        let mut people: Vec<(Duration, Option<Gate>)> = Vec::new();
        if random.chance(30) {
            let at = moment(random);
            people.push((at, Some(Gate::Pause)));
            for n in 0..random.below(3) {
                people.push((at + Duration::from_secs(n as u64 + 1), Some(Gate::Step)));
            }
            people.push((at + Duration::from_secs(5), Some(Gate::Go)));
        }
        if random.chance(10) {
            people.push((moment(random), None));
        }
        people.sort_by_key(|(at, _)| *at);
        Fate {
            faults,
            deaths: deaths.into(),
            people: people.into(),
            hesitation: Duration::from_millis(random.below(8000) as u64),
            agree: !random.chance(5),
            set: if random.chance(10) { random.within(0, 200) as f64 - 100.0 } else { 0.0 },
            disk: if random.chance(10) { random.within(500, 20_000) } else { usize::MAX },
        }
    }
}

/// A device at the end of its line.
struct Desk {
    place: &'static str,
    emulator: Emulator<'static>,
    /// What is on its way back: when it comes, and what.
    back: VecDeque<(Duration, Vec<u8>)>,
    /// Nobody gets through until then.
    cut: Duration,
    heard: Vec<u8>,
}

/// The room.
pub struct Room {
    clock: Cell<Duration>,
    /// When the process died that now goes on without reaching anything.
    died: Cell<Option<Duration>>,
    desks: RefCell<Vec<Desk>>,
    random: RefCell<Random>,
    fate: RefCell<Fate>,
    frames: Cell<usize>,
    /// By how much the clock of the machine has been set so far, s.
    set: Cell<f64>,
    control: Cell<&'static Control>,
    disk: RefCell<Disk>,
    asked: RefCell<Vec<(u64, Duration)>>,
    log: RefCell<Vec<String>>,
}

impl Room {
    /// With fresh emulators.
    pub fn new(lab: &'static Compiled, random: Random, fate: Fate, control: &'static Control) -> Rc<Room> {
        let is_first =
            |(at, part): &(usize, &Part)| lab.lab.parts.iter().position(|p| p.line.0 == part.line.0) == Some(*at);
        let first = lab.lab.parts.iter().enumerate().filter(is_first);
        let desks = first.map(|(at, part)| {
            let params = lab.served.model.params.iter().map(|p| p.value).collect();
            let engine = Engine::new(&lab.prepared.model, params, lab.served.plan.locals.len(), Options::default());
            let mut engine = engine.expect("the model of a lab");
            engine.start(&mut ()).expect("it starts");
            let sim = Sim::new(engine, &lab.prepared, 0);
            let place = part.line.0;
            let mut emulator = Emulator::new(sim, lab.drivers(part), part.line.1).expect("an emulator");
            for other in lab.lab.parts[at + 1..].iter().filter(|p| p.line.0 == place) {
                emulator.join(lab.drivers(other), other.line.1).expect("another at the line");
            }
            Desk { place, emulator, back: VecDeque::new(), cut: Duration::ZERO, heard: Vec::new() }
        });
        Rc::new(Room {
            clock: Cell::new(Duration::ZERO),
            died: Cell::new(None),
            desks: RefCell::new(desks.collect()),
            random: RefCell::new(random),
            disk: RefCell::new(Disk::with_room(fate.disk)),
            fate: RefCell::new(fate),
            frames: Cell::new(0),
            set: Cell::new(0.0),
            control: Cell::new(control),
            asked: RefCell::default(),
            log: RefCell::default(),
        })
    }

    /// The disk.
    pub fn disk(&self) -> Disk {
        self.disk.borrow().clone()
    }

    /// Frames that are to come to no device as they were sent.
    pub fn lost(&self) -> usize {
        let fate = self.fate.borrow();
        fate.faults.iter().filter(|(_, f)| matches!(f, Fault::Lost | Fault::Garbled)).count()
    }

    /// Frames that are to come to a device with a wrong bit.
    pub fn garbled(&self) -> usize {
        self.fate.borrow().faults.iter().filter(|(_, f)| *f == Fault::Garbled).count()
    }

    /// Frames that went out.
    pub fn frames(&self) -> usize {
        self.frames.get()
    }

    /// The time.
    pub fn now(&self) -> Duration {
        self.clock.get()
    }

    /// What happened, in order.
    pub fn log(&self) -> Vec<String> {
        self.log.borrow().clone()
    }

    /// Notes what happens.
    pub fn note(&self, text: impl Into<String>) {
        let text = text.into();
        self.log.borrow_mut().push(format!("{:9.3} s  {}", self.clock.get().as_secs_f64(), text));
    }

    /// Whether the process has died; the next one begins then, after so long.
    pub fn revived(&self, after: Duration, whole: impl FnOnce(&[u8]) -> usize) -> bool {
        let Some(died) = self.died.take() else { return false };
        self.clock.set(died + after);
        self.set.set(self.set.get() + self.fate.borrow().set);
        let disk = self.disk.borrow().clone();
        let length = whole(&disk.bytes());
        *self.disk.borrow_mut() = disk.reopened(length);
        self.asked.borrow_mut().clear();
        self.desks.borrow_mut().iter_mut().for_each(|desk| desk.back.clear());
        true
    }

    /// Another process is spoken to from now on.
    pub fn listens_to(&self, control: &'static Control) {
        self.control.set(control);
    }

    /// What a device has heard.
    pub fn heard(&self, line: &str) -> String {
        let desks = self.desks.borrow();
        desks
            .iter()
            .find(|d| d.place == line)
            .map(|d| String::from_utf8_lossy(&d.heard).into_owned())
            .unwrap_or_default()
    }

    /// States of a device by their names, as they are by now.
    pub fn states(&self, line: &str, lab: &Compiled, names: &[&str]) -> Vec<(String, f64)> {
        let now = self.clock.get().as_secs_f64() * SPEED;
        let mut desks = self.desks.borrow_mut();
        let Some(desk) = desks.iter_mut().find(|d| d.place == line) else { return Vec::new() };
        desk.emulator.pass(now).expect("the model goes on");
        let states = desk.emulator.sim().engine().states();
        let of = |name: &&str| {
            let index = lab.prepared.model.states.iter().position(|s| s.name == **name);
            ((*name).to_owned(), index.map_or(f64::NAN, |i| states[i]))
        };
        names.iter().map(of).collect()
    }

    fn is_dead(&self) -> bool {
        self.died.get().is_some()
    }

    /// Time passes; processes die of it, and people act.
    fn pass(&self, time: Duration) {
        self.clock.set(self.clock.get() + time);
        if self.is_dead() {
            return;
        }
        let now = self.clock.get();
        let due = self.fate.borrow().deaths.front().copied().filter(|(at, _)| *at <= now);
        if let Some((_, how)) = due {
            self.fate.borrow_mut().deaths.pop_front();
            self.note(format!("{how:?}"));
            match how {
                Death::Killed => self.disk.borrow().kill(),
                Death::Power => self.disk.borrow().power_fails(&mut self.random.borrow_mut()),
            }
            self.died.set(Some(now));
            // What is left of it comes to its end soon, and reaches nothing any more.
            self.control.get().stop("death");
            return;
        }
        let due = self.fate.borrow().people.front().copied().filter(|(at, _)| *at <= now);
        if let Some((_, what)) = due {
            self.fate.borrow_mut().people.pop_front();
            self.note(format!("a person: {what:?}"));
            match what {
                Some(gate) => self.control.get().set_gate(gate, "a person"),
                None => self.control.get().stop("a person"),
            }
        }
        for (question, _) in self.control.get().open() {
            let mut asked = self.asked.borrow_mut();
            let since = match asked.iter().find(|(q, _)| *q == question) {
                Some((_, since)) => *since,
                None => {
                    asked.push((question, now));
                    now
                }
            };
            if now >= since + self.fate.borrow().hesitation {
                let yes = self.fate.borrow().agree;
                self.note(format!("answered: {yes}"));
                self.control.get().answer(question, Answer { yes, who: "a person".into() });
            }
        }
    }

    fn fault(&self) -> Option<Fault> {
        let number = self.frames.get();
        self.frames.set(number + 1);
        self.fate.borrow().faults.iter().find(|(at, _)| *at == number).map(|(_, fault)| *fault)
    }

    fn send(&self, desk: usize, bytes: &[u8]) -> io::Result<()> {
        self.pass(Duration::from_micros(200));
        if self.is_dead() {
            return Err(io::Error::from(ErrorKind::BrokenPipe));
        }
        let fault = self.fault();
        let now = self.clock.get();
        let mut desks = self.desks.borrow_mut();
        let desk = &mut desks[desk];
        self.note(format!(
            "{} <- {} {}",
            desk.place,
            bytes.escape_ascii(),
            fault.map_or(String::new(), |f| format!("{f:?}"))
        ));
        if fault == Some(Fault::Cut) {
            desk.cut = now + Duration::from_millis(self.random.borrow_mut().within(100, 5000) as u64);
        }
        if now < desk.cut {
            return Err(io::Error::from(ErrorKind::BrokenPipe));
        }
        let mut random = self.random.borrow_mut();
        let mut sent = bytes.to_vec();
        match fault {
            Some(Fault::Lost) => return Ok(()),
            Some(Fault::Garbled) => garble(&mut sent, &mut random),
            _ => {}
        }
        if fault != Some(Fault::Garbled) {
            desk.heard.extend(&sent);
        }
        desk.emulator.pass(now.as_secs_f64() * SPEED).map_err(|f| io::Error::other(f.message))?;
        let mut answer = desk.emulator.receive(&sent).map_err(|f| io::Error::other(f.message))?;
        let mut after = Duration::from_millis(random.within(2, 30) as u64);
        match fault {
            Some(Fault::AnswerLost) => return Ok(()),
            Some(Fault::AnswerLate) => after = Duration::from_millis(random.within(500, 20_000) as u64),
            Some(Fault::AnswerDoubled) => answer = [&answer[..], &answer[..]].concat(),
            Some(Fault::AnswerTorn) => answer.truncate(random.below(answer.len() + 1)),
            Some(Fault::AnswerGarbled) => garble(&mut answer, &mut random),
            _ => {}
        }
        if !answer.is_empty() {
            desk.back.push_back((now + after, answer));
        }
        Ok(())
    }

    fn receive(&self, desk: usize, within: Duration) -> io::Result<Vec<u8>> {
        let until = self.clock.get() + within.max(Duration::from_micros(100));
        if self.is_dead() {
            self.pass(until - self.clock.get());
            return Err(io::Error::from(ErrorKind::BrokenPipe));
        }
        let next = self.desks.borrow().get(desk).and_then(|d| d.back.iter().map(|(at, _)| *at).min());
        let wake = next.map_or(until, |at| at.min(until));
        self.pass(wake.saturating_sub(self.clock.get()));
        if self.is_dead() {
            return Err(io::Error::from(ErrorKind::BrokenPipe));
        }
        let now = self.clock.get();
        let mut desks = self.desks.borrow_mut();
        let desk = &mut desks[desk];
        if now < desk.cut {
            return Err(io::Error::from(ErrorKind::UnexpectedEof));
        }
        let (come, coming) = desk.back.drain(..).partition::<Vec<_>, _>(|(at, _)| *at <= now);
        desk.back = coming.into();
        let bytes: Vec<u8> = come.into_iter().flat_map(|(_, bytes)| bytes).collect();
        if !bytes.is_empty() {
            self.note(format!("{} -> {}", desk.place, bytes.escape_ascii()));
        }
        Ok(bytes)
    }
}

fn garble(bytes: &mut [u8], random: &mut Random) {
    let at = random.below(bytes.len());
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.below(7);
    }
}

/// The room as a deployment sees it.
pub struct Seen(pub Rc<Room>);

impl World for Seen {
    fn elapsed(&self) -> Duration {
        self.0.clock.get()
    }

    fn wall(&self) -> f64 {
        1.8e9 + self.0.clock.get().as_secs_f64() + self.0.set.get()
    }

    fn sleep(&self, time: Duration) {
        self.0.pass(time);
    }

    fn open(&self, place: &Place, _: &Driver) -> io::Result<Box<dyn Port>> {
        self.0.pass(Duration::from_millis(1));
        let name = place.to_string();
        let name = name.split(':').next().unwrap_or_default();
        let desks = self.0.desks.borrow();
        let found = desks.iter().position(|d| d.place == name);
        let desk = found.ok_or_else(|| io::Error::from(ErrorKind::NotFound))?;
        if self.0.is_dead() || self.0.clock.get() < desks[desk].cut {
            return Err(io::Error::from(ErrorKind::ConnectionRefused));
        }
        Ok(Box::new(Wire { room: Rc::clone(&self.0), desk }))
    }
}

struct Wire {
    room: Rc<Room>,
    desk: usize,
}

impl Port for Wire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.room.send(self.desk, bytes)
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        self.room.receive(self.desk, within)
    }
}
