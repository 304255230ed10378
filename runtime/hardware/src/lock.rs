//! One process at a time at a port: each holds a lock on a file named after the port, in which it says who it is. The lock goes with the
//! process, however that ends.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use rustix::fs::{FlockOperation, flock};

use crate::deploy::sha256;
use crate::place::Place;

/// A port that no other process opens, for as long as this is kept.
#[derive(Debug)]
pub struct Hold(#[expect(dead_code, reason = "they are kept for their locks")] Vec<Arc<File>>);

/// What this process holds: two lines of it may share a port.
static HELD: Mutex<BTreeMap<PathBuf, Weak<File>>> = Mutex::new(BTreeMap::new());

/// Longest text that says who has a port, bytes.
const LONGEST: u64 = 1000;

/// Takes a port; an error of the kind `ResourceBusy` that names who has it.
pub fn take(place: &Place) -> io::Result<Hold> {
    let folder = folder()?;
    let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
    let files = canonical(place).into_iter().map(|name| take_one(&name, &folder, &mut held));
    let mut files = files.collect::<io::Result<Vec<_>>>()?;
    // Who clears `/tmp` of what is old passes over a folder that is locked. Who does so at this moment leaves what is new.
    let kept = File::open(&folder)?;
    if flock(&kept, FlockOperation::NonBlockingLockShared).is_ok() {
        files.push(Arc::new(kept));
    }
    Ok(Hold(files))
}

fn take_one(name: &str, folder: &Path, held: &mut BTreeMap<PathBuf, Weak<File>>) -> io::Result<Arc<File>> {
    let path = folder.join(format!("{}.lock", &sha256(name.as_bytes())[..24]));
    if let Some(file) = held.get(&path).and_then(Weak::upgrade) {
        return Ok(file);
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
    Ok(file)
}

fn busy(file: &mut File) -> io::Error {
    let mut who = String::new();
    let read = file.take(LONGEST).read_to_string(&mut who);
    let who = who.trim();
    let who = if read.is_err() || who.is_empty() { "another process" } else { who };
    io::Error::new(ErrorKind::ResourceBusy, format!("{who} uses it"))
}

/// The same texts for the same port, however it is written: one for each address that a name stands for.
fn canonical(place: &Place) -> BTreeSet<String> {
    let names: Vec<String> = match place {
        Place::Serial(path) => {
            let path = std::fs::canonicalize(path).unwrap_or_else(|_| PathBuf::from(path));
            vec![format!("serial {}", path.display())]
        }
        Place::Tcp(_) | Place::Http(_) | Place::Sila(_) => {
            let at = place.to_string();
            let all: Vec<SocketAddr> = at.to_socket_addrs().map(Iterator::collect).unwrap_or_default();
            match all.is_empty() {
                true => vec![format!("network {at}")],
                false => all.into_iter().map(|one| format!("network {}", plain(one))).collect(),
            }
        }
    };
    names.into_iter().collect()
}

/// An address as IPv4 where it stands for one; this machine as `127.0.0.1`, however it is called.
fn plain(at: SocketAddr) -> SocketAddr {
    let ip = at.ip().to_canonical();
    let is_here = ip.is_unspecified() || ip == IpAddr::V6(Ipv6Addr::LOCALHOST);
    SocketAddr::new(if is_here { Ipv4Addr::LOCALHOST.into() } else { ip }, at.port())
}

/// The user's own folder for locks: one place, whatever the environment says, as two processes may have different ones.
fn folder() -> io::Result<PathBuf> {
    let own = rustix::process::getuid().as_raw();
    let path = PathBuf::from(format!("/tmp/matterixc-{own}"));
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
    Err(io::Error::other(format!("`{}` must be a folder of this user, because it holds the locks", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_one_however_it_is_written() {
        let own = canonical(&Place::Tcp("127.0.0.1:9".into()));
        for at in ["localhost:9", "0.0.0.0:9", "[::ffff:127.0.0.1]:9", "[::1]:9", "[::]:9"] {
            assert!(!canonical(&Place::Tcp(at.into())).is_disjoint(&own), "{at}");
        }
        for at in ["127.0.0.1:10", "127.0.0.2:9", "10.0.0.1:9"] {
            assert!(canonical(&Place::Tcp(at.into())).is_disjoint(&own), "{at}");
        }
        assert_eq!(canonical(&Place::Serial("/dev/../dev/null".into())), canonical(&Place::Serial("/dev/null".into())));
    }

    #[test]
    fn locks_are_in_one_place_whatever_the_environment_says() {
        let own = rustix::process::getuid().as_raw();
        assert_eq!(folder().expect("a folder"), PathBuf::from(format!("/tmp/matterixc-{own}")));
    }

    #[test]
    fn this_process_may_take_a_port_twice() {
        let place = Place::Serial("/dev/matterixc-test-of-locks".into());
        let first = take(&place).expect("it is free");
        let second = take(&place).expect("it is this process's own");
        drop((first, second));
    }
}
