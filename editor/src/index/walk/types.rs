//! Types, units and paths.

use matterix_ir::Span;
use matterix_lang::ast::{Param, Path, Type, UnitText};

use super::Walk;
use crate::index::{DefId, Kind, Meaning};

/// Types that are neither dimensions nor kinds.
const BUILT_IN: &[(&str, &str)] = &[
    ("Bool", "a truth value"),
    ("Text", "a text"),
    ("Place", "a place of a grid: `A1`"),
    ("Int", "a whole number"),
    ("Species", "a species"),
    ("Reaction", "a reaction"),
    ("Material", "the material of a vessel"),
    ("Frame", "a named point of a thing"),
    ("Range", "from one value to another: `Range<Temperature>`"),
    ("List", "several of one kind: `List<Vessel>`"),
    ("Color", "three numbers from 0 to 1: red, green, blue"),
    ("Any", "anything"),
];

impl Walk<'_> {
    pub(super) fn ty(&mut self, ty: &Type) {
        for word in &ty.words {
            self.declares(word.span);
        }
        for path in &ty.paths {
            let name = path.segments.last();
            let built_in = name.and_then(|n| BUILT_IN.iter().find(|(b, _)| *b == n.text));
            match (built_in, path.segments.as_slice()) {
                (Some((_, what)), [name]) => self.language(name.span, what),
                (_, [name]) if self.index.units().dimension(&name.text).is_some() => {
                    let def = self.index.measure(&name.text);
                    self.maybe(name.span, def);
                }
                _ => self.path(path),
            }
        }
        if let Some(inner) = &ty.argument {
            self.ty(inner);
        }
    }

    /// A name that may have its module before it.
    pub(super) fn path(&mut self, path: &Path) {
        let Some((last, before)) = path.segments.split_last() else { return };
        for segment in before {
            self.language(segment.span, "a module");
        }
        let def = self.index.lookup(self.at, &last.text);
        self.maybe(last.span, def);
    }

    /// What a path names.
    pub(super) fn named(&self, path: &Path) -> Option<DefId> {
        self.index.lookup(self.at, &path.segments.last()?.text)
    }

    /// The types and defaults of parameters, then their names and what holds for them.
    pub(super) fn params(&mut self, params: &[Param]) {
        for p in params {
            self.param(p);
        }
        self.enter_params(params.iter());
    }

    pub(super) fn param(&mut self, p: &Param) {
        if let Some(ty) = &p.ty {
            self.ty(ty);
        }
        if let Some(default) = &p.default {
            let words = self.index.declared_at(p.name.span).map(|d| self.index.def(d).words.clone());
            self.expr_among(default, &words.unwrap_or_default());
        }
    }

    /// The names in a unit, each without its prefix.
    pub(super) fn unit(&mut self, unit: &UnitText) {
        let text = self.index.text(unit.span).to_string();
        for (start, word) in words_of(&text) {
            let (name, prefix) = self.unit_name(&word);
            let from = unit.span.start + (start + prefix) as u32;
            let span = Span { start: from, end: unit.span.start + (start + word.len()) as u32, ..unit.span };
            let meaning = name.map_or(Meaning::Unknown, Meaning::Def);
            self.note(span, meaning);
        }
    }

    /// The unit that a word names, and the length of its prefix.
    fn unit_name(&self, word: &str) -> (Option<DefId>, usize) {
        let unit = |name: &str| self.index.measure(name).filter(|d| self.index.def(*d).kind == Kind::Unit);
        if let Some(def) = unit(word) {
            return (Some(def), 0);
        }
        let known = self.index.units().find(word).is_some();
        let starts = word.char_indices().skip(1).take(2).map(|(i, _)| i);
        let found = starts.filter_map(|i| Some((unit(&word[i..])?, i))).next();
        match found.filter(|_| known) {
            Some((def, prefix)) => (Some(def), prefix),
            None => (None, 0),
        }
    }
}

/// The names in the text of a unit with where they begin.
fn words_of(text: &str) -> Vec<(usize, String)> {
    if text.starts_with('%') {
        return vec![(0, text.to_string())];
    }
    let mut out: Vec<(usize, String)> = Vec::new();
    let mut open: Option<usize> = None;
    for (i, c) in text.char_indices().chain(std::iter::once((text.len(), '*'))) {
        let part = !(matches!(c, '*' | '/' | '(' | ')' | '^' | '-' | ' ') || open.is_none() && c.is_ascii_digit());
        match (open, part) {
            (None, true) => open = Some(i),
            (Some(start), false) => {
                out.push((start, text[start..i].to_string()));
                open = None;
            }
            _ => {}
        }
    }
    out
}
