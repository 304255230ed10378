//! What can be written at a cursor. The text at the cursor need not be whole: where it stands is found without the grammar
//! (`context`), what is known comes from the last analysis.

mod bound;
mod context;
mod follow;
mod items;
mod signature;
mod steps;
mod units;
mod values;

use std::collections::BTreeSet;

use matterix_ir::FileId;
use matterix_lang::semantic_index::Sort;

pub use signature::{Signature, signature};

use crate::Index;
use crate::index::{DefId, Kind, Meaning, Member};
use context::{Context, primary};
use values::Place;

/// What can be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Completion {
    /// As shown.
    pub label: String,
    /// As written; places to fill are `${1:name}`, and `$0` is where the cursor goes.
    pub text: String,
    /// What it is.
    pub kind: Offer,
    /// In a few words.
    pub detail: String,
    /// What it stands for, to say more about it.
    pub def: Option<DefId>,
    /// The lower, the earlier in the list.
    pub rank: u8,
}

/// What is offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// Something declared.
    Def(Kind),
    /// A word of the grammar.
    Keyword,
    /// A member that the language itself knows.
    Member,
    /// A unit.
    Unit,
    /// A place of a grid.
    Place,
    /// A module.
    Module,
    /// A form with places to fill.
    Form,
}

/// All that can be written at a cursor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Offers {
    /// First byte of what is replaced; it goes to the cursor.
    pub from: usize,
    /// In no order; the rank says what is best.
    pub all: Vec<Completion>,
}

/// What can be written at a cursor in the current text of a file, which the index may not have seen yet.
pub fn complete(index: &Index, file: FileId, text: &str, cursor: usize) -> Offers {
    let context = context::context(text, cursor);
    let mut out = Offers { from: context.word.0, all: Vec::new() };
    if context.quiet {
        return out;
    }
    let place = Place::of(index, file, text, context.word.0).bind(&context);
    place.offers(&context, &mut out);
    let typed = context.word.1.to_lowercase();
    out.all.retain(|c| fits(&c.label.to_lowercase(), &typed));
    out
}

/// Whether the letters that were typed are in a label in their order, beginning with its first or that of a word of it.
fn fits(label: &str, typed: &str) -> bool {
    let Some(first) = typed.chars().next() else { return true };
    let starts =
        label.char_indices().filter(|(i, c)| *c == first && (*i == 0 || !label[..*i].ends_with(char::is_alphanumeric)));
    starts.map(|(i, _)| &label[i..]).any(|rest| {
        let mut letters = rest.chars();
        typed.chars().all(|c| letters.any(|l| l == c))
    })
}

