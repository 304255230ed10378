//! Workflows on devices: emulators and devices that misbehave, what is sent, what is refused, what is left safe.

mod ask;
mod believed;
mod bindings;
mod faulty;
mod framed;
mod held;
mod identity;
mod journal;
mod kills;
mod late;
mod left;
mod modules;
mod panel;
mod reads;
mod record;
mod safe;
mod server;
mod stop;
mod unreached;
mod whole;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};

use crate::harness::{Ended, command, folder, matterixc_in, write};

/// How much faster than the clock emulators and deployments go in tests.
pub const SPEED: &str = "40";

/// A plate with a beaker on it.
pub const HEAT: &str = "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
}
workflow warm in bench {
    stir plate at 300 rpm
    heat plate to 50 degC
    wait until plate.temperature >= 30 degC timeout 1 h
    expect plate.temperature >= 29 degC
    expect beaker.contents.temperature > 22 degC
} finally { stop heating plate; stop stirring plate }
";

/// An emulator that ends with the test.
pub struct Emulated {
    child: Child,
    /// Where it answers.
    pub address: String,
}

impl Emulated {
    pub fn start(dir: &Path, args: &[&str]) -> Emulated {
        Emulated::at(SPEED, dir, args)
    }

    /// With a speed of its own.
    pub fn at(speed: &str, dir: &Path, args: &[&str]) -> Emulated {
        let mut child = command();
        child.current_dir(dir).arg("emulate").args(args).args(["--tcp", "0", "--speed", speed]);
        let mut child = child.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the emulator starts");
        let mut address = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut address).expect("an address");
        if address.is_empty() {
            let mut err = String::new();
            child.stderr.take().expect("piped").read_to_string(&mut err).expect("text");
            panic!("no emulator: {err}");
        }
        Emulated { child, address: address.trim().to_owned() }
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A device of a test's own: what it answers to each line, and what it was told.
pub struct Device {
    pub address: String,
    heard: Arc<Mutex<Vec<String>>>,
}

/// What a device of a test does with a line.
pub enum Answer {
    Says(&'static str),
    Nothing,
    HangsUp,
}

impl Device {
    /// Lines end with `end`; `answer` is given the line and how many there were before it.
    pub fn start(end: u8, answer: impl Fn(&str, usize) -> Answer + Send + 'static) -> Device {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address").to_string();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let told = Arc::clone(&heard);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                serve(stream, end, &told, &answer);
            }
        });
        Device { address, heard }
    }

    pub fn heard(&self) -> Vec<String> {
        self.heard.lock().expect("not poisoned").clone()
    }
}

fn serve(stream: TcpStream, end: u8, heard: &Mutex<Vec<String>>, answer: &dyn Fn(&str, usize) -> Answer) {
    let mut out = stream.try_clone().expect("a stream");
    let mut reader = BufReader::new(stream);
    loop {
        let mut line = Vec::new();
        if reader.read_until(end, &mut line).map_or(0, |n| n) == 0 {
            return;
        }
        let line = String::from_utf8_lossy(&line).trim().to_owned();
        let before = {
            let mut heard = heard.lock().expect("not poisoned");
            heard.push(line.clone());
            heard.len() - 1
        };
        match answer(&line, before) {
            Answer::Says(text) => {
                if out.write_all(text.as_bytes()).is_err() {
                    return;
                }
            }
            Answer::Nothing => {}
            Answer::HangsUp => return,
        }
    }
}

/// The lines of a journal after its head.
pub fn lines(journal: &str) -> &str {
    journal.split_once('\n').map_or("", |(_, rest)| rest)
}

/// A folder with a program and bindings of its one device.
pub fn bench(name: &str, text: &str, device: &str, address: &str) -> PathBuf {
    let dir = folder(&format!("deploy_{name}"));
    write(&dir, "lab.mtx", text);
    write(&dir, "lab.toml", format!("[{device}]\naddress = \"{address}\"\n"));
    dir
}

/// Deploys it on devices.
pub fn deploy(dir: &Path, more: &[&str]) -> Ended {
    deploy_at(SPEED, dir, more)
}

/// With a speed of its own.
pub fn deploy_at(speed: &str, dir: &Path, more: &[&str]) -> Ended {
    let given = ["deploy", "lab.mtx", "--bind", "lab.toml", "--journal", "journal", "--speed", speed];
    matterixc_in(dir, &[&given, more].concat())
}
