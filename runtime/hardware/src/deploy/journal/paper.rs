//! What a journal is written on.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::{FlockOperation, flock};

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

/// A file that one process has to itself.
#[derive(Debug)]
pub struct Sheet {
    end: File,
    head: File,
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
        let end = OpenOptions::new().append(true).create_new(true).mode(0o600).open(path)?;
        lock(&end)?;
        Ok(Sheet { head: OpenOptions::new().read(true).write(true).open(path)?, end })
    }

    /// One that is there.
    pub fn open(path: &Path) -> Result<Sheet, Taken> {
        let end = OpenOptions::new().append(true).open(path)?;
        lock(&end)?;
        Ok(Sheet { head: OpenOptions::new().read(true).write(true).open(path)?, end })
    }

    /// Says in the head of a journal, if it has one, that nobody goes on from there.
    pub fn shut(&mut self) {
        let head = &mut vec![0; Chain::default().head().len()];
        let told = self.head.read_exact_at(head, 0).ok().and_then(|()| Chain::of_head(head));
        if let Some(chain) = told {
            // A file that cannot be written over cannot be gone on with either.
            let _ = self.head(Chain { is_shut: true, ..chain }.head().as_bytes()).and_then(|()| self.sync());
        }
    }

    /// Cuts off all but the first bytes.
    pub fn cut(&mut self, length: u64) -> io::Result<()> {
        self.end.set_len(length)
    }
}

/// One process at a time, for as long as the file is open.
fn lock(file: &File) -> Result<(), Taken> {
    flock(file, FlockOperation::NonBlockingLockExclusive).map_err(|e| match io::Error::from(e) {
        e if e.kind() == ErrorKind::WouldBlock => Taken::Locked,
        e => Taken::Io(e),
    })
}

impl Paper for Sheet {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.end.write_all(bytes)
    }

    fn head(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.head.write_all_at(bytes, 0)
    }

    fn sync(&mut self) -> io::Result<()> {
        if self.end.metadata()?.nlink() == 0 {
            return Err(io::Error::new(ErrorKind::NotFound, "it was removed"));
        }
        self.end.sync_data()
    }
}
