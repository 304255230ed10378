//! Questions that people answer late, and people who pause: devices, watchdogs, readings and `keep` go on meanwhile, and what follows is
//! timed from then.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use serde_json::Value;

use super::faulty::{is_safe, plate};
use super::stop::{signal, terminal};
use super::{Answer, Device, Emulated, bench, deploy, lines};
use crate::harness::{command, flat, matterixc_in, write};

/// Seconds of lab time per second.
const SPEED: &str = "10";

const STIR: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow stir_a_while in bench {
    ask \"add the reagent, then confirm\"
    stir plate at 300 rpm
    wait 10 s
    stop stirring plate
} finally { stop stirring plate }
";

const LOAD: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow load in bench {
    heat plate to 60 degC
    stir plate at 300 rpm
    wait 5 s
    ask \"load the sample, then confirm\"
    wait 6 s
    note \"after: {plate.temperature as degC :.1}\"
} finally { stop heating plate; stop stirring plate }
";

const GUARD: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow guarded in bench {
    heat plate to 80 degC
    keep plate.temperature <= 30 degC {
        wait 2 s
        ask \"load the sample, then confirm\"
    }
} finally { stop heating plate }
";

/// A deployment with a person at its terminal.
struct Room {
    dir: PathBuf,
    keyboard: File,
    process: Child,
    _emulated: Emulated,
}

/// How it ended.
struct Left {
    code: Option<i32>,
    said: String,
    journal: Vec<Value>,
}

impl Room {
    fn begin(name: &str, text: &str) -> Room {
        Room::with(name, text, "")
    }

    /// With bindings of more devices than the plate.
    fn with(name: &str, text: &str, more: &str) -> Room {
        let dir = bench(name, text, "plate", "");
        let emulated = Emulated::at(SPEED, &dir, &["plate", "--file", "lab.mtx"]);
        write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n{more}", emulated.address));
        let (keyboard, terminal) = terminal();
        let mut process = command();
        process.current_dir(&dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real"]);
        process.args(["--journal", "journal", "--speed", SPEED]).env("USER", "ada").stdin(terminal);
        let process = process.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the command starts");
        Room { dir, keyboard, process, _emulated: emulated }
    }

    /// Waits until the journal says something so often.
    fn until(&self, word: &str, times: usize) {
        for _ in 0..4000 {
            if std::fs::read_to_string(self.dir.join("journal")).is_ok_and(|j| j.matches(word).count() >= times) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("{}", std::fs::read_to_string(self.dir.join("journal")).unwrap_or_default());
    }

    fn types(&mut self, text: &str) {
        self.keyboard.write_all(text.as_bytes()).expect("typed");
    }

    fn end(mut self) -> Left {
        let mut said = String::new();
        self.process.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
        let code = self.process.wait().expect("it ends").code();
        Left { code, said, journal: journal(&self.dir) }
    }
}

fn journal(dir: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    lines(&text).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect()
}

fn event<'l>(journal: &'l [Value], name: &str) -> Option<&'l Value> {
    journal.iter().find(|l| l["event"] == name)
}

/// When the first step with this label began, s.
fn began(journal: &[Value], label: &str) -> f64 {
    let line = journal.iter().find(|l| l["event"] == "starting" && l["label"] == label);
    line.and_then(|l| l["t"].as_f64()).unwrap_or_else(|| panic!("no `{label}`: {journal:#?}"))
}

#[test]
fn what_follows_a_question_is_timed_from_its_answer() {
    for late in [100, 600, 2000] {
        let mut room = Room::begin(&format!("ask_{late}"), STIR);
        room.until("\"asked\"", 1);
        std::thread::sleep(Duration::from_millis(late));
        room.types("y\n");
        let left = room.end();
        assert_eq!(left.code, Some(0), "{}", left.said);
        let stirred = began(&left.journal, "stop stirring plate") - began(&left.journal, "stir plate at 300 rpm");
        // Where the machine has other work, the lab is as late as the clock says.
        assert!((10.0 - 1e-6..11.0).contains(&stirred), "answered after {late} ms, it stirs {stirred} s");
        let asked = event(&left.journal, "asked").expect("a question");
        let answer = event(&left.journal, "answered").expect("an answer");
        assert_eq!(asked["text"], "add the reagent, then confirm");
        assert!(answer["yes"] == true && answer["who"] == "ada", "{answer}");
        let open = answer["t"].as_f64().unwrap_or(0.0) - asked["t"].as_f64().unwrap_or(0.0);
        assert!(open >= late as f64 / 1e3 * 10.0 - 1.0, "the clock of the lab goes on: {open}");
        assert!(answer["wall"].as_f64() > asked["wall"].as_f64());
    }
}

