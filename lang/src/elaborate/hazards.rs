//! Hazards on the instances of a lab: conditions that must not come about.

use matterix_ir::model::Danger;
use matterix_ir::plan::Term;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Code, NodeId, Op, Severity, Span, codes};

use super::Elaborator;
use crate::ast::ItemKind;
use crate::eval::Value;
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

impl Hazard {
    /// The kind of finding.
    pub fn code(&self) -> Code {
        codes::find(&self.name.replace('_', "-")).unwrap_or(codes::HAZARD)
    }

    /// What is dangerous about which things.
    pub fn headline(&self) -> String {
        let about = self.shown.split_once('(').map_or("", |s| s.1.trim_end_matches(')'));
        let things: Vec<String> = about.split(", ").map(|t| format!("`{t}`")).collect();
        format!("{}: {}", self.name.replace('_', " "), things.join(" and "))
    }

    /// An error, or a warning.
    pub fn severity(&self) -> Severity {
        if self.grave { Severity::Error } else { Severity::Warning }
    }
}

impl Elaborator<'_> {
    /// What a run watches for. What depends on no state is there from the start or never, which is told before the run.
    pub fn dangers(&mut self) -> Vec<Danger> {
        let all = self.hazards().into_iter().filter(|h| !h.states.is_empty());
        let danger = |h: Hazard| Danger {
            code: h.code(),
            severity: h.severity(),
            when: h.when,
            headline: h.headline(),
            help: h.help.iter().cloned().collect(),
            span: h.span,
        };
        all.map(danger).collect()
    }

    /// Every hazard on every fitting combination of instances, but for those that cannot come about.
    pub fn hazards(&mut self) -> Vec<Hazard> {
        let mut out = Vec::new();
        let names = self.tables.names;
        for index in 0..names.decls.len() as u32 {
            let decl = names.decl(DeclId(index));
            let ItemKind::Hazard { grave, name, params, when, help } = &decl.item.kind else { continue };
            for (mut scope, shown) in self.tuples(params, decl.module, Some(when), name) {
                self.terms.clear();
                let Some(node) = self.truth(when, &mut scope) else { continue };
                let terms = std::mem::take(&mut self.terms);
                if self.never(node) {
                    continue;
                }
                let states = self.graph.schedule([node]).into_iter().filter_map(|n| match self.graph.op(n) {
                    Op::State(s) => Some(s),
                    _ => None,
                });
                let states: Vec<u32> = states.collect();
                let about = scope.vars.iter().find_map(|(_, v)| match v {
                    Value::Instance(id) => Some(*id),
                    _ => None,
                });
                out.push(Hazard {
                    name: name.text.clone(),
                    shown,
                    grave: *grave,
                    about,
                    when: node,
                    states,
                    terms,
                    help: help.clone(),
                    span: name.span,
                });
            }
        }
        out
    }
}
