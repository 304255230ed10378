//! What stands between two tokens: line ends and comments.

/// A comment with the line ends before it.
pub(super) struct Comment<'a> {
    /// Its text, without blanks at the end.
    pub(super) text: &'a str,
    /// Line ends before it; 0 where it stands after something on its line.
    pub(super) newlines: usize,
}

/// All between two tokens.
#[derive(Default)]
pub(super) struct Gap<'a> {
    pub(super) comments: Vec<Comment<'a>>,
    /// Line ends after the last comment.
    pub(super) newlines: usize,
}

impl<'a> Gap<'a> {
    /// Reads what stands between two tokens, which are blanks, line ends and comments.
    pub(super) fn of(text: &'a str) -> Self {
        let mut gap = Gap::default();
        let mut rest = text;
        while let Some(at) = rest.find(['\n', '/']) {
            if rest[at..].starts_with('\n') {
                gap.newlines += 1;
                rest = &rest[at + 1..];
                continue;
            }
            let end = rest[at..].find('\n').map_or(rest.len(), |len| at + len);
            gap.comments.push(Comment { text: rest[at..end].trim_end(), newlines: gap.newlines });
            gap.newlines = 0;
            rest = &rest[end..];
        }
        gap
    }

    /// Both, where nothing stays between them.
    pub(super) fn join(mut self, other: Gap<'a>) -> Self {
        let mut before = self.newlines;
        for comment in other.comments {
            self.comments.push(Comment { newlines: comment.newlines + before, ..comment });
            before = 0;
        }
        self.newlines = other.newlines + before;
        self
    }

    /// Whether the next token stands on another line.
    pub(super) fn breaks(&self) -> bool {
        self.newlines > 0 || !self.comments.is_empty()
    }

    /// Whether an empty line stands in it.
    pub(super) fn has_blank(&self) -> bool {
        self.newlines > 1 || self.comments.iter().any(|comment| comment.newlines > 1)
    }
}
