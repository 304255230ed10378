//! People beside a deployment: questions and their answers, what may begin, and who stopped it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::journal::Gate;

/// What a person said to a question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Whether they confirmed.
    pub yes: bool,
    /// Who.
    pub who: String,
}

impl Answer {
    /// Who answers where nobody can be asked.
    pub const NOBODY: &'static str = "nobody";

    /// The answer of a room without people.
    pub fn of_nobody() -> Self {
        Answer { yes: false, who: Self::NOBODY.to_owned() }
    }

    /// A no in words.
    pub(super) fn refusal(who: &str) -> String {
        match who {
            Self::NOBODY => "nobody is there to confirm it: run it on a terminal, or with `--yes`".to_owned(),
            who => format!("{who} did not confirm it"),
        }
    }
}

/// What is shown to whoever is at the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice<'t> {
    /// A question, and whether somebody has to answer it.
    Asked(&'t str, bool),
    /// A question that is asked no longer.
    Withdrawn(&'t str),
}

/// What people say while a deployment goes on: from a keyboard, by signals, over a page. It is shared between threads.
#[derive(Debug)]
pub struct Control {
    /// Set to end it early.
    cancel: &'static AtomicBool,
    /// Shows questions.
    show: fn(Notice<'_>),
    said: Mutex<Said>,
}

#[derive(Debug, Default)]
struct Said {
    /// Questions that are open, by number.
    open: BTreeMap<u64, String>,
    answers: BTreeMap<u64, Answer>,
    /// A question was withdrawn since somebody last answered: what they type next may be meant for that.
    withdrawn: bool,
    /// Answers that were ever given.
    given: usize,
    /// Answers every question at once.
    standing: Option<Answer>,
    gates: VecDeque<(Gate, String)>,
    stopped_by: Option<String>,
}

impl Said {
    fn give(&mut self, question: u64, answer: Answer) {
        self.answers.insert(question, answer);
        self.given += 1;
    }
}

impl Control {
    /// Nothing has been said yet; `cancel` is set to end the deployment early, `show` is given each question, and
    /// each that is asked no longer.
    pub const fn new(cancel: &'static AtomicBool, show: fn(Notice<'_>)) -> Self {
        let said = Said {
            open: BTreeMap::new(),
            answers: BTreeMap::new(),
            withdrawn: false,
            given: 0,
            standing: None,
            gates: VecDeque::new(),
            stopped_by: None,
        };
        Control { cancel, show, said: Mutex::new(said) }
    }

    /// From now on every question has this answer at once.
    pub fn answer_all(&self, answer: Answer) {
        self.said().standing = Some(answer);
    }

    /// From now on nobody can answer: what is asked, and what is open, is not confirmed.
    pub fn abandon(&self, who: &str) {
        let mut said = self.said();
        let answer = Answer { yes: false, who: who.to_owned() };
        for question in std::mem::take(&mut said.open).into_keys() {
            said.give(question, answer.clone());
        }
        said.standing = Some(answer);
    }

    /// A question is put.
    pub fn ask(&self, question: u64, text: &str) {
        let mut said = self.said();
        (self.show)(Notice::Asked(text, said.standing.is_none()));
        match said.standing.clone() {
            Some(answer) => said.give(question, answer),
            None => drop(said.open.insert(question, text.to_owned())),
        }
    }

    /// The questions that are open, by number.
    pub fn open(&self) -> Vec<(u64, String)> {
        self.said().open.iter().map(|(number, text)| (*number, text.clone())).collect()
    }

    /// A person answers; false where that question is not open.
    pub fn answer(&self, question: u64, answer: Answer) -> bool {
        let mut said = self.said();
        let is_open = said.open.remove(&question).is_some();
        if is_open {
            said.give(question, answer);
        }
        is_open
    }

    /// What was answered, once.
    pub fn answered(&self, question: u64) -> Option<Answer> {
        self.said().answers.remove(&question)
    }

    /// How many answers were given so far.
    pub fn answers(&self) -> usize {
        self.said().given
    }

    /// A question is open no longer.
    pub fn withdraw(&self, question: u64) {
        let mut said = self.said();
        if let Some(text) = said.open.remove(&question) {
            said.withdrawn = true;
            (self.show)(Notice::Withdrawn(&text));
        }
        said.answers.remove(&question);
    }

    /// Whether a question was withdrawn since this was last asked: an answer without a name may be meant for that one.
    pub fn is_overtaken(&self) -> bool {
        std::mem::take(&mut self.said().withdrawn)
    }

    /// A person says what may begin.
    pub fn set_gate(&self, gate: Gate, who: &str) {
        self.said().gates.push_back((gate, who.to_owned()));
    }

    /// What was last said of that and has not been heeded yet.
    pub fn next_gate(&self) -> Option<(Gate, String)> {
        self.said().gates.pop_front()
    }

    /// A person ends the deployment early.
    pub fn stop(&self, who: &str) {
        self.said().stopped_by.get_or_insert_with(|| who.to_owned());
        self.cancel.store(true, Ordering::SeqCst);
    }

    /// Whether it is to end.
    pub fn is_stopped(&self) -> bool {
        self.cancel.load(Ordering::SeqCst)
    }

    /// The flag that ends it.
    pub fn cancel(&self) -> &AtomicBool {
        self.cancel
    }

    /// Who ended it, where that is known.
    pub fn stopped_by(&self) -> Option<String> {
        self.said().stopped_by.clone()
    }

    fn said(&self) -> MutexGuard<'_, Said> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