impl Place<'_> {
    fn offers(&self, context: &Context<'_>, out: &mut Offers) {
        let last = context.last();
        let tokens = &context.before;
        match last {
            Some(".") if !tokens[..tokens.len() - 1].last().is_some_and(|t| t.is_number()) => {
                let value = self.value(primary(&tokens[..tokens.len() - 1]));
                if let Some((_, sort)) = value {
                    self.members(&sort, out);
                }
                return;
            }
            Some("::") => return self.after_scope(context, out),
            Some(_) if tokens.first().is_some_and(|t| t.text == "use") => return self.imports(context, out),
            Some(text) if text.starts_with(|c: char| c.is_ascii_digit()) => {
                let counts = tokens.len() == 2 && tokens[0].text == "repeat";
                if !counts {
                    self.units(&self.measured(context), context.word.1, out);
                }
                if context.apart {
                    self.after_value(context, out);
                }
                return;
            }
            // `5 mL of water`, in whatever block; outside of them a study is `of` a workflow.
            Some("of") if context.block().is_some() => {
                return self.globals(&[Kind::Species, Kind::Solution], 5, out);
            }
            Some("as") if !matches!(context.item(), "use") && tokens.first().is_none_or(|t| t.text != "include") => {
                let of = self.value(primary(&tokens[..tokens.len() - 1]));
                self.units(&of.map(|o| o.1).into_iter().collect::<Vec<_>>(), context.word.1, out);
                return;
            }
            // `(1, 2) mm`.
            Some(")") if context.apart && self.is_tuple(tokens) => {
                self.units(&self.measured(context), context.word.1, out);
            }
            _ => {}
        }
        if self.after_block(context, out) {
            return;
        }
        if let Some(open) = context.open.last().filter(|o| o.bracket == '[')
            && open.head.last().is_some_and(|t| t.is_word() && t.end() == open.at)
        {
            return self.places(&open.head, out);
        }
        if context.in_text() {
            return self.in_text(context, out);
        }
        match context.block() {
            None => self.top(context, out),
            Some(_) => self.inside(context, out),
        }
    }

    /// What can be asked of a value.
    fn members(&self, sort: &Sort, out: &mut Offers) {
        for Member { name, meaning, sort } in self.index.all_members(sort) {
            let words = self.index.sort_words(&sort);
            let (kind, detail, def) = match meaning {
                Meaning::Def(def) => (Offer::Def(self.index.def(def).kind), words, Some(def)),
                Meaning::Language(what) => (Offer::Member, what.to_string(), None),
                _ => (Offer::Member, words, None),
            };
            let inner = !matches!(kind, Offer::Def(_));
            out.all.push(Completion { text: name.clone(), label: name, kind, detail, def, rank: 10 + u8::from(inner) });
        }
    }

    /// What stands in brackets after a value: places of a grid, or species.
    fn places(&self, head: &[context::Token<'_>], out: &mut Offers) {
        let value = self.value(primary(head));
        let grid = value.as_ref().and_then(|(_, sort)| match sort {
            Sort::Thing(_, Some(full)) => Some(full.clone()),
            _ => None,
        });
        let chain: String = primary(head).iter().map(|t| t.text).collect();
        let names = [grid.unwrap_or_default(), chain];
        names.iter().filter(|n| !n.is_empty()).for_each(|name| self.places_of(name, out));
        if out.all.is_empty() {
            self.globals(&[Kind::Species], 10, out);
        }
        self.locals(&|_, _| true, 20, out);
    }

    /// Places of a grid, by its full name.
    pub(crate) fn places_of(&self, name: &str, out: &mut Offers) {
        for place in self.index.built_places(name) {
            if !out.all.iter().any(|c| c.label == place) {
                let (text, detail) = (place.clone(), "a well or place".to_string());
                out.all.push(Completion { text, label: place, kind: Offer::Place, detail, def: None, rank: 5 });
            }
        }
    }

    /// Names that a module sees, of these kinds.
    pub(crate) fn globals(&self, kinds: &[Kind], rank: u8, out: &mut Offers) {
        let Some(module) = self.index.module_of(self.file) else { return };
        for (name, def) in self.index.visible(module) {
            let d = self.index.def(def);
            if kinds.contains(&d.kind) {
                let own = u8::from(self.index.is_library(d.span.file));
                out.all.push(self.offer(name, def, rank + own));
            }
        }
    }

    /// Local names, members of the thing whose text it is, and things of the lab.
    pub(crate) fn locals(&self, wanted: &dyn Fn(&Sort, Kind) -> bool, rank: u8, out: &mut Offers) {
        for (name, sort) in self.bound.iter().rev() {
            let kind = if *sort == Sort::Step { Kind::Step } else { Kind::Variable };
            if wanted(sort, kind) && !out.all.iter().any(|c| c.label == *name) {
                let detail = self.index.sort_words(sort);
                let (label, text) = (name.clone(), name.clone());
                out.all.push(Completion { label, text, kind: Offer::Def(kind), detail, def: None, rank });
            }
        }
        let mut names: Vec<DefId> = self.index.names_at(self.file, self.offset);
        // Where the text around was not read, things of the package's labs may be meant.
        if !names.iter().any(|d| self.index.def(*d).kind == Kind::Thing) {
            names.extend(self.index.own_defs().filter(|(_, d)| d.kind == Kind::Thing).map(|d| d.0));
        }
        let mut there: BTreeSet<String> = out.all.iter().map(|c| c.label.clone()).collect();
        for def in names {
            let d = self.index.def(def);
            let local = matches!(
                d.kind,
                Kind::Variable
                    | Kind::Parameter
                    | Kind::Option
                    | Kind::Thing
                    | Kind::Included
                    | Kind::Setting
                    | Kind::Step
                    | Kind::Member
                    | Kind::Part
                    | Kind::Grid
                    | Kind::Frame
            );
            if !local || there.contains(&d.name) {
                continue;
            }
            let built = match &d.sort {
                Sort::Thing(kinds, Some(full)) => {
                    Sort::Thing(self.index.built(full).unwrap_or(kinds).clone(), Some(full.clone()))
                }
                other => other.clone(),
            };
            if wanted(&built, d.kind) {
                there.insert(d.name.clone());
                out.all.push(self.offer(&d.name, def, rank));
            }
        }
    }

    /// What is declared, as it can be written.
    pub(crate) fn offer(&self, name: &str, def: DefId, rank: u8) -> Completion {
        let d = self.index.def(def);
        let words = match d.kind {
            Kind::Function | Kind::Relation => self.index.form(def),
            _ => self.index.sort_words(&d.sort),
        };
        let detail = if words.is_empty() { d.kind.word().to_string() } else { words };
        let text = match d.kind {
            Kind::Function | Kind::Relation => format!("{name}($0)"),
            _ => name.to_string(),
        };
        Completion { label: name.to_string(), text, kind: Offer::Def(d.kind), detail, def: Some(def), rank }
    }

    pub(crate) fn keyword(&self, word: &str, text: &str, rank: u8, out: &mut Offers) {
        let kind = if text.contains('$') { Offer::Form } else { Offer::Keyword };
        let detail = String::new();
        out.all.push(Completion { label: word.to_string(), text: text.to_string(), kind, detail, def: None, rank });
    }
}

impl Index {
    /// Places of a grid in a lab by the full name of its thing or of the grid itself: `A1`, `A2`, ...
    pub(crate) fn built_places(&self, full: &str) -> Vec<String> {
        let begin = format!("{full}[");
        let mut out: Vec<(usize, String)> = Vec::new();
        for lab in self.labs_built() {
            for name in lab.range(begin.clone()..).map(|n| n.0).take_while(|n| n.starts_with(&begin)) {
                if let Some(place) = name[begin.len()..].strip_suffix(']')
                    && !out.iter().any(|o| o.1 == place)
                {
                    out.push((place.len(), place.to_string()));
                }
            }
        }
        out.sort();
        out.into_iter().map(|o| o.1).collect()
    }

    /// Functions and skills as they are called: `clamp(x, low, high)`, `place ITEM on TARGET`.
    pub fn form(&self, def: DefId) -> String {
        let d = self.def(def);
        let params = d.inside.iter().map(|p| self.def(*p)).filter(|p| p.kind == Kind::Parameter);
        match d.kind {
            Kind::Skill | Kind::Command => {
                let mut out = d.name.clone();
                let mut label: Option<&str> = None;
                for p in params {
                    match (&p.label, label) {
                        (Some(l), before) if before != Some(l.as_str()) => {
                            out.push_str(&format!(" {l} {}", p.name.to_uppercase()));
                            label = Some(l);
                        }
                        _ => out.push_str(&format!(" {}", p.name.to_uppercase())),
                    }
                }
                out
            }
            _ => format!("{}({})", d.name, params.map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")),
        }
    }
}
