//! Checks texts beside the conversation: one thread for what is being typed, one for the ways of robots, which take longer.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crossbeam_channel::{Receiver, Sender};
use matterix_editor::Analysis;
use matterix_ir::{Diagnostic, FileId};
use matterix_lang::{Loader, Session};

use crate::STACK;
use crate::cache;
use crate::pipeline::{self, Neighbours};

/// Bytes of a text whose check takes longer than one waits for.
const LARGE: usize = 64 << 10;

/// How long nothing must have changed before the ways of robots are looked at.
const QUIET: Duration = Duration::from_millis(400);

/// So many checks in a row are broken off for newer texts; then one is done to its end, so that somebody who never rests is told too what
/// things hold.
const MOST_BROKEN_OFF: usize = 20;

/// The open texts by their paths.
pub type Open = Arc<BTreeMap<PathBuf, Arc<str>>>;

/// A text to be checked.
#[derive(Clone, Debug)]
pub struct Wish {
    /// Its address.
    pub uri: String,
    /// What its result is of.
    pub stamp: u64,
    /// Its name in findings.
    pub name: String,
    /// It.
    pub text: Arc<str>,
    /// Where its neighbours are.
    pub folder: Option<PathBuf>,
}

/// Texts to be checked, the most urgent first; they replace those wished before.
#[derive(Clone, Debug)]
pub struct Round {
    /// What is to be checked.
    pub wishes: Vec<Wish>,
    /// The open texts by their paths.
    pub open: Open,
}

/// What was found.
#[derive(Debug)]
pub struct Verdict {
    /// Of which text.
    pub uri: String,
    /// Of which state of it.
    pub stamp: u64,
    /// What.
    pub said: Said,
}

/// What was found, and how.
#[derive(Debug)]
pub enum Said {
    /// By reading the text alone: the rest of a large one takes its time.
    Read(Vec<Diagnostic>),
    /// By a check, which asked for these files.
    Checked(Box<Analysis>, Vec<PathBuf>),
    /// By a check that looked at the ways of robots as well.
    Moved(Vec<Diagnostic>),
}

/// The threads that check.
#[derive(Debug)]
pub struct Judge {
    checks: Sender<Round>,
    motions: Sender<Round>,
}

impl Judge {
    /// Starts them; verdicts come through the channel. `Err` says why there are none.
    pub fn start(verdicts: &Sender<Verdict>) -> Result<Judge, String> {
        let (checks, wished) = crossbeam_channel::unbounded();
        let (motions, later) = crossbeam_channel::unbounded();
        let (to_checks, to_motions) = (verdicts.clone(), verdicts.clone());
        let start = |name: &str, work: Box<dyn FnOnce() + Send>| {
            let thread = thread::Builder::new().name(name.to_string()).stack_size(STACK);
            thread.spawn(work).map_err(|why| format!("cannot start a thread: {why}"))
        };
        start("checks", Box::new(move || check_all(&wished, &to_checks)))?;
        start("motions", Box::new(move || look_at_motions(&later, &to_motions)))?;
        Ok(Judge { checks, motions })
    }

    /// Has texts checked.
    pub fn check(&self, round: Round) {
        // The thread ends with the server only.
        let _ = self.checks.send(round);
    }

    /// Has the ways of robots looked at once nothing changes any more.
    pub fn look_at_motions(&self, round: Round) {
        let _ = self.motions.send(round);
    }
}

