//! Source files prepared for showing: line starts, and a copy that is safe on a terminal.

use std::collections::BTreeMap;

use matterix_ir::hidden::is_obeyed;
use matterix_ir::{FileId, Sources, Span};
use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Longest line, in bytes, that is shown.
const LONGEST_LINE: usize = 400;

/// How many lines two excerpts may be apart and still be shown as one.
const GAP: usize = 2;

/// The files of one compilation, prepared when first needed.
pub(super) struct Texts<'a> {
    sources: &'a Sources,
    prepared: BTreeMap<FileId, Option<Text>>,
}

impl<'a> Texts<'a> {
    pub(super) fn new(sources: &'a Sources) -> Self {
        Texts { sources, prepared: BTreeMap::new() }
    }

    /// The file with this id, if there is one.
    pub(super) fn get(&mut self, file: FileId) -> Option<&Text> {
        let source = self.sources.get(file);
        self.prepared.entry(file).or_insert_with(|| source.map(|s| Text::new(&s.name, &s.text))).as_ref()
    }

    /// The text under a span as it stands in the file.
    pub(super) fn slice(&self, span: Span) -> &'a str {
        self.sources.slice(span)
    }
}

/// One file. A line end is added, so that there is a last line to point at even in an empty file; every character keeps
/// its number of bytes, so that positions stay true.
pub(super) struct Text {
    name: String,
    shown: String,
    starts: Vec<usize>,
}

impl Text {
    fn new(name: &str, text: &str) -> Self {
        let mut shown = String::with_capacity(text.len() + 1);
        let mut chars = text.chars().peekable();
        while let Some(c) = chars.next() {
            let ends_line = c == '\r' && chars.peek() == Some(&'\n');
            shown.push(if ends_line { c } else { harmless(c) });
        }
        shown.push('\n');
        let mut starts: Vec<usize> = std::iter::once(0).chain(shown.match_indices('\n').map(|(i, _)| i + 1)).collect();
        starts.pop();
        Text { name: harmless_line(name), shown, starts }
    }

    /// As shown in positions.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// How many lines there are.
    pub(super) fn lines(&self) -> usize {
        self.starts.len()
    }

    /// One-based line and column (in characters) of a byte.
    pub(super) fn position(&self, byte: usize) -> (usize, usize) {
        let byte = self.clamp(byte);
        let line = self.line_of(byte);
        (line + 1, self.shown[self.starts[line]..byte].chars().count() + 1)
    }

    /// One-based line and column in code units of UTF-16, as editors count.
    pub(super) fn position_utf16(&self, byte: usize) -> (usize, usize) {
        let byte = self.clamp(byte);
        let line = self.line_of(byte);
        (line + 1, self.shown[self.starts[line]..byte].chars().map(char::len_utf16).sum::<usize>() + 1)
    }

    /// The bytes to underline for a span: inside the file, on characters, and not over many lines.
    pub(super) fn underlined(&self, span: Span, most_lines: usize) -> (usize, usize) {
        let start = self.clamp(span.start as usize);
        let end = self.clamp(span.end as usize).max(start);
        let first = self.line_of(start);
        let last = self.line_of(end.saturating_sub(1).max(start));
        if last - first < most_lines {
            // An excerpt ends with the line before the byte at its end, so a place at the start of a line takes a byte in.
            let extra = usize::from(start == end && start > 0 && start == self.starts[first]);
            return (start, self.ceil(end + extra));
        }
        let line = self.shown[start..self.end_of(first)].trim_end();
        (start, start + line.len())
    }

    /// Whether the lines under a range of bytes are short enough to be shown.
    pub(super) fn showable(&self, start: usize, end: usize) -> bool {
        (self.line_of(start)..=self.line_of(end)).all(|line| self.is_short(line))
    }

    fn clamp(&self, byte: usize) -> usize {
        let mut byte = byte.min(self.shown.len() - 1);
        while !self.shown.is_char_boundary(byte) {
            byte -= 1;
        }
        byte
    }

    fn ceil(&self, mut byte: usize) -> usize {
        while !self.shown.is_char_boundary(byte) {
            byte += 1;
        }
        byte
    }

    fn line_of(&self, byte: usize) -> usize {
        self.starts.partition_point(|s| *s <= byte).saturating_sub(1)
    }

    /// One past the line end of a line.
    fn end_of(&self, line: usize) -> usize {
        self.starts.get(line + 1).copied().unwrap_or(self.shown.len())
    }

    fn is_short(&self, line: usize) -> bool {
        self.end_of(line) - self.starts[line] <= LONGEST_LINE
    }

    /// Whether a line is worth showing around another.
    fn is_context(&self, line: usize) -> bool {
        self.is_short(line) && !self.shown[self.starts[line]..self.end_of(line)].trim().is_empty()
    }

    fn contents(
        &self,
        start: usize,
        end: usize,
        line: usize,
        column: usize,
        count: usize,
    ) -> Box<dyn SpanContents<'_> + '_> {
        let span = SourceSpan::from((start, end - start));
        let data = &self.shown.as_bytes()[start..end];
        Box::new(MietteSpanContents::new_named(self.name.clone(), data, span, line, column, count))
    }
}

impl SourceCode for Text {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let (start, end) = (span.offset(), span.offset() + span.len());
        if end > self.shown.len() {
            return Err(MietteError::OutOfBounds);
        }
        let mut first = self.line_of(start);
        let mut last = self.line_of(end.saturating_sub(1).max(start));
        if before == 0 && after == 0 {
            let column = self.shown[self.starts[first]..start].chars().count();
            return Ok(self.contents(start, end, first, column, last - first + 1));
        }
        if !(first..=last).all(|line| self.is_short(line)) {
            return Err(MietteError::OutOfBounds);
        }
        for _ in 0..before {
            first -= usize::from(first > 0 && self.is_context(first - 1));
        }
        for _ in 0..after {
            last += usize::from(last + 1 < self.starts.len() && self.is_context(last + 1));
        }
        Ok(self.contents(self.starts[first], self.end_of(last), first, 0, last - first + 1 + GAP))
    }
}

/// The character itself, or one of as many bytes where a terminal would obey it instead of showing it.
fn harmless(c: char) -> char {
    match c {
        '\n' | '\t' => c,
        '\u{61c}' => '·',
        c if is_obeyed(c) && c.len_utf8() == 3 => char::REPLACEMENT_CHARACTER,
        c if c.is_control() && c.len_utf8() == 1 => '?',
        c if c.is_control() => '·',
        c => c,
    }
}

/// `text` on one line, with nothing in it that a terminal obeys.
pub(super) fn harmless_line(text: &str) -> String {
    text.chars().map(|c| if c == '\n' || c == '\t' { ' ' } else { harmless(c) }).collect()
}
