//! One deployment by its seed: what happened to it, and whether that is allowed.

use std::rc::Rc;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use matterix_hardware::binding;
use matterix_hardware::deploy::{
    Control, Course, Ending, Entry, Exposed, Journal, Kept, Mode, Past, REFUSED, carry_out, read,
};
use matterix_ir::Sources;
use matterix_soundness::random::Random;

use crate::labs::{Compiled, all};
use crate::room::{Fate, Room, SPEED, Seen};

/// Processes that carry on with one deployment, at most.
const PROCESSES: usize = 6;

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum End {
    /// To its end, as planned.
    Passed,
    /// A person stopped it.
    Stopped,
    /// With a finding.
    Failed,
    /// Nobody went on with it any more.
    Left,
}

/// What came of a seed.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The lab.
    pub lab: &'static str,
    /// How it ended.
    pub end: End,
    /// Processes that took part.
    pub processes: usize,
    /// What is not allowed.
    pub wrong: Vec<String>,
    /// What happened.
    pub log: Vec<String>,
}

/// A lab where nothing happens: frames, how long it takes, what moves matter.
struct Calm {
    frames: usize,
    lasts: Duration,
    moves: Vec<Vec<String>>,
}

/// Deploys a lab in the room that belongs to the seed.
pub fn trial(seed: u64) -> Verdict {
    let mut random = Random::new(seed);
    let number = random.below(all().len());
    let calm = calm(number);
    let fate = Fate::drawn(&mut random, calm.frames + calm.frames / 2, calm.lasts.mul_f64(1.5));
    fated(number, fate, random)
}

/// What a lab says to its devices and how long it takes where nothing happens: frames, and the clock.
pub fn extent(number: usize) -> (usize, Duration) {
    let calm = calm(number);
    (calm.frames, calm.lasts)
}

/// Deploys a lab, by its number, in a room where this happens.
pub fn fated(number: usize, fate: Fate, mut random: Random) -> Verdict {
    let (lab, calm) = (&all()[number], calm(number));
    let control = fresh();
    let room = Room::new(lab, random.clone(), fate.clone(), control);
    room.note(format!("{fate:?}"));
    let (ending, processes) = carried_out(lab, &room, control, &mut random);
    let mut verdict = judged(lab, calm, &room, ending, processes);
    verdict.wrong.extend(replayed(lab, &room));
    verdict.log = room.log();
    verdict
}

/// What people say; it lives as long as the process, as that of a command does.
fn fresh() -> &'static Control {
    Box::leak(Box::new(Control::new(Box::leak(Box::new(AtomicBool::new(false))), |_| {})))
}

fn calm(number: usize) -> &'static Calm {
    static ALL: OnceLock<Vec<Calm>> = OnceLock::new();
    let measured = |lab: &'static Compiled| {
        let fate = Fate::calm();
        let control = fresh();
        let room = Room::new(lab, Random::new(0), fate, control);
        let (ending, _) = carried_out(lab, &room, control, &mut Random::new(0));
        let log = room.log().join("\n");
        let passed = ending.as_ref().is_some_and(|e| e.passed);
        assert!(passed, "`{}` passes where nothing happens: {:?}\n{log}", lab.lab.name, ending.map(|e| e.diagnostics));
        Calm { frames: room.frames(), lasts: room.now(), moves: moves(lab, &room) }
    };
    &ALL.get_or_init(|| all().iter().map(measured).collect())[number]
}

fn moves(lab: &Compiled, room: &Room) -> Vec<Vec<String>> {
    lab.lab.parts.iter().map(|part| (lab.lab.moves)(&room.heard(part.line.0))).collect()
}

/// One process after the other, until one ends by itself; how that ended.
fn carried_out(
    lab: &'static Compiled,
    room: &Rc<Room>,
    control: &'static Control,
    random: &mut Random,
) -> (Option<Ending>, usize) {
    let mut control = control;
    for process in 1..=PROCESSES {
        let kept = match process {
            1 => match Journal::on(Box::new(room.disk())) {
                Ok(journal) => Kept::New(journal),
                Err(_) => return (None, process),
            },
            _ => match read(&room.disk().bytes()[..]) {
                Ok(past) => Kept::Left(Journal::after(Box::new(room.disk()), &past), past.entries),
                Err(why) => Kept::Damaged(why),
            },
        };
        let ending = one(lab, room, control, Mode::Real, kept);
        let away = Duration::from_millis(random.below(2000) as u64);
        let whole = |bytes: &[u8]| read(bytes).map_or(bytes.len(), |Past { whole, .. }| whole as usize);
        if !room.revived(away, whole) {
            // A device that is not there is tried again a few times.
            let is_away = ending.diagnostics.iter().any(|d| d.help.iter().any(|h| h.contains("`--resume`")));
            if !is_away || process == PROCESSES {
                return (Some(ending), process);
            }
            room.note("tried again");
        }
        control = fresh();
        room.listens_to(control);
    }
    (None, PROCESSES)
}

