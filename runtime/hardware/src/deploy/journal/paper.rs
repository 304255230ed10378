//! What a journal is written on.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, OFlags, flock};

use super::chain::Chain;

/// Something that is added to at its end, and whose head can be written over.
pub trait Paper {
    /// Adds bytes at the end.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Writes over the first bytes.
    fn head(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Comes back when all of it outlives the machine's power. Fails where nobody will find it.
    fn sync(&mut self) -> io::Result<()>;
}

/// A file that one process has to itself. Whoever else writes to it or puts another in its place is found out before the next line.
#[derive(Debug)]
pub struct Sheet {
    end: File,
    head: File,
    path: PathBuf,
    /// Bytes that are in it, as far as this process knows.
    length: u64,
}

/// Why a file cannot be had.
#[derive(Debug)]
pub enum Taken {
    /// Another process has it.
    Locked,
    /// What the system says.
    Io(io::Error),
}

impl From<io::Error> for Taken {
    fn from(error: io::Error) -> Self {
        Taken::Io(error)
    }
}

impl Sheet {
    /// A new file, which its user alone may read and write.
    pub fn create(path: &Path) -> Result<Sheet, Taken> {
        Sheet::over(OpenOptions::new().append(true).create_new(true).mode(0o600).open(path)?, path)
    }

    /// One that is there.
    pub fn open(path: &Path) -> Result<Sheet, Taken> {
        if !std::fs::metadata(path)?.is_file() {
            return Err(not_a_file().into());
        }
        // What has become a pipe meanwhile would wait for somebody at its other end.
        let no_wait = i32::try_from(OFlags::NONBLOCK.bits()).unwrap_or_default();
        Sheet::over(OpenOptions::new().append(true).custom_flags(no_wait).open(path)?, path)
    }

    fn over(end: File, path: &Path) -> Result<Sheet, Taken> {
        let about = end.metadata()?;
        if !about.is_file() {
            return Err(not_a_file().into());
        }
        lock(&end)?;
        let head = OpenOptions::new().read(true).write(true).open(path)?;
        Ok(Sheet { head, end, path: path.to_owned(), length: about.len() })
    }

    /// What its head says, where it has one.
    pub fn told(&self) -> Option<Chain> {
        let head = &mut vec![0; Chain::default().head().len()];
        self.head.read_exact_at(head, 0).ok().and_then(|()| Chain::of_head(head))
    }

    /// That it is still what stands at its path, and as this process has left it.
    fn is_own(&self) -> io::Result<()> {
        let own = self.end.metadata()?;
        let there = std::fs::metadata(&self.path).ok();
        if there.is_none_or(|there| (there.dev(), there.ino()) != (own.dev(), own.ino())) {
            return Err(io::Error::new(ErrorKind::NotFound, "it was removed, moved or replaced"));
        }
        if own.len() != self.length {
            let why = format!("another program wrote to it: it has {} bytes, not {}", own.len(), self.length);
            return Err(io::Error::other(why));
        }
        Ok(())
    }

    /// Says in the head of a journal, if it has one, that nobody goes on from there.
    pub fn shut(&mut self) {
        if let Some(chain) = self.told() {
            // A file that cannot be written over cannot be gone on with either.
            let _ = self.head(Chain { is_shut: true, ..chain }.head().as_bytes()).and_then(|()| self.sync());
        }
    }

    /// Cuts off all but the first bytes.
    pub fn cut(&mut self, length: u64) -> io::Result<()> {
        self.end.set_len(length)?;
        self.length = length;
        Ok(())
    }
}

fn not_a_file() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "it is not a regular file")
}

/// One process at a time, for as long as the file is open.
pub(super) fn lock(file: &File) -> Result<(), Taken> {
    flock(file, FlockOperation::NonBlockingLockExclusive).map_err(|e| match io::Error::from(e) {
        e if e.kind() == ErrorKind::WouldBlock => Taken::Locked,
        e => Taken::Io(e),
    })
}

impl Paper for Sheet {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.is_own()?;
        let written = self.end.write_all(bytes);
        self.length = match &written {
            Ok(()) => self.length + bytes.len() as u64,
            // A part of it may have had room.
            Err(_) => self.end.metadata()?.len(),
        };
        written
    }

    fn head(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.head.write_all_at(bytes, 0)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.is_own()?;
        self.end.sync_data()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("matterixc-sheet-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        path
    }

    #[test]
    fn a_file_that_somebody_else_writes_to_is_found_out_before_the_next_line() {
        type Deed = fn(&Path) -> io::Result<()>;
        let cut: Deed = |path| std::fs::write(path, "");
        let added: Deed = |path| OpenOptions::new().append(true).open(path)?.write_all(b"x");
        let removed: Deed = |path| std::fs::remove_file(path);
        let replaced: Deed = |path| {
            let text = std::fs::read(path)?;
            std::fs::remove_file(path)?;
            std::fs::write(path, text)
        };
        let cases = [("cut", cut), ("added", added), ("removed", removed), ("replaced", replaced)];
        for (name, deed) in cases {
            let path = path(name);
            let mut sheet = Sheet::create(&path).expect("a file");
            sheet.append(b"one\n").and_then(|()| sheet.append(b"two\n")).expect("it is its own");
            // Who holds a lock cannot keep others from writing.
            deed(&path).expect("done");
            assert!(sheet.append(b"three\n").is_err() && sheet.sync().is_err(), "{name}");
            let _ = std::fs::remove_file(&path);
        }
    }

    #[test]
    fn what_is_no_regular_file_is_refused_at_once() {
        let path = path("pipe");
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        rustix::fs::mknodat(rustix::fs::CWD, &path, rustix::fs::FileType::Fifo, mode, 0).expect("a pipe");
        for there in [path.as_path(), Path::new("/dev/null"), Path::new("/tmp")] {
            assert!(matches!(Sheet::open(there), Err(Taken::Io(_))), "{}", there.display());
        }
        let _ = std::fs::remove_file(&path);
    }
}
