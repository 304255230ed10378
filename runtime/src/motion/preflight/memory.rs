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
use siphasher::sip128::SipHasher13;

use super::more::More;
use super::seal::{self, MADE_BY, Store};
use crate::motion::refused::Refused;
use crate::motion::stage::{Change, Stage};

/// What became of a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// It can be carried out, and this is different afterwards.
    Done(Change),
    /// It cannot.
    Refused {
        /// Why.
        why: Refused,
        /// What more is known of it.
        more: More,
    },
}

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
        let outcomes = store.load(&lab).map(|bytes| known(&bytes, &lab)).unwrap_or_default();
        Memory { store, lab, outcomes, asked: RefCell::default(), news: false }
    }

    /// What a motion is known by.
    pub fn key(&self, stage: &Stage<'_>, motion: &Motion, values: &[f64]) -> String {
        let mut hash = SipHasher13::new();
        hash.write_u8(u8::from(stage.hasty));
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
            Motion::Tilted { mover, about: (item, point), goal, frame, within, .. } => {
                write(7 + 9 * u8::from(within.is_some()), &[*mover, *item], point);
                write(7, &[*goal], frame);
            }
            Motion::Joints { mover, .. } => write(8, &[*mover], ""),
            Motion::Home { mover } => write(9, &[*mover], ""),
            Motion::Drive { mover, goal, frame } => write(15, &[*mover, *goal], frame),
            Motion::Lead { item, frame, by } => write(14, &[*by, *item], frame),
            Motion::Fingers { by, open } => write(10 + u8::from(*open), &[*by], ""),
        }
        values.iter().for_each(|v| hash.write_u64(v.to_bits()));
        for (id, burden) in &stage.burdens {
            hash.write_u32(id.0);
            for known in [burden.loose, burden.borne] {
                hash.write_u64(known.unwrap_or(f64::NAN).to_bits());
            }
        }
        for (id, tempo) in &stage.tempi {
            hash.write_u32(id.0);
            [tempo.slowness, tempo.tip_speed].into_iter().for_each(|known| hash.write_u64(known.to_bits()));
        }
        seal::hex(&hash)
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
        seal::add(self.store, &self.lab, |now| {
            // Another workflow of the lab may have been looked at meanwhile.
            let others = now.map(|bytes| known(&bytes, &self.lab)).unwrap_or_default();
            for (key, outcome) in others.into_iter().chain(self.outcomes) {
                if outcomes.len() >= MOST {
                    break;
                }
                outcomes.entry(key).or_insert(outcome);
            }
            seal::closed(&Kept { made_by: MADE_BY.to_string(), lab: self.lab.clone(), outcomes })
        });
    }
}

/// The outcomes that are kept of a lab.
fn known(bytes: &[u8], lab: &str) -> BTreeMap<String, Outcome> {
    let kept = seal::opened::<Kept>(bytes).filter(|k| k.made_by == MADE_BY && k.lab == lab);
    kept.map(|k| k.outcomes).unwrap_or_default()
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
        let what = (
            &i.name,
            i.owner,
            i.support,
            i.pose,
            i.placed,
            &i.frames,
            &i.shape,
            &i.solids,
            (&i.collision, &i.room, &i.articulation),
        );
        // A hash takes whatever it is given.
        let _ = serde_json::to_writer(&mut feed, &what);
    }
    seal::hex(&feed.0)
}
