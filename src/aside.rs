//! Output that holds nobody up: a thread of its own writes it as far as somebody reads. What nobody reads for long is left out, the
//! oldest first, so that the last question and the verdict are the last to go.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// So many bytes wait at most.
const MOST: usize = 1 << 20;

/// What waits to be written to one stream.
#[derive(Debug)]
pub struct Aside {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Debug)]
struct Waiting {
    texts: VecDeque<Vec<u8>>,
    bytes: usize,
    left_out: u64,
    /// A text has been taken and is not written yet.
    is_writing: bool,
}

impl Aside {
    /// Nothing waits.
    pub const fn new() -> Self {
        let waiting = Waiting { texts: VecDeque::new(), bytes: 0, left_out: 0, is_writing: false };
        Aside { waiting: Mutex::new(waiting), changed: Condvar::new() }
    }

    /// Leaves a text to be written, and comes back at once.
    pub fn put(&self, text: &[u8]) {
        let mut waiting = self.waiting();
        waiting.bytes += text.len();
        waiting.texts.push_back(text.to_vec());
        while waiting.bytes > MOST && waiting.texts.len() > 1 {
            let Some(oldest) = waiting.texts.pop_front() else { break };
            waiting.bytes -= oldest.len();
            waiting.left_out += lines(&oldest);
        }
        drop(waiting);
        self.changed.notify_all();
    }

    /// Writes what is left here, without end.
    pub fn serve(&self, write: impl Fn(&[u8])) -> ! {
        loop {
            let mut waiting = self.waiting();
            let text = loop {
                if let Some(text) = waiting.texts.pop_front() {
                    waiting.bytes -= text.len();
                    waiting.is_writing = true;
                    break text;
                }
                waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
            };
            drop(waiting);
            write(&text);
            self.waiting().is_writing = false;
            self.changed.notify_all();
        }
    }

    /// Waits at most so long until all is written; lines that were left out since this was last asked, or still wait.
    pub fn drained(&self, within: Duration) -> u64 {
        let is_open = |waiting: &mut Waiting| waiting.is_writing || !waiting.texts.is_empty();
        let waited = self.changed.wait_timeout_while(self.waiting(), within, is_open);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut waiting.left_out) + waiting.texts.iter().map(|text| lines(text)).sum::<u64>()
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lines that a text is or begins.
fn lines(text: &[u8]) -> u64 {
    text.split_inclusive(|byte| *byte == b'\n').count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_reads_is_left_out_from_the_oldest_on() {
        let aside = Aside::new();
        let line = [&[b'x'; 1023][..], b"\n"].concat();
        (0..1030).for_each(|_| aside.put(&line));
        assert_eq!(aside.waiting().left_out, 6);
        aside.put(b"the end\n");
        assert_eq!(aside.waiting().texts.back().map(Vec::as_slice), Some(&b"the end\n"[..]));
        assert_eq!(aside.drained(Duration::from_millis(1)), 1031);
    }

    #[test]
    fn what_is_read_is_written_in_its_order() {
        static ASIDE: Aside = Aside::new();
        let (sender, written) = std::sync::mpsc::channel();
        std::thread::spawn(move || ASIDE.serve(|text| drop(sender.send(text.to_vec()))));
        (0..100u8).for_each(|n| ASIDE.put(&[n, b'\n']));
        assert_eq!(ASIDE.drained(Duration::from_secs(10)), 0);
        assert!(written.try_iter().map(|text| text[0]).eq(0..100));
    }
}
