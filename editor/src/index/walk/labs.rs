//! Lines of labs, and what of a lab is seen.

use matterix_lang::ast::{Contents, ItemKind, LabLine, LabLineKind, Path};

use super::Walk;
use crate::index::{DefId, Kind};

impl Walk<'_> {
    pub(super) fn lab_line(&mut self, line: &LabLine) {
        match &line.kind {
            LabLineKind::Error => {}
            LabLineKind::Setting { name, value } => {
                self.declares(name.span);
                self.expr(value);
            }
            LabLineKind::Instance { name, literal, relations, holding } => {
                self.declares(name.span);
                self.literal(literal);
                self.exprs(relations.iter().map(|r| &r.1));
                let Some(holding) = holding else { return };
                match &holding.contents {
                    Contents::Expr(e) => drop(self.expr(e)),
                    Contents::Places(fills) => {
                        for fill in fills {
                            for place in std::iter::once(&fill.from).chain(&fill.to) {
                                self.language(place.span, "a place of the grid");
                            }
                            self.expr(&fill.value);
                            self.exprs(&fill.at);
                        }
                    }
                }
                self.exprs(&holding.at);
            }
            LabLineKind::Include { lab, name, relations, options } => {
                self.path(lab);
                self.declares(name.span);
                self.exprs(relations.iter().map(|r| &r.1));
                let inside = self.named(lab).map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
                self.options(options, &inside);
            }
            LabLineKind::Between { a, b, fields } => {
                self.exprs([a, b]);
                for f in fields {
                    self.global(&f.key);
                    self.value(&f.value);
                }
            }
        }
    }

    /// The things of a lab are seen; of all labs where any will do.
    pub(super) fn in_lab(&mut self, lab: Option<&Path>) {
        match lab {
            Some(path) => {
                self.path(path);
                self.labs = self.named(path).into_iter().collect();
            }
            None => {
                let labs = self.index.visible(self.at).filter(|(_, d)| self.index.def(*d).kind == Kind::Lab);
                self.labs = labs.map(|l| l.1).collect();
            }
        }
    }

    /// What a workflow sees is seen.
    pub(super) fn like(&mut self, workflow: Option<DefId>) {
        let Some(workflow) = workflow else { return self.in_lab(None) };
        let modules = self.index.modules.clone();
        let span = self.index.def(workflow).span;
        let items = modules.iter().flat_map(|m| &m.tree.items);
        let lab = items.filter_map(|i| match &i.kind {
            ItemKind::Workflow { name, lab, .. } if name.span == span => Some(lab),
            _ => None,
        });
        self.labs = match lab.into_iter().next() {
            Some(Some(path)) => {
                let at = self.index.module_of(span.file).unwrap_or(self.at);
                path.segments.last().and_then(|n| self.index.lookup(at, &n.text)).into_iter().collect()
            }
            _ => {
                self.index.visible(self.at).filter(|(_, d)| self.index.def(*d).kind == Kind::Lab).map(|l| l.1).collect()
            }
        };
        for param in self.index.def(workflow).inside.clone() {
            let name = self.index.def(param).name.clone();
            self.enter(&name, param, self.end.min(span.end));
        }
        // Steps stay in sight when their workflow has ended.
        let steps: Vec<_> = self
            .index
            .defs()
            .filter(|(_, d)| d.kind == Kind::Step && d.owner == Some(workflow))
            .map(|d| (d.1.name.clone(), d.0))
            .collect();
        self.scope.extend(steps);
    }
}
