//! The keyboard while devices are at work: answers to questions, and the keys that pause, go on and stop.

use std::io::{BufRead, IsTerminal};

use matterix_hardware::deploy::{Answer, Control, Gate};

use crate::cancel;
use crate::terminal::{Stream, print};

const STOPPING: &str = "stopping: devices are halted, what `finally` says is done; Ctrl-C ends at once\n";
const PAUSING: &str = "pausing: what goes on ends, nothing new begins; r goes on, s lets one step begin\n";
const GOING_ON: &str = "going on\n";
const STEPPING: &str = "one step\n";
const HINT: &str = "q and Enter stops, p pauses, r goes on, s lets one step begin\n";
const CONFIRM: &str = "type y and Enter to confirm, n to stop: ";

/// What a person types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Word {
    Stop,
    Gate(Gate),
    Yes,
    No,
    Other,
}

/// Shows a question, and how to answer it where somebody has to.
pub fn show(text: &str, open: bool) {
    let how = if open { CONFIRM } else { "" };
    print(Stream::Err, &format!("{text}\n{how}"));
}

/// Listens from here on; false where standard input is no terminal.
pub fn listen(control: &'static Control) -> bool {
    if !std::io::stdin().is_terminal() {
        return false;
    }
    std::thread::spawn(move || hear(control));
    print(Stream::Err, HINT);
    true
}

fn hear(control: &Control) {
    for line in std::io::stdin().lock().lines() {
        let Ok(line) = line else { return };
        obey(&line, control);
    }
}

fn obey(line: &str, control: &Control) {
    let who = person();
    let answer = |yes| {
        control.open().first().is_some_and(|(question, _)| control.answer(*question, Answer { yes, who: who.clone() }))
    };
    match meant(line) {
        Word::Stop => {
            control.stop(&who);
            cancel::ask(STOPPING);
        }
        Word::Gate(gate) => {
            control.set_gate(gate, &who);
            let said = match gate {
                Gate::Pause => PAUSING,
                Gate::Step => STEPPING,
                Gate::Go => GOING_ON,
            };
            print(Stream::Err, said);
        }
        Word::Yes if answer(true) => {}
        Word::No if answer(false) => {}
        _ if !control.open().is_empty() => print(Stream::Err, CONFIRM),
        _ => print(Stream::Err, HINT),
    }
}

/// Who is at the terminal, as far as the system knows.
pub fn person() -> String {
    let name = ["USER", "LOGNAME"].into_iter().find_map(|key| std::env::var(key).ok().filter(|n| !n.is_empty()));
    name.unwrap_or_else(|| "a person".to_owned())
}

/// A blank or Esc stops as `q` does.
fn meant(line: &str) -> Word {
    let word = line.trim_matches(|c: char| c.is_whitespace() || c == '\u{1b}').to_ascii_lowercase();
    match word.as_str() {
        "" if !line.is_empty() => Word::Stop,
        "q" | "stop" => Word::Stop,
        "p" | "pause" => Word::Gate(Gate::Pause),
        "r" | "resume" => Word::Gate(Gate::Go),
        "s" | "step" => Word::Gate(Gate::Step),
        "y" | "yes" => Word::Yes,
        "n" | "no" => Word::No,
        _ => Word::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_in_a_hurry_is_understood() {
        for line in ["q", "Q ", "stop", " ", "\u{1b}", "\u{1b}q"] {
            assert_eq!(meant(line), Word::Stop, "{line:?}");
        }
        assert_eq!(meant("P"), Word::Gate(Gate::Pause));
        assert_eq!(meant(" y "), Word::Yes);
        for line in ["", "what?"] {
            assert_eq!(meant(line), Word::Other, "{line:?}");
        }
    }

    #[test]
    fn an_answer_goes_to_the_question_that_has_waited_longest() {
        static CANCEL: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);
        static CONTROL: Control = Control::new(&CANCEL, |_, _| {});
        CONTROL.ask(3, "is it in?");
        CONTROL.ask(5, "is it out?");
        obey("yes", &CONTROL);
        assert_eq!(CONTROL.answered(3).map(|a| a.yes), Some(true));
        assert_eq!(CONTROL.answered(5), None);
        obey("n", &CONTROL);
        assert_eq!(CONTROL.answered(5).map(|a| a.yes), Some(false));
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answers(), 0);
    }
}
