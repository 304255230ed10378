//! The text of `.mtx` files: to a syntax [tree](ast), and in its one style ([`fmt`]). Everything that knows the grammar's rules is in here.
//!
//! Brackets and texts that were left open are closed first (`scan`, `brackets`, `repair`), so that the grammar sees whole groups; its error
//! productions skip what is no form (`recovery.pest`), and the skipped line is read once more alone to find where it fails (`mistake`).

pub mod ast;
mod brackets;
pub mod classes;
mod cursor;
mod decode;
mod dump;
pub mod fmt;
mod grammar;
mod lower;
mod mistake;
mod parts;
mod pieces;
pub mod relocate;
mod repair;
mod scan;
mod spot;
mod tokens;
mod words;

use matterix_ir::{Diagnostic, FileId, Span, codes, hidden};
use pest::Parser;

pub use decode::{NotText, decode};
pub use dump::dump;
pub use parts::Memo;
pub use scan::STEP_WORDS;

use crate::ast::{Expr, ExprKind, File};
use grammar::{Grammar, Rule};
use repair::Offsets;

/// The deepest nesting of brackets.
pub const MAX_NESTING: usize = 256;

/// The largest file, in bytes.
pub const MAX_SIZE: usize = 2 << 20;

/// At most this many findings are shown, and how many more there are.
const MAX_SHOWN: usize = 100;

/// The tree of a file and what is wrong with its text. Total: what cannot be read becomes error nodes.
pub fn parse(file: FileId, text: &str) -> (File, Vec<Diagnostic>) {
    parse_again(file, text, &mut Memo::default())
}

/// The same of a file that may have been read before: what is as it was then is taken from the memo, which then knows this text.
pub fn parse_again(file: FileId, text: &str, memo: &mut Memo) -> (File, Vec<Diagnostic>) {
    if text.len() > MAX_SIZE {
        return (nothing(), vec![too_large(Span::new(file, 0, 0), text.len())]);
    }
    let unseen = hidden::characters(file, text);
    // What is an error anyway is read as blanks, so that it is one finding wherever it stands.
    let text = &hidden::blanked(text);
    let (changes, mut found) = brackets::balance(file, text, &scan::scan(text));
    found.extend(unseen);
    found.extend(reserved_character(file, text));
    if changes.len() > brackets::MAX_CHANGES {
        return (nothing(), shown(file, text, found, 0));
    }
    let (repaired, offsets) = repair::apply(text, &changes);
    let scan = scan::scan(&repaired);
    let (depth, deepest) = scan::depth(&scan);
    if depth >= MAX_NESTING {
        found.push(too_deep(offsets.span(file, deepest, deepest + 1)));
        return (nothing(), shown(file, text, found, 0));
    }
    let (tree, mistakes, hidden) = parts::read(file, &repaired, &scan, &offsets, memo);
    found.extend(mistakes);
    (tree, shown(file, text, found, hidden))
}

/// The value that stands alone in a text from `start` on, and what is wrong with it.
pub fn parse_value(file: FileId, text: &str, start: usize) -> (Expr, Vec<Diagnostic>) {
    let value = text.get(start..).unwrap_or_default();
    let (depth, _) = scan::depth(&scan::scan(value));
    let span = Span::new(file, start, text.len());
    if depth >= MAX_NESTING {
        return (Expr { kind: Box::new(ExprKind::Error), span }, vec![too_deep(span)]);
    }
    with_stack(depth, || lower::Lower::new(file, text, &Offsets::default()).value(start, text.len()))
}

/// What stands in brackets, with them, in the order of the closing ones; brackets that were left open stand for nothing.
pub fn groups(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut open: Vec<(u8, usize)> = Vec::new();
    let mut out = Vec::new();
    for bracket in scan::scan(text).brackets {
        match scan::closer(bracket.byte) {
            Some(closer) => open.push((closer, bracket.at)),
            None => {
                let Some(index) = open.iter().rposition(|(closer, _)| *closer == bracket.byte) else { continue };
                out.extend(open.get(index).map(|(_, start)| *start..bracket.at + 1));
                open.truncate(index);
            }
        }
    }
    out
}

