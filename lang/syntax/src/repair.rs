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
#[derive(Clone, Debug, Default)]
pub(super) struct Offsets {
    steps: Vec<Step>,
    /// Where the text that was changed was not the user's either.
    below: Option<Box<Offsets>>,
}

/// A place right after a change of the length.
#[derive(Clone, Debug)]
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
    /// Those of a text that stands behind so many bytes which are not the user's.
    pub(super) fn behind(inserted: usize) -> Offsets {
        Offsets { steps: vec![Step { parsed: inserted, user: 0, inserted }], below: None }
    }

    /// The user's offset of a parsed one; inside of something inserted, where that was put.
    pub(super) fn user(&self, parsed: usize) -> usize {
        let after = self.steps.partition_point(|step| step.parsed <= parsed);
        let next = self.steps.get(after);
        let below = |at| self.below.as_ref().map_or(at, |below| below.user(at));
        let plain = match after.checked_sub(1).and_then(|i| self.steps.get(i)) {
            Some(step) => step.user + (parsed - step.parsed),
            None => parsed,
        };
        match next {
            Some(next) if parsed + next.inserted > next.parsed => below(plain.min(next.user)),
            _ => below(plain),
        }
    }

    /// Whether nothing was changed in a range of the parsed text.
    pub(super) fn is_even(&self, start: usize, end: usize) -> bool {
        self.below.is_none()
            && !self.steps.iter().any(|s| start < s.parsed && s.parsed.saturating_sub(s.inserted) <= end)
    }

    /// The same for the parsed text from a place on.
    pub(super) fn from(&self, start: usize) -> Offsets {
        let first = Step { parsed: 0, user: self.user(start), inserted: 0 };
        let later = self.steps.iter().filter(|s| s.parsed > start);
        let later = later.map(|s| Step { parsed: s.parsed - start, user: s.user, inserted: s.inserted });
        Offsets { steps: std::iter::once(first).chain(later).collect(), below: self.below.clone() }
    }

    /// The same where the text that was changed is itself a changed one.
    pub(super) fn over(self, below: Offsets) -> Offsets {
        Offsets { below: Some(Box::new(below)), ..self }
    }

    /// A range of the parsed text as a span of the user's.
    pub(super) fn span(&self, file: FileId, start: usize, end: usize) -> Span {
        if self.steps.is_empty() && self.below.is_none() {
            return Span::new(file, start, end);
        }
        let start = self.user(start);
        Span::new(file, start, self.user(end).max(start))
    }
}
