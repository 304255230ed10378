//! From matches of the grammar to the syntax tree. Total: what is missing becomes an error node.

mod devices;
mod exprs;
mod items;
mod labs;
mod laws;
mod precedence;
mod steps;
mod texts;
mod types;

use matterix_ir::{Diagnostic, FileId, Span, codes};
use pest::Parser;

use super::{
    cursor::{Kids, Node, token_end},
    grammar::{Grammar, Rule},
    mistake::Mistakes,
    repair::Offsets,
    scan::first_word,
};
use crate::ast::{Expr, ExprKind, File, Item, ItemKind, Name};

/// The deepest tree that later stages have to walk.
const MAX_DEPTH: usize = 600;

/// The longest `if ... else if ... else if ...`.
const MAX_BRANCHES: usize = 64;

/// The state of one pass over a file.
pub(super) struct Lower<'a> {
    file: FileId,
    /// What was parsed: the user's text with its brackets closed.
    text: &'a str,
    offsets: &'a Offsets,
    mistakes: Mistakes<'a>,
    /// Levels of the expression tree above the current place, at most.
    depth: usize,
    /// Where the piece that is read begins in the file; 0 but inside a text.
    base: usize,
    /// Inside a `test`, where `run` is a statement.
    in_test: bool,
    /// Inside a driver or framing, where texts go over lines and `\x02` is a byte.
    on_line: bool,
}

impl<'a> Lower<'a> {
    pub(super) fn new(file: FileId, text: &'a str, offsets: &'a Offsets) -> Self {
        Lower {
            file,
            text,
            offsets,
            mistakes: Mistakes::new(file, text, offsets),
            depth: 0,
            base: 0,
            in_test: false,
            on_line: false,
        }
    }

    /// The tree, and what is wrong with the text in the order of the text.
    ///
    /// The last number counts the mistakes that were not looked into. `known` is the version where the text is a part of a file behind its
    /// header.
    pub(super) fn run(mut self, root: Node, known: Option<Option<u32>>) -> (File, Vec<Diagnostic>, usize) {
        let file = self.file(root, known);
        let (found, hidden) = self.mistakes.finish();
        (file, found, hidden)
    }

    /// The one value in a range of the text.
    pub(super) fn value(mut self, start: usize, end: usize) -> (Expr, Vec<Diagnostic>) {
        let value = self.piece(start, end).unwrap_or_else(|| self.error_expr(self.place(start, end)));
        (value, self.mistakes.finish().0)
    }

    /// The value in a range of the text; what is wrong with it is noted.
    fn piece(&mut self, start: usize, end: usize) -> Option<Expr> {
        let text = self.text.get(start..end).unwrap_or_default();
        let Some(node) = Grammar::parse(Rule::only_value, text).ok().and_then(|mut pairs| pairs.next()) else {
            self.mistakes.piece(Rule::only_value, start, end);
            return None;
        };
        // Reading a piece counts from its own beginning.
        self.base = start;
        let value = self.expr_in(&mut Kids::of(node));
        self.base = 0;
        Some(value)
    }

    fn file(&mut self, root: Node, known: Option<Option<u32>>) -> File {
        let mut kids = Kids::of(root);
        let version = known.unwrap_or_else(|| self.header(&mut kids));
        let mut items: Vec<Item> = Vec::new();
        let mut before = None;
        while let Some(node) = kids.take() {
            let start = node.as_span().start();
            match node.as_rule() {
                Rule::end => continue,
                // Said already: the header is missing.
                Rule::bad_item if version.is_none() && first_word(node.as_str()) == "mtx" => continue,
                Rule::bad_rest => self.mistakes.rest(Rule::only_item, before.unwrap_or(start), &node),
                _ => {
                    let docs = self.docs_before(start);
                    let span = self.span(&node);
                    let kind = self.item(node, before);
                    items.push(Item { docs, kind, span });
                }
            }
            before = Some(start);
        }
        File { version, docs: Vec::new(), items }
    }

    fn header(&mut self, kids: &mut Kids) -> Option<u32> {
        let Some(header) = kids.eat(Rule::header) else {
            self.mistakes.no_header();
            return None;
        };
        let version = Kids::of(header).eat(Rule::version)?;
        match version.as_str().parse() {
            Ok(1) => Some(1),
            number => {
                let span = self.span(&version);
                let headline = format!("`mtx {}` is not a known version of the language", version.as_str());
                self.report(Diagnostic::error(codes::SYNTAX, span, headline, "the known version is `mtx 1`"));
                number.ok()
            }
        }
    }

    /// The span of a node in the user's text.
    fn span(&self, node: &Node) -> Span {
        self.place(node.as_span().start(), token_end(node))
    }

    /// The span of a range of the parsed text in the user's text.
    fn place(&self, start: usize, end: usize) -> Span {
        self.offsets.span(self.file, self.base + start, self.base + end)
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.mistakes.push(diagnostic);
    }

    fn name(&self, node: &Node) -> Name {
        Name { text: node.as_str().to_owned(), span: self.span(node) }
    }

    /// The name that stands next; an empty one where there is none.
    fn name_in(&self, kids: &mut Kids) -> Name {
        kids.take().map_or_else(|| Name { text: String::new(), span: self.place(0, 0) }, |node| self.name(&node))
    }

    fn names(&self, nodes: Vec<Node>) -> Vec<Name> {
        nodes.iter().map(|node| self.name(node)).collect()
    }

    fn error_expr(&self, span: Span) -> Expr {
        Expr { kind: Box::new(ExprKind::Error), span }
    }

    /// The `///` lines that stand right above the line on which `start` is.
    fn docs_before(&self, start: usize) -> Vec<String> {
        let above = self.text.get(..start).unwrap_or_default();
        let mut lines = above.lines().rev();
        if !above.ends_with('\n') && lines.next().is_some_and(|indent| !indent.trim().is_empty()) {
            return Vec::new();
        }
        let mut docs: Vec<String> = lines.map_while(|line| doc_line(line, "///")).collect();
        docs.reverse();
        docs
    }

    fn too_many_branches(&mut self, span: Span) {
        let headline = format!("this `if` has more than {MAX_BRANCHES} branches");
        self.report(Diagnostic::error(codes::SYNTAX, span, headline, "one too many"));
    }

    fn item(&mut self, node: Node, before: Option<usize>) -> ItemKind {
        match node.as_rule() {
            Rule::bad_item => self.bad_item(node, before),
            _ => self.item_form(node),
        }
    }
}

/// The `//!` lines.
pub(super) fn file_docs(text: &str) -> Vec<String> {
    text.lines().filter_map(|line| doc_line(line, "//!")).collect()
}

/// What stands after the marker and one blank, if the line is such a comment.
fn doc_line(line: &str, marker: &str) -> Option<String> {
    let text = line.trim().strip_prefix(marker)?;
    Some(text.strip_prefix(' ').unwrap_or(text).to_owned())
}

/// Whether the rule is an error production for a whole line.
fn is_bad(rule: Rule) -> bool {
    use Rule::*;
    matches!(
        rule,
        bad_member
            | bad_wire
            | bad_lab_line
            | bad_study_line
            | bad_fit_line
            | bad_field
            | bad_clause
            | bad_law
            | bad_stmt
    )
}
