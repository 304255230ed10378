//! Writes the tokens of a file with blanks and line ends between them.

use super::gap::Gap;
use crate::tokens::{Begins, Kind, Token};

/// Blanks per level.
const STEP: usize = 4;

/// A body that is open.
struct Body {
    /// Whether it spans lines.
    multi: bool,
    /// The indentation of the line on which it was opened.
    indent: usize,
    /// The indentation of the forms around it, and of the form that holds it.
    outer: (usize, usize),
    /// Whether that form had clauses on their own lines.
    clauses: bool,
}

/// How the next token stands to the one before.
#[derive(Clone, Copy, PartialEq)]
enum Break {
    /// On the same line.
    No,
    /// On a new line with this indentation.
    Line(usize),
    /// The same, with an empty line where there was one.
    Free(usize),
    /// The same, with an empty line.
    Apart(usize),
}

struct Layout<'a> {
    text: &'a str,
    tokens: &'a [Token],
    /// For each `{`, whether its body spans lines; for each item, whether it does.
    multi: Vec<bool>,
    out: String,
    bodies: Vec<Body>,
    /// The indentation of forms.
    level: usize,
    /// The indentation of the form, clause or handler that is being written.
    base: usize,
    /// The indentation of the current line.
    line: usize,
    /// Brackets open in the form.
    groups: usize,
    /// The form has clauses on their own lines.
    clauses: bool,
    /// A separator stands before what comes next.
    separator: bool,
}

/// The tokens of `text` in the one style.
pub(super) fn layout(text: &str, tokens: &[Token]) -> String {
    let mut layout = Layout {
        text,
        tokens,
        multi: spans(text, tokens),
        out: String::with_capacity(text.len()),
        bodies: Vec::new(),
        level: 0,
        base: 0,
        line: 0,
        groups: 0,
        clauses: false,
        separator: false,
    };
    let mut gap = Gap::default();
    let mut end = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    let mut last = None;
    for (index, token) in tokens.iter().enumerate() {
        gap = gap.join(Gap::of(text.get(end..token.start).unwrap_or_default()));
        end = token.end;
        let trailing =
            token.kind == Kind::Comma && tokens.get(index + 1).is_some_and(|next| next.kind == Kind::CloseGroup);
        if token.kind == Kind::Separator {
            layout.separator = true;
        } else if !trailing {
            layout.token(last, index, std::mem::take(&mut gap));
            last = Some(index);
        }
    }
    gap = gap.join(Gap::of(text.get(end..).unwrap_or_default()));
    layout.gap(&gap, Break::Free(0), 0, false);
    let mut out = layout.out;
    out.truncate(out.trim_end().len());
    if !out.is_empty() {
        out.push('\n');
    }
    out
}

/// For each token that opens a body or begins an item, whether that spans lines.
fn spans(text: &str, tokens: &[Token]) -> Vec<bool> {
    let mut multi = vec![false; tokens.len()];
    let mut open = Vec::new();
    let mut item = None;
    // Tokens so far that begin a clause, which always has a line of its own.
    let mut clauses = 0;
    let spans = |from: &Token, to: usize| text.get(from.start..to).is_some_and(|t| t.contains('\n'));
    for (index, token) in tokens.iter().enumerate() {
        if token.begins == Begins::Item
            && let Some((at, before)) = item.replace((index, clauses))
        {
            multi[at] = before != clauses || spans(&tokens[at], tokens[index - 1].end);
        }
        clauses += usize::from(token.begins == Begins::Clause);
        match token.kind {
            Kind::OpenBody => open.push((index, clauses)),
            Kind::CloseBody => {
                if let Some((at, before)) = open.pop() {
                    multi[at] = before != clauses || spans(&tokens[at], token.start);
                }
            }
            _ => {}
        }
    }
    if let (Some((at, before)), Some(last)) = (item, tokens.last()) {
        multi[at] = before != clauses || spans(&tokens[at], last.end);
    }
    multi
}

