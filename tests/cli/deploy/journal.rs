//! Journals that others have laid hands on: what is gone on with, what is refused, and what is then left safe.

use std::fs::OpenOptions;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use matterix_hardware::deploy::Chain;

use super::{Emulated, HEAT, bench, lines};
use crate::harness::{Ended, command, flat, matterixc_in, write};

/// A plate must hear something every 15 s of lab time: slow enough for a process to end and another to begin.
const SLOW: &str = "4";

const DEPLOY: [&str; 10] =
    ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--speed", SLOW];

/// Heats for long enough to be disturbed.
fn text() -> String {
    HEAT.replace(
        "wait until plate.temperature >= 30 degC timeout 1 h",
        "wait until plate.temperature >= 45 degC timeout 1 h",
    )
}

fn deployed(dir: &Path) -> Child {
    let mut child = command();
    child.current_dir(dir).args(DEPLOY).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    child.spawn().expect("the command starts")
}

fn resumed(dir: &Path, bindings: &str) -> Ended {
    let mut args = DEPLOY.map(str::to_owned).to_vec();
    args[3] = bindings.to_owned();
    args.push("--resume".to_owned());
    matterixc_in(dir, &args.iter().map(String::as_str).collect::<Vec<_>>())
}

fn journal(dir: &Path) -> String {
    std::fs::read_to_string(dir.join("journal")).unwrap_or_default()
}