fn check_all(wished: &Receiver<Round>, verdicts: &Sender<Verdict>) {
    let mut done: BTreeMap<String, u64> = BTreeMap::new();
    let mut session = Session::default();
    let mut broken_off = 0;
    while let Ok(round) = wished.recv() {
        let round = wished.try_iter().last().unwrap_or(round);
        for wish in round.wishes {
            if !wished.is_empty() {
                break;
            }
            if done.get(&wish.uri) == Some(&wish.stamp) {
                continue;
            }
            if wish.text.len() > LARGE {
                let found = session.syntax(&wish.name, &wish.text);
                let said = Said::Read(found);
                let verdict = Verdict { uri: wish.uri.clone(), stamp: wish.stamp, said };
                if verdicts.send(verdict).is_err() {
                    return;
                }
            }
            let texts = Texts::new(wish.folder.as_deref(), &round.open);
            let newer = || broken_off < MOST_BROKEN_OFF && !wished.is_empty();
            let Some(analysis) = Analysis::unless(&wish.name, &wish.text, &texts, &mut session, &newer) else {
                broken_off += 1;
                break;
            };
            broken_off = 0;
            let said = Said::Checked(Box::new(analysis), texts.asked());
            done.insert(wish.uri.clone(), wish.stamp);
            if verdicts.send(Verdict { uri: wish.uri, stamp: wish.stamp, said }).is_err() {
                return;
            }
        }
    }
}

fn look_at_motions(wished: &Receiver<Round>, verdicts: &Sender<Verdict>) {
    let store = cache::of(false);
    let mut wishes: BTreeMap<String, (Wish, Open)> = BTreeMap::new();
    let mut session = Session::default();
    loop {
        let came = match wishes.is_empty() {
            true => wished.recv().ok(),
            false => match wished.recv_timeout(QUIET) {
                Ok(round) => Some(round),
                Err(crossbeam_channel::RecvTimeoutError::Timeout) => {
                    let Some((uri, (wish, open))) = wishes.pop_first() else { continue };
                    let texts = Texts::new(wish.folder.as_deref(), &open);
                    let found = pipeline::check_text(&wish.name, &wish.text, &texts, &*store, &mut session);
                    if verdicts.send(Verdict { uri, stamp: wish.stamp, said: Said::Moved(found) }).is_err() {
                        return;
                    }
                    continue;
                }
                Err(crossbeam_channel::RecvTimeoutError::Disconnected) => None,
            },
        };
        let Some(round) = came else { return };
        for wish in round.wishes {
            wishes.insert(wish.uri.clone(), (wish, round.open.clone()));
        }
    }
}

/// Modules beside a text: those that are open as they are on the screen, the others as on the disk.
pub struct Texts<'o> {
    folder: Option<&'o Path>,
    neighbours: Neighbours,
    open: &'o BTreeMap<PathBuf, Arc<str>>,
    asked: RefCell<BTreeSet<PathBuf>>,
}

impl<'o> Texts<'o> {
    /// Beside a text in a folder; none where it lies nowhere.
    pub fn new(folder: Option<&'o Path>, open: &'o BTreeMap<PathBuf, Arc<str>>) -> Self {
        let neighbours = Neighbours::of(folder.unwrap_or(Path::new("")));
        Texts { folder, neighbours, open, asked: RefCell::default() }
    }

    /// The files that were asked for.
    fn asked(&self) -> Vec<PathBuf> {
        self.asked.borrow().iter().cloned().collect()
    }

    fn note(&self, path: &Path) {
        self.asked.borrow_mut().insert(path.to_path_buf());
    }
}

impl Loader for Texts<'_> {
    fn load(&self, from: FileId, module: &str) -> Option<(String, String)> {
        // A text that lies nowhere has no neighbours.
        self.folder?;
        let path = self.neighbours.path(module)?;
        self.note(&path);
        match self.open.get(&path) {
            Some(text) => Some((path.display().to_string(), text.to_string())),
            None => self.neighbours.load(from, module),
        }
    }

    fn bytes(&self, from: FileId, path: &str) -> Result<Vec<u8>, String> {
        let Some(folder) = self.folder else { return Err("a file that uses this name is not saved".to_string()) };
        self.note(&folder.join(path));
        self.neighbours.bytes(from, path)
    }

    fn file(&self, from: FileId, path: &str) -> Result<String, String> {
        let Some(folder) = self.folder else { return Err("a file that uses this name is not saved".to_string()) };
        self.note(&folder.join(path));
        self.neighbours.file(from, path)
    }
}
