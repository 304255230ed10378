//! What names and expressions were found to mean while a text was checked. It is noted only where that is asked for, by the
//! evaluator and the planner themselves, so that what is shown is what was checked.

mod noted;
mod sort;

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::{FileId, Span, Unit};
use rustc_hash::FxHashMap;

pub use noted::Noted;
pub use sort::Sort;

use crate::ast::{ItemKind, MemberKind};
use crate::elaborate::tables::{MemberRef, member_name};
use crate::elaborate::verbs::Verb;
use crate::elaborate::{Elaborator, Tables};
use crate::eval::Value;
use crate::library;
use crate::names::{DeclId, item_name};
use crate::units::Units;

/// What an expression was found to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// What kind of value it is.
    pub sort: Sort,
    /// Its value, SI, where it is always the same number.
    pub value: Option<f64>,
    /// The unit it was written in.
    pub unit: Option<Unit>,
}

/// What was noted, where that is asked for.
pub type Seeing = Option<Box<Meanings>>;

/// All that a check has noted of a package, as it was noted piece by piece.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// What is declared.
    pub around: Around,
    /// What the checks of declarations and of each workflow have noted; of what several did the first counts.
    pub pieces: Vec<Noted>,
}

impl Gathered {
    /// All of it as one.
    pub fn joined(&self) -> Meanings {
        let mut all = Meanings::default();
        self.pieces.iter().for_each(|piece| piece.join_into(&mut all));
        all
    }
}

/// What was noted.
#[derive(Clone, Debug, Default)]
pub struct Meanings {
    /// Names, and where what they stand for is declared: its name, or the call form of a skill or command.
    pub names: FxHashMap<Span, Span>,
    /// Expressions.
    pub values: FxHashMap<Span, Seen>,
    /// Everything in each lab that was built, with its kinds, by the full names of both.
    pub things: BTreeMap<String, BTreeMap<String, Vec<DeclId>>>,
    /// A file of the library that is looked at; the others are not.
    pub opened: Option<FileId>,
}

/// What is declared, apart from the texts that declare it.
#[derive(Clone, Debug, Default)]
pub struct Around {
    /// What the names that each module sees stand for.
    pub scopes: Vec<BTreeMap<Arc<str>, DeclId>>,
    /// Each capability and asset with everything that it extends, most derived first.
    pub ancestors: BTreeMap<DeclId, Vec<DeclId>>,
    /// All dimensions and units.
    pub units: Units,
}

impl Around {
    /// What the tables say; the scopes of the modules are still to come.
    pub fn of(tables: &Tables<'_>) -> Around {
        let ancestors = tables.kinds.values().map(|kind| (kind.id, kind.ancestors.clone())).collect();
        Around { scopes: Vec::new(), ancestors, units: tables.units.clone() }
    }
}

impl Meanings {
    /// Whether what stands in a file is noted: the user's own files and the one of the library that is looked at.
    fn notes(&self, file: FileId) -> bool {
        !library::is_module(file) || self.opened == Some(file)
    }

    /// Notes a value; where there is one already, what is not the same in both is forgotten.
    fn see(&mut self, span: Span, seen: Seen) {
        match self.values.entry(span) {
            std::collections::hash_map::Entry::Vacant(free) => {
                free.insert(seen);
            }
            std::collections::hash_map::Entry::Occupied(mut known) => {
                let known = known.get_mut();
                if known.value != seen.value {
                    known.value = None;
                }
                known.sort.join(seen.sort);
            }
        }
    }
}

impl<'a> Elaborator<'a> {
    /// Notes where what a name stands for is declared.
    pub fn note_name(&mut self, name: Span, declared: impl FnOnce(&Self) -> Option<Span>) {
        if !self.meanings.as_ref().is_some_and(|m| m.notes(name.file)) {
            return;
        }
        let declared = declared(self);
        if let (Some(meanings), Some(declared)) = (&mut self.meanings, declared) {
            meanings.names.entry(name).or_insert(declared);
        }
    }

    /// Notes that a name stands for a member.
    pub fn note_member(&mut self, name: Span, m: MemberRef<'a>) {
        self.note_name(name, |_| member_name(m.member).map(|n| n.span));
    }

    /// Notes that a name stands for a declaration.
    pub fn note_declared(&mut self, name: Span, id: DeclId) {
        self.note_name(name, |lab| item_name(lab.tables.names.decl(id).item).map(|n| n.1));
    }

    /// Notes what the verb of a call means.
    pub fn note_verb(&mut self, verb: Span, meant: &Verb<'a>) {
        self.note_name(verb, |lab| match meant {
            Verb::Skill(id) => match &lab.tables.names.decl(*id).item.kind {
                ItemKind::Skill { sig, .. } => Some(sig.span),
                _ => None,
            },
            Verb::Command(_, m) => match &m.member.kind {
                MemberKind::Command { sig, .. } => Some(sig.span),
                _ => None,
            },
        });
    }

    /// Notes what an expression was found to be.
    pub fn note_value(&mut self, at: Span, value: &Value) {
        let Some(meanings) = &self.meanings else { return };
        if !meanings.notes(at.file) {
            return;
        }
        let Some(sort) = self.sort_of(value) else { return };
        let varies = meanings.values.get(&at).is_some_and(|s| s.value.is_none());
        let (mut number, mut unit) = (None, None);
        if let Value::Num(n) = value {
            number = if varies || self.prototype { self.graph.constant(n.node) } else { self.glance(n.node) };
            unit = n.unit.as_deref().cloned();
        }
        let seen = Seen { sort, value: number.filter(|v| v.is_finite()), unit };
        if let Some(meanings) = &mut self.meanings {
            meanings.see(at, seen);
        }
    }

    /// Notes everything that is in the lab.
    pub fn note_things(&mut self, lab: DeclId) {
        let Some(meanings) = &mut self.meanings else { return };
        let Some((name, _)) = item_name(self.tables.names.decl(lab).item) else { return };
        let things = self.instances.iter().map(|i| (i.name.clone(), i.kinds.clone())).collect();
        meanings.things.insert(name, things);
    }
}