impl Layout<'_> {
    fn token(&mut self, last: Option<usize>, index: usize, gap: Gap) {
        let token = self.tokens[index];
        let before = last.map(|at| self.tokens[at]);
        if token.kind == Kind::CloseGroup {
            self.groups = self.groups.saturating_sub(1);
        }
        let how = self.break_before(last, &token, index, &gap);
        let comments = match token.kind {
            Kind::CloseBody => self.level,
            _ => match how {
                Break::No => self.base,
                Break::Line(indent) | Break::Free(indent) | Break::Apart(indent) => indent,
            },
        };
        self.enter(&token, how);
        let opened = before.is_none_or(|b| b.kind == Kind::OpenBody);
        let same_line = how == Break::No && gap.comments.is_empty();
        // Steps on one line are told apart by a `;` in the one style, also where a brace does it.
        let step = token.begins == Begins::Line && !opened;
        if (self.separator || step) && same_line && token.kind != Kind::CloseBody {
            self.out.push(if token.begins == Begins::Field { ',' } else { ';' });
        }
        self.separator = false;
        self.gap(&gap, how, comments, opened);
        if same_line && before.is_some_and(|b| blank_between(&b, &token)) {
            self.out.push(' ');
        }
        self.out.push_str(self.text.get(token.start..token.end).unwrap_or_default());
        match token.kind {
            Kind::OpenGroup | Kind::OpenTight => self.groups += 1,
            Kind::OpenBody => {
                self.bodies.push(Body {
                    multi: self.multi[index],
                    indent: self.line,
                    outer: (self.level, self.base),
                    clauses: self.clauses,
                });
                self.level = self.line + STEP;
                self.base = self.level;
                self.clauses = false;
            }
            _ => {}
        }
    }

    /// Keeps track of where the token stands.
    fn enter(&mut self, token: &Token, how: Break) {
        if let Break::Line(indent) | Break::Free(indent) | Break::Apart(indent) = how {
            self.line = indent;
        }
        match token.begins {
            Begins::Item | Begins::Line | Begins::Field => {
                (self.base, self.groups, self.clauses) = (self.level, 0, false);
            }
            Begins::Clause => (self.base, self.groups, self.clauses) = (self.level + STEP, 0, true),
            Begins::Guard => self.clauses = how != Break::No,
            Begins::Handler => (self.base, self.clauses) = (self.line.max(self.level), false),
            Begins::Nothing => {}
        }
        if token.kind == Kind::CloseBody
            && let Some(body) = self.bodies.pop()
        {
            ((self.level, self.base), self.clauses) = (body.outer, body.clauses);
        }
    }

    fn break_before(&self, last: Option<usize>, token: &Token, index: usize, gap: &Gap) -> Break {
        let Some(last) = last else { return Break::Free(0) };
        let before = self.tokens[last];
        let body = self.bodies.last();
        let multi = body.is_some_and(|body| body.multi);
        let kept = gap.breaks();
        match (token.kind, token.begins) {
            (Kind::CloseBody, _) if multi => Break::Line(body.map_or(0, |body| body.indent)),
            (Kind::CloseBody, _) => Break::No,
            (Kind::OpenBody, _) if self.clauses => Break::Line(self.level),
            (Kind::OpenBody, _) if gap.comments.is_empty() => Break::No,
            (_, Begins::Item) => self.between_items(index, last, gap),
            (_, Begins::Line) if multi => Break::Free(self.level),
            (_, Begins::Field) if multi && (kept || before.kind == Kind::OpenBody) => Break::Free(self.level),
            (_, Begins::Clause) => Break::Line(self.level + STEP),
            (_, Begins::Handler) if before.kind == Kind::CloseBody && gap.comments.is_empty() => Break::No,
            (_, Begins::Handler) if kept && before.kind == Kind::CloseBody => Break::Line(self.level),
            _ if !kept => Break::No,
            (Kind::CloseGroup, _) => Break::Line(self.base + STEP * self.groups),
            _ => Break::Line(self.base + STEP * self.groups.max(1)),
        }
    }

    /// Items stand apart, but for groups of one-line items.
    fn between_items(&self, index: usize, last: usize, gap: &Gap) -> Break {
        let above = (0..=last).rev().find(|at| self.tokens[*at].begins == Begins::Item).unwrap_or(0);
        let grouped = above != 0 && !self.multi[above] && !self.multi[index];
        if grouped || gap.has_blank() { Break::Free(0) } else { Break::Apart(0) }
    }

    /// Writes comments and line ends; `opened` says that nothing stands before in its body.
    fn gap(&mut self, gap: &Gap, how: Break, indent: usize, opened: bool) {
        // The empty line between items stands before the comments of the second, after those of the file.
        let mut apart = matches!(how, Break::Apart(_));
        let mut first = opened;
        for comment in &gap.comments {
            if comment.newlines == 0 && !self.out.is_empty() {
                self.out.push_str("  ");
            } else {
                let of_file = comment.text.starts_with("//!");
                let blank = comment.newlines > 1 && !matches!(how, Break::Line(_) | Break::No) || apart && !of_file;
                apart &= of_file;
                self.newline(blank && !first, indent);
            }
            self.out.push_str(comment.text);
            first = false;
        }
        match how {
            Break::No if gap.comments.is_empty() => {}
            Break::No => self.newline(false, indent),
            Break::Line(indent) => self.newline(false, indent),
            Break::Free(indent) => self.newline(gap.newlines > 1 && !first, indent),
            Break::Apart(indent) => self.newline((apart || gap.newlines > 1) && !first, indent),
        }
    }

    fn newline(&mut self, blank: bool, indent: usize) {
        if self.out.is_empty() {
            return;
        }
        self.out.push_str(if blank { "\n\n" } else { "\n" });
        self.out.extend(std::iter::repeat_n(' ', indent));
    }
}

fn blank_between(before: &Token, token: &Token) -> bool {
    let tight_left =
        matches!(token.kind, Kind::Suffix | Kind::Joint | Kind::OpenTight | Kind::CloseGroup | Kind::Comma);
    let tight_right = matches!(before.kind, Kind::Prefix | Kind::Joint | Kind::OpenGroup | Kind::OpenTight);
    let empty = before.kind == Kind::OpenBody && token.kind == Kind::CloseBody;
    !(tight_left || tight_right || empty)
}
