//! What could be left behind: by a no that comes late, by a person's hand, by a journal that is gone, by a number that is cut.

use std::path::Path;
use std::time::Duration;

use super::faulty::plate;
use super::{Device, bench, deploy};
use crate::harness::{matterixc_in, write};

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
    assert!(ended.code == 1 && ended.err.contains("a question was answered with no"), "{}", ended.err);
    assert!(ended.err.contains("nobody was there to confirm"), "{}", ended.err);
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
fn a_number_has_all_of_its_digits_and_is_not_made_nothing() {
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
        ("mg :.1", "240 ug", "FEED 0.2"),
    ] {
        let dir = bench("left_digits", &text(form, mass), "feeder", "127.0.0.1:1");
        let ended = dry(&dir);
        assert!(ended.code == 0 && ended.out.contains(&format!("{sent}\\n")), "{}{}", ended.out, ended.err);
    }
    let dir = bench("left_digits", &text("mg :.1", "1 ug"), "feeder", "127.0.0.1:1");
    let ended = dry(&dir);
    let found = ended.err.replace("\n  ", " ");
    assert!(ended.code == 1 && found.contains("too few digits"), "{}{}", ended.out, ended.err);
}
