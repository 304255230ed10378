//! One place where reading failed, and what the user probably meant.

mod lines;
mod signs;
mod values;

use matterix_ir::{Diagnostic, Span, codes};
use pest::Parser;

use super::{
    grammar::{Grammar, Rule},
    scan::{ITEM_WORDS, STEP_WORDS, first_word},
    words::{either, expected},
};

pub(super) use lines::meant_step;

/// The place with what stands around it.
pub(super) struct Spot<'a> {
    only: Rule,
    /// Where the form starts, where it fails, and where the failing token ends.
    start: usize,
    at: usize,
    end: usize,
    /// The form before the place, without trailing blanks.
    before: &'a str,
    /// The line from the place on.
    after: &'a str,
    /// The failing token; empty at the end of a line.
    token: &'a str,
    expected: &'a [Rule],
}

/// A mistake with a name of its own.
pub(super) struct Mistake {
    headline: String,
    label: String,
    /// From where to where it stands, where that is not the failing token.
    place: Option<(usize, usize)>,
    help: Option<String>,
    /// Title, range and text of a correction, and whether it leaves no doubt.
    fix: Option<(String, usize, usize, String, bool)>,
}

impl Mistake {
    fn new(headline: impl Into<String>, label: impl Into<String>) -> Self {
        Mistake { headline: headline.into(), label: label.into(), place: None, help: None, fix: None }
    }

    fn at(mut self, start: usize, end: usize) -> Self {
        self.place = Some((start, end));
        self
    }

    fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    fn fix(mut self, title: impl Into<String>, start: usize, end: usize, text: impl Into<String>) -> Self {
        self.fix = Some((title.into(), start, end, text.into(), true));
        self
    }

    fn guess(mut self, title: impl Into<String>, start: usize, end: usize, text: impl Into<String>) -> Self {
        self.fix = Some((title.into(), start, end, text.into(), false));
        self
    }
}

/// The longest line that is tried another way, bytes.
const MAX_LINE: usize = 400;

/// The rules of thumb, in the order in which they are tried.
const RULES: &[fn(&Spot) -> Option<Mistake>] = &[
    signs::lookalike,
    signs::control,
    signs::comment,
    signs::quotes,
    lines::misspelt_step,
    signs::negated,
    lines::lasting,
    signs::operator,
    signs::reaction_arrow,
    signs::equals,
    signs::assignment,
    lines::because,
    lines::braced_clauses,
    lines::of_a_capability,
    values::fractional_power,
    values::decimal_comma,
    values::bare_point,
    values::range,
    values::split_unit,
    values::instance,
    values::colon,
    values::lab_line,
    values::value_with_equals,
    lines::function_call,
    lines::reserved,
    lines::unknown_item,
    lines::unknown_line,
    lines::out_of_place,
    values::missing_comma,
    values::missing_of,
    lines::second_form,
    lines::missing_value,
];

impl<'a> Spot<'a> {
    /// The place `at` in the form that begins at `start`.
    pub(super) fn new(text: &'a str, only: Rule, start: usize, at: usize, expected: &'a [Rule]) -> Self {
        let rest = text.get(at..).unwrap_or_default();
        let line = rest.split('\n').next().unwrap_or_default();
        // Reading fails before the blanks of a place; the token comes after them.
        let blanks = line.len() - line.trim_start().len();
        let (at, line) = (at + blanks, line.trim_start());
        let before = text.get(start..at).unwrap_or_default().trim_end();
        let token = if line.starts_with("//") { "" } else { first_token(line) };
        let at = if token.is_empty() { start + before.len() } else { at };
        Spot { only, start, at, end: at + token.len(), before, after: line, token, expected }
    }

    /// The finding, in the user's words.
    pub(super) fn diagnose(&self, span: impl Fn(usize, usize) -> Span) -> Diagnostic {
        let mistake = RULES.iter().find_map(|rule| rule(self)).unwrap_or_else(|| self.unexpected());
        let (from, to) = mistake.place.unwrap_or((self.at, self.end));
        let place = span(from, to);
        let mut diagnostic = Diagnostic::error(codes::SYNTAX, place, mistake.headline, mistake.label);
        if let Some(help) = mistake.help {
            diagnostic = diagnostic.help(help);
        }
        match mistake.fix {
            Some((title, start, end, text, true)) => diagnostic.fix(title, span(start, end), text),
            Some((title, start, end, text, false)) => diagnostic.guess(title, span(start, end), text),
            None => diagnostic,
        }
    }