#[test]
fn a_watchdog_is_fed_while_a_question_is_open() {
    let mut room = Room::begin("ask_watchdog", LOAD);
    room.until("\"asked\"", 1);
    // Its watchdog trips after 60 s: 8 s at ten times the speed of the clock.
    std::thread::sleep(Duration::from_secs(8));
    room.types("y\n");
    let left = room.end();
    assert_eq!(left.code, Some(0), "{}", left.said);
    let asked = event(&left.journal, "asked").and_then(|l| l["t"].as_f64()).expect("a question");
    let answered = event(&left.journal, "answered").and_then(|l| l["t"].as_f64()).expect("an answer");
    assert!(answered - asked > 60.0, "{asked} to {answered}");
    let fed = left.journal.iter().filter(|l| l["event"] == "out" && l["t"].as_f64() > Some(asked));
    let fed = fed.filter(|l| l["t"].as_f64() < Some(answered) && l["bytes"].to_string().contains("OUT_WD1"));
    assert!(fed.count() >= 3, "{:#?}", left.journal);
}

#[test]
fn what_must_be_kept_is_watched_while_a_question_is_open() {
    let room = Room::begin("ask_keep", GUARD);
    let left = room.end();
    assert_eq!(left.code, Some(1), "{}", left.said);
    assert!(left.said.contains("plate.temperature <= 30 degC"), "{}", left.said);
    assert!(event(&left.journal, "asked").is_some() && event(&left.journal, "answered").is_none());
    assert!(began(&left.journal, "stop heating plate") > 0.0);
}

