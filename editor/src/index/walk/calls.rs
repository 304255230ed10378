//! Calls of skills and commands, and jobs.

use matterix_ir::Span;
use matterix_lang::ast::{Call, ExprKind, Name, NamedExpr};
use matterix_lang::names::{DeclId, verb_text};
use matterix_lang::semantic_index::Sort;

use super::super::collect::verb_span;
use super::Walk;
use crate::index::{DefId, Index, Kind, Meaning};

/// What a verb can mean in a call, with the number of its words.
struct Verb {
    def: DefId,
    words: usize,
}

impl Walk<'_> {
    /// A call; gives the skill or command it means.
    pub(super) fn call(&mut self, call: &Call) -> Option<DefId> {
        let verb = self.verb(call);
        let count = verb.as_ref().map_or(call.words.len(), |v| v.words);
        let def = verb.as_ref().map(|v| v.def);
        if let Some(span) = verb_span(&call.words[..count]) {
            self.maybe(span, def);
            if let Some(def) = def {
                self.index.own.calls.push((span, self.item, def));
            }
        }
        let params = def.map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
        let first = params.iter().copied().find(|p| {
            let p = self.index.def(*p);
            p.kind == Kind::Parameter && p.label.is_none()
        });
        let words = first.map(|p| self.index.def(p).words.clone()).unwrap_or_default();
        for word in call.words.iter().skip(count) {
            self.name(word, &words);
        }
        match call.object.as_ref().map(|object| (object, &*object.kind)) {
            Some((_, ExprKind::Tuple(items, None))) => {
                let front: Vec<DefId> = params.iter().copied().filter(|p| self.index.def(*p).label.is_none()).collect();
                for (item, param) in items.iter().zip(front.iter().map(Some).chain(std::iter::repeat(None))) {
                    let words = param.map(|p| self.index.def(*p).words.clone()).unwrap_or_default();
                    self.expr_among(item, &words);
                }
            }
            Some((object, _)) => {
                self.expr_among(object, &words);
            }
            None => {}
        }
        for (label, e) in &call.labelled {
            let group: Vec<DefId> = params
                .iter()
                .copied()
                .filter(|p| self.index.def(*p).label.as_deref() == Some(label.text.as_str()))
                .collect();
            match group.first() {
                Some(param) => self.known(label.span, *param),
                None => self.language(label.span, "the device that does it"),
            }
            match (&*e.kind, group.as_slice()) {
                (ExprKind::Tuple(items, None), [_, _, ..]) if items.len() == group.len() => {
                    for (item, param) in items.iter().zip(&group) {
                        let words = self.index.def(*param).words.clone();
                        self.expr_among(item, &words);
                    }
                }
                _ => {
                    let words = group.first().map(|p| self.index.def(*p).words.clone()).unwrap_or_default();
                    self.expr_among(e, &words);
                }
            }
        }
        self.options(&call.options, &params);
        def
    }

    /// What stands in braces: values of options or parameters.
    pub(super) fn options(&mut self, options: &[NamedExpr], params: &[DefId]) {
        for o in options {
            let param = params.iter().copied().find(|p| self.index.def(*p).name == o.name.text);
            self.maybe(o.name.span, param);
            let words = param.map(|p| self.index.def(p).words.clone()).unwrap_or_default();
            self.expr_among(&o.value, &words);
        }
    }

    fn verb(&mut self, call: &Call) -> Option<Verb> {
        for words in (1..=call.words.len()).rev() {
            let noted = verb_span(&call.words[..words]).and_then(|s| self.index.meanings.names.get(&s));
            if let Some(def) = noted.and_then(|s| self.index.declared_at(*s)) {
                return Some(Verb { def, words });
            }
        }
        for words in (1..=call.words.len()).rev() {
            let rest = call.words.len() - words;
            if rest > 1 || (rest == 1 && call.object.is_some()) {
                continue;
            }
            let all = self.index.meant_by(self.at, &verb_text(&call.words[..words]));
            if all.is_empty() {
                continue;
            }
            let device = |this: &mut Self, command: DefId| -> Sort {
                let takes = this.front(command).next().is_some();
                let is_behind = call.words.len() > words || call.object.is_some();
                let by = call.labelled.iter().find(|(l, _)| l.text == "by").map(|b| &b.1);
                match by {
                    _ if !takes && is_behind => this.behind(call, words),
                    Some(by) => this.quietly(|w| w.expr(by).sort),
                    None => Sort::Any,
                }
            };
            let mut fitting: Vec<(usize, DefId)> = Vec::new();
            for def in &all {
                let lacking = match self.index.def(*def).kind {
                    Kind::Command => {
                        let device = device(self, *def);
                        if self.index.can(&device, *def) { 0 } else { 100 }
                    }
                    _ => {
                        let first = self.front(*def).next();
                        let given = self.behind(call, words);
                        let fits = first.is_none_or(|p| self.index.may_be(&given, &self.index.def(p).sort));
                        if fits { 0 } else { 100 }
                    }
                };
                fitting.push((lacking + self.misfit(*def, call), *def));
            }
            let least = fitting.iter().map(|(misfit, _)| *misfit).min()?;
            let best: Vec<DefId> = fitting.iter().filter(|(misfit, _)| *misfit == least).map(|(_, def)| *def).collect();
            return self.index.most_derived(&best).map(|def| Verb { def, words });
        }
        None
    }

    /// The parameters of a skill or command that stand behind its verb, before any preposition.
    fn front(&self, def: DefId) -> impl Iterator<Item = DefId> + '_ {
        let inside = self.index.def(def).inside.iter().copied();
        inside.filter(|p| {
            let p = self.index.def(*p);
            p.kind == Kind::Parameter && p.label.is_none()
        })
    }

    /// What kind of value stands behind so many words of a verb.
    fn behind(&mut self, call: &Call, words: usize) -> Sort {
        match (call.words.get(words), &call.object) {
            (Some(word), _) => self.quietly(|w| w.name(word, &[]).sort),
            (None, Some(object)) => self.quietly(|w| w.expr(object).sort),
            (None, None) => Sort::Any,
        }
    }

    /// How badly a call's prepositions fit.
    fn misfit(&self, def: DefId, call: &Call) -> usize {
        let labels: Vec<&str> =
            self.index.def(def).inside.iter().filter_map(|p| self.index.def(*p).label.as_deref()).collect();
        let takes = self.front(def).next().is_some();
        let object = call.object.is_some() || call.words.len() > self.index.def(def).name.split(' ').count();
        // `by` names the device of a command whose object is something else.
        let command = self.index.def(def).kind == Kind::Command && (takes || !object);
        let unknown =
            call.labelled.iter().filter(|(l, _)| !(labels.contains(&l.text.as_str()) || command && l.text == "by"));
        let missing = labels.iter().filter(|l| !call.labelled.iter().any(|(c, _)| c.text == **l));
        unknown.count() + missing.count()
    }

    /// Looks at an expression without noting what its names stand for.
    fn quietly<T>(&mut self, look: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.index.own.uses.get(&self.file).map_or(0, Vec::len);
        let result = look(self);
        if let Some(uses) = self.index.own.uses.get_mut(&self.file) {
            uses.truncate(before);
        }
        result
    }

    /// The name of a job that is started.
    pub(super) fn job(&mut self, name: &Name, whole: Span) {
        let known = self.jobs().into_iter().find(|d| self.index.def(*d).name == name.text);
        let id = known.unwrap_or_else(|| {
            let def = super::bare(&name.text, Kind::Job, name.span, whole);
            let id = self.index.add(def);
            let item = self.item;
            if let Some(def) = self.index.own_mut(id) {
                def.owner = item;
            }
            id
        });
        self.known(name.span, id);
    }

    /// The name of a job that is waited for.
    pub(super) fn awaited(&mut self, name: &Name) {
        let known = self.jobs().into_iter().find(|d| self.index.def(*d).name == name.text);
        self.maybe(name.span, known);
    }

    /// The jobs of the item.
    fn jobs(&self) -> Vec<DefId> {
        let of = |d: &crate::index::Def| d.kind == Kind::Job && d.owner == self.item;
        self.index.own_defs().filter(|(_, d)| of(d)).map(|d| d.0).collect()
    }

    /// A verb as a driver or an `alive` line names it.
    pub(super) fn verb_of(&mut self, words: &[Name], device: &Sort) -> Option<DefId> {
        let span = verb_span(words)?;
        let all: Vec<DefId> = self.index.verbs(&verb_text(words)).collect();
        let own: Vec<DefId> = all.iter().copied().filter(|d| self.index.can(device, *d)).collect();
        let def = self.index.most_derived(&own).or(all.first().copied());
        self.note(span, def.map_or(Meaning::Unknown, Meaning::Def));
        def
    }
}