/// Waits until the journal says something so often.
fn until(dir: &Path, word: &str, times: usize) {
    for _ in 0..2000 {
        if journal(dir).matches(word).count() >= times {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("{}", journal(dir));
}

/// A deployment that was killed while it heated, on an emulator that goes on.
fn killed(name: &str) -> (std::path::PathBuf, Emulated) {
    killed_in(name, &text())
}

fn killed_in(name: &str, text: &str) -> (std::path::PathBuf, Emulated) {
    let dir = bench(name, text, "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut process = deployed(&dir);
    until(&dir, "\"told\"", 3);
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    (dir, emulated)
}

#[test]
fn a_journal_that_was_edited_is_refused_and_the_devices_are_made_safe() {
    let (dir, _emulated) = killed("edited");
    let before = journal(&dir);
    let all: Vec<&str> = before.split_inclusive('\n').collect();
    let line = all.iter().position(|l| l.contains("START_1")).expect("it heats");
    let gone = |at: usize| [&all[..at], &all[at + 1..]].concat().concat();
    let cases = [
        ("a line is gone", gone(line), "was edited"),
        ("another set point", before.replace("OUT_SP_1 50.0", "OUT_SP_1 90.0"), "was edited"),
        ("another label", before.replace("heat plate to", "stir plate to"), "was edited"),
        ("another time", before.replacen("\"t\":0.0", "\"t\":7.5", 1), "was edited"),
        ("the last line is gone", all[..all.len() - 1].concat(), "was cut short"),
        ("half is gone", before[..before.len() / 2].to_owned(), "was cut short"),
        ("all is gone", String::new(), "is empty"),
        ("no head", lines(&before).to_owned(), "does not start like a journal"),
    ];
    for (name, text, why) in cases {
        assert_ne!(text, before, "{name}");
        write(&dir, "journal", &text);
        let ended = resumed(&dir, "lab.toml");
        assert_eq!(ended.code, 1, "{name}: {}", ended.err);
        let one_line = flat(&ended.err);
        assert!(one_line.contains("journal-mismatch") && one_line.contains(why), "{name}: {}", ended.err);
        assert!(one_line.contains("these devices were made safe: `plate`"), "{name}: {}", ended.err);
        // Nothing is mended, but whoever mends it does not go on either.
        assert_eq!(lines(&journal(&dir)), lines(&text), "{name}: it is left as it is");
        if text.contains("\"state\":\"open\"") {
            let shut = format!("{}\n{}", journal(&dir).lines().next().unwrap_or_default(), lines(&text));
            assert!(shut.contains("\"state\":\"shut\""), "{name}: {shut}");
        }
    }
    let shut = before.replacen("\"open\"", "\"shut\"", 1);
    write(&dir, "journal", &shut);
    let ended = resumed(&dir, "lab.toml");
    let one_line = flat(&ended.err);
    assert!(ended.code == 1 && one_line.contains("could not be resumed"), "{}", ended.err);
}

#[test]
fn another_program_another_seed_and_another_end_are_refused() {
    let (dir, _emulated) = killed("unlike");
    write(&dir, "lab.mtx", text().replace("300 rpm", "310 rpm"));
    let ended = resumed(&dir, "lab.toml");
    assert!(ended.code == 1 && ended.err.contains("another program"), "{}", ended.err);
    write(&dir, "lab.mtx", text());
    let (seeded_dir, _other) = killed("seeded");
    let seeded = matterixc_in(&seeded_dir, &[&DEPLOY[..], &["--resume", "--seed", "7"]].concat());
    assert!(seeded.code == 1 && seeded.err.contains("another seed"), "{}", seeded.err);
    // The plate is off by now: whoever goes on would believe that it heats.
    for dir in [&dir, &seeded_dir] {
        let right = resumed(dir, "lab.toml");
        let one_line = flat(&right.err);
        assert!(right.code == 1 && one_line.contains("were made safe when it could not be resumed"), "{one_line}");
        assert!(one_line.contains("these devices were made safe: `plate`"), "{one_line}");
    }
    let again = matterixc_in(&dir, &DEPLOY);
    assert!(again.code == 2 && again.err.contains("--resume"), "{}", again.err);
}

#[test]
fn a_device_that_was_moved_to_another_port_is_gone_on_with() {
    let (dir, emulated) = killed("moved");
    let door = super::unreached::Door::at(&emulated.address);
    write(&dir, "moved.toml", format!("# it has another converter now\n[plate]\naddress = \"{}\"\n", door.address));
    let ended = resumed(&dir, "moved.toml");
    assert_eq!(ended.code, 0, "{}", ended.err);
}

#[test]
fn a_plate_that_was_set_twice_goes_on_from_the_second() {
    let twice = HEAT.replace(
        "wait until plate.temperature >= 30 degC timeout 1 h",
        "wait until plate.temperature >= 26 degC timeout 1 h\n    heat plate to 55 degC\n    stir plate at 400 rpm\n    wait 10 s\n    wait until plate.temperature >= 40 degC timeout 1 h",
    );
    let dir = bench("set_twice", &twice, "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut process = deployed(&dir);
    until(&dir, "OUT_SP_1 55.0", 2);
    std::thread::sleep(Duration::from_millis(300));
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    let ended = resumed(&dir, "lab.toml");
    assert_eq!(ended.code, 0, "{}", ended.err);
    let journal = journal(&dir);
    for set in ["OUT_SP_1 50.0", "OUT_SP_1 55.0", "OUT_SP_4 400"] {
        let sent = format!("\"bytes\":\"{set}");
        assert_eq!(journal.matches(&sent).count(), 1, "{set}: {journal}");
    }
}

#[test]
fn a_loop_that_was_killed_makes_the_rest_of_its_turns() {
    let text = "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench { ambient: 22 degC; plate = IkaRetControl at (0,0,0) m; cup = Beaker250mL on plate holding 100 g of water }
workflow w(target: Temperature = 40 degC) in bench {
 heat plate to target
 repeat 20 times { wait 1 s
 note \"turn\" }
} finally { stop heating plate
 note \"finally was done\" }
study s of w { vary target in 30 degC .. 60 degC
 runs 400
 report a = plate.temperature }
";
    let dir = bench("turns", text, "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut process = deployed(&dir);
    until(&dir, "START_1", 1);
    std::thread::sleep(Duration::from_millis(1500));
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    let ended = resumed(&dir, "lab.toml");
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert_eq!(ended.err.matches("finally was done").count(), 1, "{}", ended.err);
    let journal = journal(&dir);
    assert_eq!(journal.matches("\"bytes\":\"START_1").count(), 1, "{journal}");
    let began = |label: &str| {
        let line = lines(&journal).lines().filter_map(|l| serde_json::from_str::<serde_json::Value>(l).ok());
        let mut line = line.filter(|l| l["event"] == "starting" && l["label"] == label);
        line.next().and_then(|l| l["t"].as_f64()).unwrap_or_else(|| panic!("no `{label}`: {journal}"))
    };
    let lasted = began("stop heating plate") - began("heat plate to target");
    assert!((20.0 - 1e-6..25.0).contains(&lasted), "{lasted}");
}

/// The plate of a lab, whose watchdog waits so long.
fn patient(patience: &str) -> String {
    let text = text().replace("IkaRetControl at", &format!("IkaRetControl {{ patience: {patience} }} at"));
    assert!(text.contains("patience"), "{text}");
    text
}

#[test]
fn a_watchdog_that_has_not_tripped_lets_a_deployment_go_on() {
    let (dir, _emulated) = killed_in("patient", &patient("60 s"));
    // It hears something every 3.75 s of the clock, and waits 15 s.
    std::thread::sleep(Duration::from_millis(4500));
    let ended = resumed(&dir, "lab.toml");
    assert_eq!(ended.code, 0, "{}", ended.err);
}

#[test]
fn a_watchdog_that_may_have_tripped_does_not_and_the_plate_is_made_safe() {
    let (dir, _emulated) = killed_in("impatient", &patient("6 s"));
    std::thread::sleep(Duration::from_millis(2000));
    let ended = resumed(&dir, "lab.toml");
    let said = flat(&ended.err);
    assert!(
        ended.code == 1 && said.contains("journal-mismatch") && said.contains("longer than its watchdog waits (6 s)"),
        "{said}"
    );
    assert!(said.contains("these devices were made safe: `plate`"), "{said}");
}

#[test]
fn two_processes_do_not_write_one_journal() {
    let dir = bench("twice", &text(), "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut first = deployed(&dir);
    until(&dir, "\"told\"", 2);
    let second = resumed(&dir, "lab.toml");
    assert_eq!(second.code, 2, "{}", second.err);
    let named = format!("process {} (started by ", first.id());
    assert!(second.err.contains(&named) && second.err.contains("is writing the journal"), "{}", second.err);
    assert!(first.wait().expect("it ends").success(), "the first goes on: {}", journal(&dir));
    assert_eq!(journal(&dir).matches("\"event\":\"resumed\"").count(), 0);
}

#[test]
fn two_processes_do_not_speak_over_one_line() {
    let dir = bench("one_line", &text(), "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut first = deployed(&dir);
    until(&dir, "\"told\"", 2);
    let mut other = DEPLOY;
    other[7] = "another";
    let second = matterixc_in(&dir, &other);
    assert_eq!(second.code, 1, "{}", second.err);
    let said = flat(&second.err);
    assert!(
        said.contains(&format!("is in use: process {} (", first.id())) && said.contains("nothing was sent"),
        "{said}"
    );
    assert!(first.wait().expect("it ends").success(), "the first goes on: {}", journal(&dir));
}

#[test]
fn a_journal_is_its_users_own_and_small() {
    let dir = bench("own", &text(), "plate", "");
    let emulated = Emulated::at("40", &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut args = DEPLOY;
    args[9] = "40";
    let ended = matterixc_in(&dir, &args);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let file = OpenOptions::new().read(true).open(dir.join("journal")).expect("a journal");
    let about = file.metadata().expect("it is there");
    assert_eq!(about.permissions().mode() & 0o777, 0o600);
    let all = journal(&dir);
    let last: serde_json::Value = serde_json::from_str(all.lines().last().expect("a line")).expect("JSON");
    let hours = last["t"].as_f64().expect("a time") / 3600.0;
    let told = all.matches("\"told\"").count() as f64;
    let (bytes, per_hour) = (about.len() as f64, 0.5e6);
    assert!(bytes <= 8e3 + per_hour * hours, "{bytes} bytes in {hours} h with {told} readings");
}

/// A stirrer of a user's own, which confirms what it is told.
const STIRRER: &str = "mtx 1
capability Spins { state spinning: Bool = false { counts_as: running }
    command spin effect spinning = true
    command rest effect spinning = false }
asset Spinner: Spins { }
driver SpinnerLine for Spinner over serial(baud: 9600, frame: \"8N1\", framing: line, timeout: 5 s) {
    spin sends \"ON\" expects \"OK\"
    rest sends \"OFF\" expects \"OK\"
    safe sends \"OFF\" expects \"OK\"
}
lab bench { ambient: 22 degC, stirrer = Spinner }
workflow mix in bench {
    spin stirrer
    wait 12 s
    rest stirrer
}
";

#[test]
#[allow(clippy::disallowed_methods, reason = "how long it spins is told by the clock")]
fn what_was_half_said_begins_when_it_is_said_once_more() {
    let told = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let noted = std::sync::Arc::clone(&told);
    let device = super::Device::start(b'\n', move |line, before| {
        noted.lock().expect("not poisoned").push((line.to_owned(), std::time::SystemTime::now()));
        if before == 0 {
            // The process that waits for this answer is killed meanwhile.
            std::thread::sleep(Duration::from_millis(1500));
        }
        super::Answer::Says("OK\r\n")
    });
    let dir = bench("half_said", STIRRER, "stirrer", &device.address);
    let mut process = deployed(&dir);
    until(&dir, "\"starting\"", 1);
    std::thread::sleep(Duration::from_millis(300));
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    // As long as the wait would take.
    std::thread::sleep(Duration::from_secs(4));
    let ended = resumed(&dir, "lab.toml");
    assert_eq!(ended.code, 0, "{}", ended.err);
    let told = told.lock().expect("not poisoned");
    let words: Vec<&str> = told.iter().map(|(line, _)| line.as_str()).collect();
    assert_eq!(words, ["ON", "ON", "OFF"]);
    let spins = told[2].1.duration_since(told[1].1).expect("later").as_secs_f64();
    assert!((2.5..6.0).contains(&spins), "12 s at four times the speed of the clock are 3 s: {spins} s");
}

/// What this machine keeps beside a journal.
fn counterfoil(journal: &str) -> std::path::PathBuf {
    let head = journal.split_inclusive('\n').next().unwrap_or_default();
    let id = Chain::of_head(head.as_bytes()).expect("a head").id;
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("state/matterixc/journals").join(id)
}

#[test]
fn an_older_copy_of_a_journal_is_refused_and_the_devices_are_made_safe() {
    // Time between the two commands: a copy is taken there.
    let apart = text().replace("    heat plate to 50 degC", "    wait 8 s\n    heat plate to 50 degC");
    let dir = bench("older", &apart, "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut process = deployed(&dir);
    until(&dir, "\"started\"", 1);
    let copy = journal(&dir);
    let whole = &copy[..=copy.rfind('\n').expect("a line")];
    until(&dir, "\"started\"", 2);
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    write(&dir, "journal", whole);
    let ended = resumed(&dir, "lab.toml");
    let one_line = flat(&ended.err);
    assert!(ended.code == 1 && one_line.contains("is an older copy: it has"), "{one_line}");
    assert!(one_line.contains("these devices were made safe: `plate`"), "{one_line}");
    // It is known from here on that the plate is off, whichever copy is put there.
    write(&dir, "journal", whole);
    let again = resumed(&dir, "lab.toml");
    assert_eq!(again.code, 1, "{}", again.err);
}

#[test]
fn a_copy_from_before_the_end_is_refused_after_it() {
    let dir = bench("older_end", &text(), "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let process = deployed(&dir);
    until(&dir, "\"told\"", 3);
    let copy = journal(&dir);
    super::stop::signal("-TERM", &process);
    assert_eq!(process.wait_with_output().expect("it ends").status.code(), Some(1));
    write(&dir, "journal", &copy[..=copy.rfind('\n').expect("a line")]);
    let ended = resumed(&dir, "lab.toml");
    let one_line = flat(&ended.err);
    assert!(ended.code == 1 && one_line.contains("is an older copy: it has"), "{one_line}");
}

#[test]
fn a_journal_that_nothing_is_known_of_is_vouched_for() {
    let (dir, _emulated) = killed_in("vouched", &patient("60 s"));
    let before = journal(&dir);
    std::fs::remove_file(counterfoil(&before)).expect("it has one");
    let ended = resumed(&dir, "lab.toml");
    assert_eq!(ended.code, 2, "{}", ended.err);
    assert!(ended.err.contains("has no counterfoil") && ended.err.contains("--resume --vouch"), "{}", ended.err);
    assert_eq!(journal(&dir), before, "it is left as it is");
    let ended = matterixc_in(&dir, &[&DEPLOY[..], &["--resume", "--vouch"]].concat());
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(counterfoil(&before).is_file());
}

#[test]
fn where_nothing_can_be_kept_beside_a_journal_nothing_is_sent() {
    let device = super::Device::start(b'\n', |line, _| super::faulty::plate(line));
    let dir = bench("no_state", HEAT, "plate", &device.address);
    let deployed = || command().current_dir(&dir).env_remove("XDG_STATE_HOME").env_remove("HOME").args(DEPLOY).output();
    for _ in 0..2 {
        let ended = deployed().expect("the command starts");
        let said = flat(&String::from_utf8_lossy(&ended.stderr));
        assert_eq!(ended.status.code(), Some(1), "{said}");
        assert!(said.contains("its counterfoil: it has no folder"), "{said}");
        assert!(device.heard().is_empty(), "{:?}", device.heard());
        assert!(!dir.join("journal").exists(), "another attempt finds none");
    }
}

#[test]
fn a_journal_that_is_cut_or_replaced_meanwhile_ends_the_deployment_and_cannot_be_gone_on_with() {
    for name in ["cut", "replaced"] {
        let dir = bench(&format!("meanwhile_{name}"), &text(), "plate", "");
        let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
        write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
        let mut child = command();
        child.current_dir(&dir).args(DEPLOY).stdout(Stdio::null()).stderr(Stdio::piped());
        let process = child.spawn().expect("the command starts");
        until(&dir, "\"told\"", 3);
        let copy = journal(&dir);
        if name == "replaced" {
            std::fs::remove_file(dir.join("journal")).expect("removed");
        }
        write(&dir, "journal", if name == "cut" { "" } else { &copy });
        let ended = process.wait_with_output().expect("it ends");
        let said = flat(&String::from_utf8_lossy(&ended.stderr));
        assert!(ended.status.code() == Some(1) && said.contains("the journal cannot be written"), "{name}: {said}");
        write(&dir, "journal", &copy[..=copy.rfind('\n').expect("a line")]);
        let again = resumed(&dir, "lab.toml");
        assert_eq!(again.code, 1, "{name}: {}", again.err);
        assert!(again.err.contains("journal-mismatch"), "{name}: {}", again.err);
    }
}

#[test]
fn a_journal_that_is_a_pipe_is_refused_at_once() {
    let dir = bench("pipe", HEAT, "plate", "127.0.0.1:1");
    let made = std::process::Command::new("mkfifo").arg(dir.join("journal")).status();
    assert!(made.expect("mkfifo").success());
    let ended = resumed(&dir, "lab.toml");
    assert!(ended.code == 2 && ended.err.contains("it is not a regular file"), "{}", ended.err);
}

/// Two plates that are alike.
const PAIR: &str = "mtx 1
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    left = IkaRetControl at (0, 0, 0) m
    right = IkaRetControl at (1, 0, 0) m
}
workflow warm in bench {
    stir left at 300 rpm
    stir right at 300 rpm
    wait 60 s
    stop stirring left
    stop stirring right
}
";

#[test]
fn plates_that_were_exchanged_or_both_moved_are_not_gone_on_with() {
    for (name, moved) in [("exchanged", false), ("both_moved", true)] {
        let [one, other] = [(); 2].map(|()| super::Device::start(b'\n', |line, _| super::faulty::plate(line)));
        let dir = bench(&format!("pair_{name}"), PAIR, "left", "");
        let bound = |left: &str, right: &str| format!("[left]\naddress = \"{left}\"\n[right]\naddress = \"{right}\"\n");
        write(&dir, "lab.toml", bound(&one.address, &other.address));
        let mut process = deployed(&dir);
        until(&dir, "\"started\"", 2);
        process.kill().expect("it can be killed");
        process.wait().expect("it ends");
        let doors = [&one, &other].map(|device| super::unreached::Door::at(&device.address));
        let now = match moved {
            true => bound(&doors[0].address, &doors[1].address),
            false => bound(&other.address, &one.address),
        };
        write(&dir, "now.toml", now);
        let ended = resumed(&dir, "now.toml");
        let one_line = flat(&ended.err);
        assert!(ended.code == 1 && one_line.contains("they cannot be distinguished"), "{name}: {one_line}");
        assert!(one_line.contains("these devices were made safe: `left`, `right`"), "{name}: {one_line}");
    }
}

/// The same journal with another text, chained anew.
fn rechained(text: &str) -> String {
    let head = text.split_inclusive('\n').next().unwrap_or_default();
    let mut chain = Chain::of_head(head.as_bytes()).expect("a head").begun();
    let mut lines = String::new();
    for line in text.lines().skip(1) {
        let after = line.find("\"after\":\"").expect("each line has a digest") + "\"after\":\"".len();
        let end = after + line[after..].find('"').expect("that ends");
        let line = format!("{}{}{}", &line[..after], chain.last, &line[end..]);
        chain.grow(line.as_bytes());
        lines += &(line + "\n");
    }
    chain.head() + &lines
}

#[test]
fn a_journal_of_another_version_is_refused_and_the_devices_are_made_safe() {
    let (dir, _emulated) = killed("version");
    let before = journal(&dir);
    let (first, rest) = before.split_once('\n').expect("a head");
    let broken = rest.rfind('\n').map_or(rest, |end| &rest[..=end]);
    assert_eq!(rechained(&before), format!("{first}\n{broken}"), "only the text is changed below");
    let tool = format!("\"tool\":\"{}\"", env!("CARGO_PKG_VERSION"));
    assert!(before.contains(&tool), "{before}");
    write(&dir, "journal", rechained(&before.replace(&tool, "\"tool\":\"0.0.1\"")));
    // What this machine knows of it is that it was written otherwise.
    std::fs::remove_file(counterfoil(&before)).expect("it has one");
    let ended = matterixc_in(&dir, &[&DEPLOY[..], &["--resume", "--vouch"]].concat());
    let one_line = flat(&ended.err);
    assert_eq!(ended.code, 1, "{one_line}");
    assert!(one_line.contains("written by version 0.0.1 of this program"), "{one_line}");
    assert!(one_line.contains("these devices were made safe: `plate`"), "{one_line}");
}

/// What a plate is asked when a deployment of this workflow is gone on with.
fn asked_on_resuming(name: &str, text: &str) -> Vec<String> {
    let device = super::Device::start(b'\n', |line, before| match line {
        "IN_PV_90" => super::Answer::Says("100.0 90 \r\n"),
        "IN_PV_2" if before > 40 => super::Answer::Says("50.0 2 \r\n"),
        other => super::faulty::plate(other),
    });
    let dir = bench(name, text, "plate", &device.address);
    let mut process = deployed(&dir);
    until(&dir, "\"told\"", 3);
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    let before = device.heard().len();
    let ended = resumed(&dir, "lab.toml");
    assert_eq!(ended.code, 0, "{}", ended.err);
    let asked = device.heard()[before..].to_vec();
    asked.into_iter().filter(|line| line.starts_with("IN_PV")).collect()
}

#[test]
fn only_readings_that_the_workflow_uses_are_asked_for_when_it_goes_on() {
    let asked = asked_on_resuming("uses_two", &text());
    assert!(asked.iter().any(|line| line == "IN_PV_2"), "{asked:?}");
    assert!(!asked.iter().any(|line| line == "IN_PV_90"), "nothing asks for a weight: {asked:?}");
    let weighed = text().replace("expect beaker", "expect plate.weight >= 1 g\n    expect beaker");
    let asked = asked_on_resuming("uses_three", &weighed);
    assert!(asked.iter().any(|line| line == "IN_PV_90"), "{asked:?}");
}
