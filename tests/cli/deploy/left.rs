//! What could be left behind: by a no that comes late, by a person's hand, by a journal that is gone, by a number that is cut.

use std::path::Path;
use std::time::Duration;

use super::faulty::plate;
use super::{Answer, Device, bench, deploy};
use crate::harness::{flat, matterixc_in, write};

const IN_FINALLY: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow warm in bench {
    heat plate to 50 degC
    wait 1 s
} finally {
    ask \"close the valve, then confirm\"
    stop heating plate
}
";

const BY_HAND: &str = "mtx 1
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    bath = IkaRetControl at (1, 0, 0) m
}
workflow warm in bench {
    heat bath to 50 degC
    heat plate to 50 degC
    fail spilled \"the bath was spilled\"
}
";

fn heard(device: &Device, word: &str) -> usize {
    device.heard().iter().filter(|line| *line == word).count()
}

#[test]
fn a_no_in_a_finally_does_not_hold_up_what_switches_off() {
    let device = Device::start(b'\n', |line, _| plate(line));
    let dir = bench("left_no", IN_FINALLY, "plate", &device.address);
    // Nobody is there: each question is answered with no at once.
    let ended = deploy(&dir, &["--mode", "real"]);
    assert!(heard(&device, "STOP_1") > 0, "{:?}", device.heard());
    assert!(ended.code == 1 && ended.err.contains("a person answered no"), "{}", ended.err);
    assert!(ended.err.contains("nobody could confirm"), "{}", ended.err);
}

#[test]
fn what_a_person_has_heated_is_named() {
    let device = Device::start(b'\n', |line, _| plate(line));
    let dir = bench("left_by_hand", BY_HAND, "plate", &device.address);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n[bath]\nby = \"hand\"\n", device.address));
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(ended.err.contains("`bath`: it was set by hand and is left heating"), "{}", ended.err);
    assert!(!ended.err.contains("`plate`: it was set by hand"), "{}", ended.err);
}

#[test]
fn what_a_finally_did_not_come_to_is_named() {
    const FINALLY: &str = "mtx 1
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    other = IkaRetControl at (1, 0, 0) m
}
workflow warm in bench {
    stir other at 300 rpm
    heat plate to 50 degC
    wait 60 s
} finally { stop heating plate; stop stirring other; ask \"is it cool?\" }
";
    let gone = Device::start(b'\n', |line, _| if line == "IN_SP_1" { Answer::HangsUp } else { plate(line) });
    let other = Device::start(b'\n', |line, _| plate(line));
    let dir = bench("left_finally", FINALLY, "plate", &gone.address);
    let bound = format!("[plate]\naddress = \"{}\"\n[other]\naddress = \"{}\"\n", gone.address, other.address);
    write(&dir, "lab.toml", bound);
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    let one_line = flat(&ended.err);
    let named = "a `finally` stopped early: `stop stirring other`, `ask \"is it cool?\"` did not run";
    assert!(ended.code == 1 && one_line.contains(named), "{one_line}");
    assert!(heard(&other, "STOP_4") > 0, "safe all the same: {:?}", other.heard());
}

#[test]
fn a_deployment_whose_disk_was_full_is_not_gone_on_with() {
    const WAITS: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow warm in bench {
    heat plate to 50 degC
    wait until plate.temperature >= 40 degC timeout 2 h
} finally { stop heating plate }
";
    let device = Device::start(b'\n', |line, _| plate(line));
    let dir = bench("left_full", WAITS, "plate", &device.address);
    let args = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--record", "record", "--speed", "20"];
    let mut shell = crate::harness::in_its_environment("bash");
    // A signal would end it where a full disk only fails.
    let limited = "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"";
    shell.current_dir(&dir).args(["-c", limited]).arg(env!("CARGO_BIN_EXE_matterixc")).args(args);
    let full = shell.stdin(std::process::Stdio::null()).output().expect("bash");
    let err = String::from_utf8_lossy(&full.stderr);
    let one_line = flat(&err);
    assert!(one_line.contains("the journal cannot be written") && one_line.contains("start again"), "{err}");
    assert!(heard(&device, "STOP_1") > 0, "{:?}", device.heard());
    let started = heard(&device, "START_1");
    let more = crate::harness::matterixc_in(&dir, &[&args[..], &["--resume"]].concat());
    let one_line = flat(&more.err);
    assert!(more.code == 1 && one_line.contains("were made safe when it could not be resumed"), "{one_line}");
    assert_eq!(heard(&device, "START_1"), started, "{:?}", device.heard());
}

