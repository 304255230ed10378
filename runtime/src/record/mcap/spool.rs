//! Messages brought into order of time in bounded memory: what is too much to be held is sorted in runs, which are written to files
//! without a name and merged at the end.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use mcap::McapResult;

/// Bytes that are held before they are written to a run.
const HELD: usize = 8 << 20;

/// A message that waits for its turn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Message {
    /// ns.
    pub(super) time: u64,
    pub(super) channel: u16,
    pub(super) data: Vec<u8>,
}

impl Message {
    /// What it takes in memory, bytes, more or less.
    fn size(&self) -> usize {
        size_of::<Message>() + self.data.len()
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(&self.time.to_le_bytes())?;
        out.write_all(&self.channel.to_le_bytes())?;
        out.write_all(&(self.data.len() as u64).to_le_bytes())?;
        out.write_all(&self.data)
    }

    /// The next one of a run; none at its end.
    fn read(from: &mut (impl Read + ?Sized)) -> io::Result<Option<Message>> {
        let mut time = [0; 8];
        match from.read_exact(&mut time) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
            read => read?,
        }
        let (mut channel, mut len) = ([0; 2], [0; 8]);
        from.read_exact(&mut channel)?;
        from.read_exact(&mut len)?;
        let mut data = vec![0; u64::from_le_bytes(len) as usize];
        from.read_exact(&mut data)?;
        Ok(Some(Message { time: u64::from_le_bytes(time), channel: u16::from_le_bytes(channel), data }))
    }
}

/// Messages in any order of time.
#[derive(Debug)]
pub(super) struct Spool {
    /// Where runs are written.
    folder: PathBuf,
    /// So many bytes are held.
    limit: usize,
    held: Vec<Message>,
    size: usize,
    runs: Vec<File>,
}

impl Spool {
    /// Without any yet. Runs are written into a folder.
    pub(super) fn new(folder: &Path) -> Self {
        Spool { folder: folder.to_owned(), limit: HELD, held: Vec::new(), size: 0, runs: Vec::new() }
    }

    /// Takes one more.
    pub(super) fn push(&mut self, message: Message) -> io::Result<()> {
        self.size += message.size();
        self.held.push(message);
        if self.size > self.limit { self.write_run() } else { Ok(()) }
    }

    fn write_run(&mut self) -> io::Result<()> {
        let path = self.folder.join(format!(".messages-{}", self.runs.len()));
        let file = OpenOptions::new().create_new(true).read(true).write(true).open(&path)?;
        // It is gone when it is closed, whatever comes between.
        fs::remove_file(&path)?;
        let mut out = BufWriter::new(file);
        self.held.sort_by_key(|m| m.time);
        for message in self.held.drain(..) {
            message.write(&mut out)?;
        }
        self.size = 0;
        let mut file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.seek(SeekFrom::Start(0))?;
        self.runs.push(file);
        Ok(())
    }

    /// Gives all in order of time, those of one instant in the order in which they were taken.
    pub(super) fn drain(mut self, mut each: impl FnMut(&Message) -> McapResult<()>) -> McapResult<()> {
        self.held.sort_by_key(|m| m.time);
        let mut runs: Vec<BufReader<File>> = self.runs.into_iter().map(BufReader::new).collect();
        let mut held = self.held.into_iter();
        let last = runs.len();
        let mut next = |run: usize| match runs.get_mut(run) {
            Some(file) => Message::read(file),
            None => Ok(held.next()),
        };
        // What a run has is of before what a later one has: of one instant the earlier run goes first.
        let mut heads: Vec<Option<Message>> = Vec::new();
        let mut turns = BinaryHeap::new();
        for run in 0..=last {
            let head = next(run)?;
            turns.extend(head.as_ref().map(|m| Reverse((m.time, run))));
            heads.push(head);
        }
        while let Some(Reverse((_, run))) = turns.pop() {
            let Some(head) = heads.get_mut(run) else { continue };
            if let Some(message) = head.take() {
                each(&message)?;
            }
            *head = next(run)?;
            turns.extend(head.as_ref().map(|m| Reverse((m.time, run))));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn drained(times: &[u64], limit: usize) -> Vec<Message> {
        let mut spool = Spool { limit, ..Spool::new(&std::env::temp_dir()) };
        for (i, time) in times.iter().enumerate() {
            let data = i.to_string().into_bytes();
            spool.push(Message { time: *time, channel: (i % 7) as u16, data }).expect("a file for a run");
        }
        let mut all = Vec::new();
        let take = |m: &Message| {
            all.push(m.clone());
            Ok(())
        };
        spool.drain(take).expect("runs are read");
        all
    }

    proptest! {
        #[test]
        fn runs_give_what_memory_alone_gives(times in prop::collection::vec(0..40_u64, 0..300), limit in 0..4000_usize) {
            let all = drained(&times, limit);
            prop_assert_eq!(&all, &drained(&times, usize::MAX));
            let mut order: Vec<(u64, usize)> = times.iter().copied().zip(0..).collect();
            order.sort();
            let found = all.iter().map(|m| (m.time, String::from_utf8_lossy(&m.data).parse().expect("its number")));
            prop_assert_eq!(found.collect::<Vec<_>>(), order);
        }
    }
}
