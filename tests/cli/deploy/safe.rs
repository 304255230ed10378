//! What is left safe, and what is named where it could not be: signals, closed streams, full disks, devices that refuse or are gone.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use super::faulty::{is_safe, plate};
use super::{Answer, Device, HEAT, SPEED, bench, deploy, deploy_at};
use crate::harness::{command, flat, matterixc_in, write};

/// Arguments of a deployment on devices.
const REAL: [&str; 9] =
    ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--speed"];

/// A plate that never gets warm, and a folder with a workflow that waits for that.
fn heating(name: &str) -> (Device, PathBuf) {
    let device = Device::start(b'\n', |line, _| plate(line));
    let dir = bench(name, HEAT, "plate", &device.address);
    (device, dir)
}

/// Waits until a device has heard this, or fails.
fn hears(device: &Device, word: &str) {
    for _ in 0..4000 {
        if device.heard().iter().any(|line| line == word) {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("`{word}` was not heard: {:?}", device.heard());
}

#[test]
fn a_file_that_may_not_grow_ends_the_run_and_leaves_the_device_safe() {
    let (device, dir) = heating("safe_full");
    let matterixc = command().get_program().to_owned();
    let mut shell = Command::new("bash");
    // 8 blocks of 1024 bytes.
    shell.current_dir(&dir).args(["-c", "ulimit -f 8; exec \"$0\" \"$@\""]).arg(matterixc).args(REAL).arg(SPEED);
    let ended = shell.stdin(Stdio::null()).output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.contains("the journal cannot be written"), "{said}");
    assert!(!said.contains("could not be made safe"), "{said}");
    assert!(is_safe(&device.heard()), "{:?}", device.heard());
}

#[test]
fn nobody_need_read_what_is_said() {
    let (device, dir) = heating("safe_closed");
    let mut deployed = command();
    deployed.current_dir(&dir).args(REAL).args([SPEED, "--trace"]).stdin(Stdio::null());
    let mut deployed = deployed.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts");
    hears(&device, "START_1");
    drop((deployed.stdout.take(), deployed.stderr.take()));
    std::thread::sleep(Duration::from_millis(200));
    super::stop::signal("-HUP", &deployed);
    let ended = deployed.wait().expect("it ends");
    assert_eq!(ended.code(), Some(1));
    assert!(is_safe(&device.heard()), "{:?}", device.heard());
}

#[test]
fn a_device_that_answers_nothing_any_more_is_named() {
    let dead = std::sync::Arc::new(AtomicBool::new(false));
    let is_dead = std::sync::Arc::clone(&dead);
    let device = Device::start(b'\n', move |line, _| {
        is_dead.fetch_or(line == "START_1", Ordering::SeqCst);
        if is_dead.load(Ordering::SeqCst) { Answer::Nothing } else { plate(line) }
    });
    let dir = bench("safe_dead", HEAT, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("a device could not be made safe: `plate`: it did not reply"), "{}", ended.err);
    assert!(is_safe(&device.heard()), "it is told all the same: {:?}", device.heard());
}

#[test]
fn a_host_that_vanishes_is_named_and_one_that_is_there_again_is_made_safe() {
    for (name, comes_back) in [("safe_gone", false), ("safe_back", true)] {
        let cut = AtomicUsize::new(0);
        let device = Device::start(b'\n', move |line, _| match line {
            "IN_PV_2" if cut.fetch_add(1, Ordering::SeqCst) == 2 => Answer::HangsUp,
            _ if !comes_back && cut.load(Ordering::SeqCst) > 2 => Answer::HangsUp,
            other => plate(other),
        });
        let dir = bench(name, HEAT, "plate", &device.address);
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(ended.code, 1);
        assert!(ended.err.contains("error[device-lost]"), "{}", ended.err);
        assert_eq!(ended.err.contains("could not be made safe: `plate`"), !comes_back, "{name}: {}", ended.err);
    }
}

/// A stroke that fails on one pump while the other one is at it.
const STROKES: &str = "mtx 1
use std::glassware::Beaker50mL
use std::pumps
lab bench {
    ambient: 22 degC
    pump = CavroXlp6000 at (0, 0, 0) m
    a = Beaker50mL at (1, 0, 0) m holding 20 mL of water
    between pump and a { piped: true, port: 1 }
}
workflow dose in bench { draw 4 mL from a by pump }
";

/// A pump whose plunger never arrives, stopped meanwhile; what it was told, and what was said.
fn stopped_stroke(name: &str, to_stop: &'static str) -> (Vec<String>, Option<i32>, String) {
    let device = Device::start(b'\r', move |line, before| match line {
        "/1Q" if before > 2 => Answer::Says("/0@\u{3}\r\n"),
        "/1T" => Answer::Says(to_stop),
        _ => Answer::Says("/0`\u{3}\r\n"),
    });
    let dir = bench(name, STROKES, "pump", &device.address);
    write(&dir, "lab.toml", format!("[pump]\naddress = \"{}\"\ndriver = \"CavroDt\"\n", device.address));
    let mut deployed = command();
    deployed.current_dir(&dir).args(REAL).arg("1").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let deployed = deployed.spawn().expect("the command starts");
    hears(&device, "/1I1A2400R");
    super::stop::signal("-QUIT", &deployed);
    let ended = deployed.wait_with_output().expect("it ends");
    (device.heard(), ended.status.code(), String::from_utf8_lossy(&ended.stderr).into_owned())
}

#[test]
fn a_stroke_is_terminated_without_what_would_start_it_again() {
    let (heard, code, said) = stopped_stroke("safe_stroke", "/0`\u{3}\r\n");
    assert_eq!(code, Some(1), "{said}");
    assert!(heard.iter().any(|l| l == "/1T"), "{heard:?}");
    assert!(!heard.iter().any(|l| l == "/1TR"), "{heard:?}");
    assert!(!said.contains("did not stop") && !said.contains("could not be made safe"), "{said}");
}

#[test]
fn a_stroke_that_cannot_be_terminated_is_named() {
    let (_, code, said) = stopped_stroke("safe_refuses", "/0b\u{3}\r\n");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("a device did not stop on command: `pump`: it replied `error 2`"), "{said}");
    assert!(said.contains("a device could not be made safe: `pump`: it replied `error 2`"), "{said}");
}

