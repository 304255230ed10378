//! The keyboard while devices are at work: answers to questions, and the keys that pause, go on and stop.

use std::io::{BufRead, BufReader, IsTerminal};

use matterix_hardware::deploy::{Answer, Control, Gate, Notice, Taken};

use crate::cancel;
use crate::terminal::{Stream, print};

const STOPPING: &str = "stopping: devices are halted, then `finally` runs; Ctrl-C ends at once\n";
const PAUSING: &str = "pausing: running steps end, no new step starts; r and Enter continues, s starts one step\n";
/// What is said where a deployment that was paused is gone on with.
pub const STILL_PAUSED: &str = "still paused: r and Enter continues, s starts one step\n";
const GOING_ON: &str = "continuing\n";
const STEPPING: &str = "one step\n";
const HINT: &str = "q and Enter stops, p pauses, r continues, s starts one step\n";
const OVERTAKEN: &str = "this answers no question: the previous one was withdrawn or already answered\n";
const CONFIRM: &str = "type y and Enter to confirm, n to stop: ";

/// Who does not confirm what is asked when the terminal has gone.
const GONE: &str = "nobody, because the terminal was closed,";

/// So many ends of the input in a row are those of a terminal that is gone.
const MOST_ENDS: usize = 20;

/// How often a process in the background looks whether it is in the foreground again.
const BACKGROUND: std::time::Duration = std::time::Duration::from_millis(200);

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
pub fn show(notice: Notice<'_>) {
    let text = match notice {
        Notice::Prompt(text) => format!("{text}\n{CONFIRM}"),
        Notice::Waits(text) => format!("\nnext question: {text}\nfirst the previous question: {CONFIRM}"),
        Notice::Answered(text) => format!("{text}\n"),
        Notice::Heard(text, answer) => {
            format!("{} by {}: {text}\n", if answer.yes { "confirmed" } else { "not confirmed" }, answer.who)
        }
        Notice::Withdrawn(text) => format!("\nwithdrawn: {text}\n"),
    };
    print(Stream::Err, &text);
}

/// Listens from here on; false where standard input is no terminal.
/// Where the terminal goes away and nobody else can answer, nothing is confirmed any more.
pub fn listen(control: &'static Control, others_may_answer: bool) -> bool {
    if !std::io::stdin().is_terminal() {
        return false;
    }
    std::thread::spawn(move || {
        hear(control);
        if !others_may_answer {
            control.abandon(GONE);
        }
    });
    print(Stream::Err, HINT);
    true
}

fn hear(control: &Control) {
    let mut typed = BufReader::new(std::io::stdin().lock());
    let mut ends = 0;
    loop {
        if typed.buffer().is_empty() {
            turn();
        }
        let mut line = String::new();
        match typed.read_line(&mut line) {
            Ok(1..) => {
                ends = 0;
                obey(line.trim_end_matches(['\r', '\n']), control);
            }
            // Ctrl-D is no word; a terminal that is gone says the same without end.
            Ok(0) if ends < MOST_ENDS => {
                ends += 1;
                print(Stream::Err, HINT);
                std::thread::sleep(BACKGROUND);
            }
            _ => return,
        }
    }
}

/// Waits until something is typed and this process is the one that it is typed for: a terminal stops a process in the background
/// that reads, and a stopped one feeds no watchdog.
#[cfg(unix)]
fn turn() {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};

    let patience = Timespec { tv_sec: 0, tv_nsec: 200_000_000 };
    let stdin = std::io::stdin();
    loop {
        let group = rustix::termios::tcgetpgrp(&stdin);
        if group.is_ok_and(|group| group != rustix::process::getpgrp()) {
            std::thread::sleep(BACKGROUND);
            continue;
        }
        match poll(&mut [PollFd::new(&stdin, PollFlags::IN)], Some(&patience)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => {}
            _ => return,
        }
    }
}

#[cfg(not(unix))]
fn turn() {}

/// A person stops a deployment.
pub fn stop(who: &str, control: &Control) {
    control.stop(who);
    cancel::ask(STOPPING);
}

