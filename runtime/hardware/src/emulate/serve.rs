//! An emulator at a pseudo-terminal or a port of this machine, in real time or a multiple of it.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpListener;
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::Emulator;

/// How often the twin moves on where nothing comes in.
pub(super) const TICK: Duration = Duration::from_millis(5);

/// When to end, and how fast lab time passes.
#[derive(Clone, Copy, Debug)]
pub struct Stop<'c> {
    /// Set from outside.
    pub cancel: &'c AtomicBool,
    /// Seconds of lab time per second.
    pub speed: f64,
}

pub(super) struct Clock {
    begun: Instant,
    speed: f64,
}

impl Clock {
    #[allow(clippy::disallowed_methods, reason = "an emulator answers by the wall clock")]
    pub(super) fn new(speed: f64) -> Self {
        Clock { begun: Instant::now(), speed }
    }

    pub(super) fn now(&self) -> f64 {
        self.begun.elapsed().as_secs_f64() * self.speed
    }
}

/// Serves a pseudo-terminal; `ready` is given its path. A link at `path` leads to it while it is served.
pub fn serve_pty(
    emulator: &mut Emulator<'_>,
    link: Option<&Path>,
    stop: Stop<'_>,
    ready: &mut dyn FnMut(&str),
) -> Result<(), String> {
    let failed = |e: io::Error| format!("cannot open a pseudo-terminal: {e}");
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).map_err(|e| failed(e.into()))?;
    grantpt(&master).map_err(|e| failed(e.into()))?;
    unlockpt(&master).map_err(|e| failed(e.into()))?;
    let name = ptsname(&master, Vec::new()).map_err(|e| failed(e.into()))?;
    let name = name.into_string().map_err(|_| "the pseudo-terminal has no readable name".to_owned())?;
    // Kept open, so that the line stays there when a master has gone.
    let slave = File::options().read(true).write(true).open(&name).map_err(failed)?;
    raw(&slave).map_err(failed)?;
    if let Some(link) = link {
        let _ = std::fs::remove_file(link);
        std::os::unix::fs::symlink(&name, link).map_err(|e| format!("cannot make `{}`: {e}", link.display()))?;
    }
    ready(link.and_then(Path::to_str).unwrap_or(&name));
    let mut file = File::from(master);
    let bytes = reader(file.try_clone().map_err(failed)?);
    let clock = Clock::new(stop.speed);
    while !stop.cancel.load(Ordering::Relaxed) {
        let came = match bytes.recv_timeout(TICK) {
            Ok(came) => came,
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) => Vec::new(),
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => break,
        };
        let out = turn(emulator, &clock, &came)?;
        file.write_all(&out).map_err(|e| format!("the pseudo-terminal is gone: {e}"))?;
    }
    if let Some(link) = link {
        let _ = std::fs::remove_file(link);
    }
    Ok(())
}

fn raw(slave: impl AsFd) -> io::Result<()> {
    let mut settings = tcgetattr(&slave)?;
    settings.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &settings)?;
    Ok(())
}

/// What comes in, read on a thread of its own.
fn reader(mut from: impl Read + Send + 'static) -> std::sync::mpsc::Receiver<Vec<u8>> {
    let (send, receive) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut buffer = [0; 1024];
        loop {
            match from.read(&mut buffer) {
                Ok(n) if n > 0 => {
                    if send.send(buffer[..n].to_vec()).is_err() {
                        return;
                    }
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                _ => return,
            }
        }
    });
    receive
}

/// Serves a port of this machine; `ready` is given its address. One master after the other.
pub fn serve_tcp(
    emulator: &mut Emulator<'_>,
    port: u16,
    stop: Stop<'_>,
    ready: &mut dyn FnMut(&str),
) -> Result<(), String> {
    let failed = |e: io::Error| format!("cannot listen at port {port}: {e}");
    let listener = TcpListener::bind(("127.0.0.1", port)).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    ready(&listener.local_addr().map_err(failed)?.to_string());
    let clock = Clock::new(stop.speed);
    while !stop.cancel.load(Ordering::Relaxed) {
        let mut stream = match listener.accept() {
            Ok((stream, _)) => stream,
            Err(e) if e.kind() == ErrorKind::WouldBlock => {
                std::thread::sleep(TICK);
                turn(emulator, &clock, &[])?;
                continue;
            }
            Err(e) => return Err(failed(e)),
        };
        stream.set_nonblocking(false).map_err(failed)?;
        stream.set_nodelay(true).map_err(failed)?;
        stream.set_read_timeout(Some(TICK)).map_err(failed)?;
        let mut buffer = [0; 1024];
        while !stop.cancel.load(Ordering::Relaxed) {
            let came = match stream.read(&mut buffer) {
                Ok(0) => break,
                Ok(n) => &buffer[..n],
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                    &[]
                }
                Err(_) => break,
            };
            let out = turn(emulator, &clock, came)?;
            if stream.write_all(&out).is_err() {
                break;
            }
        }
    }
    Ok(())
}

/// Lets time pass to now and answers.
pub(super) fn turn(emulator: &mut Emulator<'_>, clock: &Clock, came: &[u8]) -> Result<Vec<u8>, String> {
    emulator.pass(clock.now()).map_err(|f| f.message)?;
    let mut out = emulator.spoken();
    if !came.is_empty() {
        out.extend(emulator.receive(came).map_err(|f| f.message)?);
    }
    Ok(out)
}
