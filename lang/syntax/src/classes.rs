//! What the words of a text are by the grammar alone, for colours. Total: of what could not be read the plain parts are told.

use matterix_ir::FileId;
use pest::Parser;

use crate::cursor::Node;
use crate::grammar::{Grammar, Rule};
use crate::repair::{self, Offsets};
use crate::{MAX_NESTING, MAX_SIZE, brackets, scan, with_stack};

/// What a piece of a text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// A word of the language.
    Keyword,
    /// A preposition before an argument.
    Label,
    /// A number.
    Number,
    /// A unit.
    Unit,
    /// A text in quotes.
    Text,
    /// `//` and what follows.
    Comment,
    /// A name where it is declared.
    Declared(Declared),
    /// A word of a call: of its verb, or its first argument.
    Call,
    /// A name before brackets with arguments.
    Function,
    /// The name of a type, a module or another item.
    Type,
    /// A species.
    Species,
    /// The name of a member, an option or a field.
    Member,
    /// Another name.
    Name,
}

/// What a name is declared as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Declared {
    /// A capability or an asset.
    Type,
    /// A skill, a command, a workflow or a test.
    Skill,
    /// A function, a relation or a law.
    Function,
    /// A parameter.
    Parameter,
    /// A local value, a thing of a lab, a named step.
    Variable,
    /// A member.
    Member,
    /// Anything else.
    Other,
}

/// A piece of a text with its class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// First byte.
    pub start: usize,
    /// Behind the last byte.
    pub end: usize,
    /// What it is.
    pub class: Class,
}

/// The words of a text in its order; none overlap.
pub fn words(text: &str) -> Vec<Word> {
    if text.len() > MAX_SIZE {
        return Vec::new();
    }
    let (changes, _) = brackets::balance(FileId(0), text, &scan::scan(text));
    let plain = || plain(text, 0, text.len());
    if changes.len() > brackets::MAX_CHANGES {
        return plain();
    }
    let (repaired, offsets) = repair::apply(text, &changes);
    let (depth, _) = scan::depth(&scan::scan(&repaired));
    if depth >= MAX_NESTING {
        return plain();
    }
    let leaves = with_stack(depth, || {
        let mut leaves = Vec::new();
        if let Some(root) = Grammar::parse(Rule::file, &repaired).ok().and_then(|mut pairs| pairs.next()) {
            collect(root, Rule::file, false, &mut leaves);
        }
        leaves
    });
    placed(text, &offsets, leaves)
}

/// Leaves at the places of the user's text, and what stands between them.
fn placed(text: &str, offsets: &Offsets, leaves: Vec<(usize, usize, Option<Class>)>) -> Vec<Word> {
    let mut out: Vec<Word> = Vec::new();
    let mut done = 0;
    for (start, end, class) in leaves {
        let (start, end) = (offsets.user(start).max(done), offsets.user(end));
        if start >= end {
            continue;
        }
        out.extend(plain(text, done, start).into_iter().filter(|word| word.class == Class::Comment));
        match class {
            Some(class) => out.push(Word { start, end, class }),
            None => out.extend(plain(text, start, end)),
        }
        done = end;
    }
    out.extend(plain(text, done, text.len()).into_iter().filter(|word| word.class == Class::Comment));
    out
}

/// Adds the leaves of a node that have a class; what could not be read has none yet.
fn collect(node: Node, parent: Rule, called: bool, out: &mut Vec<(usize, usize, Option<Class>)>) {
    let rule = node.as_rule();
    let span = node.as_span();
    if is_junk(rule) {
        out.push((span.start(), span.end(), None));
        return;
    }
    let whole = matches!(rule, Rule::species | Rule::charged | Rule::unit | Rule::bare_word);
    if whole || node.clone().into_inner().next().is_none() {
        let text = node.as_str();
        let start = span.start() + (text.len() - text.trim_start().len());
        let end = start + text.trim().len();
        if let Some(class) = class(rule, parent, text.trim(), called).filter(|_| start < end) {
            out.push((start, end, Some(class)));
        }
        return;
    }
    let parts: Vec<Node> = node.into_inner().collect();
    for (i, part) in parts.iter().enumerate() {
        let called = parts.get(i + 1).is_some_and(|next| next.as_rule() == Rule::args);
        collect(part.clone(), rule, called, out);
    }
}