    fn unexpected(&self) -> Mistake {
        let words = self.words();
        let found = if self.token.is_empty() { "the end of the line".to_owned() } else { format!("`{}`", self.token) };
        let label = match last_word(self.before) {
            "" => format!("{} is expected here", either(&words)),
            last => format!("{} is expected after `{last}`", either(&words)),
        };
        if words.is_empty() {
            return Mistake::new(format!("{found} is not expected here"), "the line is correct up to here");
        }
        Mistake::new(format!("expected {}, found {found}", either(&words)), label)
    }

    /// The first word of the form.
    fn form(&self) -> &'a str {
        first_word(self.before)
    }

    /// What is expected, in words.
    fn words(&self) -> Vec<&'static str> {
        let mut words = expected(self.expected);
        // The options of a call are never missed.
        if self.only == Rule::only_stmt && !RESERVED.contains(&self.form()) {
            words.retain(|word| *word != "`{`");
        }
        words
    }

    fn expects(&self, word: &str) -> bool {
        self.words().contains(&word)
    }

    /// Whether the failing token stands right behind what is before it.
    fn is_tight(&self) -> bool {
        self.start + self.before.len() == self.at
    }

    /// Whether a line in place of this one can be read as a form; a block that it opens goes on below.
    fn reads(&self, line: &str) -> bool {
        let code = line.split("//").next().unwrap_or_default().trim_end();
        // The end of the line may close the block around it.
        let (opened, ended) = (code.matches('{').count(), code.matches('}').count());
        let code = (opened..ended).fold(code, |code, _| code.trim_end().strip_suffix('}').unwrap_or(code));
        let closed = if code.ends_with('{') { " }" } else { "" };
        code.len() <= MAX_LINE && Grammar::parse(self.only, &format!("{code}{closed}")).is_ok()
    }

    fn is_at_start(&self) -> bool {
        self.before.is_empty()
    }
}

/// The token at the start of a line: a word with its digits, a text, a run of signs or one character.
fn first_token(line: &str) -> &str {
    const SIGNS: &[&str] = &[
        "==", "!=", "<=", ">=", "<->", "<-", "->", "-->", "=>", "+-", "+=", "-=", "..", "&&", "||", "::", ":=", "<>",
        "++",
    ];
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let Some(first) = line.chars().next() else { return "" };
    let len = if word(first) {
        line.find(|c: char| !word(c)).unwrap_or(line.len())
    } else if first == '"' {
        line[1..].find('"').map_or(line.len(), |at| at + 2)
    } else {
        SIGNS.iter().filter(|sign| line.starts_with(**sign)).map(|sign| sign.len()).max().unwrap_or(first.len_utf8())
    };
    &line[..len]
}

/// The last token of a text.
fn last_word(text: &str) -> &str {
    if let Some(inner) = text.strip_suffix('"') {
        return text.get(inner.rfind('"').unwrap_or(inner.len())..).unwrap_or_default();
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let start = text.trim_end_matches(is_word).len();
    match text.get(start..).unwrap_or_default() {
        "" => text.char_indices().next_back().map_or("", |(at, _)| &text[at..]),
        word => word,
    }
}

fn is_word(text: &str) -> bool {
    !text.is_empty() && first_word(text) == text
}

/// Words that cannot be names.
const RESERVED: &[&str] = &[
    "let", "wait", "sequence", "parallel", "start", "await", "repeat", "for", "if", "else", "while", "retry", "try",
    "finally", "hold", "holding", "keep", "within", "expect", "expects", "record", "note", "ask", "asks", "step",
    "claim", "fail", "fails", "return", "and", "or", "not", "is", "of", "timeout", "after", "needs", "presumes",
    "effect", "takes", "every", "sends", "until", "to", "from", "into", "onto", "on", "in", "with", "by", "at",
    "using", "through", "as", "max",
];
