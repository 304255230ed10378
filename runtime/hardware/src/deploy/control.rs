//! People beside a deployment: questions and their answers, what may begin, and who stopped it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

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
            Self::NOBODY => "nobody can confirm it: run it on a terminal, or with `--yes`".to_owned(),
            who => format!("{who} did not confirm it"),
        }
    }
}

/// Nobody has read a question and answered it so soon after it was prompted for in place of another one.
const UNREAD: Duration = Duration::from_millis(300);

/// What is shown to whoever is at the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice<'t> {
    /// The question that the next answer at the terminal is to.
    Prompt(&'t str),
    /// A question that is asked too, and prompted for when those before it are answered.
    Waits(&'t str),
    /// A question that is answered at once, as all are.
    Answered(&'t str),
    /// What was said to a question, and by whom.
    Heard(&'t str, &'t Answer),
    /// A question that is asked no longer.
    Withdrawn(&'t str),
}

/// What became of an answer at the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// It is the answer to the question that was prompted for.
    Yes,
    /// It is none: the question that was prompted for before was withdrawn, answered elsewhere or just now, and it may be meant for that.
    Overtaken,
    /// Nothing is asked.
    Nothing,
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
    /// The question that the next answer at the terminal is to.
    prompted: Option<u64>,
    /// One that was prompted for is over without an answer there: what is typed next may be meant for that.
    overtaken: bool,
    /// When the prompt last went from one question to the next.
    moved: Option<Instant>,
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

    /// A question is over: the next one is prompted for.
    #[allow(
        clippy::disallowed_methods,
        reason = "people live by the clock of the room; the journal has what they said"
    )]
    fn close(&mut self, question: u64, show: fn(Notice<'_>)) {
        if self.prompted != Some(question) {
            return;
        }
        let next = self.open.first_key_value();
        self.prompted = next.map(|(number, _)| *number);
        if let Some((_, text)) = next {
            self.moved = Some(Instant::now());
            show(Notice::Prompt(text));
        }
    }
}

impl Control {
    /// Nothing has been said yet; `cancel` is set to end the deployment early, `show` is given each question, and
    /// each that is asked no longer.
    pub const fn new(cancel: &'static AtomicBool, show: fn(Notice<'_>)) -> Self {
        let said = Said {
            open: BTreeMap::new(),
            answers: BTreeMap::new(),
            prompted: None,
            overtaken: false,
            moved: None,
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
        said.prompted = None;
        said.standing = Some(answer);
    }

    /// A question is put.
    pub fn ask(&self, question: u64, text: &str) {
        let mut said = self.said();
        if let Some(answer) = said.standing.clone() {
            (self.show)(Notice::Answered(text));
            said.give(question, answer);
            return;
        }
        said.open.insert(question, text.to_owned());
        let prompted = *said.prompted.get_or_insert(question);
        (self.show)(if prompted == question { Notice::Prompt(text) } else { Notice::Waits(text) });
    }

    /// The questions that are open, by number.
    pub fn open(&self) -> Vec<(u64, String)> {
        self.said().open.iter().map(|(number, text)| (*number, text.clone())).collect()
    }

    /// A person who is not at the terminal answers; false where that question is not open.
    pub fn answer(&self, question: u64, answer: Answer) -> bool {
        let mut said = self.said();
        let Some(text) = said.open.remove(&question) else { return false };
        (self.show)(Notice::Heard(&text, &answer));
        said.overtaken |= said.prompted == Some(question);
        said.give(question, answer);
        said.close(question, self.show);
        true
    }

    /// A person at the terminal answers what is prompted for.
    pub fn answer_prompted(&self, answer: Answer) -> Taken {
        let mut said = self.said();
        let is_overtaken = std::mem::take(&mut said.overtaken);
        let Some(question) = said.prompted else {
            return if is_overtaken { Taken::Overtaken } else { Taken::Nothing };
        };
        if is_overtaken || said.moved.is_some_and(|moved| moved.elapsed() < UNREAD) {
            return Taken::Overtaken;
        }
        if let Some(text) = said.open.remove(&question) {
            (self.show)(Notice::Heard(&text, &answer));
        }
        said.give(question, answer);
        said.close(question, self.show);
        Taken::Yes
    }

    /// Shows once more what is prompted for.
    pub fn prompt_again(&self) {
        let said = self.said();
        if let Some(text) = said.prompted.and_then(|question| said.open.get(&question)) {
            (self.show)(Notice::Prompt(text));
        }
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
            said.overtaken |= said.prompted == Some(question);
            (self.show)(Notice::Withdrawn(&text));
            said.close(question, self.show);
        }
        said.answers.remove(&question);
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
