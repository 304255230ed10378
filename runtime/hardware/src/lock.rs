//! One process at a time at a port: each holds a lock on a file named after the port, in which it says who it is. The lock goes with the
//! process, however that ends.

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::net::ToSocketAddrs;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use rustix::fs::{FlockOperation, flock};

use crate::deploy::sha256;
use crate::place::Place;

/// A port that no other process opens, for as long as this is kept.
#[derive(Debug)]
pub struct Hold(#[expect(dead_code, reason = "it is kept for its lock")] Arc<File>);

/// What this process holds: two lines of it may share a port.
static HELD: Mutex<BTreeMap<PathBuf, Weak<File>>> = Mutex::new(BTreeMap::new());

/// Longest text that says who has a port, bytes.
const LONGEST: u64 = 1000;

/// Takes a port; an error of the kind `ResourceBusy` that names who has it.
pub fn take(place: &Place) -> io::Result<Hold> {
    let path = folder()?.join(format!("{}.lock", &sha256(canonical(place).as_bytes())[..24]));
    let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(file) = held.get(&path).and_then(Weak::upgrade) {
        return Ok(Hold(file));
    }
    let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).mode(0o600).open(&path)?;
    if let Err(e) = flock(&file, FlockOperation::NonBlockingLockExclusive) {
        let e = io::Error::from(e);
        return Err(match e.kind() {
            ErrorKind::WouldBlock => busy(&mut file),
            _ => e,
        });
    }
    let who = std::env::args().take(4).collect::<Vec<_>>().join(" ");
    file.set_len(0)?;
    writeln!(file, "process {} (`{}`)", std::process::id(), who.escape_debug())?;
    let file = Arc::new(file);
    held.insert(path, Arc::downgrade(&file));
    Ok(Hold(file))
}

fn busy(file: &mut File) -> io::Error {
    let mut who = String::new();
    let read = file.take(LONGEST).read_to_string(&mut who);
    let who = who.trim();
    let who = if read.is_err() || who.is_empty() { "another process" } else { who };
    io::Error::new(ErrorKind::ResourceBusy, format!("{who} is using it"))
}

/// The same text for the same port, however it is written.
fn canonical(place: &Place) -> String {
    match place {
        Place::Serial(path) => {
            let path = std::fs::canonicalize(path).unwrap_or_else(|_| PathBuf::from(path));
            format!("serial {}", path.display())
        }
        Place::Tcp(_) | Place::Http(_) | Place::Sila(_) => {
            let at = place.to_string();
            let first = at.to_socket_addrs().ok().and_then(|mut all| all.next());
            format!("network {}", first.map_or_else(|| at.clone(), |a| a.to_string()))
        }
    }
}

/// The user's own folder for locks, which lasts as long as the machine is on.
fn folder() -> io::Result<PathBuf> {
    let own = rustix::process::getuid().as_raw();
    let runtime =
        std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|dir| dir.is_absolute() && dir.is_dir());
    let path =
        runtime.map_or_else(|| std::env::temp_dir().join(format!("matterixc-{own}")), |dir| dir.join("matterixc"));
    match DirBuilder::new().mode(0o700).create(&path) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(e),
        _ => {}
    }
    is_own(&path, own)?;
    Ok(path)
}

/// Nobody else can put files or links there.
fn is_own(path: &Path, user: u32) -> io::Result<()> {
    let about = std::fs::symlink_metadata(path)?;
    if about.is_dir() && about.uid() == user && about.mode() & 0o022 == 0 {
        return Ok(());
    }
    Err(io::Error::other(format!("`{}` is not a folder of this user's own, and locks belong there", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_one_however_it_is_written() {
        let [a, b] = ["127.0.0.1:9", "localhost:9"].map(|at| canonical(&Place::Tcp(at.into())));
        assert!(a == b || b.contains("::1"), "{a} {b}");
        assert_eq!(canonical(&Place::Serial("/dev/../dev/null".into())), canonical(&Place::Serial("/dev/null".into())));
    }

    #[test]
    fn this_process_may_take_a_port_twice() {
        let place = Place::Serial("/dev/matterixc-test-of-locks".into());
        let first = take(&place).expect("it is free");
        let second = take(&place).expect("it is this process's own");
        drop((first, second));
    }
}
