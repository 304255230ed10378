//! A long workflow is read in pieces, some statements each: pieces that are as they were before need not be read again, and
//! two processors share the others. What comes of it is what reading it whole gives; where a piece has a mistake, it is read
//! whole, so that mistakes are found in one way only.

use std::collections::BTreeMap;
use std::ops::Range;

use matterix_ir::FileId;

use crate::ast::{Block, ItemKind, Stmt};
use crate::parts::{Known, Part, once};
use crate::relocate::{Relocate, shifted};
use crate::repair::{self, Change, Offsets};
use crate::scan::{self, Scan, closer, first_word};
use crate::{SHALLOW, is_name};

/// Bytes of a piece, at least.
const LEAST: usize = 1000;

/// From so many bytes on, two processors read.
const SHARED: usize = 6000;

/// Statements that a piece may begin with, beside calls: words that never go on with the statement of the line above. A `for`
/// may, but what it goes on with is no statement without it.
const BEGINNINGS: &[&str] = &[
    "let", "wait", "step", "if", "repeat", "for", "within", "hold", "keep", "try", "retry", "claim", "sequence",
    "parallel", "start", "await", "fail", "expect", "record", "note", "ask", "return",
];

/// Statements in a row: where they stand in the text of their item, and which of its statements they are.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    text: Range<usize>,
    stmts: Range<usize>,
}

/// What holds statements.
struct Body {
    /// The shortest beginning of an item of its kind.
    begin: &'static str,
    open: usize,
    close: usize,
}

/// The item that a text holds, if it is long and without mistakes; pieces that stand in `before` too are taken from there.
pub(super) fn read(text: &str, known: Known, before: &BTreeMap<(bool, String), Part>) -> Option<Part> {
    if text.len() < 2 * LEAST {
        return None;
    }
    let scan = scan::scan(text);
    if scan::depth(&scan).0 >= SHALLOW {
        return None;
    }
    let body = body(text, &scan)?;
    let ranges = ranges(text, &scan, &body, LEAST);
    whole(text, known, &body, &ranges, before)
}

/// An item of which the statements in some ranges are read apart.
fn whole(
    text: &str,
    known: Known,
    body: &Body,
    ranges: &[Range<usize>],
    before: &BTreeMap<(bool, String), Part>,
) -> Option<Part> {
    let around = Change { at: body.open + 1, remove: body.close - body.open - 1, insert: "" };
    let (hollow, offsets) = repair::apply(text, &[around]);
    let mut part = once(FileId(0), &hollow, &offsets, known);
    if !part.is_right() {
        return None;
    }
    let earlier = earlier(before, body.begin);
    let kept: Vec<Option<(&[Stmt], usize)>> =
        ranges.iter().map(|range| earlier.get(text.get(range.clone())?).copied()).collect();
    let open: Vec<&str> =
        ranges.iter().zip(&kept).filter(|(_, k)| k.is_none()).filter_map(|(r, _)| text.get(r.clone())).collect();
    let mut fresh = shared(&open, |piece| statements(piece, body.begin, known)).into_iter();
    let mut stmts: Vec<Stmt> = Vec::new();
    for (range, kept) in ranges.iter().zip(kept) {
        let (mut own, from) = match kept {
            Some((stmts, from)) => (stmts.to_vec(), from),
            None => (fresh.next()??, 0),
        };
        own.moved(&shifted(FileId(0), range.start as i64 - from as i64));
        part.pieces.push(Piece { text: range.clone(), stmts: stmts.len()..stmts.len() + own.len() });
        stmts.extend(own);
    }
    block(&mut part)?.stmts = stmts;
    Some(part)
}

/// The statements of a piece, counted from its beginning; none where there is a mistake.
fn statements(piece: &str, begin: &str, known: Known) -> Option<Vec<Stmt>> {
    let text = format!("{begin}{piece}}}");
    let mut part = once(FileId(0), &text, &Offsets::behind(begin.len()), known);
    if !part.is_right() {
        return None;
    }
    block(&mut part).map(|block| std::mem::take(&mut block.stmts))
}

/// The statements' block of the one item that a part holds.
fn block(part: &mut Part) -> Option<&mut Block> {
    match part.items.as_mut_slice() {
        [item] => match &mut item.kind {
            ItemKind::Workflow { body, .. } | ItemKind::Test { body, .. } => Some(body),
            _ => None,
        },
        _ => None,
    }
}

/// Pieces that were read before, by their text: their statements, and what these count from.
fn earlier<'p>(before: &'p BTreeMap<(bool, String), Part>, begin: &str) -> BTreeMap<&'p str, (&'p [Stmt], usize)> {
    let mut out = BTreeMap::new();
    for ((_, text), part) in before {
        let stmts = match part.items.as_slice() {
            [item] => match &item.kind {
                ItemKind::Workflow { body, .. } if begin == WORKFLOW => &body.stmts,
                ItemKind::Test { body, .. } if begin == TEST => &body.stmts,
                _ => continue,
            },
            _ => continue,
        };
        for piece in &part.pieces {
            if let (Some(text), Some(own)) = (text.get(piece.text.clone()), stmts.get(piece.stmts.clone())) {
                out.insert(text, (own, piece.text.start));
            }
        }
    }
    out
}

const WORKFLOW: &str = "workflow w in w {";
const TEST: &str = "test w in w {";

