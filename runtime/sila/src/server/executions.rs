//! Commands that were called and last: how each stands, for whoever asks.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::watch;

use crate::call::Failure;
use crate::value::Value;

/// The most that are kept; the oldest that have ended are forgotten first.
const MOST: usize = 1000;

/// How an execution stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// From 0 to 1.
    pub progress: f64,
    /// s.
    pub remaining: Option<f64>,
    /// Whether it has begun.
    pub begun: bool,
    /// How it ended.
    pub end: Option<Result<Vec<Value>, Failure>>,
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Known {
    /// Index of its feature and of its command.
    pub of: (usize, usize),
    /// Set to break it off.
    pub cancelled: Arc<AtomicBool>,
    /// How it stands.
    pub state: watch::Receiver<State>,
}

/// All of them.
#[derive(Debug, Default)]
pub struct Executions(Mutex<Kept>);

/// How many there were, and those that are kept, by their names and with their numbers.
#[derive(Debug, Default)]
struct Kept {
    count: u64,
    all: BTreeMap<String, (u64, Known)>,
}

impl Executions {
    /// A new one; nothing where too many go on.
    pub fn add(&self, of: (usize, usize), cancelled: Arc<AtomicBool>, state: watch::Receiver<State>) -> Option<String> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.all.len() >= MOST {
            let ended = kept.all.iter().filter(|(_, (_, known))| known.state.borrow().end.is_some());
            let oldest = ended.min_by_key(|(_, (turn, _))| *turn).map(|(name, _)| name.clone())?;
            kept.all.remove(&oldest);
        }
        let name = uuid::Uuid::new_v4().to_string();
        kept.count += 1;
        let turn = kept.count;
        kept.all.insert(name.clone(), (turn, Known { of, cancelled, state }));
        Some(name)
    }

    /// Breaks off one that goes on, or all without a name; whether there was one with it.
    pub fn cancel(&self, name: Option<&str>) -> bool {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let meant = kept.all.iter().filter(|(known, _)| name.is_none_or(|name| name == known.as_str()));
        let going = meant.filter(|(_, (_, known))| known.state.borrow().end.is_none());
        going.map(|(_, (_, known))| known.cancelled.store(true, Ordering::Relaxed)).count() > 0
    }

    /// One of a command.
    pub fn find(&self, name: &str, of: (usize, usize)) -> Option<Known> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.all.get(name).map(|(_, known)| known.clone()).filter(|k| k.of == of)
    }
}
