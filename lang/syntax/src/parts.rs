//! A file is read in parts, an item each, so that those that are as they were before need not be read again.

use std::collections::BTreeMap;

use matterix_ir::{Diagnostic, FileId, Span};
use pest::Parser;

use crate::ast::{File, Item};
use crate::grammar::{Grammar, Rule};
use crate::pieces::{self, Piece};
use crate::relocate::{Relocate, shifted};
use crate::repair::{self, Change, Offsets};
use crate::scan::{self, Scan};
use crate::{MISSING_VALUE, lower, missing_value, unreadable, with_stack};

/// The parts of a file as they were read the last time.
#[derive(Clone, Debug, Default)]
pub struct Memo {
    parts: BTreeMap<(bool, String), Part>,
}

/// What a part of a text says.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    version: Option<u32>,
    pub(super) items: Vec<Item>,
    pub(super) found: Vec<Diagnostic>,
    /// Mistakes that were not looked into.
    pub(super) hidden: usize,
    /// Which of its statements were read together.
    pub(super) pieces: Vec<Piece>,
}

impl Part {
    /// Whether it was read without a mistake.
    pub(super) fn is_right(&self) -> bool {
        self.found.is_empty() && self.hidden == 0
    }
}

/// The version of a file, for its parts behind the first.
pub(super) type Known = Option<Option<u32>>;

/// Reads a text whose brackets match; the last number counts mistakes that were not looked into. What was read is in the memo afterwards,
/// and nothing else.
pub(crate) fn read(
    file: FileId,
    text: &str,
    scan: &Scan,
    offsets: &Offsets,
    memo: &mut Memo,
) -> (File, Vec<Diagnostic>, usize) {
    let mut before = std::mem::take(&mut memo.parts);
    let mut whole = Part::default();
    let cuts = cuts(text, scan);
    for (i, start) in cuts.iter().copied().enumerate() {
        let end = cuts.get(i + 1).copied().unwrap_or(text.len());
        let own = text.get(start..end).unwrap_or_default();
        let known = (i > 0).then_some(whole.version);
        let part = match offsets.is_even(start, end) {
            true => {
                let key = (known.is_some_and(|version| version.is_none()), own.to_owned());
                // The first part, with the header, is read anew: it is short.
                let kept = if i > 0 { before.remove(&key).or_else(|| memo.parts.get(&key).cloned()) } else { None };
                let in_pieces = || pieces::read(own, known, &before);
                let in_one = || part(FileId(0), own, &Offsets::default(), known);
                let part = kept.or_else(in_pieces).unwrap_or_else(in_one);
                let mut moved = part.clone();
                memo.parts.insert(key, part);
                let to = shifted(file, offsets.user(start) as i64);
                moved.items.moved(&to);
                moved.found.moved(&to);
                moved
            }
            false => part(file, own, &offsets.from(start), known),
        };
        if i == 0 {
            whole.version = part.version;
        }
        whole.items.extend(part.items);
        whole.found.extend(part.found);
        whole.hidden += part.hidden;
    }
    let docs = lower::file_docs(text);
    (File { version: whole.version, docs, items: whole.items }, whole.found, whole.hidden)
}

/// Where parts begin: where an item does, with the comment above it, outside of all brackets.
pub(super) fn cuts(text: &str, scan: &Scan) -> Vec<usize> {
    let mut cuts = vec![0];
    let mut brackets = scan.brackets.iter().peekable();
    let mut open = 0usize;
    for (i, line) in scan.lines.iter().enumerate() {
        if i > 0 && open == 0 && line.starts_item(text) {
            let comment = |line: &&scan::Line| {
                line.is_blank() && text.get(line.first..).is_some_and(|rest| rest.starts_with("//"))
            };
            let above = scan.lines[..i].iter().rev().take_while(comment).last();
            let start = above.unwrap_or(line).start;
            if cuts.last().is_some_and(|last| *last < start) {
                cuts.push(start);
            }
        }
        while let Some(bracket) = brackets.next_if(|bracket| bracket.line <= i) {
            match scan::closer(bracket.byte) {
                Some(_) => open += 1,
                None => open = open.saturating_sub(1),
            }
        }
    }
    cuts
}

/// One part, and once more with marks for values that its lines lack where it has mistakes. `known` is the version of the file, behind its
/// first part.
fn part(file: FileId, text: &str, offsets: &Offsets, known: Known) -> Part {
    let scan = scan::scan(text);
    let (depth, _) = scan::depth(&scan);
    let part = with_stack(depth, || once(file, text, offsets, known));
    if part.found.is_empty() {
        return part;
    }
    let (mut holes, mut missing) = (Vec::new(), Vec::new());
    for (end, word) in scan::dangling(text, &scan) {
        let at = offsets.user(end);
        holes.push(Change { at: end, remove: 0, insert: MISSING_VALUE });
        missing.push(missing_value(Span::new(file, at, at), word));
    }
    if holes.is_empty() {
        return part;
    }
    let (marked, marks) = repair::apply(text, &holes);
    let marks = marks.over(offsets.clone());
    let mut part = with_stack(depth, || once(file, &marked, &marks, known));
    part.found.extend(missing);
    part
}

/// What the grammar makes of a text.
pub(super) fn once(file: FileId, text: &str, offsets: &Offsets, known: Known) -> Part {
    match Grammar::parse(Rule::file, text).ok().and_then(|mut pairs| pairs.next()) {
        Some(root) => {
            let (tree, found, hidden) = lower::Lower::new(file, text, offsets).run(root, known);
            Part { version: tree.version, items: tree.items, found, hidden, pieces: Vec::new() }
        }
        None => Part { found: vec![unreadable(offsets.span(file, 0, 0))], ..Part::default() },
    }
}
