//! Devices that are not there when a deployment begins or is gone on with: nothing is said to any, and a journal stays.

use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use super::kills::pass;
use super::{Answer, Device, Emulated, bench, deploy, deploy_at, lines};
use crate::harness::{command, flat, write};

/// A port at which nobody listens.
fn nobody() -> String {
    TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").to_string()
}

const TWO: &str = "mtx 1
use std::glassware::Beaker50mL
use std::heating::IkaRetControl
use std::balances::PrecisionBalance
lab bench {
    ambient: 22 degC
    scale = PrecisionBalance at (1, 0, 0) m
    plate = IkaRetControl at (0, 0, 0) m
}
workflow both in bench {
    tare scale
    stir plate at 300 rpm
    wait 1 s
} finally { stop stirring plate }
";

#[test]
fn where_one_device_is_not_there_none_is_told_anything() {
    let scale = Device::start(b'\n', |_, _| Answer::Nothing);
    let dir = bench("unreached", TWO, "plate", "");
    let bound = |plate: &str| format!("[scale]\naddress = \"{}\"\n[plate]\naddress = \"{plate}\"\n", scale.address);
    for (plate, said) in [(nobody(), "refused the connection"), ("no-such-host.invalid:1".into(), "host is unknown")] {
        write(&dir, "lab.toml", bound(&plate));
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(ended.code, 1, "{}", ended.err);
        let flat = flat(&ended.err);
        assert!(flat.contains("error[device-lost]") && flat.contains(said), "{}", ended.err);
        assert!(ended.err.contains("lab.toml:4:11") && !ended.err.contains("std::"), "{}", ended.err);
        assert!(!ended.err.contains("could not be made safe"), "{}", ended.err);
        assert!(!dir.join("journal").exists(), "it may be tried again");
    }
    write(&dir, "lab.toml", bound("x").replace("address = \"x\"", "port = \"/dev/no-such-port\""));
    let ended = deploy(&dir, &["--mode", "real"]);
    assert!(ended.err.contains("the port `/dev/no-such-port` does not exist"), "{}", ended.err);
    assert_eq!(scale.heard(), Vec::<String>::new());
}

const OPEN: u8 = 0;
const SHUT: u8 = 1;
const MUTE: u8 = 2;

/// A port before a device, at which nobody listens while it is shut, and nobody answers while it is mute.
pub(super) struct Door {
    pub(super) address: String,
    wanted: Arc<AtomicU8>,
    is: Arc<AtomicU8>,
}

impl Door {
    pub(super) fn at(device: &str) -> Door {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address").to_string();
        let (wanted, is) = (Arc::new(AtomicU8::new(OPEN)), Arc::new(AtomicU8::new(OPEN)));
        let (device, place, goal, now) = (device.to_owned(), address.clone(), Arc::clone(&wanted), Arc::clone(&is));
        std::thread::spawn(move || {
            let (mut listener, mut held) = (Some(listener), Vec::new());
            loop {
                let state = goal.load(Ordering::SeqCst);
                if state == SHUT {
                    listener = None;
                    held.clear();
                } else if listener.is_none() {
                    listener = TcpListener::bind(&place).ok();
                }
                now.store(state, Ordering::SeqCst);
                if let Some(listener) = &listener {
                    listener.set_nonblocking(true).expect("a listener");
                    match listener.accept() {
                        Ok((stream, _)) if state == MUTE => held.push(stream),
                        Ok((stream, _)) => {
                            stream.set_nonblocking(false).expect("a stream");
                            let far = TcpStream::connect(&device).expect("the device");
                            let (back, from) = (stream.try_clone().expect("one"), far.try_clone().expect("one"));
                            std::thread::spawn(move || pass(from, back, None));
                            std::thread::spawn(move || pass(stream, far, None));
                        }
                        Err(_) => {}
                    }
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        Door { address, wanted, is }
    }

    fn set(&self, state: u8) {
        self.wanted.store(state, Ordering::SeqCst);
        while self.is.load(Ordering::SeqCst) != state {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// Slow enough for a process to be killed on the way.
pub(super) const SLOW: &str = "4";

/// No watchdog minds how long nobody is there.
pub(super) const WEIGH: &str = "mtx 1
use std::balances::PrecisionBalance
lab bench { ambient: 22 degC, scale = PrecisionBalance at (0, 0, 0) m }
workflow weigh_it in bench {
    tare scale
    wait 40 s
    expect scale.net < 1 g
}
";

/// Deploys a workflow through a port, and kills it on the way.
pub(super) fn killed(dir: &Path) {
    let mut process = command();
    process.current_dir(dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real"]);
    process.args(["--journal", "journal", "--speed", SLOW]).stdout(Stdio::null()).stderr(Stdio::null());
    let mut process = process.spawn().expect("the command starts");
    for _ in 0..2000 {
        let journal = std::fs::read_to_string(dir.join("journal")).unwrap_or_default();
        if journal.contains("\"event\":\"started\"") {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    process.kill().expect("it can be killed");
    process.wait().expect("it ends");
}

#[test]
fn a_journal_is_gone_on_with_once_its_device_is_there_again() {
    let dir = bench("back", WEIGH, "scale", "");
    let emulated = Emulated::at(SLOW, &dir, &["scale", "--file", "lab.mtx"]);
    let door = Door::at(&emulated.address);
    write(&dir, "lab.toml", format!("[scale]\naddress = \"{}\"\n", door.address));
    killed(&dir);
    let before = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    for state in [SHUT, SHUT, MUTE] {
        door.set(state);
        let ended = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
        assert_eq!(ended.code, 1, "{}", ended.err);
        assert!(ended.err.contains("cannot be reached") && ended.err.contains("with `--resume`"), "{}", ended.err);
        assert!(ended.err.contains("lab.toml:2:11"), "{}", ended.err);
        let after = std::fs::read_to_string(dir.join("journal")).expect("a journal");
        let (before, after) = (lines(&before), lines(&after));
        assert!(after.starts_with(before) && !after.contains("\"event\":\"end\""), "{after}");
        assert!(after == before || state == MUTE, "{after}");
    }
    door.set(OPEN);
    let ended = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}
