//! Members of capabilities and lines of assets.

use matterix_ir::Span;
use matterix_lang::ast::{AssetLine, AssetLiteral, At, ExprKind, Field, FieldValue, Member, MemberKind, NamedExpr};
use matterix_lang::names::DeclId;
use matterix_lang::semantic_index::Sort;

use super::{Found, Walk};
use crate::index::Kind;

impl Walk<'_> {
    /// Options in braces after a member or a function.
    pub(super) fn member_options(&mut self, options: &[NamedExpr]) {
        for o in options {
            self.language(o.name.span, "an option of a declaration");
            match &*o.value.kind {
                ExprKind::Name(n) if self.index.lookup(self.at, &n.text).is_none() => self.language(n.span, "a word"),
                _ => drop(self.expr(&o.value)),
            }
        }
    }

    pub(super) fn member_line(&mut self, m: &Member) {
        let depth = self.scope.len();
        let item = self.item;
        self.end = m.span.end;
        match &m.kind {
            MemberKind::Error => {}
            MemberKind::Value { name, ty, per, value, options, .. } => {
                let def = self.declares(name.span);
                self.ty(ty);
                if let Some(per) = per {
                    self.language(per.span, "one for each species");
                }
                let words = def.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
                if let Some(value) = value {
                    self.expr_among(value, &words);
                }
                self.member_options(options);
            }
            MemberKind::View { param, ty, value } => {
                self.param(param);
                self.ty(ty);
                let sort = self.index.typed(self.at, param.ty.as_ref(), None);
                self.bind(Kind::Parameter, &param.name, m.span, &Found::of(sort));
                self.expr(value);
            }
            MemberKind::Command { sig, clauses } => {
                self.item = self.index.declared_at(sig.span).or(item);
                self.signature(sig, clauses);
                self.clauses(clauses);
                self.region(m.span);
            }
            MemberKind::Process(p) => {
                self.declares(p.name.span);
                self.params(&p.params);
                self.exprs(&p.guard);
                self.laws(&p.laws);
            }
            MemberKind::Event(e) => {
                self.declares(e.name.span);
                self.params(&e.params);
                self.expr(&e.when);
                self.exprs(e.delay.iter().map(|d| &d.time));
                self.laws(&e.laws);
            }
            MemberKind::Limit { cond, refusal, .. } => self.condition(cond, refusal.as_ref()),
            MemberKind::Frame { name, at } => {
                self.declares(name.span);
                at.iter().for_each(|at| self.at_place(at));
            }
        }
        self.item = item;
        self.scope.truncate(depth);
    }

    pub(super) fn at_place(&mut self, at: &At) {
        match &*at.position.kind {
            ExprKind::Name(n) if self.index.lookup(self.at, &n.text).is_none() => {
                self.language(n.span, "a point of the shape");
            }
            _ => drop(self.expr(&at.position)),
        }
        if let Some(from) = &at.from {
            let kind = self.this.and_then(|k| self.index.decl_of(k));
            let def = kind.and_then(|k| self.index.declared_member(&[k], &from.text));
            match def {
                Some(def) => self.known(from.span, def),
                None => self.language(from.span, "a frame or joint of its description"),
            }
        }
        self.exprs(&at.turned);
    }

    pub(super) fn asset_line(&mut self, line: &AssetLine, file: Option<Span>) {
        match line {
            AssetLine::Error(_) | AssetLine::Mesh(..) | AssetLine::Robot(..) => {}
            AssetLine::Field(f) if Some(f.span) != file && Some(f.key.span) != file => {
                let kind = self.this.and_then(|k| self.index.decl_of(k));
                self.asset_field(f, &kind.into_iter().collect::<Vec<_>>());
            }
            AssetLine::Frame { name, at } if Some(name.span) != file => {
                self.declares(name.span);
                self.at_place(at);
            }
            AssetLine::Solid { shape, at } => {
                self.expr(shape);
                at.iter().for_each(|at| self.at_place(at));
            }
            AssetLine::Joint(joint) => {
                self.declares(joint.name.span);
                if let Some(way) = &joint.way {
                    self.expr(&way.axis);
                    way.at.iter().for_each(|at| self.at_place(at));
                }
                self.expr(&joint.by);
            }
            AssetLine::Part { name, literal } if Some(name.span) != file => {
                self.declares(name.span);
                self.literal(literal);
            }
            AssetLine::Grid(grid) if Some(grid.name.span) != file => {
                let first = self.index.declared_at(grid.name.span).or_else(|| {
                    let kind = self.this.and_then(|k| self.index.decl_of(k))?;
                    self.index.declared_member(&[kind], &grid.name.text)
                });
                self.maybe(grid.name.span, first);
                for place in std::iter::once(&grid.from).chain(&grid.to) {
                    self.language(place.span, "a place of the grid");
                }
                self.literal(&grid.literal);
                self.exprs(grid.at.iter().chain(&grid.pitch).chain(&grid.row));
            }
            _ => {}
        }
    }

    /// A field of a thing: one of its members, or of its geometry.
    pub(super) fn asset_field(&mut self, f: &Field, kinds: &[DeclId]) {
        let def = self.index.declared_member(kinds, &f.key.text);
        match def {
            Some(def) => self.known(f.key.span, def),
            None => self.language(f.key.span, "a field"),
        }
        let words = def.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
        let part: Vec<DeclId> = match def.map(|d| &self.index.def(d).sort) {
            Some(Sort::Thing(kinds, _)) => kinds.clone(),
            Some(Sort::List(inner)) => match &**inner {
                Sort::Thing(kinds, _) => kinds.clone(),
                _ => Vec::new(),
            },
            _ => Vec::new(),
        };
        match &f.value {
            FieldValue::Expr(e) => drop(self.expr_among(e, &words)),
            FieldValue::Fields(fields) => fields.iter().for_each(|f| self.asset_field(f, &part)),
            FieldValue::Literal(l) => self.literal(l),
            FieldValue::Species(terms) => self.terms(terms),
        }
    }

    /// A type with values of its fields.
    pub(super) fn literal(&mut self, literal: &AssetLiteral) {
        self.path(&literal.ty);
        let kinds: Vec<DeclId> = self.index.kind_named(self.at, &literal.ty).into_iter().collect();
        literal.fields.iter().for_each(|f| self.asset_field(f, &kinds));
    }
}