/// The outermost block of a workflow or a test.
fn body(text: &str, scan: &Scan) -> Option<Body> {
    let head = scan.lines.iter().find(|line| !line.is_blank())?;
    let begin = match first_word(head.code(text)) {
        "workflow" => WORKFLOW,
        "test" => TEST,
        _ => return None,
    };
    let mut depth = 0usize;
    let mut open = None;
    for bracket in &scan.brackets {
        match closer(bracket.byte) {
            Some(_) => {
                if depth == 0 && bracket.byte == b'{' {
                    open = open.or(Some(bracket.at));
                }
                depth += 1;
            }
            None => {
                depth = depth.checked_sub(1)?;
                if let (0, Some(open)) = (depth, open) {
                    return (bracket.byte == b'}').then_some(Body { begin, open, close: bracket.at });
                }
            }
        }
    }
    None
}

/// The text between the brackets of a body in ranges of at least so many bytes, each but the first at the start of a line.
fn ranges(text: &str, scan: &Scan, body: &Body, least: usize) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let mut start = body.open + 1;
    let mut brackets = scan.brackets.iter().peekable();
    let mut depth = 0usize;
    for (i, line) in scan.lines.iter().enumerate() {
        let inside = line.start > body.open && line.first < body.close;
        if inside && depth == 1 && line.start >= start + least && begins(line.code(text)) {
            out.push(start..line.start);
            start = line.start;
        }
        while let Some(bracket) = brackets.next_if(|bracket| bracket.line <= i) {
            depth = if closer(bracket.byte).is_some() { depth + 1 } else { depth.saturating_sub(1) };
        }
    }
    out.push(start..body.close);
    out
}

/// Whether a line begins a statement, whatever stands above it.
fn begins(code: &str) -> bool {
    let word = first_word(code);
    let apart = code.get(word.len()..).is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', '\t']));
    apart && (BEGINNINGS.contains(&word) || is_name(word))
}

/// What comes of each text, by two processors where it is much.
fn shared<T: Send>(texts: &[&str], read: impl Fn(&str) -> T + Sync) -> Vec<T> {
    let all: usize = texts.iter().map(|text| text.len()).sum();
    let each = |texts: &[&str]| texts.iter().map(|text| read(text)).collect::<Vec<T>>();
    if all < SHARED {
        return each(texts);
    }
    let mut read_by_now = 0;
    let first_half = |text: &&&str| {
        read_by_now += text.len();
        read_by_now <= all / 2
    };
    let middle = texts.iter().take_while(first_half).count();
    let (first, rest) = texts.split_at(middle);
    std::thread::scope(|scope| {
        let other = std::thread::Builder::new().spawn_scoped(scope, || each(rest));
        let mut done = each(first);
        done.extend(other.ok().and_then(|other| other.join().ok()).unwrap_or_else(|| each(rest)));
        done
    })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::*;
    use crate::parts::cuts;
    use crate::{Memo, parse_again};

    fn files(folder: &Path, out: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path()) {
            match entry.is_dir() {
                true => files(&entry, out),
                false => out.extend(entry.extension().is_some_and(|end| end == "mtx").then_some(entry)),
            }
        }
    }

    fn items(text: &str) -> Vec<&str> {
        let cuts = cuts(text, &scan::scan(text));
        let ends = cuts.iter().skip(1).copied().chain([text.len()]);
        cuts.iter().zip(ends).map(|(start, end)| &text[*start..end]).collect()
    }

    #[test]
    fn pieces_make_the_same_tree_as_the_whole() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut all = Vec::new();
        for folder in ["examples", "tests/spec", "tests/cases"] {
            files(&root.join(folder), &mut all);
        }
        let known = Some(Some(1));
        let (mut compared, mut cut) = (0, 0);
        for file in all {
            let text = fs::read_to_string(&file).unwrap();
            for item in items(&text) {
                let scan = scan::scan(item);
                let Some(body) = body(item, &scan) else { continue };
                let ranges = ranges(item, &scan, &body, 1);
                let whole_at_once = once(FileId(0), item, &Offsets::default(), known);
                let in_pieces = whole(item, known, &body, &ranges, &BTreeMap::new());
                if !whole_at_once.found.is_empty() {
                    continue;
                }
                let Some(in_pieces) = in_pieces else { panic!("{}: not read in pieces:\n{item}", file.display()) };
                assert_eq!(in_pieces.items, whole_at_once.items, "{}", file.display());
                compared += 1;
                cut += ranges.len();
            }
        }
        assert!(compared > 40 && cut > 3 * compared, "{compared} items in {cut} pieces");
    }

    #[test]
    fn what_was_read_before_is_taken_from_there() {
        let line = |i: usize| format!("    wait {i} s\n    expect elapsed > {i} s // µ\n");
        let lines = |n: usize| (0..n).map(line).collect::<String>();
        let text = |body: &str| format!("mtx 1\n\nworkflow w in l {{\n{body}}} on failure {{\n    note \"x\"\n}}\n");
        let mut memo = Memo::default();
        for body in
            [lines(300), lines(300) + &line(7), line(9) + &lines(300), lines(100) + "    wait 5 s 6 s\n" + &lines(200)]
        {
            let text = text(&body);
            let again = parse_again(FileId(3), &text, &mut memo);
            assert_eq!(again, parse_again(FileId(3), &text, &mut Memo::default()));
        }
    }
}
