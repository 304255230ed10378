//! Servers of the command with clients that mean no good, and Ctrl-C meanwhile.

mod lines;
mod pages;

use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

use crate::harness::command;

/// Long enough for a busy machine; a server that waits for a client would take for ever.
pub const SOON: Duration = Duration::from_secs(30);

/// A command that serves until it is told to stop.
pub struct Server {
    child: Child,
    /// The first line it said: where it answers.
    pub place: String,
}

impl Server {
    pub fn start(dir: &Path, args: &[&str]) -> Server {
        let mut child = command();
        child.current_dir(dir).args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = child.spawn().expect("the command starts");
        let mut place = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut place).expect("a line");
        if place.is_empty() {
            let mut err = String::new();
            child.stderr.take().expect("piped").read_to_string(&mut err).expect("text");
            panic!("it does not serve: {err}");
        }
        Server { child, place: place.trim().to_owned() }
    }

    pub fn connect(&self) -> TcpStream {
        let address = self.place.trim_start_matches("http://").trim_end_matches('/');
        let stream = TcpStream::connect(address).expect("connects");
        stream.set_read_timeout(Some(SOON)).expect("a timeout");
        stream.set_write_timeout(Some(SOON)).expect("a timeout");
        stream
    }

    /// Interrupts it; how it ended.
    pub fn interrupted(mut self) -> Option<i32> {
        let id = Pid::from_raw(self.child.id().cast_signed()).expect("a process");
        kill_process(id, Signal::INT).expect("it runs");
        const PAUSE: Duration = Duration::from_millis(10);
        for _ in 0..SOON.as_millis() / PAUSE.as_millis() {
            if let Some(ended) = self.child.try_wait().expect("a status") {
                return ended.code();
            }
            std::thread::sleep(PAUSE);
        }
        panic!("it goes on {SOON:?} after Ctrl-C");
    }

    /// Memory in use, KiB.
    pub fn memory(&self) -> u64 {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:"));
        line.and_then(|l| l.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