/// What is different when a journal with an end is gone through again.
fn replayed(lab: &'static Compiled, room: &Rc<Room>) -> Option<String> {
    let past = read(&room.disk().bytes()[..]).ok()?;
    let Some(Entry::End { status, states, .. }) = past.entries.last() else { return None };
    for entry in past.entries.iter().filter(|e| !matches!(e, Entry::Out { .. } | Entry::Back { .. })) {
        room.note(format!("journal: {entry:?}"));
    }
    let kept = Kept::Left(Journal::none(), past.entries.clone());
    let ending = one(lab, room, fresh(), Mode::Replay, kept);
    if ending.execution.is_none() || status == REFUSED {
        return None;
    }
    let same = ending.status == *status && ending.states == *states;
    (!same).then(|| {
        let (is, log) = (ending.status, room.log().last().cloned().unwrap_or_default());
        format!("gone through again it is `{is}`, not `{status}`, or comes to other states: {log}")
    })
}

fn one(lab: &'static Compiled, room: &Rc<Room>, control: &'static Control, mode: Mode, journal: Kept) -> Ending {
    let mut sources: Sources = lab.sources.clone();
    let file = sources.add("lab.toml", lab.bindings.clone());
    let (bindings, found) = binding::read(&lab.deployed, file, &lab.bindings);
    assert!(found.is_empty(), "the bindings of `{}`: {:?}", lab.lab.name, found.first().map(|d| &d.headline));
    let exposed = Exposed::new();
    let course = Course {
        bindings,
        mode,
        speed: SPEED,
        seed: 0,
        trace: Box::new(|_, _, _, _| {}),
        journal,
        control,
        who: "a person",
        world: Rc::new(Seen(Rc::clone(room))),
        exposed: &exposed,
    };
    let ending = carry_out(&lab.deployed, &sources, course, &mut ()).expect("devices as they are bound");
    for d in &ending.diagnostics {
        room.note(format!("{:?} {}: {}", d.severity, d.code.name, d.headline));
    }
    for trace in ending.execution.iter().flat_map(|e| &e.suppressed).filter(|_| mode == Mode::Replay) {
        room.note(format!("not shown: {}", trace.text));
    }
    ending
}

/// Whether what was said is planned, in that order, from the first on; a frame that noise has changed may still mean the same
/// to the device, and is not in what it heard as it was sent.
fn is_of(said: &[String], planned: &[String], garbled: usize) -> bool {
    let mut ahead = planned.iter();
    let passed_over = said.iter().try_fold(0, |n, s| Some(n + ahead.position(|p| p == s)?));
    passed_over.is_some_and(|n| n <= garbled)
}

fn judged(lab: &'static Compiled, calm: &Calm, room: &Rc<Room>, ending: Option<Ending>, processes: usize) -> Verdict {
    let mut wrong = Vec::new();
    let end = match &ending {
        None => End::Left,
        Some(e) if e.passed => End::Passed,
        Some(e) if e.stopped => End::Stopped,
        Some(_) => End::Failed,
    };
    for ((part, said), planned) in lab.lab.parts.iter().zip(moves(lab, room)).zip(&calm.moves) {
        if !is_of(&said, planned, room.garbled()) {
            wrong.push(format!("`{}` was told {said:?}, planned is {planned:?}", part.name));
        }
        // What noise has changed may still mean the same to a device; what it did is read back.
        if end == End::Passed && said.len() + room.garbled() < planned.len() {
            wrong.push(format!("it passed, and `{}` was told {said:?} of {planned:?}", part.name));
        }
        let named = |e: &Ending| {
            let name = format!("`{}`", part.name);
            e.diagnostics.iter().any(|d| d.code.name.starts_with("device-") && d.headline.contains(&name))
        };
        // A stop is said twice to a device that acknowledges nothing: both may get lost, and nobody can know.
        if let Some(e) = ending.as_ref().filter(|e| !named(e) && room.lost() < 2) {
            for (state, value) in room.states(part.line.0, lab, part.off) {
                if value != 0.0 {
                    let left = if e.passed { "it passed" } else { "it is not named" };
                    wrong.push(format!("{left}, and `{state}` is {value}"));
                }
            }
        }
    }
    if ending.as_ref().is_some_and(|e| !e.passed && e.diagnostics.is_empty() && !e.stopped) {
        wrong.push("it did not pass, and says nothing of why".to_owned());
    }
    Verdict { lab: lab.lab.name, end, processes, wrong, log: room.log() }
}