/// Rules that hold what could not be read.
fn is_junk(rule: Rule) -> bool {
    use Rule::*;
    matches!(
        rule,
        bad_rest
            | bad_field_rest
            | bad_clause_rest
            | bad_field
            | bad_clause
            | bad_member
            | bad_wire
            | bad_lab_line
            | bad_study_line
            | bad_fit_line
            | bad_text
    )
}

fn class(rule: Rule, parent: Rule, text: &str, called: bool) -> Option<Class> {
    use Rule::*;
    let name = format!("{rule:?}");
    Some(match (parent, rule) {
        _ if name.starts_with("kw_") => Class::Keyword,
        (_, role | wire_when | joint_way) => Class::Keyword,
        (_, label) => Class::Label,
        (_, number | version) => Class::Number,
        (_, unit | uname) => Class::Unit,
        (_, string) => Class::Text,
        (capability | asset, ident) => Class::Declared(Declared::Type),
        (workflow | test | verb, ident) => Class::Declared(Declared::Skill),
        (fn_ | relation | process | event | hazard, ident) => Class::Declared(Declared::Function),
        (param | option_param, ident | word) => Class::Declared(Declared::Parameter),
        (let_ | var_ | law_let | for_ | law_for | each | step | start | instance | include, ident) => {
            Class::Declared(Declared::Variable)
        }
        (value_member, word) | (column, word) | (frame_member | frame | part_line | grid | joint, ident) => {
            Class::Declared(Declared::Member)
        }
        (
            const_ | table | dimension | solution | reaction | equilibrium | interaction | reactive_group | material
            | framing | driver | lab | study | fit,
            ident,
        ) => Class::Declared(Declared::Other),
        (_, bare_word | returning) => Class::Call,
        (species_item, species) => Class::Declared(Declared::Other),
        (key, species) | (_, key | arg_name | member) | (named | setting, word) => Class::Member,
        (_, species | charged) => Class::Species,
        (path, _) | (_, path) | (use_ | ty, ident) => Class::Type,
        (_, ident) if called => Class::Function,
        (_, ident | set_name | word | well | place | state_word | state_name) => Class::Name,
        // `and`, `or`, `in`, `is` among the signs.
        (_, rel) if text.starts_with(|c: char| c.is_ascii_alphabetic()) => Class::Keyword,
        _ => return None,
    })
}

/// Comments, texts, numbers and words of the language in a stretch, found without the grammar.
fn plain(text: &str, start: usize, end: usize) -> Vec<Word> {
    let mut out = Vec::new();
    let bytes = text.as_bytes();
    let mut at = start;
    while at < end {
        let from = at;
        let run = |at: usize, holds: &dyn Fn(u8) -> bool| bytes[at..end].iter().take_while(|b| holds(**b)).count();
        let class = match bytes[at] {
            b'/' if bytes.get(at + 1) == Some(&b'/') && at + 1 < end => {
                at += run(at, &|b| b != b'\n' && b != b'\r');
                Some(Class::Comment)
            }
            b'"' => {
                at += 1;
                while at < end && !matches!(bytes[at], b'"' | b'\n') {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at = (at + 1).min(end);
                Some(Class::Text)
            }
            b'0'..=b'9' => {
                at += run(at, &|b| b.is_ascii_alphanumeric() || b == b'.');
                Some(Class::Number)
            }
            b if b.is_ascii_alphabetic() || b == b'_' => {
                at += run(at, &|b| b.is_ascii_alphanumeric() || b == b'_');
                let word = text.get(from..at).unwrap_or_default();
                (scan::ITEM_WORDS.contains(&word) || !crate::is_name(word)).then_some(Class::Keyword)
            }
            _ => {
                at += 1;
                None
            }
        };
        // A quote may end inside of a character where something was cut.
        while at < end && !text.is_char_boundary(at) {
            at += 1;
        }
        out.extend(class.filter(|_| text.get(from..at).is_some()).map(|class| Word { start: from, end: at, class }));
    }
    out
}