impl Index {
    /// What a verb may mean in a module: the skill that is seen, and commands.
    pub(crate) fn meant_by(&self, at: usize, verb: &str) -> Vec<DefId> {
        let skill = self.lookup(at, verb).filter(|d| self.def(*d).kind == Kind::Skill);
        let commands = self.verbs(verb).filter(|d| self.def(*d).kind == Kind::Command);
        skill.into_iter().chain(commands).collect()
    }

    /// Whether a value can be what a parameter takes, as far as both are known to be things.
    pub(crate) fn may_be(&self, given: &Sort, taken: &Sort) -> bool {
        let (Sort::Thing(kinds, _), Sort::Thing(wanted, _)) = (given, taken) else { return true };
        let has = |kind: &DeclId| kinds.iter().any(|k| k == kind || self.ancestors(*k).contains(kind));
        kinds.is_empty() || wanted.is_empty() || wanted.iter().all(has)
    }

    /// The first of some commands of one thing that no more derived capability declares again.
    fn most_derived(&self, commands: &[DefId]) -> Option<DefId> {
        commands.iter().copied().find(|d| !self.is_replaced(*d, commands))
    }

    /// Whether one of some commands of one thing is declared again by a capability that extends that of this one.
    pub(crate) fn is_replaced(&self, command: DefId, others: &[DefId]) -> bool {
        let owner = |d: DefId| self.def(d).owner.and_then(|owner| self.decl_of(owner));
        let Some(own) = owner(command).filter(|_| self.def(command).kind == Kind::Command) else { return false };
        others.iter().copied().filter(|d| *d != command && self.def(*d).kind == Kind::Command).any(|other| {
            let extends = |of| of != own && self.ancestors(of).contains(&own);
            owner(other).is_some_and(extends)
                && self.def(other).name == self.def(command).name
                && self.prepositions(other) == self.prepositions(command)
        })
    }

    /// The prepositions of a command's parameters, none for those right behind its verb.
    fn prepositions(&self, command: DefId) -> Vec<Option<&str>> {
        let inside = self.def(command).inside.iter().map(|p| self.def(*p));
        inside.filter(|p| p.kind == Kind::Parameter).map(|p| p.label.as_deref()).collect()
    }

    /// Whether a thing has the capability of a command.
    pub(crate) fn can(&self, device: &Sort, command: DefId) -> bool {
        let (Sort::Thing(kinds, _), Some(owner)) = (device, self.def(command).owner) else { return false };
        let Some(owner) = self.decl_of(owner) else { return false };
        kinds.iter().any(|k| self.ancestors(*k).contains(&owner))
    }
}
