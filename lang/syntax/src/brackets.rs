//! Closes what was left open and drops what closes nothing, so that the grammar sees whole groups.
//!
//! Where brackets do not match, an item at the left edge ends everything before it, and the indentation of a `}` says which block it was
//! meant for.

use matterix_ir::{Diagnostic, FileId, Span, codes};

use super::{
    repair::Change,
    scan::{Bracket, Line, OpenText, Scan, closer, first_word},
};

/// Beyond this many changes the text is not taken for a program.
pub(super) const MAX_CHANGES: usize = 1000;

/// The changes that close everything, sorted, and what they are about.
pub(super) fn balance(file: FileId, text: &str, scan: &Scan) -> (Vec<Change>, Vec<Diagnostic>) {
    let mut balance = Balance { file, text, scan, changes: Vec::new(), found: Vec::new(), open: Vec::new() };
    balance.texts();
    if !matches(&scan.brackets) {
        for region in regions(text, scan) {
            balance.region(region);
        }
    }
    balance.changes.sort_by_key(|change| change.at);
    (balance.changes, balance.found)
}

/// Whether every bracket has its counterpart.
fn matches(brackets: &[Bracket]) -> bool {
    let mut open = Vec::new();
    for bracket in brackets {
        match closer(bracket.byte) {
            Some(closer) => open.push(closer),
            None if open.pop() == Some(bracket.byte) => {}
            None => return false,
        }
    }
    open.is_empty()
}

/// An item with the lines up to the next one.
struct Region<'a> {
    first_line: usize,
    last_line: usize,
    brackets: &'a [Bracket],
}

fn regions<'a>(text: &str, scan: &'a Scan) -> Vec<Region<'a>> {
    let mut starts: Vec<usize> = (0..scan.lines.len()).filter(|i| scan.lines[*i].starts_item(text)).collect();
    if starts.first() != Some(&0) {
        starts.insert(0, 0);
    }
    let mut regions = Vec::with_capacity(starts.len());
    let mut done = 0;
    for (i, first_line) in starts.iter().copied().enumerate() {
        let last_line = starts.get(i + 1).map_or(scan.lines.len(), |next| *next).saturating_sub(1);
        let count = scan.brackets[done..].partition_point(|b| b.line <= last_line);
        regions.push(Region { first_line, last_line, brackets: &scan.brackets[done..done + count] });
        done += count;
    }
    regions
}

struct Balance<'a> {
    file: FileId,
    text: &'a str,
    scan: &'a Scan,
    changes: Vec<Change>,
    found: Vec<Diagnostic>,
    /// Brackets that wait for their counterpart.
    open: Vec<Bracket>,
}

