//! Noting what names and expressions are found to mean, where that is asked for.

use matterix_ir::Span;

use super::Value;
use crate::ast::{ItemKind, MemberKind};
use crate::declare::MemberRef;
use crate::declare::tables::member_name;
use crate::eval::lab::Elaborator;
use crate::eval::lab::verbs::Verb;
use crate::names::{DeclId, item_name};
use crate::semantic_index::{Seen, Sort};

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

impl Elaborator<'_> {
    /// What kind of value this is; none for a mistake.
    pub fn sort_of(&self, value: &Value) -> Option<Sort> {
        let all = |items: &[Value]| items.iter().map(|i| self.sort_of(i).unwrap_or(Sort::Any)).collect::<Vec<_>>();
        Some(match value {
            Value::Error => return None,
            Value::Num(n) => Sort::Quantity(n.dimension.clone(), n.point),
            Value::Bool(_) => Sort::Truth,
            Value::Text(_) => Sort::Text,
            Value::Place(_) => Sort::Any,
            Value::Row(table, _) => Sort::Row(*table),
            Value::Enum(_, words) => Sort::Word(words.clone()),
            Value::Range(low, _) => Sort::Range(Box::new(Sort::Quantity(low.dimension.clone(), low.point))),
            Value::Tuple(items) => Sort::Tuple(all(items)),
            Value::List(items) => {
                let first = items.first().and_then(|i| self.sort_of(i)).unwrap_or(Sort::Any);
                Sort::List(Box::new(unnamed(first)))
            }
            Value::Instance(id) | Value::Qualified(id, _) => {
                let thing = &self.instances[id.0 as usize];
                let kinds = match value {
                    Value::Qualified(_, kind) => vec![*kind],
                    _ => thing.kinds.clone(),
                };
                Sort::Thing(kinds, (!self.prototype).then(|| thing.name.clone()))
            }
            Value::InstanceNode(_) => Sort::Thing(Vec::new(), None),
            Value::Nothing => Sort::Nothing,
            Value::Unlimited => Sort::Unlimited,
            Value::Grid(id, grid) => {
                let grid = self.instances[id.0 as usize].grids.get(*grid);
                let child = grid.and_then(|g| g.children.values().next());
                let kinds = child.map_or_else(Vec::new, |c| self.instances[c.0 as usize].kinds.clone());
                Sort::List(Box::new(Sort::Thing(kinds, None)))
            }
            Value::Species(_) => Sort::Species,
            Value::Included(lab) => Sort::Lab(lab.clone()),
            Value::Reaction(_) => Sort::Reaction,
            Value::Concentration(..) => Sort::Concentration,
            Value::Frame(..) => Sort::Frame,
            Value::Kind(id) => Sort::Kind(*id),
            Value::Solution(_) => Sort::Solution,
            Value::Material(_) => Sort::Material,
            Value::Function(id) => Sort::Function(*id),
            Value::Step(..) => Sort::Step,
            Value::Method(..) => Sort::Method,
        })
    }
}

/// A thing of which only the kinds are kept, as it stands for others like it.
fn unnamed(sort: Sort) -> Sort {
    match sort {
        Sort::Thing(kinds, _) => Sort::Thing(kinds, None),
        other => other,
    }
}