#[test]
fn a_device_that_was_reset_while_a_question_was_open_is_noticed() {
    let asked = AtomicUsize::new(0);
    let device = Device::start(b'\n', move |line, _| match line {
        "IN_SP_1" if asked.fetch_add(1, Ordering::SeqCst) == 0 => Answer::Says("60.0 1 \r\n"),
        "IN_SP_1" => Answer::Says("20.0 1 \r\n"),
        other => plate(other),
    });
    let dir = bench("ask_reset", LOAD, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(ended.err.contains("error[diverged]") && ended.err.contains("is 20 degC on the device"), "{}", ended.err);
    let answered = journal(&dir).iter().position(|l| l["event"] == "answered");
    assert!(answered.is_some() && is_safe(&device.heard()), "{:?}", device.heard());
}

#[test]
fn a_question_that_is_open_keeps_nobody_from_stopping() {
    let mut room = Room::begin("ask_stop", LOAD);
    room.until("\"asked\"", 1);
    room.types("q\n");
    let left = room.end();
    assert_eq!(left.code, Some(1), "{}", left.said);
    let stop = event(&left.journal, "stop").expect("a stop");
    assert_eq!(stop["who"], "ada");
    assert!(began(&left.journal, "stop heating plate") - stop["t"].as_f64().unwrap_or(0.0) < 1.0);
    let room = Room::begin("ask_signal", LOAD);
    room.until("\"asked\"", 1);
    signal("-INT", &room.process);
    let left = room.end();
    assert_eq!(left.code, Some(1), "{}", left.said);
    began(&left.journal, "stop heating plate");
}

#[test]
fn who_says_no_wants_it_to_end() {
    let mut room = Room::begin("ask_no", LOAD);
    room.until("\"asked\"", 1);
    room.types("n\n");
    let left = room.end();
    assert!(left.code == Some(1) && left.said.contains("was stopped by a person"), "{}", left.said);
    assert_eq!(event(&left.journal, "answered").map(|l| l["yes"].clone()), Some(Value::Bool(false)));
}

#[test]
fn a_question_that_was_open_when_its_process_was_killed_is_put_again() {
    let mut room = Room::begin("ask_killed", STIR);
    room.until("\"asked\"", 1);
    room.process.kill().expect("it can be killed");
    room.process.wait().expect("it ends");
    let given = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--speed", SPEED];
    let ended = matterixc_in(&room.dir, &[&given[..], &["--resume", "--yes"]].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    let journal = journal(&room.dir);
    assert_eq!(journal.iter().filter(|l| l["event"] == "asked").count(), 1);
    assert!(event(&journal, "answered").is_some_and(|l| l["who"].to_string().contains("--yes")), "{journal:#?}");
    let stirred = began(&journal, "stop stirring plate") - began(&journal, "stir plate at 300 rpm");
    // Where the machine has other work, the lab is as late as the clock says.
    assert!((10.0 - 1e-6..11.0).contains(&stirred), "{stirred}");
}

#[test]
fn nothing_begins_while_it_is_paused_and_one_step_begins_at_a_time() {
    let mut room = Room::begin("pause", &STIR.replace("    ask \"add the reagent, then confirm\"\n", "    wait 5 s\n"));
    room.until("\"opened\"", 1);
    room.types("p\n");
    room.until("\"gate\"", 1);
    std::thread::sleep(Duration::from_millis(1500));
    room.types("s\n");
    room.until("stir plate at", 1);
    std::thread::sleep(Duration::from_millis(2500));
    room.types("r\n");
    let left = room.end();
    assert_eq!(left.code, Some(0), "{}", left.said);
    let gates: Vec<(String, f64)> = left
        .journal
        .iter()
        .filter(|l| l["event"] == "gate")
        .map(|l| (l["to"].as_str().unwrap_or("").to_owned(), l["t"].as_f64().unwrap_or(f64::NAN)))
        .collect();
    let [(pause, _), (step, stepped), (go, went)] = &gates[..] else { panic!("{gates:?}") };
    assert_eq!([pause.as_str(), step, go], ["pause", "step", "go"]);
    // Where the machine has other work, the lab is as late as the clock says.
    let late = |what, gate: f64| began(&left.journal, what) - gate;
    assert!((0.0..1.0).contains(&late("stir plate at 300 rpm", *stepped)), "{:?}", left.journal);
    assert!(went - stepped > 10.0, "the wait is over meanwhile");
    assert!((0.0..1.0).contains(&late("stop stirring plate", *went)), "{:?}", left.journal);
}

#[test]
fn what_a_person_does_not_confirm_in_a_finally_is_named_and_the_rest_is_done() {
    const FINALLY: &str = "mtx 1
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    bath = IkaRetControl at (1, 0, 0) m
}
workflow warm in bench {
    stir plate at 300 rpm
    heat bath to 50 degC
} finally { stop heating bath; stop stirring plate }
";
    let mut room = Room::with("ask_by_hand", FINALLY, "[bath]\nby = \"hand\"\n");
    room.until("\"asked\"", 1);
    room.types("y\n");
    room.until("\"asked\"", 2);
    room.types("n\n");
    let left = room.end();
    let said = flat(&left.said);
    assert_eq!(left.code, Some(1), "{said}");
    assert!(said.contains("`bath`: it was set by hand, but nobody confirmed `stop heating bath`"), "{said}");
    began(&left.journal, "stop stirring plate");
}

#[test]
fn a_question_that_is_asked_no_longer_takes_no_answer_to_the_next() {
    const TWO: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow guarded in bench {
    heat plate to 80 degC
    keep plate.temperature <= 26 degC { ask \"is the salt in?\" } on broken { }
    ask \"is the hood closed?\"
    stir plate at 300 rpm
} finally { stop heating plate; stop stirring plate }
";
    let mut room = Room::begin("ask_withdrawn", TWO);
    room.until("\"asked\"", 2);
    // Meant for the salt.
    room.types("y\n");
    std::thread::sleep(Duration::from_millis(500));
    let early = journal(&room.dir);
    assert!(event(&early, "answered").is_none(), "{early:?}");
    room.types("y\n");
    let left = room.end();
    assert_eq!(left.code, Some(0), "{}", left.said);
    for line in ["withdrawn: is the salt in?", "this answers no question: the previous one was withdrawn"] {
        assert!(left.said.contains(line), "`{line}`: {}", left.said);
    }
    began(&left.journal, "stir plate at 300 rpm");
}
