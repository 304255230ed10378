//! Whole workflows on emulators.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Stdio;
use std::time::Duration;

use super::{Emulated, HEAT, bench, deploy, deploy_at, lines};
use crate::harness::{command, folder, matterixc_in, write};

#[test]
fn a_dry_run_prints_every_byte_and_sends_none() {
    let dir = bench("dry", HEAT, "plate", "127.0.0.1:1");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let sent: Vec<&str> =
        ended.out.lines().filter(|l| !l.contains("IN_PV")).filter_map(|l| l.split(" <- ").nth(1)).collect();
    let wanted = [
        "IN_NAME\\r\\n",
        "OUT_WD1@60\\r\\n",
        "OUT_SP_4 300\\r\\n",
        "START_4\\r\\n",
        "OUT_SP_1 50.0\\r\\n",
        "START_1\\r\\n",
        "STOP_1\\r\\n",
        "\\r\\n",
        "STOP_1\\r\\n",
        "STOP_4\\r\\n",
        "\\r\\n",
        "STOP_4\\r\\n",
        "OUT_WD2@0\\r\\n",
    ];
    assert_eq!(sent, wanted);
}

#[test]
fn a_plate_heats_and_stirs_on_its_emulator() {
    let dir = bench("heat", HEAT, "plate", "");
    // The slower the two go, the less a machine that is busy for a moment leaves them apart.
    let slow = "20";
    let emulated = Emulated::at(slow, &dir, &["plate", "--file", "lab.mtx"]);
    write(
        &dir,
        "lab.toml",
        format!("[plate]\naddress = \"{}\"\ntolerance = {{ temperature = \"3 K\" }}\n", emulated.address),
    );
    let ended = deploy_at(slow, &dir, &["--mode", "shadow"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    assert!(ended.err.contains("2 expectations: 1 met, 1 not observed"), "{}", ended.err);
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    assert!(journal.contains("\"event\":\"starting\"") && journal.contains("lab.mtx:11:5"), "{journal}");
}

const DOSE: &str = include_str!("../../deploy/dose.mtx");

#[test]
fn a_plunger_goes_where_the_volume_says_in_both_protocols() {
    for driver in ["CavroDt", "CavroOem"] {
        let dir = bench(&format!("dose_{driver}"), DOSE, "pump", "");
        let emulated = Emulated::start(&dir, &["pump", "--file", "lab.mtx", "--driver", driver]);
        write(&dir, "lab.toml", format!("[pump]\naddress = \"{}\"\ndriver = \"{driver}\"\n", emulated.address));
        let ended = deploy(&dir, &["--mode", "real", "--trace"]);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        // 2.123 mL of 5 mL are 1273.8 of 3000 steps, 1.123 mL are 673.8.
        for step in ["I1A1274R", "I3A674R", "I3A0R"] {
            assert!(ended.out.contains(step), "{driver} {step}: {}", ended.out);
        }
    }
}

#[test]
fn an_emulator_says_why_it_refuses_what_it_understands() {
    let dir = folder("deploy_refused");
    // There is less in the flask than is drawn.
    let lab = &DOSE[..DOSE.find("workflow").expect("one")];
    write(&dir, "lab.mtx", lab.replace("20 mL of water", "0.5 mL of water"));
    let mut emulated = command();
    emulated.current_dir(&dir).args(["emulate", "pump", "--file", "lab.mtx", "--driver", "CavroDt", "--tcp", "0"]);
    let mut emulated =
        emulated.args(["--speed", "40"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let mut address = String::new();
    BufReader::new(emulated.stdout.take().expect("piped")).read_line(&mut address).expect("an address");
    let mut line = TcpStream::connect(address.trim()).expect("it answers");
    for (said, wanted) in
        [("/1ZR", "/0`"), ("/1QR", "/0`"), ("/1I1A1274R", "/0b"), ("/1I1A1274R", "/0b"), ("/1I1A60R", "/0@")]
    {
        line.write_all(format!("{said}\r").as_bytes()).expect("said");
        let mut answer = vec![0; wanted.len() + 3];
        line.read_exact(&mut answer).expect("answered");
        assert!(answer.starts_with(wanted.as_bytes()), "{said}: {}", String::from_utf8_lossy(&answer));
    }
    emulated.kill().expect("it can be killed");
    let mut why = String::new();
    emulated.stderr.take().expect("piped").read_to_string(&mut why).expect("text");
    emulated.wait().expect("it ends");
    assert_eq!(why.lines().count(), 1, "{why}");
    assert!(why.contains("`A1274`, `draw`, is refused: volume underflow: fill in more, or draw less"), "{why}");
}

#[test]
fn what_stands_in_for_a_device_needs_no_workflow() {
    let dir = folder("deploy_no_workflow");
    let at = HEAT.find("workflow").expect("one");
    write(&dir, "lab.mtx", HEAT);
    write(&dir, "none.mtx", &HEAT[..at]);
    write(&dir, "two.mtx", format!("{HEAT}{}", HEAT[at..].replace("warm", "again")));
    for file in ["none.mtx", "two.mtx"] {
        let emulated = Emulated::start(&dir, &["plate", "--file", file]);
        write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
        let _ = std::fs::remove_file(dir.join("journal"));
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(ended.code, 0, "{file}: {}", ended.err);
    }
    // Which lab is meant is not said.
    write(
        &dir,
        "labs.mtx",
        format!("{}{}", &HEAT[..at], HEAT[HEAT.find("lab bench").expect("a lab")..at].replace("bench", "other")),
    );
    let ended = matterixc_in(&dir, &["emulate", "plate", "--file", "labs.mtx", "--tcp", "0"]);
    assert!(ended.code == 1 && ended.err.contains("no workflow"), "{}", ended.err);
}

#[test]
fn a_balance_is_read_and_tared() {
    let text = "mtx 1
use std::balances::PrecisionBalance
use std::glassware::Beaker50mL
lab bench {
    ambient: 22 degC
    scale = PrecisionBalance at (0, 0, 0) m
    a = Beaker50mL on scale holding 20 mL of water
}
workflow weigh_it in bench {
    let m <- read scale
    tare scale
    wait 2 s
    expect m in 40 g .. 60 g
    expect scale.net in -0.1 g .. 0.1 g
}
";
    let dir = bench("scale", text, "scale", "");
    let emulated = Emulated::start(&dir, &["scale", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[scale]\naddress = \"{}\"\n", emulated.address));
    let ended = deploy(&dir, &["--mode", "sim-first"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    assert!(ended.err.contains("2 expectations: 2 met"), "{}", ended.err);
}

#[test]
fn a_simulation_that_does_not_pass_sends_nothing() {
    let dir = bench("gate", &HEAT.replace(">= 29 degC", "> 40 degC"), "plate", "127.0.0.1:1");
    let ended = deploy(&dir, &["--mode", "sim-first"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("nothing was sent"), "{}", ended.err);
    assert!(!dir.join("journal").exists());
}

/// A plate must hear something every 15 s of lab time: slow enough for a process to end and another to begin.
const SLOW: &str = "4";

#[test]
fn a_deployment_that_was_killed_goes_on_from_its_journal() {
    let dir = bench("resume", HEAT, "plate", "");
    let emulated = Emulated::at(SLOW, &dir, &["plate", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
    let mut killed = command();
    killed.current_dir(&dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real"]);
    killed.args(["--journal", "journal", "--speed", SLOW]).stdout(Stdio::null()).stderr(Stdio::null());
    let mut killed = killed.spawn().expect("the command starts");
    for _ in 0..2000 {
        let journal = std::fs::read_to_string(dir.join("journal")).unwrap_or_default();
        if journal.matches("\"told\"").count() > 3 {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    killed.kill().expect("it can be killed");
    killed.wait().expect("it ends");
    let before = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    let ended = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let after = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    let whole = &before[..before.rfind('\n').map_or(0, |n| n + 1)];
    assert!(lines(&after).starts_with(lines(whole)), "nothing is rewritten");
    assert_eq!(after.matches("START_1\\\\r").count(), 1, "told once: {after}");
    // What has come to its end is not gone on with.
    let again = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
    assert_eq!(again.code, 1);
    assert!(again.err.contains("journal-mismatch") && again.err.contains("has already ended"), "{}", again.err);
}

#[test]
fn an_asset_of_the_library_is_emulated_by_its_name() {
    let dir = folder("deploy_alone");
    let emulated = Emulated::start(&dir, &["IkaRetControl"]);
    assert!(emulated.address.starts_with("127.0.0.1:"));
    let unknown = matterixc_in(&dir, &["emulate", "IkaRat", "--tcp", "0"]);
    assert_eq!(unknown.code, 2, "{}", unknown.err);
}
