//! Hazards on the instances of a lab: conditions that must not come about.

use matterix_ir::plan::Term;
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op, Span};

use super::Elaborator;
use crate::ast::ItemKind;
use crate::eval::{Scope, Value};
use crate::names::DeclId;

/// A hazard over instances of the lab.
#[derive(Clone, Debug)]
pub struct Hazard {
    /// `above_boiling_point`.
    pub name: String,
    /// `above_boiling_point(plate, beaker)`.
    pub shown: String,
    /// An error, not a warning.
    pub grave: bool,
    /// The first thing it is about.
    pub about: Option<InstanceId>,
    /// When it is there.
    pub when: NodeId,
    /// The states it depends on; one that depends on none is there from the start or never.
    pub states: Vec<u32>,
    /// The members it names.
    pub terms: Vec<Term>,
    /// How to mend it.
    pub help: Option<String>,
    /// Its declaration.
    pub span: Span,
}

impl<'a> Elaborator<'a> {
    /// Every hazard on every fitting combination of instances, but for those that cannot come about.
    pub fn hazards(&mut self) -> Vec<Hazard> {
        let mut out = Vec::new();
        let names = self.tables.names;
        for index in 0..names.decls.len() as u32 {
            let decl = names.decl(DeclId(index));
            let ItemKind::Hazard { name, params, when, .. } = &decl.item.kind else { continue };
            let mut tuples = self.tuples(params, decl.module, Some(when), name);
            while let Some((scope, shown)) = tuples.next(self) {
                let hazard = if self.enter(name.span) { self.hazard(&decl.item.kind, scope, shown) } else { None };
                self.leave();
                out.extend(hazard);
            }
        }
        if self.budget.is_over() {
            return Vec::new();
        }
        out
    }

    /// One hazard on a combination; none where it cannot come about.
    fn hazard(&mut self, kind: &'a ItemKind, mut scope: Scope, shown: String) -> Option<Hazard> {
        let ItemKind::Hazard { grave, name, when, help, .. } = kind else { return None };
        self.terms.clear();
        let node = self.truth(when, &mut scope)?;
        let terms = std::mem::take(&mut self.terms);
        if self.never(node) {
            return None;
        }
        let states = self.graph.schedule([node]).into_iter().filter_map(|n| match self.graph.op(n) {
            Op::State(s) => Some(s),
            _ => None,
        });
        let about = scope.vars.iter().find_map(|(_, v)| match v {
            Value::Instance(id) => Some(*id),
            _ => None,
        });
        Some(Hazard {
            name: name.text.clone(),
            shown,
            grave: *grave,
            about,
            when: node,
            states: states.collect(),
            terms,
            help: help.clone(),
            span: name.span,
        })
    }
}
