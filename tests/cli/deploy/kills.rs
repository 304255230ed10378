//! Deployments that are killed at any moment and gone on with: nothing that moves matter is said twice, what emulators heard is
//! what was to be said, or it is refused to go on, saying why.
//!
//! `MATTERIX_KILLS` says how many moments each workflow is killed at; `.ci/peers` asks for more than the gate.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::Emulated;
use crate::harness::{Ended, command, folder, matterixc_in, write};

/// Slow enough that a process is killed while something is under way, and for its watchdogs until another goes on.
const SPEED: &str = "8";
/// In the gate.
const FEW: u64 = 5;

const PUMPED: &str = "mtx 1
use std::glassware::{Beaker50mL, Beaker250mL}
use std::heating::IkaRetControl
use std::pumps
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
    pump = CavroXlp6000 at (3, 0, 0) m
    a = Beaker50mL at (1, 0, 0) m holding 20 mL of water
    b = Beaker50mL at (2, 0, 0) m
    between pump and a { piped: true, port: 1 }
    between pump and b { piped: true, port: 3 }
}
workflow dose in bench {
    stir plate at 300 rpm
    heat plate to 40 degC
    draw 2.123 mL from a by pump
    push 1 mL into b by pump
    wait 1 s
    push 1.123 mL into b by pump
} finally { stop heating plate; stop stirring plate }
";

/// Passes everything on between a deployment and an emulator, and notes what the deployment said.
struct Tap {
    address: String,
    heard: Arc<Mutex<Vec<u8>>>,
}

impl Tap {
    fn on(device: &str) -> Tap {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address").to_string();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let (device, noted) = (device.to_owned(), Arc::clone(&heard));
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let Ok(far) = TcpStream::connect(&device) else { return };
                let (back, from) = (stream.try_clone().expect("a stream"), far.try_clone().expect("a stream"));
                std::thread::spawn(move || pass(from, back, None));
                let noted = Arc::clone(&noted);
                // An emulator of a line serves one after the other.
                pass(stream, far, Some(noted));
            }
        });
        Tap { address, heard }
    }

    fn heard(&self) -> String {
        String::from_utf8_lossy(&self.heard.lock().expect("not poisoned")).into_owned()
    }
}

/// Passes on what comes, and notes it.
pub(super) fn pass(mut from: TcpStream, mut to: TcpStream, noted: Option<Arc<Mutex<Vec<u8>>>>) {
    let mut buffer = [0; 4096];
    while let Ok(n @ 1..) = from.read(&mut buffer) {
        if to.write_all(&buffer[..n]).is_err() {
            break;
        }
        if let Some(noted) = &noted {
            noted.lock().expect("not poisoned").extend_from_slice(&buffer[..n]);
        }
    }
    let _ = to.shutdown(std::net::Shutdown::Both);
}

/// A lab: its text, the emulated devices with the keys of their bindings and drivers, and what moves matter in what one hears.
struct Lab {
    name: &'static str,
    text: &'static str,
    devices: &'static [(&'static str, &'static str, Option<&'static str>)],
    moving: fn(&str) -> Vec<String>,
}

/// Strings of a pump that move its plunger.
fn strokes(heard: &str) -> Vec<String> {
    heard.split('\r').filter(|s| s.starts_with('/') && s.contains('A')).map(str::to_owned).collect()
}

/// Commands of a robot that move liquids or tips.
fn commands(heard: &str) -> Vec<String> {
    let named = heard.split("\"commandType\":\"").skip(1).filter_map(|rest| rest.split('"').next());
    named.filter(|name| !name.starts_with("load") && *name != "home").map(str::to_owned).collect()
}

const LABS: [Lab; 3] = [
    Lab {
        name: "pumped",
        text: PUMPED,
        devices: &[("plate", "address", None), ("pump", "address", Some("CavroDt"))],
        moving: strokes,
    },
    Lab {
        name: "pipetted",
        text: include_str!("../../deploy/transfer.mtx"),
        devices: &[("ot2", "http", None)],
        moving: commands,
    },
    Lab {
        name: "dosed",
        text: include_str!("../../deploy/doses.mtx"),
        devices: &[("pump", "address", Some("CavroDt"))],
        moving: strokes,
    },
];