impl Balance<'_> {
    fn full(&self) -> bool {
        self.changes.len() > MAX_CHANGES
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span::new(self.file, start, end)
    }

    fn line(&self, bracket: &Bracket) -> Line {
        self.scan.lines[bracket.line]
    }

    fn insert(&mut self, at: usize, text: &'static str) {
        self.changes.push(Change { at, remove: 0, insert: text });
    }

    fn texts(&mut self) {
        for open in &self.scan.open_texts {
            if self.full() {
                return;
            }
            self.insert(open.end, "\"");
            match open.inside {
                Some(b')') => self.insert(open.end, ")"),
                Some(_) => self.insert(open.end, "]"),
                None => {}
            }
            let span = self.span(open.at, open.end);
            self.found.push(
                Diagnostic::error(
                    codes::SYNTAX,
                    span,
                    "this text has no closing quote",
                    "a text must end on its own line, with `\"`",
                )
                .guess("close the text", self.span(open.end, open.end), "\""),
            );
        }
    }

    fn region(&mut self, region: Region) {
        if matches(region.brackets) || self.full() {
            return;
        }
        let count = |byte| region.brackets.iter().filter(|b| b.byte == byte).count();
        let (opened, closed) = (count(b'{'), count(b'}'));
        let mut missing = opened.saturating_sub(closed);
        let mut extra = closed.saturating_sub(opened);
        let mut line = region.first_line;
        for bracket in region.brackets {
            if self.full() {
                return;
            }
            while line < bracket.line {
                line += 1;
                self.newline(line);
            }
            match bracket.byte {
                b'(' | b'[' => self.open.push(*bracket),
                b'{' => {
                    self.close_groups(bracket.at);
                    self.open.push(*bracket);
                }
                b'}' => {
                    self.close_groups(bracket.at);
                    self.close_block(*bracket, &region, &mut missing, &mut extra);
                }
                _ => self.close_group(*bracket),
            }
        }
        while line < region.last_line {
            line += 1;
            self.newline(line);
        }
        self.end(&region);
    }

    /// A new line ends the round and square brackets that cannot go on over it.
    fn newline(&mut self, line: usize) {
        let Some(top) = self.open.last().filter(|b| b.byte != b'{') else { return };
        let here = self.scan.lines[line];
        if here.is_blank() {
            return;
        }
        let above = self.scan.lines[top.line..line].iter().rev().find(|l| !l.is_blank());
        let goes_on = above.is_none_or(|above| may_go_on(above.code(self.text), here.code(self.text)));
        if !goes_on {
            self.close_groups(here.first);
        }
    }

    /// Closes the round and square brackets on top, at the end of what stands before `at`.
    fn close_groups(&mut self, at: usize) {
        while !self.full()
            && let Some(top) = self.open.pop_if(|b| b.byte != b'{')
        {
            self.unclosed_group(top, at);
        }
    }

    fn unclosed_group(&mut self, top: Bracket, at: usize) {
        let line = self.line(&top);
        // What a text without its quote has swallowed is mended with the text.
        let swallowed = |t: &OpenText| t.inside.is_some() && (top.at..line.end).contains(&t.at);
        if self.scan.open_texts.iter().any(swallowed) {
            return;
        }
        let end = self.within_phrase(top, self.code_before(at).max(top.at + 1));
        let (opener, insert) = if top.byte == b'(' { ("(", ")") } else { ("[", "]") };
        self.insert(end, insert);
        let span = self.span(top.at, top.at + 1);
        self.found.push(
            Diagnostic::error(
                codes::SYNTAX,
                span,
                format!("`{opener}` is not closed"),
                format!("`{insert}` is missing for this"),
            )
            .guess(format!("add `{insert}`"), self.span(end, end), insert),
        );
    }

    /// Where a round bracket that must close before `end` is best closed: before a word that begins a phrase of its own, and in a tuple
    /// of numbers before their common unit.
    fn within_phrase(&self, top: Bracket, end: usize) -> usize {
        let inside = self.text.get(top.at + 1..end).unwrap_or_default();
        if top.byte != b'(' || inside.contains(['(', '[', '{', '"', '\n', '/']) {
            return end;
        }
        let starts = inside.match_indices(' ').map(|(at, _)| at);
        let workflow = first_word(self.line(&top).code(self.text)) == "workflow";
        let begins = |word: &str| PHRASE_WORDS.contains(&word) || workflow && word == "in";
        let phrase = starts.filter(|at| begins(first_word(inside[*at..].trim_start()))).min();
        let inside = phrase.map_or(inside, |at| &inside[..at]).trim_end();
        let plain = |item: &str| item.trim().parse::<f64>().is_ok();
        let tuple = inside.rsplit_once(',').and_then(|(items, last)| {
            let number = last.trim_start().split(' ').next().filter(|number| plain(number))?;
            items.split(',').all(plain).then(|| inside.len() - last.trim_start().len() + number.len())
        });
        top.at + 1 + tuple.unwrap_or(inside.len())
    }

    /// The end of the last thing before `at` that is neither blank nor comment.
    fn code_before(&self, at: usize) -> usize {
        let line = self.scan.lines.partition_point(|l| l.start < at).saturating_sub(1);
        let own = self.scan.lines[line];
        if own.first < at && at <= own.end {
            return own.first + self.text.get(own.first..at).map_or(0, |t| t.trim_end().len());
        }
        let above = self.scan.lines[..line].iter().rev().take(LOOK_BACK).find(|l| !l.is_blank());
        if own.first < at && !own.is_blank() { own.end } else { above.map_or(at, |l| l.end) }
    }

    fn close_group(&mut self, bracket: Bracket) {
        let expected = self.open.last().and_then(|top| closer(top.byte));
        if expected == Some(bracket.byte) {
            self.open.pop();
            return;
        }
        let beneath = self.open.iter().rev().nth(1).and_then(|b| closer(b.byte));
        let span = self.span(bracket.at, bracket.at + 1);
        let found = char::from(bracket.byte);
        match (expected, self.open.last().copied()) {
            (Some(b')' | b']'), Some(_)) if beneath == Some(bracket.byte) => {
                // One closer is missing: the inner one.
                if let Some(inner) = self.open.pop() {
                    self.open.pop();
                    self.unclosed_group(inner, bracket.at);
                }
            }
            (Some(expected @ (b')' | b']')), Some(top)) => {
                self.open.pop();
                let insert = if expected == b')' { ")" } else { "]" };
                self.changes.push(Change { at: bracket.at, remove: 1, insert });
                self.found.push(
                    Diagnostic::error(
                        codes::SYNTAX,
                        span,
                        format!("`{found}` does not close `{}`", char::from(top.byte)),
                        format!("`{insert}` is expected"),
                    )
                    .because(self.span(top.at, top.at + 1), "opened here")
                    .guess(format!("write `{insert}`"), span, insert),
                );
            }
            _ => self.stray(bracket),
        }
    }

    fn stray(&mut self, bracket: Bracket) {
        let span = self.span(bracket.at, bracket.at + 1);
        self.changes.push(Change { at: bracket.at, remove: 1, insert: " " });
        let headline = format!("`{}` has no opening bracket", char::from(bracket.byte));
        self.found.push(Diagnostic::error(codes::SYNTAX, span, headline, "no open bracket before it").guess(
            "remove it",
            span,
            "",
        ));
    }

    fn close_block(&mut self, bracket: Bracket, region: &Region, missing: &mut usize, extra: &mut usize) {
        let line = self.line(&bracket);
        let leads = line.first == bracket.at;
        while let Some(top) = self.open.last().copied() {
            let indent = self.line(&top).indent();
            if leads && top.line != bracket.line && line.indent() < indent && *missing > 0 {
                *missing -= 1;
                self.open.pop();
                self.unclosed(top, line.first, Some(bracket.at));
                continue;
            }
            if leads && top.line != bracket.line && line.indent() > indent && *extra > 0 {
                *extra -= 1;
                self.unopened(bracket, top.line + 1, line.indent());
                return;
            }
            // A block that spans lines is not closed at the end of a line with something else on it.
            if !leads && top.line != bracket.line && *extra > 0 {
                *extra -= 1;
                return self.stray(bracket);
            }
            self.open.pop();
            return;
        }
        *extra = extra.saturating_sub(1);
        self.unopened(bracket, region.first_line, line.indent());
    }

    /// A `}` without a `{`: of the last block of this indentation whose head lacks one, or of nothing.
    fn unopened(&mut self, bracket: Bracket, from: usize, indent: usize) {
        let from = from.max(bracket.line.saturating_sub(LOOK_BACK));
        let lines = &self.scan.lines[from.min(bracket.line)..bracket.line];
        let head = lines.iter().rposition(|l| !l.is_blank() && l.indent() == indent);
        let Some(head) = head.map(|i| i + from).filter(|i| self.is_head(*i, bracket.line)) else {
            return self.stray(bracket);
        };
        // The clauses of a skill stand before its block.
        let clauses = self.scan.lines[head + 1..bracket.line]
            .iter()
            .take_while(|l| l.is_blank() || CLAUSE_WORDS.contains(&first_word(l.code(self.text))));
        let end = clauses.filter(|l| !l.is_blank()).last().map_or(self.scan.lines[head].end, |l| l.end);
        self.insert(end, " {");
        let what = title(self.scan.lines[head].code(self.text));
        let span = self.span(end, end);
        self.found.push(
            Diagnostic::error(codes::SYNTAX, span, format!("`{{` is missing after `{what}`"), "the block starts here")
                .because(self.span(bracket.at, bracket.at + 1), "the block ends here")
                .guess("add `{`", span, " {"),
        );
    }

    /// Whether the line could be the head of a block that ends on the line `end`.
    fn is_head(&self, line: usize, end: usize) -> bool {
        let code = self.scan.lines[line].code(self.text);
        let inner = self.scan.lines[line + 1..end].iter().find(|l| !l.is_blank());
        let indent = self.scan.lines[line].indent();
        BLOCK_WORDS.contains(&first_word(code))
            && !code.contains(['{', '}'])
            && inner.is_some_and(|l| l.indent() > indent)
    }

    /// Closes what is still open at the end of an item.
    fn end(&mut self, region: &Region) {
        let after = self.scan.lines.get(region.last_line).map_or(self.text.len(), |l| l.end.max(l.start));
        let last = self.scan.lines[..=region.last_line.min(self.scan.lines.len().saturating_sub(1))]
            .iter()
            .rev()
            .find(|l| !l.is_blank());
        let after = last.map_or(after, |l| l.end);
        while let Some(top) = self.open.pop().filter(|_| !self.full()) {
            if top.byte == b'{' {
                self.unclosed(top, after, None);
            } else {
                self.unclosed_group(top, after);
            }
        }
    }

    /// A block without its `}`; `before` is where it must have ended, `other` what closes an outer one.
    fn unclosed(&mut self, top: Bracket, before: usize, other: Option<usize>) {
        let end = if other.is_some() { self.code_before(before) } else { before };
        self.insert(end, "\n}");
        let what = title(self.line(&top).code(self.text));
        let span = self.span(top.at, top.at + 1);
        let headline = match what {
            "" => "this block is not closed".to_owned(),
            what => format!("the block of `{what}` is not closed"),
        };
        let mut diagnostic = Diagnostic::error(codes::SYNTAX, span, headline, "`}` is missing for this `{`");
        if let Some(other) = other {
            diagnostic =
                diagnostic.because(self.span(other, other + 1), "this `}` is further left: it closes an outer block");
        }
        self.found.push(diagnostic.guess("add `}`", self.span(end, end), "\n}"));
    }
}

