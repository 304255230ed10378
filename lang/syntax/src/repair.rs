//! Small changes of the text before it is parsed, and the way back to the user's offsets.

use matterix_ir::{FileId, Span};

/// A change: `remove` bytes at `at` give way to `insert`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Change {
    /// Offset in the user's text.
    pub(super) at: usize,
    /// Bytes that go.
    pub(super) remove: usize,
    /// Text that comes.
    pub(super) insert: &'static str,
}

/// Maps offsets of the parsed text to the user's text.
#[derive(Debug, Default)]
pub(super) struct Offsets {
    steps: Vec<Step>,
}

/// A place right after a change of the length.
#[derive(Debug)]
struct Step {
    /// In the parsed text.
    parsed: usize,
    /// In the user's text.
    user: usize,
    /// Bytes that were inserted before it.
    inserted: usize,
}

/// Applies changes that are sorted by place and do not overlap.
pub(super) fn apply(text: &str, changes: &[Change]) -> (String, Offsets) {
    let mut repaired = String::with_capacity(text.len() + changes.len());
    let mut offsets = Offsets::default();
    let mut done = 0;
    for change in changes {
        repaired.push_str(text.get(done..change.at).unwrap_or_default());
        repaired.push_str(change.insert);
        done = done.max(change.at + change.remove);
        if change.remove == change.insert.len() {
            continue;
        }
        offsets.steps.push(Step { parsed: repaired.len(), user: done, inserted: change.insert.len() });
    }
    repaired.push_str(text.get(done..).unwrap_or_default());
    (repaired, offsets)
}

impl Offsets {
    /// The user's offset of a parsed one; inside of something inserted, where that was put.
    pub(super) fn user(&self, parsed: usize) -> usize {
        let after = self.steps.partition_point(|step| step.parsed <= parsed);
        let next = self.steps.get(after);
        let plain = match after.checked_sub(1).and_then(|i| self.steps.get(i)) {
            Some(step) => step.user + (parsed - step.parsed),
            None => parsed,
        };
        match next {
            Some(next) if parsed + next.inserted > next.parsed => plain.min(next.user),
            _ => plain,
        }
    }

    /// A range of the parsed text as a span of the user's.
    pub(super) fn span(&self, file: FileId, start: usize, end: usize) -> Span {
        if self.steps.is_empty() {
            return Span::new(file, start, end);
        }
        let start = self.user(start);
        Span::new(file, start, self.user(end).max(start))
    }
}
