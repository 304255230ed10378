//! What became of motions that were planned before, so that none is planned twice from the same moment.
//!
//! A motion is known by everything that decides it: the lab's geometry and robots, the moment, where to. Texts and their
//! places do not count, so that a file may be edited around a motion; the findings are written anew each time.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::hash::Hasher;
use std::io;

use matterix_ir::plan::Motion;
use matterix_ir::scene::{InstanceId, Scene};
use serde::{Deserialize, Serialize};
use siphasher::sip128::{Hasher128, SipHasher13};

use crate::motion::perform::Refused;
use crate::motion::stage::{Change, Stage};

/// Keeps bytes under a name for another time. Nothing depends on it but the time that a check takes.
pub trait Store {
    /// What was kept under a name, if it still is.
    fn load(&self, name: &str) -> Option<Vec<u8>>;
    /// Keeps bytes under a name.
    fn save(&self, name: &str, bytes: &[u8]);
}

/// Keeps nothing.
pub struct Nowhere;

impl Store for Nowhere {
    fn load(&self, _: &str) -> Option<Vec<u8>> {
        None
    }

    fn save(&self, _: &str, _: &[u8]) {}
}

/// What became of a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// It can be carried out, and this is different afterwards.
    Done(Change),
    /// It cannot.
    Refused {
        /// Why.
        why: Refused,
        /// For what is out of reach: how far its goal would have to be shifted, x and y in metres.
        nearer: Option<[f64; 2]>,
    },
}

/// Which code it was that planned: another one may plan otherwise.
const MADE_BY: &str = concat!(env!("CARGO_PKG_VERSION"), "-", env!("MATTERIX_MOTION_SOURCES"));
/// How many motions of a lab are kept.
const MOST: usize = 4000;

#[derive(Serialize, Deserialize)]
struct Kept {
    made_by: String,
    lab: String,
    /// By the digest of moment and motion, with whether it was asked for the last time the lab was looked at.
    outcomes: BTreeMap<String, Outcome>,
}

/// Outcomes of the motions in one lab.
pub struct Memory<'s> {
    store: &'s dyn Store,
    lab: String,
    outcomes: BTreeMap<String, Outcome>,
    asked: RefCell<BTreeMap<String, Outcome>>,
    news: bool,
}

impl<'s> Memory<'s> {
    /// What is known of a lab.
    pub fn of(scene: &Scene, store: &'s dyn Store) -> Self {
        let lab = digest_of(scene);
        let outcomes = store.load(&lab).and_then(|bytes| read(&bytes, &lab)).unwrap_or_default();
        Memory { store, lab, outcomes, asked: RefCell::default(), news: false }
    }

    /// What a motion is known by.
    pub fn key(&self, stage: &Stage<'_>, motion: &Motion, values: &[f64]) -> String {
        let mut hash = SipHasher13::new();
        stage.digest(None, &mut hash);
        let mut write = |kind: u8, ids: &[InstanceId], name: &str| {
            hash.write_u8(kind);
            ids.iter().for_each(|id| hash.write_u32(id.0));
            hash.write(name.as_bytes());
            hash.write_u8(u8::MAX);
        };
        match motion {
            Motion::To { mover, goal, frame, straight, within, .. } => {
                write(u8::from(*straight) + 2 * u8::from(within.is_some()), &[*mover, *goal], frame);
            }
            Motion::By { mover, straight, .. } => write(12 + u8::from(*straight), &[*mover], ""),
            Motion::Grip { item, frame, by } => write(4, &[*by, *item], frame),
            Motion::Free { item, on, by } => write(5, &[*by, *item, on.unwrap_or(InstanceId(u32::MAX))], ""),
            Motion::Upright { mover, goal, frame, .. } => write(6, &[*mover, *goal], frame),
            Motion::Tilted { mover, about: (item, point), goal, frame, .. } => {
                write(7, &[*mover, *item], point);
                write(7, &[*goal], frame);
            }
            Motion::Joints { mover, .. } => write(8, &[*mover], ""),
            Motion::Home { mover } => write(9, &[*mover], ""),
            Motion::Lead { item, frame, by } => write(14, &[*by, *item], frame),
            Motion::Fingers { by, open } => write(10 + u8::from(*open), &[*by], ""),
        }
        values.iter().for_each(|v| hash.write_u64(v.to_bits()));
        hex(&hash)
    }

    /// What became of a motion, if it is known.
    pub fn recall(&self, key: &str) -> Option<Outcome> {
        let found = self.outcomes.get(key)?;
        self.asked.borrow_mut().insert(key.to_string(), found.clone());
        Some(found.clone())
    }

    /// Something new.
    pub fn learn(&mut self, key: String, outcome: Outcome) {
        self.asked.borrow_mut().insert(key.clone(), outcome.clone());
        self.outcomes.insert(key, outcome);
        self.news = true;
    }

    /// Keeps what is new; of what was not asked for, as much as there is room for.
    pub fn keep(self) {
        if !self.news {
            return;
        }
        let mut outcomes = self.asked.into_inner();
        for (key, outcome) in self.outcomes {
            if outcomes.len() >= MOST {
                break;
            }
            outcomes.entry(key).or_insert(outcome);
        }
        let kept = Kept { made_by: MADE_BY.to_string(), lab: self.lab, outcomes };
        if let Ok(body) = serde_json::to_vec(&kept) {
            let mut bytes = sum(&body).into_bytes();
            bytes.push(b'\n');
            bytes.extend(body);
            self.store.save(&kept.lab, &bytes);
        }
    }
}

/// The outcomes that were kept of a lab; none where something else was kept, or not all of it is there.
fn read(bytes: &[u8], lab: &str) -> Option<BTreeMap<String, Outcome>> {
    let end = bytes.iter().position(|b| *b == b'\n')?;
    let (line, body) = (bytes.get(..end)?, bytes.get(end + 1..)?);
    if line != sum(body).as_bytes() {
        return None;
    }
    let kept: Kept = serde_json::from_slice(body).ok()?;
    (kept.made_by == MADE_BY && kept.lab == lab).then_some(kept.outcomes)
}

fn sum(bytes: &[u8]) -> String {
    let mut hash = SipHasher13::new();
    hash.write(bytes);
    hex(&hash)
}

fn hex(hash: &SipHasher13) -> String {
    format!("{:032x}", hash.finish128().as_u128())
}

/// What a lab is known by: everything of it but where in the text it stands.
fn digest_of(scene: &Scene) -> String {
    struct Feed(SipHasher13);
    impl io::Write for Feed {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.write(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let mut feed = Feed(SipHasher13::new());
    feed.0.write(MADE_BY.as_bytes());
    for i in &scene.instances {
        let what =
            (&i.name, i.owner, i.support, i.pose, i.placed, &i.frames, &i.shape, &i.solids, &i.room, &i.articulation);
        // A hash takes whatever it is given.
        let _ = serde_json::to_writer(&mut feed, &what);
    }
    hex(&feed.0)
}