/// A heater of a user's own, whose driver says nothing of how it is made safe.
const OWN: &str = "mtx 1
use std::thermal::Heater
asset Block: Heater {
    capacity: 500 J/K
    air: 0.5 W/K
    gain: 40 W/K
    power: 500 W
    limits: 0 degC .. 200 degC
}
driver BlockLine for Block over serial(baud: 9600, frame: \"8N1\", framing: line, timeout: 1 s) {
    heat to(t) sends \"H{t as degC :.1}\" expects \"OK\"
    stop heating sends \"OFF\" expects \"OK\"
    reading temperature asks \"T\" expects \"{degC in -20 .. 250}\"
    reply \"NO\" fails refused
}
lab bench { ambient: 22 degC, plate = Block }
workflow warm in bench {
    heat plate to 60 degC
    wait until plate.temperature >= 50 degC timeout 2 h
} finally { stop heating plate }
";

fn check(dir: &Path, text: &str) -> String {
    write(dir, "lab.mtx", text);
    let ended = matterixc_in(dir, &["check", "lab.mtx"]);
    ended.out + &ended.err
}

#[test]
fn a_driver_of_what_can_be_left_on_says_how_it_is_made_safe() {
    let dir = bench("safe_unsaid", OWN, "plate", "127.0.0.1:1");
    let found = check(&dir, OWN);
    assert!(found.contains("warning[no-safe]") && found.contains("`BlockLine`"), "{found}");
    let with = OWN.replace("    reply \"NO\"", "    safe sends \"OFF\" expects \"OK\"\n    reply \"NO\"");
    let found = check(&dir, &with);
    assert!(!found.contains("no-safe"), "{found}");
    // A number that a law goes by, without a switch.
    let power = "mtx 1
capability Lamp { state power: Power = 0 W, flow heat: Power, extensive warmth: Energy = 0 J { scale: 1 J }
    command shine at(p: Power) effect power = p
    process shining { heat += power } process stored { warmth' += heat } }
asset Bulb: Lamp { }
driver BulbLine for Bulb over serial(baud: 9600, frame: \"8N1\", framing: line, timeout: 1 s) { shine at(p) sends \"P{p as W}\" }
";
    let found = check(&dir, power);
    assert!(found.contains("warning[no-safe]"), "{found}");
    // What only says something about itself is left as it is.
    let label = "mtx 1
capability Shown { state shown: Ratio = 0
    command show(n: Ratio) effect shown = n }
asset Display: Shown { }
driver DisplayLine for Display over serial(baud: 9600, frame: \"8N1\", framing: line, timeout: 1 s) { show(n) sends \"N{n}\" }
";
    let found = check(&dir, label);
    assert!(!found.contains("no-safe"), "{found}");
}

#[test]
fn a_device_whose_driver_does_not_say_how_it_is_made_safe_is_named() {
    let device = Device::start(b'\n', |line, _| match line {
        "T" | "OFF" => Answer::Says("NO\r\n"),
        _ => Answer::Says("OK\r\n"),
    });
    let dir = bench("safe_none", OWN, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 1);
    let said = flat(&ended.err);
    assert!(said.contains("could not be made safe: `plate`: its driver has no `safe` line"), "{}", ended.err);
}

/// With a watchdog that waits so long, and is fed so often.
fn watched(every: &str, within: &str) -> String {
    let lines = format!(
        "    safe sends \"OFF\" expects \"OK\"\n    alive while active every {every} within {within} by say hello\n    say hello sends \"HELLO\" expects \"OK\"\n"
    );
    let text = OWN.replace("    reply \"NO\"", &(lines + "    reply \"NO\""));
    text.replace("asset Block: Heater {", "capability Watched { command say hello }\nasset Block: Heater, Watched {")
}

#[test]
fn a_watchdog_is_fed_before_it_trips() {
    let dir = bench("watched", OWN, "plate", "127.0.0.1:1");
    for (every, within, wrong) in [("6 s", "6 s", true), ("10 s", "6 s", true), ("5.9 s", "6 s", false)] {
        let found = check(&dir, &watched(every, within));
        assert_eq!(found.contains("the watchdog waits 6 s, but a message comes only every"), wrong, "{every}: {found}");
        assert_eq!(found.contains("error"), wrong, "{every}: {found}");
    }
    // Without a patience it is no watchdog, and says so.
    let found = check(&dir, &watched("2 s", "6 s").replace(" within 6 s", ""));
    assert!(found.contains("error"), "{found}");
    let found = check(&dir, &watched("2 s", "6 s").replace(" within 6 s", "").replace("alive while", "repeat while"));
    assert!(!found.contains("error"), "{found}");
}

#[test]
fn a_watchdog_that_heard_nothing_for_too_long_ends_the_run() {
    // 20 s of lab time are a second: one reading takes 6 s of 5.
    let device = Device::start(b'\n', |line, before| match line {
        "T" if before > 6 => {
            std::thread::sleep(std::time::Duration::from_millis(300));
            Answer::Says("22.0\r\n")
        }
        "T" => Answer::Says("22.0\r\n"),
        _ => Answer::Says("OK\r\n"),
    });
    let dir = bench("late_feed", &watched("1 s", "5 s"), "plate", &device.address);
    let ended = deploy_at("20", &dir, &["--mode", "real"]);
    let said = flat(&ended.err);
    assert!(
        ended.code == 1 && said.contains("diverged") && said.contains("longer than its watchdog waits (5 s)"),
        "{said}"
    );
    assert!(device.heard().iter().any(|line| line == "OFF"), "{:?}", device.heard());
}
