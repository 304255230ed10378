//! The keyboard while devices are at work: answers to questions, and the key that stops.

use std::io::{BufRead, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use crate::cancel;
use crate::terminal::{Stream, print};

/// A question is open: the next line answers it.
static ASKS: AtomicBool = AtomicBool::new(false);

const STOPPING: &str = "stopping: devices are halted, what `finally` says is done; Ctrl-C ends at once\n";
const HINT: &str = "type q and Enter to stop\n";

/// A person at a terminal.
pub struct Keys {
    answers: Receiver<String>,
}

impl Keys {
    /// Listens from here on; none where standard input is no terminal.
    pub fn listen() -> Option<Keys> {
        if !std::io::stdin().is_terminal() {
            return None;
        }
        let (send, answers) = channel();
        std::thread::spawn(move || hear(&send));
        print(Stream::Err, HINT);
        Some(Keys { answers })
    }

    /// The next line; none where nobody is there any more.
    pub fn ask(&mut self) -> Option<String> {
        ASKS.store(true, Ordering::SeqCst);
        let answer = self.answers.recv().ok();
        ASKS.store(false, Ordering::SeqCst);
        answer
    }
}

fn hear(answers: &Sender<String>) {
    for line in std::io::stdin().lock().lines() {
        let Ok(line) = line else { return };
        if ASKS.swap(false, Ordering::SeqCst) {
            if answers.send(line).is_err() {
                return;
            }
        } else if is_stop(&line) {
            cancel::ask(STOPPING);
        } else {
            print(Stream::Err, HINT);
        }
    }
}

/// `q`, `stop`, a blank or Esc.
fn is_stop(line: &str) -> bool {
    let word = line.trim_matches(|c: char| c.is_whitespace() || c == '\u{1b}');
    word.eq_ignore_ascii_case("q") || word.eq_ignore_ascii_case("stop") || (word.is_empty() && !line.is_empty())
}

#[cfg(test)]
mod tests {
    use super::is_stop;

    #[test]
    fn a_person_in_a_hurry_is_understood() {
        for line in ["q", "Q ", "stop", " ", "\u{1b}", "\u{1b}q"] {
            assert!(is_stop(line), "{line:?}");
        }
        for line in ["", "y", "what?"] {
            assert!(!is_stop(line), "{line:?}");
        }
    }
}
