//! Studies and fits.

use matterix_lang::ast::{Expr, ExprKind, FitLine, Path, StudyLine};
use matterix_lang::semantic_index::Sort;

use super::{Found, Walk};
use crate::index::{Kind, Meaning};

impl Walk<'_> {
    pub(super) fn many(&mut self, of: &Path) {
        self.path(of);
        self.like(self.named(of));
    }

    pub(super) fn study_line(&mut self, line: &StudyLine) {
        match line {
            StudyLine::Error(_) => {}
            StudyLine::Vary { path, range, by } => {
                self.study_path(path);
                self.expr(range);
                if let Some((name, args)) = by {
                    self.language(name.span, "how values are drawn");
                    for arg in args {
                        if let Some(name) = &arg.name {
                            self.language(name.span, "an argument");
                        }
                        self.expr(&arg.value);
                    }
                }
            }
            StudyLine::Runs(e) => drop(self.expr(e)),
            StudyLine::Report { name, value } => {
                self.report(value);
                let item = self.item;
                let id = self.index.add(super::bare(&name.text, Kind::Report, name.span, name.span.to(value.span)));
                if let Some(def) = self.index.own_mut(id) {
                    def.owner = item;
                }
                self.known(name.span, id);
            }
        }
    }

    /// What is reported: a value at the end, or a figure of all of the run.
    pub(super) fn report(&mut self, e: &Expr) {
        match &*e.kind {
            ExprKind::As(inner, unit) => {
                self.report(inner);
                self.unit(unit);
            }
            ExprKind::Call(callee, args) => match &*callee.kind {
                ExprKind::Name(n) if n.text.ends_with("_over_time") => {
                    self.language(n.span, "a figure of all of the run");
                    self.exprs(args.iter().map(|a| &a.value));
                }
                _ => drop(self.expr(e)),
            },
            _ => drop(self.expr(e)),
        }
    }

    pub(super) fn fit_line(&mut self, line: &FitLine) {
        match line {
            FitLine::Error(_) | FitLine::Data(_) => {}
            FitLine::Estimate { path, range, .. } => {
                self.study_path(path);
                self.expr(range);
            }
            FitLine::Match { value, unit, noise, .. } => {
                self.expr(value);
                unit.iter().for_each(|u| self.unit(u));
                self.exprs(noise);
            }
        }
    }

    /// What a study varies: names of the lab and of reactions, what is held at the start, arguments of rate laws.
    pub(super) fn study_path(&mut self, e: &Expr) -> Found {
        match &*e.kind {
            ExprKind::Member(base, name) => {
                let of = self.study_path(base);
                let kind = of.def.map(|d| self.index.def(d).kind);
                let found = match (kind, &of.sort) {
                    (Some(Kind::Lab), _) => {
                        let inside = of.def.map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
                        inside.into_iter().find(|d| self.index.def(*d).name == name.text)
                    }
                    (_, Sort::Reaction | Sort::Any) => None,
                    (_, sort) => match self.index.member_of(sort, &name.text) {
                        Some(member) => {
                            self.note(name.span, member.meaning);
                            let def = match member.meaning {
                                Meaning::Def(def) => Some(def),
                                _ => None,
                            };
                            return Found { sort: member.sort, def };
                        }
                        None => None,
                    },
                };
                match found {
                    Some(def) => {
                        self.known(name.span, def);
                        self.value_of(def)
                    }
                    None => {
                        self.language(name.span, "a part of an argument");
                        Found::nothing()
                    }
                }
            }
            ExprKind::IndexWord(base, word) => {
                let base = self.study_path(base);
                match self.index.lookup(self.at, &word.text) {
                    Some(def) => self.known(word.span, def),
                    None => self.language(word.span, "a place of the grid"),
                }
                Found::of(self.index.element_of(&base.sort).unwrap_or(Sort::Any))
            }
            // Reactions are known by name wherever they are declared.
            ExprKind::Name(n) if self.find(n).is_none() => {
                let reaction = |d: &&crate::index::Def| d.kind == Kind::Reaction && d.name == n.text;
                let def = self.index.defs().find(|(_, d)| reaction(d)).map(|d| d.0);
                self.maybe(n.span, def);
                Found { sort: def.map_or(Sort::Any, |_| Sort::Reaction), def }
            }
            _ => self.expr(e),
        }
    }
}
