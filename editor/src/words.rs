//! What each word of a text is, for colours.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use matterix_lang::names::{Module, verb_text};
use matterix_syntax::ast::{ItemKind, MemberKind, Sig};
use matterix_syntax::classes::{self, Class, Declared};

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
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
    /// A comment.
    Comment,
    /// A word of a verb, or the name of a workflow or a test.
    Skill,
    /// A function, a relation or a law.
    Function,
    /// A capability, an asset, a dimension, a module.
    Type,
    /// A species.
    Species,
    /// A parameter.
    Parameter,
    /// A member, an option or a field.
    Member,
    /// Another name.
    Name,
}

/// A word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// Its bytes.
    pub range: Range<usize>,
    /// What it is.
    pub kind: Kind,
    /// Whether it is declared there.
    pub declared: bool,
}

/// The words of a text in its order. Where a verb ends is known from the skills and commands of the modules.
pub fn words(text: &str, modules: &[Arc<Module>]) -> Vec<Word> {
    let verbs = verbs(modules);
    let found = classes::words(text);
    let mut out = Vec::new();
    let mut i = 0;
    while let Some(word) = found.get(i) {
        let run = found[i..].iter().take_while(|w| w.class == Class::Call).count();
        // Words of one call have nothing but blanks between them.
        let run = (1..=run).rev().find(|n| blanks(text, &found[i..i + n])).unwrap_or(1);
        if word.class == Class::Call {
            let of = |n: usize| {
                found[i..i + n].iter().filter_map(|w| text.get(w.start..w.end)).collect::<Vec<_>>().join(" ")
            };
            let verb = (1..=run).rev().find(|n| verbs.contains(&of(*n))).unwrap_or(1);
            let call = found[i..i + run].iter().enumerate();
            out.extend(call.map(|(n, w)| Word {
                range: w.start..w.end,
                kind: if n < verb { Kind::Skill } else { Kind::Name },
                declared: false,
            }));
            i += run;
            continue;
        }
        let (kind, declared) = kind(word.class);
        out.push(Word { range: word.start..word.end, kind, declared });
        i += 1;
    }
    out
}

fn blanks(text: &str, words: &[classes::Word]) -> bool {
    let gaps = words.windows(2).map(|pair| text.get(pair[0].end..pair[1].start));
    gaps.into_iter().all(|gap| gap.is_some_and(|gap| gap.bytes().all(|b| b == b' ' || b == b'\t')))
}

fn kind(class: Class) -> (Kind, bool) {
    match class {
        Class::Keyword => (Kind::Keyword, false),
        Class::Label => (Kind::Label, false),
        Class::Number => (Kind::Number, false),
        Class::Unit => (Kind::Unit, false),
        Class::Text => (Kind::Text, false),
        Class::Comment => (Kind::Comment, false),
        Class::Call => (Kind::Skill, false),
        Class::Function => (Kind::Function, false),
        Class::Type => (Kind::Type, false),
        Class::Species => (Kind::Species, false),
        Class::Member => (Kind::Member, false),
        Class::Name => (Kind::Name, false),
        Class::Declared(what) => {
            let kind = match what {
                Declared::Type => Kind::Type,
                Declared::Skill => Kind::Skill,
                Declared::Function => Kind::Function,
                Declared::Parameter => Kind::Parameter,
                Declared::Member => Kind::Member,
                Declared::Variable | Declared::Other => Kind::Name,
            };
            (kind, true)
        }
    }
}

/// The words of all verbs.
fn verbs(modules: &[Arc<Module>]) -> BTreeSet<String> {
    let mut out = BTreeSet::new();
    let mut add = |sig: &Sig| out.extend([verb_text(&sig.verb)]);
    for item in modules.iter().flat_map(|module| &module.tree.items) {
        match &item.kind {
            ItemKind::Skill { sig, .. } => add(sig),
            ItemKind::Capability { members, .. } => members.iter().for_each(|member| {
                if let MemberKind::Command { sig, .. } = &member.kind {
                    add(sig);
                }
            }),
            _ => {}
        }
    }
    out
}
