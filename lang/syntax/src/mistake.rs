//! What is wrong with a line that could not be read: it is read alone, to find where it fails.

use matterix_ir::{Diagnostic, FileId, codes};
use pest::{
    Parser,
    error::{ErrorVariant, InputLocation},
};

use super::{
    MISSING_VALUE,
    cursor::Node,
    grammar::{Grammar, Rule},
    repair::Offsets,
    spot::Spot,
};

/// More are only counted.
const MAX_MISTAKES: usize = 200;

/// The longest piece of text that is read once more.
const MAX_PIECE: usize = 4000;

/// The longest form with a block that is read once more for what follows it.
const MAX_BLOCK: usize = 400;

/// Collects the mistakes of one file.
pub(super) struct Mistakes<'a> {
    file: FileId,
    text: &'a str,
    offsets: &'a Offsets,
    found: Vec<Diagnostic>,
    hidden: usize,
}

/// Where a reading fails, and what would have fitted.
struct Failure {
    at: usize,
    expected: Vec<Rule>,
}

impl<'a> Mistakes<'a> {
    pub(super) fn new(file: FileId, text: &'a str, offsets: &'a Offsets) -> Self {
        Mistakes { file, text, offsets, found: Vec::new(), hidden: 0 }
    }

    pub(super) fn push(&mut self, diagnostic: Diagnostic) {
        if self.found.len() < MAX_MISTAKES {
            self.found.push(diagnostic);
        } else {
            self.hidden += 1;
        }
    }

    pub(super) fn finish(self) -> (Vec<Diagnostic>, usize) {
        (self.found, self.hidden)
    }

    pub(super) fn no_header(&mut self) {
        let first = self.text.trim_start_matches('\u{feff}');
        let start = self.text.len() - first.len();
        let end = start + first.find('\n').unwrap_or(first.len());
        let span = self.offsets.span(self.file, start, end);
        let at = self.offsets.span(self.file, start, start);
        let diagnostic = Diagnostic::error(
            codes::SYNTAX,
            span,
            "the file does not start with `mtx 1`",
            "the version of the language belongs here",
        );
        let diagnostic = match super::scan::first_word(first) {
            "mtx" => diagnostic.help("write `mtx 1` alone on the first line"),
            _ => diagnostic.fix("add the version", at, "mtx 1\n"),
        };
        self.push(diagnostic);
    }

    /// A form that starts at `start` was read, but not to the end of its line.
    pub(super) fn rest(&mut self, only: Rule, start: usize, rest: &Node) {
        let span = rest.as_span();
        let read = self.text.get(start..span.start()).unwrap_or_default();
        // Reading a large block again at every level around it would cost much, for little.
        let block = read.len() > MAX_BLOCK && read.trim_end().ends_with('}');
        let mut failure = self.reread(only, if block { span.start() } else { start }, span.end());
        if block || failure.at < span.start() {
            failure = Failure { at: span.start(), expected: vec![Rule::end] };
        }
        self.explain(only, start, &failure);
    }

    /// A line that is no form; `before` is where the one before starts, which it may be meant to go on with.
    pub(super) fn line(&mut self, only: Rule, before: Option<usize>, node: &Node) {
        let (start, end) = (node.as_span().start(), node.as_span().end());
        let head = node.as_str().find('{').map_or(end, |brace| start + brace + 1);
        let own = self.reread(only, start, head);
        if let Some(before) = before.filter(|_| goes_on(node.as_str())) {
            let joined = self.reread(only, before, head);
            if joined.at > own.at.max(start) {
                return self.explain(only, before, &joined);
            }
        }
        self.explain(only, start, &own);
    }

    /// A range of the text that should be one form and is not.
    pub(super) fn piece(&mut self, only: Rule, start: usize, end: usize) {
        let failure = self.reread(only, start, end);
        self.explain(only, start, &failure);
    }

    fn reread(&self, only: Rule, start: usize, end: usize) -> Failure {
        let nowhere = Failure { at: start, expected: Vec::new() };
        if end - start > MAX_PIECE || self.found.len() >= MAX_MISTAKES {
            return nowhere;
        }
        let piece = self.text.get(start..end).unwrap_or_default();
        let Err(error) = Grammar::parse(only, piece) else { return nowhere };
        let at = match error.location {
            InputLocation::Pos(at) | InputLocation::Span((at, _)) => start + at,
        };
        let expected = match error.variant {
            ErrorVariant::ParsingError { positives, .. } => positives,
            ErrorVariant::CustomError { .. } => Vec::new(),
        };
        Failure { at, expected }
    }

    fn explain(&mut self, only: Rule, start: usize, failure: &Failure) {
        if self.found.len() >= MAX_MISTAKES {
            self.hidden += 1;
            return;
        }
        // What is missing there has been said.
        if self
            .text
            .get(failure.at..)
            .is_some_and(|rest| rest.trim_start_matches([' ', '\t']).starts_with(MISSING_VALUE))
        {
            return;
        }
        let spot = Spot::new(self.text, only, start, failure.at, &failure.expected);
        let diagnostic = spot.diagnose(|start, end| self.offsets.span(self.file, start, end));
        self.push(diagnostic);
    }
}

/// Whether a line begins with what nothing may begin with.
fn goes_on(line: &str) -> bool {
    const WORDS: &[&str] = &[
        "and", "or", "is", "in", "of", "to", "from", "into", "onto", "on", "with", "by", "at", "using", "through",
        "as", "timeout", "holding", "else", "finally", "max", "times", "every", "after", "for", "labelled", "expects",
        "asks", "noise", "while",
    ];
    line.starts_with(|c: char| c.is_ascii_punctuation() && !matches!(c, '(' | '[' | '{' | '"' | '_' | '#'))
        || WORDS.contains(&super::scan::first_word(line))
}