/// A person says what may begin.
pub fn gate(gate: Gate, who: &str, control: &Control) {
    control.set_gate(gate, who);
    let said = match gate {
        Gate::Pause => PAUSING,
        Gate::Step => STEPPING,
        Gate::Go => GOING_ON,
    };
    print(Stream::Err, said);
}

/// What a person said who is not at this terminal.
pub fn told(what: &str, who: &str) {
    print(Stream::Err, &format!("{what}: {who}\n"));
}

/// Signals that pause, let one step begin and go on. Ctrl-Z pauses too: a process that stands still feeds no watchdog.
#[cfg(unix)]
pub fn heed_signals(control: &'static Control) -> std::io::Result<()> {
    use signal_hook::consts::{SIGTSTP, SIGURG, SIGUSR1, SIGUSR2};

    let mut signals = signal_hook::iterator::Signals::new([SIGUSR1, SIGURG, SIGUSR2, SIGTSTP])?;
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let (to, name) = match signal {
                SIGUSR1 => (Gate::Pause, "SIGUSR1"),
                SIGURG => (Gate::Step, "SIGURG"),
                SIGUSR2 => (Gate::Go, "SIGUSR2"),
                _ => (Gate::Pause, "Ctrl-Z"),
            };
            let who = format!("a signal ({name})");
            told("heard", &who);
            gate(to, &who, control);
        }
    });
    Ok(())
}

#[cfg(not(unix))]
pub fn heed_signals(_: &'static Control) -> std::io::Result<()> {
    Ok(())
}

fn obey(line: &str, control: &Control) {
    let who = person();
    let word = meant(line);
    match word {
        Word::Stop => stop(&who, control),
        Word::Gate(to) => gate(to, &who, control),
        Word::Yes | Word::No => match control.answer_prompted(Answer { yes: word == Word::Yes, who }) {
            Taken::Yes => {}
            // Whoever types may not have seen that another question is asked by now.
            Taken::Overtaken => {
                print(Stream::Err, OVERTAKEN);
                control.prompt_again();
            }
            Taken::Nothing => print(Stream::Err, HINT),
        },
        Word::Other if !control.open().is_empty() => print(Stream::Err, CONFIRM),
        Word::Other => print(Stream::Err, HINT),
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
        static CONTROL: Control = Control::new(&CANCEL, |_| {});
        CONTROL.ask(3, "is it in?");
        CONTROL.ask(5, "is it out?");
        obey("yes", &CONTROL);
        assert_eq!(CONTROL.answered(3).map(|a| a.yes), Some(true));
        assert_eq!(CONTROL.answered(5), None);
        // Typed ahead: nobody has seen the second question.
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answered(5), None);
        std::thread::sleep(std::time::Duration::from_millis(400));
        obey("n", &CONTROL);
        assert_eq!(CONTROL.answered(5).map(|a| a.yes), Some(false));
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answers(), 2, "nothing was open any more");
    }

    #[test]
    fn an_answer_to_a_question_that_was_withdrawn_is_not_that_to_the_next() {
        static CANCEL: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);
        static CONTROL: Control = Control::new(&CANCEL, |_| {});
        CONTROL.ask(3, "is the salt in?");
        CONTROL.withdraw(3);
        CONTROL.ask(5, "is the hood closed?");
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answered(5), None);
        std::thread::sleep(std::time::Duration::from_millis(400));
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answered(5).map(|a| a.yes), Some(true));
    }

    #[test]
    fn an_answer_to_a_question_that_was_just_answered_on_the_page_is_not_that_to_the_next() {
        static CANCEL: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);
        static CONTROL: Control = Control::new(&CANCEL, |_| {});
        let page = |question| CONTROL.answer(question, Answer { yes: true, who: "Ann, on the page".to_owned() });
        for (n, text) in [(1, "is the bottle under the pump?"), (2, "is the flask on?"), (3, "is the hood closed?")] {
            CONTROL.ask(n, text);
        }
        assert!(page(1));
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answered(2), None, "it was meant for the first");
        assert!(page(3), "one that was not prompted for overtakes nobody");
        std::thread::sleep(std::time::Duration::from_millis(400));
        obey("y", &CONTROL);
        assert_eq!(CONTROL.answered(2).map(|a| a.who), Some(person()));
    }
}
