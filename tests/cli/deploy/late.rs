//! Devices that take their time to answer: the lab goes on by the clock meanwhile, so that what comes after is as long as it says and
//! what was to be over is late.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::{Answer, Device, bench};
use crate::harness::{Ended, matterixc_in};

/// A valve that is told two things, with this between and after them.
fn text(between: &str, after: &str) -> String {
    format!(
        "mtx 1
capability Valve {{
    command give way
    command shut off
}}
asset Line: Valve
driver LineOne for Line over tcp(framing: lf, timeout: 8 s) {{
    give way sends \"ON\" expects \"OK\"
    shut off sends \"OFF\" expects \"OK\"
    safe sends \"SAFE\" expects \"OK\"
}}
lab bench {{ ambient: 22 degC, valve = Line at (0, 0, 0) m }}
workflow pulse in bench {{
    step begun {{ wait 10 ms }}
    give way valve
    {between}
    shut off valve
    {after}
}}
"
    )
}

/// Deploys on a valve that answers `ON` after so long; what came when.
#[allow(clippy::disallowed_methods, reason = "how long devices wait is what is tested")]
fn pulse(name: &str, text: &str, slow: Duration) -> (Ended, PathBuf, Vec<(String, Instant)>) {
    let heard = Arc::new(Mutex::new(Vec::new()));
    let told = Arc::clone(&heard);
    let device = Device::start(b'\n', move |line, _| {
        if line == "ON" {
            std::thread::sleep(slow);
        }
        told.lock().expect("not poisoned").push((line.to_owned(), Instant::now()));
        Answer::Says("OK\n")
    });
    let dir = bench(name, text, "valve", &device.address);
    let ended =
        matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--record", "record"]);
    let heard = heard.lock().expect("not poisoned").clone();
    (ended, dir, heard)
}

fn journal(dir: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(dir.join("record/journal.jsonl")).expect("a journal");
    text.lines().map(|line| serde_json::from_str(line).expect("a line")).collect()
}

#[test]
fn a_wait_behind_a_late_answer_is_as_long_as_it_says() {
    let text = text("wait 1 s", "expect elapsed < 2 s");
    let (ended, dir, heard) = pulse("late_wait", &text, Duration::from_millis(1500));
    let at = |word: &str| heard.iter().find(|(line, _)| line == word).map(|(_, at)| *at).expect("it was heard");
    let between = at("OFF").duration_since(at("ON"));
    assert!(between >= Duration::from_millis(900), "{between:?}: {heard:?}");
    // The run took as long as the clock says.
    assert!(ended.code == 1 && ended.err.contains("expectation-failed"), "{}", ended.err);
    let journal = journal(&dir);
    let off = journal.iter().filter(|e| e["event"] == "starting").nth(1).and_then(|e| e["t"].as_f64()).expect("OFF");
    assert!((2.4..4.0).contains(&off), "{off} s");
    // Who goes through the journal again comes to the same states.
    let record = matterixc_in(&dir, &["verify", "record"]);
    assert_eq!(record.code, 0, "{}{}", record.out, record.err);
}

#[test]
fn a_window_that_is_over_when_an_answer_comes_is_missed() {
    let text = text("within 1 s after begun.end { shut off valve }", "wait 1 s");
    let (ended, dir, heard) = pulse("late_window", &text, Duration::from_millis(1600));
    assert!(ended.code == 1 && ended.err.contains("late"), "{} {heard:?}", ended.err);
    assert!(journal(&dir).iter().any(|e| e["event"] == "late"));
}
