//! A disk that keeps what was synced, and of the rest what it likes.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;

use matterix_hardware::deploy::Paper;
use matterix_soundness::random::Random;

/// One write.
#[derive(Clone, Debug)]
enum Write {
    Append(Vec<u8>),
    Head(Vec<u8>),
}

#[derive(Debug)]
struct Inner {
    /// What outlives a loss of power.
    kept: Vec<u8>,
    /// What has not been synced yet.
    open: Vec<Write>,
    /// Bytes that still fit.
    room: usize,
    /// Nothing reaches it any more: the process is dead.
    dead: bool,
}

/// A file on the disk.
#[derive(Clone, Debug)]
pub struct Disk(Rc<RefCell<Inner>>);

impl Disk {
    /// An empty file, with room for so many bytes.
    pub fn with_room(room: usize) -> Disk {
        Disk(Rc::new(RefCell::new(Inner { kept: Vec::new(), open: Vec::new(), room, dead: false })))
    }

    /// The process that writes is killed: what it has written stays.
    pub fn kill(&self) {
        self.0.borrow_mut().dead = true;
    }

    /// The power fails: of what was not synced, some writes are lost, and one may be torn.
    pub fn power_fails(&self, random: &mut Random) {
        let mut inner = self.0.borrow_mut();
        inner.dead = true;
        let open = std::mem::take(&mut inner.open);
        let whole = random.below(open.len() + 1);
        let mut left: Vec<Write> = open[..whole].to_vec();
        if let (Some(Write::Append(bytes)), true) = (open.get(whole), random.chance(50)) {
            left.push(Write::Append(bytes[..random.below(bytes.len() + 1)].to_vec()));
        }
        // A head may have come to the disk before the line that it speaks of.
        if let Some(head) = open[whole..].iter().find(|w| matches!(w, Write::Head(_))).filter(|_| random.chance(20)) {
            left.push(head.clone());
        }
        left.iter().for_each(|write| apply(&mut inner.kept, write));
    }

    /// What the next process finds.
    pub fn bytes(&self) -> Vec<u8> {
        let inner = self.0.borrow();
        let mut bytes = inner.kept.clone();
        inner.open.iter().for_each(|write| apply(&mut bytes, write));
        bytes
    }

    /// The file for the next process, cut to so many bytes.
    pub fn reopened(&self, whole: usize) -> Disk {
        let mut kept = self.bytes();
        kept.truncate(whole);
        Disk(Rc::new(RefCell::new(Inner { kept, open: Vec::new(), room: self.0.borrow().room, dead: false })))
    }
}

fn apply(bytes: &mut Vec<u8>, write: &Write) {
    match write {
        Write::Append(more) => bytes.extend(more),
        Write::Head(head) => {
            let n = head.len().min(bytes.len());
            bytes[..n].copy_from_slice(&head[..n]);
        }
    }
}

impl Paper for Disk {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut inner = self.0.borrow_mut();
        if inner.dead {
            return Ok(());
        }
        if inner.room < bytes.len() {
            let part = bytes[..inner.room].to_vec();
            inner.room = 0;
            inner.open.push(Write::Append(part));
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        inner.room -= bytes.len();
        inner.open.push(Write::Append(bytes.to_vec()));
        Ok(())
    }

    fn head(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut inner = self.0.borrow_mut();
        if !inner.dead {
            inner.open.push(Write::Head(bytes.to_vec()));
        }
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut inner = self.0.borrow_mut();
        if !inner.dead {
            let open = std::mem::take(&mut inner.open);
            open.iter().for_each(|write| apply(&mut inner.kept, write));
        }
        Ok(())
    }
}