/// Fresh emulators behind taps, with the bindings to them.
fn stage(lab: &Lab, dir: &Path) -> (Vec<Emulated>, Vec<Tap>) {
    write(dir, "lab.mtx", lab.text);
    let _ = std::fs::remove_file(dir.join("journal"));
    let (mut emulated, mut taps, mut bindings) = (Vec::new(), Vec::new(), String::new());
    for (device, key, driver) in lab.devices {
        let mut args = vec![*device, "--file", "lab.mtx"];
        args.extend(driver.iter().flat_map(|d| ["--driver", d]));
        let one = Emulated::at(SPEED, dir, &args);
        let tap = Tap::on(&one.address);
        let driver = driver.map_or(String::new(), |d| format!("driver = \"{d}\"\n"));
        bindings += &format!("[{device}]\n{key} = \"{}\"\n{driver}", tap.address);
        emulated.push(one);
        taps.push(tap);
    }
    write(dir, "lab.toml", bindings);
    (emulated, taps)
}

const DEPLOY: [&str; 10] =
    ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--speed", SPEED];

fn heard(lab: &Lab, taps: &[Tap]) -> Vec<String> {
    taps.iter().flat_map(|t| (lab.moving)(&t.heard())).collect()
}

/// Deploys until the journal has begun and then for so long, kills it, and goes on.
fn killed(dir: &Path, after: Duration) -> Ended {
    let mut process = command();
    process.current_dir(dir).args(DEPLOY).stdout(Stdio::null()).stderr(Stdio::null());
    let mut process = process.spawn().expect("the command starts");
    while !dir.join("journal").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(after);
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
    matterixc_in(dir, &[&DEPLOY[..], &["--resume"]].concat())
}

/// The next of a sequence of numbers from 0 to 1.
fn next(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}

/// How long a deployment was at work, by its journal.
fn lasted(dir: &Path) -> Duration {
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    let wall = |line: &str| serde_json::from_str::<serde_json::Value>(line).ok()?["wall"].as_f64();
    let walls: Vec<f64> = journal.lines().filter_map(wall).collect();
    let (Some(first), Some(last)) = (walls.first(), walls.last()) else { panic!("no times: {journal}") };
    Duration::from_secs_f64(last - first)
}

fn what_a_killed_deployment_did(lab: &Lab) {
    let kills = std::env::var("MATTERIX_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(FEW);
    let dir = folder(&format!("deploy_kills_{}", lab.name));
    let (emulated, taps) = stage(lab, &dir);
    let ended = matterixc_in(&dir, &DEPLOY);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let whole = heard(lab, &taps);
    assert!(whole.len() >= 3, "{whole:?}");
    let lasts = lasted(&dir);
    drop(emulated);
    let (mut seed, mut counts) = (7, [0; 3]);
    for kill in 0..kills {
        let (emulated, taps) = stage(lab, &dir);
        let after = lasts.mul_f64(next(&mut seed));
        let ended = killed(&dir, after);
        let said = heard(lab, &taps);
        let case = format!("{} {kill}, killed after {after:?}: {said:?}\n{}", lab.name, ended.err);
        assert!(said.len() <= whole.len() && whole.starts_with(&said), "said twice or otherwise: {case}");
        if ended.code == 0 {
            assert_eq!(said, whole, "all was done: {case}");
            counts[0] += 1;
        } else {
            assert!(ended.err.contains("error[journal-mismatch]"), "it is said why: {case}");
            counts[if said == whole { 2 } else { 1 }] += 1;
        }
        drop(emulated);
    }
    let [on, refused, over] = counts;
    println!("{}: {on} of {kills} went on to the end, {refused} were refused, {over} had come to their end", lab.name);
}

#[test]
fn a_pump_and_a_plate_are_told_nothing_twice() {
    what_a_killed_deployment_did(&LABS[0]);
}

#[test]
fn a_robot_is_told_nothing_twice() {
    what_a_killed_deployment_did(&LABS[1]);
}

#[test]
fn a_pump_that_doses_in_a_loop_is_told_nothing_twice() {
    what_a_killed_deployment_did(&LABS[2]);
}
