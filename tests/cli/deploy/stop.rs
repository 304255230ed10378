//! A person stops a deployment: by a key at its terminal, or from outside.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::{Emulated, HEAT, SPEED, bench};
use crate::harness::{command, folder, write};

/// Waits until devices have told something, or fails.
fn under_way(dir: &Path) {
    for _ in 0..2000 {
        let journal = std::fs::read_to_string(dir.join("journal")).unwrap_or_default();
        if journal.matches("\"told\"").count() > 1 {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("nothing was told");
}

/// Deploys with this at standard input, stops it so, and looks at what it left.
fn stopped(name: &str, stdin: Stdio, stop: impl FnOnce(&Child)) {
    let dir = bench(name, &HEAT.replace(">= 30 degC", ">= 49 degC"), "plate", "");
    let emulated = Emulated::start(&dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut deployed = command();
    deployed.current_dir(&dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real"]);
    deployed.args(["--journal", "journal", "--speed", SPEED]).stdin(stdin).stdout(Stdio::null()).stderr(Stdio::piped());
    let deployed = deployed.spawn().expect("the command starts");
    under_way(&dir);
    stop(&deployed);
    let ended = deployed.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(said.contains("the deployment was stopped by a person after"), "{said}");
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    assert!(journal.contains("\"status\":\"stopped by a person\""), "{journal}");
    for said in ["stop heating plate", "stop stirring plate", "STOP_1\\\\r", "STOP_4\\\\r"] {
        assert!(journal.contains(said), "{said}: {journal}");
    }
}

/// A keyboard, and the terminal that what is typed comes in at.
pub fn terminal() -> (File, File) {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&master).and_then(|()| unlockpt(&master)).expect("its other end");
    let path = ptsname(&master, Vec::new()).expect("a name").into_string().expect("text");
    (File::from(master), File::options().read(true).write(true).open(path).expect("a terminal"))
}

#[test]
fn a_key_at_the_terminal_stops_it_and_finally_is_done() {
    let (mut keyboard, terminal) = terminal();
    stopped("stop_key", terminal.into(), move |_| {
        keyboard.write_all(b"what?\n").and_then(|()| keyboard.write_all(b"q\n")).expect("typed");
        // The terminal is there until the end.
        std::mem::forget(keyboard);
    });
}

#[test]
fn a_request_to_terminate_stops_it_and_finally_is_done() {
    stopped("stop_term", Stdio::null(), |process| signal("-TERM", process));
}

#[test]
fn a_quit_from_the_keyboard_stops_it_and_finally_is_done() {
    stopped("stop_quit", Stdio::null(), |process| signal("-QUIT", process));
}

#[test]
fn a_terminal_that_is_closed_stops_it_and_finally_is_done() {
    stopped("stop_hup", Stdio::null(), |process| signal("-HUP", process));
}

pub fn signal(which: &str, process: &Child) {
    let kill = std::process::Command::new("kill").args([which, &process.id().to_string()]).status();
    assert!(kill.expect("kill").success());
}

/// Stops a deployment on a robot whose server has frozen, with so many signals; what it says, and how long it takes to end.
#[allow(clippy::disallowed_methods, reason = "how long a person waits is told by the wall clock")]
fn frozen(name: &str, signals: usize) -> (String, Duration) {
    let dir = folder(&format!("deploy_{name}"));
    write(&dir, "lab.mtx", include_str!("../../deploy/transfer.mtx"));
    let emulated = Emulated::at("2", &dir, &["ot2", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    let mut deployed = command();
    deployed.current_dir(&dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real"]);
    deployed.args(["--journal", "journal", "--speed", "2"]).stdin(Stdio::null()).stdout(Stdio::null());
    let deployed = deployed.stderr(Stdio::piped()).spawn().expect("the command starts");
    for _ in 0..4000 {
        if std::fs::read_to_string(dir.join("journal")).is_ok_and(|j| j.contains("\"event\":\"started\"")) {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    signal("-STOP", &emulated.child);
    let begun = Instant::now();
    for _ in 0..signals {
        std::thread::sleep(Duration::from_millis(500));
        signal("-TERM", &deployed);
    }
    let ended = deployed.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(1));
    (String::from_utf8_lossy(&ended.stderr).into_owned(), begun.elapsed())
}

#[test]
fn a_frozen_server_is_waited_for_for_seconds_only() {
    let (said, took) = frozen("frozen", 1);
    assert!(said.contains("was stopped by a person"), "{said}");
    assert!(said.contains("a device could not be made safe: `ot2`: it did not reply"), "{said}");
    assert!(said.contains("lab.toml:2:8"), "{said}");
    // 10 s for what was asked, 5 s for what makes it safe.
    assert!(took < Duration::from_secs(25), "{took:?}");
}

#[test]
fn a_second_signal_ends_at_once_and_says_what_is_left() {
    let (said, took) = frozen("frozen_twice", 2);
    assert!(said.contains("ended at once; not made safe: `ot2`"), "{said}");
    assert!(took < Duration::from_secs(5), "{took:?}");
}
