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
    let species = species(modules);
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
        let (mut kind, declared) = kind(word.class);
        let before = || i.checked_sub(1).and_then(|i| found.get(i)).and_then(|w| text.get(w.start..w.end));
        if declared && before() == Some("lab") {
            // Where a lab is named it is coloured as items are.
            kind = Kind::Type;
        } else if kind == Kind::Species && is_indexed(text, word) && !modules.is_empty() {
            // The grammar takes the place of a grid for a species: `trough[A1]`.
            let known = text.get(word.start..word.end).is_some_and(|name| species.contains(name));
            kind = if known { Kind::Species } else { Kind::Name };
        }
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

/// Whether a word is all that stands in square brackets.
fn is_indexed(text: &str, word: &classes::Word) -> bool {
    let before = text.get(..word.start).is_some_and(|before| before.trim_end().ends_with('['));
    before && text.get(word.end..).is_some_and(|after| after.trim_start().starts_with(']'))
}

/// The names of all species.
fn species(modules: &[Arc<Module>]) -> BTreeSet<&str> {
    let items = modules.iter().flat_map(|module| &module.tree.items);
    let names = items.filter_map(|item| match &item.kind {
        ItemKind::Species { name, .. } => Some(name.text.as_str()),
        _ => None,
    });
    names.collect()
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

#[cfg(test)]
mod tests {
    use matterix_lang::{LibraryOnly, Session};

    use super::*;
    use crate::Analysis;

    #[test]
    fn what_is_alike_is_coloured_alike() {
        let text = "mtx 1\nlab bench {\n    ambient: 22 degC\n}\nworkflow w in bench {\n    expect trough[A1].volume > \
            cup[water] and all(w in wells[A2 .. A3]: w.volume > 1 mL)\n}\n";
        let analysis = Analysis::of("a.mtx", text, &LibraryOnly, &mut Session::default());
        let found = words(text, &analysis.modules);
        let kinds = |name: &str| -> Vec<Kind> {
            found.iter().filter(|w| text.get(w.range.clone()) == Some(name)).map(|w| w.kind).collect()
        };
        assert_eq!((kinds("A1"), kinds("A2")), (vec![Kind::Name], vec![Kind::Name]));
        assert_eq!(kinds("water"), [Kind::Species]);
        assert_eq!(kinds("bench"), [Kind::Type, Kind::Type]);
    }
}
