//! The tokens of a file without mistakes, with what the formatter has to know of each.

use matterix_ir::{Diagnostic, FileId};
use pest::Parser;

use super::{
    cursor::Node,
    grammar::{Grammar, Rule},
    parse, scan, with_stack,
};

/// A token: what stands between two places where blanks may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    /// Its first byte.
    pub(crate) start: usize,
    /// After its last byte.
    pub(crate) end: usize,
    /// What it does.
    pub(crate) kind: Kind,
    /// What begins with it.
    pub(crate) begins: Begins,
}

/// What a token does for the layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Stands between blanks.
    Plain,
    /// Stands without a blank after what is before it: `.x`, `?`, `:`.
    Suffix,
    /// Stands without a blank before what follows: `-`.
    Prefix,
    /// Stands between two things without blanks: `::`.
    Joint,
    /// `{` of a body.
    OpenBody,
    /// `}` of a body.
    CloseBody,
    /// An opening bracket with a blank before it.
    OpenGroup,
    /// An opening bracket that stands tight: `f(`, `x[`.
    OpenTight,
    /// A closing bracket.
    CloseGroup,
    /// A comma inside brackets or between parts of one form.
    Comma,
    /// `;`, or `,` between fields.
    Separator,
}

/// What begins with a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Begins {
    /// Nothing that has a line of its own.
    Nothing,
    /// The header or an item.
    Item,
    /// A form with a line of its own.
    Line,
    /// A field, which may share its line with others.
    Field,
    /// A clause of a skill or command.
    Clause,
    /// `while` of a process, `when` of an event.
    Guard,
    /// `else`, `on`, `finally`.
    Handler,
}

/// The tokens in the order of the text; the findings where it has mistakes.
pub(crate) fn tokens(file: FileId, text: &str) -> Result<Vec<Token>, Vec<Diagnostic>> {
    let (_, found) = parse(file, text);
    if !found.is_empty() {
        return Err(found);
    }
    let (depth, _) = scan::depth(&scan::scan(text));
    Ok(with_stack(depth, || {
        let mut tokens = Vec::new();
        if let Some(root) = Grammar::parse(Rule::file, text).ok().and_then(|mut pairs| pairs.next()) {
            for part in root.into_inner() {
                collect(part, Rule::file, Begins::Item, &mut tokens);
            }
        }
        tokens
    }))
}

/// Adds the tokens of a node; the first of them begins `begins`.
fn collect(node: Node, parent: Rule, begins: Begins, tokens: &mut Vec<Token>) {
    let rule = node.as_rule();
    if is_whole(rule) || node.clone().into_inner().next().is_none() {
        let text = node.as_str();
        let start = node.as_span().start() + (text.len() - text.trim_start().len());
        let end = start + text.trim().len();
        if start < end {
            tokens.push(Token { start, end, kind: kind(rule, parent), begins });
        }
        return;
    }
    let mut first = begins;
    for part in node.into_inner() {
        let inner = begins_with(part.as_rule(), rule);
        let begins = if inner == Begins::Nothing { first } else { inner };
        collect(part, rule, begins, tokens);
        first = Begins::Nothing;
    }
}

/// Rules whose text is one token though they have parts.
fn is_whole(rule: Rule) -> bool {
    matches!(rule, Rule::path | Rule::member | Rule::species | Rule::charged | Rule::unit)
}

fn begins_with(rule: Rule, parent: Rule) -> Begins {
    use Rule::*;
    match (parent, rule) {
        (_, lbrace | rbrace | end | field_end) => Begins::Nothing,
        (block | laws | members | wires | study_body | fit_body, _) => Begins::Line,
        (fields | fills | options | columns | asset_body | lab_body, _) => Begins::Field,
        (clauses, _) => Begins::Clause,
        (handlers, _) | (if_ | try_ | law_if, kw_else) => Begins::Handler,
        (process, kw_while) | (event | hazard, kw_when) => Begins::Guard,
        _ => Begins::Nothing,
    }
}

fn kind(rule: Rule, parent: Rule) -> Kind {
    use Rule::*;
    match (parent, rule) {
        (use_, lbrace) => Kind::OpenTight,
        (use_, rbrace) => Kind::CloseGroup,
        (_, lbrace) => Kind::OpenBody,
        (_, rbrace) => Kind::CloseBody,
        (tuple_body, lparen) | (list, lbracket) => Kind::OpenGroup,
        (_, lparen | lbracket | langle) => Kind::OpenTight,
        (_, rparen | rbracket | rangle) => Kind::CloseGroup,
        (_, comma) => Kind::Comma,
        (_, end | field_end) => Kind::Separator,
        (_, colon | question | prime | member) => Kind::Suffix,
        (_, scope) => Kind::Joint,
        (_, neg) => Kind::Prefix,
        _ => Kind::Plain,
    }
}