/// Whether a word can be a name of the language.
pub fn is_name(word: &str) -> bool {
    Grammar::parse(Rule::ident, word).is_ok_and(|mut pairs| pairs.next().is_some_and(|p| p.as_str() == word))
}

/// Whether a word can be the name of an option: it reads as a value where it is used.
pub fn is_option(word: &str) -> bool {
    Grammar::parse(Rule::cond, word).is_ok_and(|mut pairs| pairs.next().is_some_and(|p| p.as_str() == word))
}

/// Where the line with the version ends; where there is none, at the start.
pub fn header_end(text: &str) -> usize {
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split("//").next().unwrap_or_default().trim_start_matches('\u{feff}').trim();
        if !code.is_empty() {
            return if scan::first_word(code) == "mtx" { at + line.trim_end().len() } else { 0 };
        }
        at += line.len();
    }
    0
}

/// Whether a short text is one step.
pub fn is_step(text: &str) -> bool {
    text.len() <= MAX_STEP && Grammar::parse(Rule::only_stmt, text).is_ok()
}

/// The longest text that is tried as a step, bytes.
const MAX_STEP: usize = 400;

/// Runs `inside` where the stack holds for that many nested brackets, also without optimisation.
fn with_stack<T: Send>(depth: usize, inside: impl Fn() -> T + Sync) -> T {
    if depth < SHALLOW {
        return inside();
    }
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(DEEP_STACK);
        let result = thread.spawn_scoped(scope, &inside).ok().and_then(|running| running.join().ok());
        result.unwrap_or_else(&inside)
    })
}

/// Fewer nested brackets than this fit on any stack.
const SHALLOW: usize = 16;

/// Bytes of stack for [`MAX_NESTING`] brackets.
const DEEP_STACK: usize = 256 << 20;

fn nothing() -> File {
    File { version: None, docs: Vec::new(), items: Vec::new() }
}

/// What stands for a missing value while reading.
const MISSING_VALUE: &str = "\u{1a}";

fn reserved_character(file: FileId, text: &str) -> Option<Diagnostic> {
    let at = text.find(MISSING_VALUE)?;
    let span = Span::new(file, at, at + MISSING_VALUE.len());
    Some(Diagnostic::error(codes::SYNTAX, span, "the file contains a control character (U+001A)", "here"))
}

fn unreadable(span: Span) -> Diagnostic {
    Diagnostic::error(codes::SYNTAX, span, "this file cannot be read", "it starts here")
}

fn missing_value(span: Span, word: &str) -> Diagnostic {
    let what = if word == "of" { "a species" } else { "a value" };
    Diagnostic::error(codes::SYNTAX, span, format!("{what} is missing after `{word}`"), "the line ends here")
        .help("to continue on the next line, indent it")
}

fn too_large(span: Span, size: usize) -> Diagnostic {
    let headline = format!("the file is too large ({:.1} MB)", size as f64 / 1e6);
    Diagnostic::error(codes::SYNTAX, span, headline, format!("the limit is {:.1} MB", MAX_SIZE as f64 / 1e6))
        .help("split it into modules and import them with `use`")
}

fn too_deep(span: Span) -> Diagnostic {
    let label = format!("more than {} brackets are open here", MAX_NESTING - 1);
    Diagnostic::error(codes::SYNTAX, span, "nested too deeply", label)
        .help("give the inner parts names with `let`, or move them into skills")
}

/// The findings in the order of the text, the first ones of very many.
fn shown(file: FileId, text: &str, mut found: Vec<Diagnostic>, unseen: usize) -> Vec<Diagnostic> {
    found.sort_by_key(|diagnostic| diagnostic.span().start);
    let more = unseen + found.len().saturating_sub(MAX_SHOWN);
    if more > 0 {
        found.truncate(MAX_SHOWN);
        let end = Span::new(file, text.len(), text.len());
        let headline = format!("{more} more syntax errors are not shown");
        found.push(Diagnostic::error(codes::SYNTAX, end, headline, "the file ends here"));
    }
    found
}
