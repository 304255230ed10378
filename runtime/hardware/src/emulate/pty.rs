//! An emulator at a pseudo-terminal.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::Emulator;
use super::serve::{Clock, Stop, TICK, turn};
use super::symlink::Symlink;

/// How long an answer waits for somebody to read it. After that it is lost, as on a line where nobody listens.
const UNREAD: Duration = Duration::from_secs(2);

/// Serves a pseudo-terminal; `ready` is given its path. A symbolic link at `path` leads to it while it is served.
pub fn serve_pty(
    emulator: &mut Emulator<'_>,
    link: Option<&Path>,
    stop: Stop<'_>,
    ready: &mut dyn FnMut(&str),
) -> Result<(), String> {
    let failed = |e: io::Error| format!("cannot open a pseudo-terminal: {e}");
    let (mut line, name, _slave) = Line::open().map_err(failed)?;
    let made = link.map(|link| Symlink::new(link, &name)).transpose()?;
    ready(made.as_ref().and_then(Symlink::name).unwrap_or(&name));
    let clock = Clock::new(stop.speed);
    while !stop.cancel.load(Ordering::Relaxed) {
        let came = line.next(TICK).map_err(|e| format!("the pseudo-terminal was lost: {e}"))?;
        let out = turn(emulator, &clock, &came)?;
        line.send(&out).map_err(|e| format!("the pseudo-terminal was lost: {e}"))?;
    }
    Ok(())
}

/// The emulator's end of a pseudo-terminal. Nothing on it blocks, so Ctrl-C is looked at while nobody reads.
struct Line {
    master: File,
    output: Vec<u8>,
    /// When somebody last read.
    since: Instant,
}

impl Line {
    /// A pseudo-terminal, the path of its other end, and that end: kept open, so that the line stays there when a master has gone.
    fn open() -> io::Result<(Self, String, File)> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let name = ptsname(&master, Vec::new())?;
        let name = name.into_string().map_err(|_| io::Error::other("the pseudo-terminal has no readable name"))?;
        let slave = File::options().read(true).write(true).open(&name)?;
        raw(&slave)?;
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        Ok((Line { master: File::from(master), output: Vec::new(), since: now() }, name, slave))
    }

    /// What has come in, waited for so long at most. While an answer is unread nothing more is taken.
    fn next(&mut self, patience: Duration) -> io::Result<Vec<u8>> {
        let wanted = if self.output.is_empty() { PollFlags::IN } else { PollFlags::OUT };
        let patience = Timespec::try_from(patience).map_err(io::Error::other)?;
        match poll(&mut [PollFd::from_borrowed_fd(self.master.as_fd(), wanted)], Some(&patience)) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(e) => return Err(e.into()),
        }
        self.flush()?;
        if !self.output.is_empty() {
            return Ok(Vec::new());
        }
        let mut buffer = [0; 1024];
        let n = not_now(self.master.read(&mut buffer))?;
        Ok(buffer[..n].to_vec())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.output.is_empty() {
            self.since = now();
        }
        self.output.extend_from_slice(bytes);
        self.flush()
    }

    fn flush(&mut self) -> io::Result<()> {
        while !self.output.is_empty() {
            match not_now(self.master.write(&self.output))? {
                0 => break,
                n => {
                    self.output.drain(..n);
                    self.since = now();
                }
            }
        }
        if now().saturating_duration_since(self.since) > UNREAD {
            self.output.clear();
        }
        Ok(())
    }
}

/// A read or write that must not block: 0 where nothing went.
fn not_now(attempt: io::Result<usize>) -> io::Result<usize> {
    match attempt {
        Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
        other => other,
    }
}

fn raw(slave: impl AsFd) -> io::Result<()> {
    let mut settings = tcgetattr(&slave)?;
    settings.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &settings)?;
    Ok(())
}

#[allow(clippy::disallowed_methods, reason = "an emulator answers by the wall clock")]
fn now() -> Instant {
    Instant::now()
}
