//! The record of a deployment: what it holds, and what `verify` says of one that was changed.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use super::{Answer, Device, Emulated, HEAT, bench};
use crate::harness::{Ended, command, matterixc_in, write};

const SPEED: &str = "8";

const DEPLOY: [&str; 11] =
    ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--speed", SPEED, "--yes", "--record", "signed"];

/// A program with a module of its own and a question.
fn text() -> String {
    HEAT.replace("workflow warm", "use parts::words\nworkflow warm")
        .replace("    stir", "    ask \"is it in?\"\n    stir")
}

fn room(name: &str) -> (PathBuf, Emulated) {
    let dir = bench(&format!("record_{name}"), &text(), "plate", "");
    let _ = std::fs::remove_dir_all(dir.join("signed"));
    std::fs::create_dir_all(dir.join("parts")).expect("a folder");
    write(&dir, "parts/words.mtx", "mtx 1\n/// A word.\nconst word = 3\n");
    let emulated = Emulated::at(SPEED, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    (dir, emulated)
}

fn verified(dir: &Path) -> Ended {
    matterixc_in(dir, &["verify", "signed"])
}

#[test]
fn a_record_is_whole_and_is_gone_through_again_to_the_last_bit() {
    let (dir, _emulated) = room("whole");
    let ended = matterixc_in(&dir, &DEPLOY);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let digest = ended.err.split("the record is sealed: ").nth(1).and_then(|r| r.split_whitespace().next());
    let checked = verified(&dir);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    for line in [
        "are unchanged since they were sealed",
        "an unbroken chain",
        "the one of the journal",
        "to the last bit",
        "agrees with",
    ] {
        assert!(checked.out.contains(line), "{line}: {}", checked.out);
    }
    assert!(digest.is_some_and(|d| checked.out.contains(d)), "{} {}", ended.err, checked.out);
    let page = std::fs::read_to_string(dir.join("signed/report.md")).expect("a page");
    for part in ["is it in?", "by `--yes`", "START_1", "plate.temperature >= 29 degC", "plate.temperature", "IkaNamur"]
    {
        assert!(page.contains(part), "{part}: {page}");
    }
    for file in ["program/lab.mtx", "program/parts/words.mtx", "bindings.toml", "journal.jsonl", "report.json"] {
        assert!(dir.join("signed").join(file).is_file(), "{file}");
    }
    let again = matterixc_in(&dir, &DEPLOY);
    assert!(again.code == 2 && again.err.contains("already"), "{}", again.err);
}

#[test]
fn a_record_that_was_changed_anywhere_is_known_for_one() {
    let (dir, _emulated) = room("changed");
    let ended = matterixc_in(&dir, &DEPLOY);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let record = dir.join("signed");
    for file in
        ["program/lab.mtx", "program/parts/words.mtx", "bindings.toml", "journal.jsonl", "report.json", "report.md"]
    {
        let path = record.join(file);
        let before = std::fs::read(&path).expect("a file");
        let mut changed = before.clone();
        let at = changed.len() / 2;
        changed[at] ^= 1;
        std::fs::write(&path, &changed).expect("written");
        let checked = verified(&dir);
        assert_eq!(checked.code, 1, "{file}: {}{}", checked.out, checked.err);
        assert!(checked.out.contains(&format!("wrong: `{file}` has changed since it was sealed")), "{}", checked.out);
        std::fs::write(&path, &before).expect("written");
    }
    // Who writes the seals anew is found out by the replay.
    let journal = std::fs::read_to_string(record.join("journal.jsonl")).expect("a journal");
    std::fs::write(record.join("journal.jsonl"), journal.replace("OUT_SP_1 50.0", "OUT_SP_1 51.0")).expect("written");
    let checked = verified(&dir);
    assert!(checked.code == 1 && checked.out.contains("wrong: the journal was edited"), "{}", checked.out);
    std::fs::write(record.join("journal.jsonl"), journal).expect("written");
    std::fs::write(record.join("more"), "more").expect("written");
    let checked = verified(&dir);
    assert!(checked.code == 1 && checked.out.contains("`more` is not part"), "{}", checked.out);
}

#[test]
fn a_record_of_two_processes_is_one() {
    let (dir, _emulated) = room("resumed");
    let mut process = command();
    process.current_dir(&dir).args(DEPLOY).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut process = process.spawn().expect("the command starts");
    for _ in 0..4000 {
        let journal = std::fs::read_to_string(dir.join("signed/journal.jsonl")).unwrap_or_default();
        if journal.matches("\"told\"").count() > 2 {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    let ended = matterixc_in(&dir, &[&DEPLOY[..], &["--resume"]].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    let checked = verified(&dir);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    let page = std::fs::read_to_string(dir.join("signed/report.md")).expect("a page");
    assert!(page.contains("## Processes") && page.matches("| 20").count() >= 2, "{page}");
}

#[test]
fn a_record_of_a_deployment_that_failed_is_gone_through_again_too() {
    let (dir, _) = room("failed");
    let device = Device::start(b'\n', |line, _| match line {
        "IN_NAME" => Answer::Says("plate \r\n"),
        "OUT_WD1@60" => Answer::Says("60 \r\n"),
        "OUT_WD2@0" => Answer::Says("0 \r\n"),
        "IN_SP_4" => Answer::Says("300 4 \r\n"),
        "IN_SP_1" => Answer::Says("12.0 1 \r\n"),
        "IN_PV_2" => Answer::Says("22.0 2 \r\n"),
        _ => Answer::Nothing,
    });
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", device.address));
    let ended = matterixc_in(&dir, &DEPLOY);
    assert!(ended.code == 1 && ended.err.contains("diverged"), "{}", ended.err);
    let checked = verified(&dir);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    let page = std::fs::read_to_string(dir.join("signed/report.md")).expect("a page");
    assert!(page.contains("## Failures") && page.contains("## Made safe"), "{page}");
}

#[test]
fn what_is_refused_beforehand_leaves_no_record() {
    let (dir, _) = room("refused");
    write(&dir, "lab.toml", "[plate]\naddress = \"127.0.0.1:1\"\n");
    let ended = matterixc_in(&dir, &DEPLOY);
    assert!(ended.code == 1 && ended.err.contains("nothing was sent"), "{}", ended.err);
    assert!(!dir.join("signed").exists());
}

/// A heater of a user's own that says who it is.
const OWN: &str = "mtx 1
use std::thermal::Heater
asset Block: Heater {
    capacity: 500 J/K
    air: 0.5 W/K
    gain: 40 W/K
    power: 500 W
    limits: 0 degC .. 200 degC
}
driver BlockLine for Block over serial(baud: 9600, frame: \"8N1\", framing: line, timeout: 300 ms) {
    open sends \"ID\" expects \"BLOCK {<serial>}\"
    heat to(t) sends \"H{t as degC :.1}\" expects \"OK\"
    stop heating sends \"OFF\" expects \"OK\"
    reading temperature asks \"T\" expects \"{degC in -20 .. 250}\"
    safe sends \"OFF\" expects \"OK\"
}
lab bench { ambient: 22 degC, plate = Block }
workflow warm in bench {
    heat plate to 60 degC
    wait until plate.temperature >= 50 degC timeout 2 h
} finally { stop heating plate }
";

#[test]
fn a_report_says_which_device_it_was_and_what_was_asked_twice() {
    let device = Device::start(b'\n', |line, before| match line {
        "ID" => Answer::Says("BLOCK no. 4711 | B\r\n"),
        "T" if before == 4 => Answer::Nothing,
        "T" if before > 8 => Answer::Says("51.0\r\n"),
        "T" => Answer::Says("22.0\r\n"),
        _ => Answer::Says("OK\r\n"),
    });
    let dir = bench("record_texts", OWN, "plate", &device.address);
    let _ = std::fs::remove_dir_all(dir.join("signed"));
    let ended = matterixc_in(&dir, &DEPLOY);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let page = std::fs::read_to_string(dir.join("signed/report.md")).expect("a page");
    let texts = page.split("## Texts of devices").nth(1).expect("texts");
    assert!(texts.contains("| plate | serial | no. 4711 \\| B |"), "{page}");
    let again = page.split("## Asked again").nth(1).expect("what was asked again");
    assert!(again.contains("| plate | "), "{page}");
    let checked = verified(&dir);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
}