#[test]
fn a_late_answer_to_what_was_said_before_does_not_say_that_a_device_is_safe() {
    const ROTOR: &str = "mtx 1
capability Rotor {
    state turning: Bool = false
    command turn go
        effect turning = true
}
asset Line: Rotor
driver LineOne for Line over tcp(framing: lf, timeout: 1 s) {
    turn go sends \"GO\" expects \"OK\"
    safe sends \"HALT\" expects \"OK\"
}
lab bench { ambient: 22 degC, rotor = Line at (0, 0, 0) m }
workflow go in bench { turn go rotor }
";
    // The answer to `GO` comes as that to the first `HALT`, which the rotor does not take.
    for (name, answers, is_named) in [("misses_one", 2, false), ("misses_all", 1, true)] {
        let said = std::sync::atomic::AtomicUsize::new(0);
        let device = Device::start(b'\n', move |line, _| match line {
            "HALT" if said.fetch_add(1, std::sync::atomic::Ordering::SeqCst) < answers => Answer::Says("OK\n"),
            _ => Answer::Nothing,
        });
        let dir = bench(&format!("left_late_{name}"), ROTOR, "rotor", &device.address);
        let ended = deploy(&dir, &["--mode", "real", "--yes"]);
        let one_line = flat(&ended.err);
        assert_eq!(ended.code, 1, "{one_line}");
        assert!(heard(&device, "HALT") >= 2, "{:?}", device.heard());
        assert_eq!(one_line.contains("could not be made safe"), is_named, "{name}: {one_line}");
    }
}

#[test]
fn nothing_is_said_once_the_journal_is_gone() {
    const WAITS: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow warm in bench {
    heat plate to 50 degC
    wait 60 s
    stir plate at 300 rpm
} finally { stop heating plate; stop stirring plate }
";
    let device = Device::start(b'\n', |line, _| plate(line));
    let dir = bench("left_journal", WAITS, "plate", &device.address);
    let journal = dir.join("journal");
    let removed = std::thread::spawn(move || {
        while !std::fs::read_to_string(&journal).is_ok_and(|text| text.contains("\"started\"")) {
            std::thread::sleep(Duration::from_millis(20));
        }
        std::fs::remove_file(&journal).expect("it was there");
    });
    let ended = deploy(&dir, &["--mode", "real"]);
    removed.join().expect("removed");
    assert!(ended.code == 1 && ended.err.contains("the journal cannot be written: it was removed"), "{}", ended.err);
    assert_eq!(heard(&device, "START_4"), 0, "{:?}", device.heard());
    // Safe all the same.
    assert!(heard(&device, "STOP_1") > 0, "{:?}", device.heard());
}

fn dry(dir: &Path) -> crate::harness::Ended {
    matterixc_in(dir, &["deploy", "lab.mtx", "--bind", "lab.toml"])
}

#[test]
fn a_number_has_all_of_its_digits_and_is_not_sent_as_another_one() {
    let text = |form: &str, mass: &str| {
        format!(
            "mtx 1
capability Feeder {{
    state fed: Mass = 0 g {{ unit: \"g\" }}
    command feed(m: Mass)
        effect fed = m
}}
asset Line: Feeder
driver LineOne for Line over tcp(framing: lf, timeout: 1 s) {{
    feed(m) sends \"FEED {{m as {form}}}\" expects \"OK\"
    safe sends \"STOP\" expects \"OK\"
}}
lab bench {{ ambient: 22 degC, feeder = Line at (0, 0, 0) m }}
workflow go in bench {{ feed {mass} by feeder }}
"
        )
    };
    for (form, mass, sent) in [
        ("g", "12345.678 g", "FEED 12345.678"),
        ("mg", "1.5 ug", "FEED 0.0015"),
        ("ug", "1 kg", "FEED 1000000000"),
        ("g", "0.1 g", "FEED 0.1"),
        ("mg :.1", "2040 ug", "FEED 2.0"),
    ] {
        let dir = bench("left_digits", &text(form, mass), "feeder", "127.0.0.1:1");
        let ended = dry(&dir);
        assert!(ended.code == 0 && ended.out.contains(&format!("{sent}\\n")), "{}{}", ended.out, ended.err);
    }
    for mass in ["1 ug", "240 ug"] {
        let dir = bench("left_digits", &text("mg :.1", mass), "feeder", "127.0.0.1:1");
        let ended = dry(&dir);
        let found = ended.err.replace("\n  ", " ");
        assert!(ended.code == 1 && found.contains("too few digits"), "{}{}", ended.out, ended.err);
    }
}
