//! Files in which an earlier check found nothing that is to be shown: they are not looked through again while nothing it read has
//! changed.
//!
//! Findings are not kept, only that there were none: what has to be shown is found anew.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::UNIX_EPOCH;
use std::{env, fs};

use matterix_ir::FileId;
use matterix_lang::{Loader, Stop};
use matterix_runtime::motion::{Store, seal};
use serde::{Deserialize, Serialize};

use super::Advice;
use super::neighbours::Neighbours;
use crate::args::Fidelity;

/// What they are kept under, with the first digits of a key.
const NAME: &str = "clean-";
/// How many digits.
const DIGITS: usize = 2;
/// How many files are kept under a name, those looked through last.
const MOST: usize = 64;

/// What the compiler asks for beside the file itself.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
enum Question {
    Module(String),
    Bytes(String),
    Text(String),
}

/// Questions with what the answers are known by; nothing where there was no answer.
type Answers = Vec<(Question, Option<String>)>;

/// A loader that notes what was asked for.
pub(super) struct Noted<'n> {
    neighbours: &'n Neighbours,
    answers: RefCell<BTreeMap<Question, Option<String>>>,
}

impl<'n> Noted<'n> {
    pub(super) fn new(neighbours: &'n Neighbours) -> Self {
        Noted { neighbours, answers: RefCell::default() }
    }

    fn note(&self, question: Question, answer: Option<&[u8]>) {
        self.answers.borrow_mut().insert(question, answer.map(seal::sum));
    }
}

impl Loader for Noted<'_> {
    fn load(&self, from: FileId, module: &str) -> Option<(String, String)> {
        let found = self.neighbours.load(from, module);
        self.note(Question::Module(module.to_owned()), found.as_ref().map(|f| f.1.as_bytes()));
        found
    }

    fn bytes(&self, from: FileId, path: &str) -> Result<Vec<u8>, String> {
        let found = self.neighbours.bytes(from, path);
        self.note(Question::Bytes(path.to_owned()), found.as_deref().ok());
        found
    }

    fn file(&self, from: FileId, path: &str) -> Result<String, String> {
        let found = self.neighbours.file(from, path);
        self.note(Question::Text(path.to_owned()), found.as_ref().ok().map(|f| f.as_bytes()));
        found
    }

    fn stop(&self) -> Stop {
        self.neighbours.stop()
    }
}

/// What is kept of a text, a fidelity and what is looked for.
pub(super) struct Entry<'s> {
    store: &'s dyn Store,
    key: String,
}

impl<'s> Entry<'s> {
    /// That of a text; none where nothing is kept.
    pub(super) fn of(text: &[u8], fidelity: Fidelity, advice: Advice, store: &'s dyn Store) -> Option<Self> {
        let made_by = store.keeps().then(command).flatten()?;
        let key = seal::sum(format!("{made_by} {fidelity:?} {advice:?} {}", seal::sum(text)).as_bytes());
        Some(Entry { store, key })
    }

    /// Whether an earlier check found nothing and would read the same now.
    pub(super) fn is_clean(&self, neighbours: &Neighbours) -> bool {
        let from = FileId(0);
        let now = |question: &Question| match question {
            Question::Module(module) => neighbours.load(from, module).map(|f| seal::sum(f.1.as_bytes())),
            Question::Bytes(path) => neighbours.bytes(from, path).ok().map(|b| seal::sum(&b)),
            Question::Text(path) => neighbours.file(from, path).ok().map(|t| seal::sum(t.as_bytes())),
        };
        let kept = self.kept();
        let found = kept.iter().find(|(key, _)| *key == self.key);
        found.is_some_and(|(_, answers)| answers.iter().all(|(question, then)| now(question) == *then))
    }

    /// Keeps that a check which read these found nothing.
    pub(super) fn keep(&self, read: Noted<'_>) {
        let mut kept = self.kept();
        kept.retain(|(key, _)| *key != self.key);
        kept.insert(0, (self.key.clone(), read.answers.into_inner().into_iter().collect()));
        kept.truncate(MOST);
        if let Some(bytes) = seal::closed(&kept) {
            self.store.save(&self.name(), &bytes);
        }
    }

    fn name(&self) -> String {
        format!("{NAME}{}", &self.key[..DIGITS])
    }

    fn kept(&self) -> Vec<(String, Answers)> {
        self.store.load(&self.name()).and_then(|bytes| seal::opened(&bytes)).unwrap_or_default()
    }
}

/// Which build of the command it is, library and all: another one may find what this one does not.
fn command() -> Option<String> {
    let file = fs::metadata(env::current_exe().ok()?).ok()?;
    let made = file.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some(format!("{} {} {}", env!("CARGO_PKG_VERSION"), file.len(), made.as_nanos()))
}
