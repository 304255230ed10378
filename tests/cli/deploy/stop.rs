//! A person stops a deployment: by a key at its terminal, or from outside.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::{Emulated, HEAT, SPEED, bench};
use crate::harness::{command, write};

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
    deployed.args(["--journal", "journal", "--speed", SPEED]).stdin(stdin).stdout(Stdio::null()).stderr(Stdio::null());
    let mut deployed = deployed.spawn().expect("the command starts");
    under_way(&dir);
    stop(&deployed);
    let status = deployed.wait().expect("it ends");
    assert_eq!(status.code(), Some(1));
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    assert!(journal.contains("\"status\":\"stopped by a person\""), "{journal}");
    for said in ["stop heating plate", "stop stirring plate", "STOP_1\\\\r", "STOP_4\\\\r"] {
        assert!(journal.contains(said), "{said}: {journal}");
    }
}

#[test]
fn a_key_at_the_terminal_stops_it_and_finally_is_done() {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&master).and_then(|()| unlockpt(&master)).expect("its other end");
    let path = ptsname(&master, Vec::new()).expect("a name").into_string().expect("text");
    let terminal = File::options().read(true).write(true).open(path).expect("a terminal");
    let mut keyboard = File::from(master);
    stopped("stop_key", terminal.into(), move |_| {
        keyboard.write_all(b"what?\n").and_then(|()| keyboard.write_all(b"q\n")).expect("typed");
        // The terminal is there until the end.
        std::mem::forget(keyboard);
    });
}

#[test]
fn a_request_to_terminate_stops_it_and_finally_is_done() {
    stopped("stop_term", Stdio::null(), |process| {
        let kill = std::process::Command::new("kill").args(["-TERM", &process.id().to_string()]).status();
        assert!(kill.expect("kill").success());
    });
}