/// How far back the head of a block is looked for.
const LOOK_BACK: usize = 400;

/// The words that start a block inside an item, and items with a body.
const BLOCK_WORDS: &[&str] = &[
    "step",
    "if",
    "repeat",
    "for",
    "within",
    "keep",
    "try",
    "claim",
    "sequence",
    "parallel",
    "start",
    "process",
    "event",
    "species",
    "solution",
    "reaction",
    "equilibrium",
    "interaction",
    "reactive_group",
    "material",
    "incompatible",
    "capability",
    "asset",
    "framing",
    "driver",
    "lab",
    "skill",
    "workflow",
    "study",
    "fit",
    "test",
    "on",
    "else",
    "finally",
    "between",
];

/// The words that begin a phrase behind a value in brackets.
const PHRASE_WORDS: &[&str] =
    &["holding", "labelled", "at", "on", "onto", "into", "from", "to", "by", "using", "through", "with"];

/// The words that start a clause.
const CLAUSE_WORDS: &[&str] = &[
    "needs", "presumes", "warns", "while", "fails", "effect", "takes", "until", "option", "says", "moves", "grips",
    "frees", "leads",
];

/// The head of a line: what stands before its bracket.
fn title(code: &str) -> &str {
    let head = code.split(['{', '(', ':']).next().unwrap_or(code).trim_start_matches(['}', ' ']).trim();
    let end = head.char_indices().nth(40).map_or(head.len(), |(at, _)| at);
    head[..end].trim_end()
}

/// Whether a newline between these two lines does not end what stands above.
fn may_go_on(above: &str, below: &str) -> bool {
    const INFIX: [char; 13] = ['(', '[', ',', '=', ':', '+', '-', '*', '/', '^', '<', '>', '.'];
    const WORDS: [&str; 16] =
        ["and", "or", "is", "in", "of", "not", "to", "from", "into", "onto", "on", "with", "by", "at", "using", "as"];
    let last = above.rsplit(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
    above.ends_with(INFIX)
        || WORDS.contains(&last)
        || below.starts_with([')', ']', ',', '+', '-', '*', '/', '^', '<', '>', '=', '!', '.'])
        || WORDS.contains(&first_word(below))
}
