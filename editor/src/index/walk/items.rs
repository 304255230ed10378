//! Items: what is declared at the top of a file.

use matterix_ir::Span;
use matterix_lang::ast::{
    AssetLine, AssetLiteral, At, Expr, ExprKind, Field, FieldValue, FitLine, Holding, Item, ItemKind, LabLine,
    LabLineKind, Member, MemberKind, Name, NamedExpr, Path, StmtKind, StudyLine, Term, Wire, WireKind,
};
use matterix_lang::meanings::Sort;
use matterix_lang::names::DeclId;

use super::{Found, Walk};
use crate::index::{DefId, Kind, Meaning};

impl Walk<'_> {
    pub(super) fn item(&mut self, item: &Item) {
        self.scope.clear();
        self.labs.clear();
        self.this = None;
        self.end = item.span.end;
        self.file = item.span.file;
        let name = match &item.kind {
            ItemKind::Dimension { name, .. } => Some(name.span),
            ItemKind::Unit { name, .. } => Some(name.span),
            ItemKind::Skill { sig, .. } => Some(sig.span),
            _ => matterix_lang::names::item_name(item).map(|n| n.1),
        };
        self.item = name.and_then(|span| self.index.declared_at(span));
        if let (Some(span), false) = (name, matches!(item.kind, ItemKind::Skill { .. })) {
            self.declares(span);
        }
        self.inner(item);
        self.region(item.span);
    }

    fn inner(&mut self, item: &Item) {
        match &item.kind {
            ItemKind::Error => {}
            ItemKind::Use { path, names } => self.import(path, names.as_deref()),
            ItemKind::Dimension { definition, .. } => {
                if let Some(e) = definition {
                    self.dimensions(e);
                }
            }
            ItemKind::Unit { dimension, definition, origin, aliases, .. } => {
                if let Some(name) = dimension {
                    let def = self.index.measure(&name.text);
                    self.maybe(name.span, def);
                }
                self.exprs(definition.iter().chain(origin));
                for alias in aliases {
                    self.declares(alias.span);
                }
            }
            ItemKind::Species { fields, .. } => self.species_fields(fields),
            ItemKind::Solution { fields, labelled, .. } => {
                for f in fields {
                    self.global(&f.key);
                    if let FieldValue::Expr(Expr { kind, .. }) = &f.value
                        && let ExprKind::Name(n) = &**kind
                        && n.text == "rest"
                    {
                        self.language(n.span, "what the others leave of the whole");
                        continue;
                    }
                    self.value(&f.value);
                }
                if let Some(label) = labelled {
                    self.expr(&label.value);
                    self.global(&label.species);
                    self.exprs(&label.tolerance);
                }
            }
            ItemKind::Reaction { reactants, products, fields, .. } => {
                self.terms(reactants);
                self.terms(products);
                self.reaction_fields(fields);
            }
            ItemKind::ReactiveGroup { fields, .. } | ItemKind::Material { fields, .. } => self.class_fields(fields),
            ItemKind::Incompatible { a, b, fields } => {
                self.global(a);
                self.global(b);
                self.class_fields(fields);
            }
            ItemKind::Allow { a, b, .. } => {
                self.global(a);
                self.global(b);
            }
            ItemKind::Hazard { params, when, .. } => {
                self.params(params);
                self.expr(when);
            }
            ItemKind::Capability { extends, members, .. } => {
                extends.iter().for_each(|p| self.path(p));
                self.this = self.item;
                members.iter().for_each(|m| self.member_line(m));
            }
            ItemKind::Asset { extends, lines, source, .. } => {
                extends.iter().for_each(|p| self.path(p));
                if let Some((format, _)) = source {
                    self.language(format.span, "a format of files that assets come from");
                }
                self.this = self.item;
                let file = source.as_ref().map(|s| s.1.span);
                lines.iter().for_each(|l| self.asset_line(l, file));
            }
            ItemKind::Process(p) => {
                self.params(&p.params);
                self.exprs(&p.guard);
                self.laws(&p.laws);
            }
            ItemKind::Event(e) => {
                self.params(&e.params);
                self.expr(&e.when);
                self.laws(&e.laws);
            }
            ItemKind::Relation { params, definition, .. } => {
                self.params(params);
                self.exprs(definition);
            }
            ItemKind::Fn { params, result, body, options, .. } => {
                self.params(params);
                result.iter().for_each(|t| self.ty(t));
                self.exprs(body);
                self.member_options(options);
            }
            ItemKind::Const { ty, value, .. } => {
                ty.iter().for_each(|t| self.ty(t));
                let words = self.item.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
                self.expr_among(value, &words);
            }
            ItemKind::Driver { device, transport, args, wires, .. } => {
                self.path(device);
                let driver = self.index.lookup(self.at, &transport.text);
                match driver.filter(|d| self.index.def(*d).kind == Kind::Driver) {
                    Some(def) => self.known(transport.span, def),
                    None => self.language(transport.span, "a kind of line"),
                }
                for arg in args {
                    if let Some(name) = &arg.name {
                        self.language(name.span, "a setting of the line");
                    }
                    match &*arg.value.kind {
                        ExprKind::Name(n) => self.language(n.span, "a setting of the line"),
                        _ => drop(self.expr(&arg.value)),
                    }
                }
                self.this = self.named(device);
                wires.iter().for_each(|w| self.wire(w));
            }
            ItemKind::Lab { params, lines, .. } => {
                self.labs = self.item.into_iter().collect();
                self.params(params);
                lines.iter().for_each(|l| self.lab_line(l));
            }
            ItemKind::Skill { sig, clauses, body, handlers, .. } => {
                self.signature(sig, clauses);
                self.clauses(clauses);
                if let Some(body) = body {
                    self.guarded(body, handlers);
                }
            }
            ItemKind::Workflow { params, lab, body, handlers, .. } => {
                self.in_lab(lab.as_ref());
                self.params(params);
                self.guarded(body, handlers);
            }
            ItemKind::Study { of, lines, .. } => {
                self.many(of);
                lines.iter().for_each(|l| self.study_line(l));
            }
            ItemKind::Fit { of, lines, .. } => {
                self.many(of);
                lines.iter().for_each(|l| self.fit_line(l));
            }
            ItemKind::Test { lab, body, handlers, .. } => {
                match (lab, body.stmts.first().map(|s| &s.kind)) {
                    (None, Some(StmtKind::Run { workflow, .. })) => self.like(self.named(workflow)),
                    _ => self.in_lab(lab.as_ref()),
                }
                self.guarded(body, handlers);
            }
        }
    }

    fn import(&mut self, path: &Path, names: Option<&[Name]>) {
        let module = |n: usize| path.segments[..n].iter().map(|s| s.text.as_str()).collect::<Vec<_>>().join("::");
        let count = path.segments.len();
        let known = |this: &Self, name: &str| this.index.modules.iter().position(|m| m.name == name);
        let of_item = names.is_none() && count > 1 && known(self, &module(count - 1)).is_some();
        let modules = if of_item { count - 1 } else { count };
        let from = known(self, &module(modules));
        for segment in &path.segments[..modules] {
            self.note(segment.span, from.map_or(Meaning::Unknown, |m| Meaning::Module(m as u32)));
        }
        let last = path.segments.last().filter(|_| of_item);
        for name in names.into_iter().flatten().chain(last) {
            let def = from.and_then(|m| self.index.lookup(m, &name.text));
            self.maybe(name.span, def);
        }
    }

    /// What a dimension is made of.
    fn dimensions(&mut self, e: &Expr) {
        match &*e.kind {
            ExprKind::Name(n) => {
                let def = self.index.measure(&n.text);
                self.maybe(n.span, def);
            }
            ExprKind::Binary(_, a, b) => {
                self.dimensions(a);
                self.dimensions(b);
            }
            ExprKind::Tuple(items, _) => items.iter().for_each(|i| self.dimensions(i)),
            ExprKind::Unary(_, inner) => self.dimensions(inner),
            _ => {}
        }
    }

    fn terms(&mut self, terms: &[Term]) {
        terms.iter().for_each(|t| self.global(&t.species));
    }

    fn key(&mut self, field: &Field) {
        self.language(field.key.span, "a field");
    }

    fn value(&mut self, value: &FieldValue) {
        match value {
            FieldValue::Expr(e) => drop(self.expr(e)),
            FieldValue::Fields(fields) => {
                for f in fields {
                    self.key(f);
                    self.value(&f.value);
                }
            }
            FieldValue::Literal(l) => self.literal(l, None),
            FieldValue::Species(terms) => self.terms(terms),
        }
    }

    fn species_fields(&mut self, fields: &[Field]) {
        for f in fields {
            self.key(f);
            match &f.value {
                FieldValue::Expr(e) => self.classes(e),
                other => self.value(other),
            }
        }
    }

    /// Names of classes and of other species; words that a property may be.
    fn classes(&mut self, e: &Expr) {
        match &*e.kind {
            ExprKind::List(items) => items.iter().for_each(|i| self.classes(i)),
            ExprKind::Name(n) => match self.index.lookup(self.at, &n.text) {
                Some(def) => self.known(n.span, def),
                None => self.language(n.span, "a word"),
            },
            _ => drop(self.expr(e)),
        }
    }

    fn class_fields(&mut self, fields: &[Field]) {
        for f in fields {
            self.key(f);
            match &f.value {
                FieldValue::Fields(members) => {
                    for m in members {
                        self.global(&m.key);
                        if let FieldValue::Expr(e) = &m.value {
                            self.classes(e);
                        }
                    }
                }
                FieldValue::Expr(e) => self.classes(e),
                other => self.value(other),
            }
        }
    }

    fn reaction_fields(&mut self, fields: &[Field]) {
        for f in fields {
            self.key(f);
            match &f.value {
                FieldValue::Fields(orders) => {
                    for order in orders {
                        self.global(&order.key);
                        self.value(&order.value);
                    }
                }
                FieldValue::Expr(e) if f.key.text == "requires" => self.about_mixture(e),
                FieldValue::Expr(e) => drop(self.expr(e)),
                other => self.value(other),
            }
        }
    }

    /// A condition on a mixture, whose members it names: any kind that counts species may be meant.
    fn about_mixture(&mut self, e: &Expr) {
        let counting = self.index.library.per_species.iter().chain(&self.index.own.per_species).next().copied();
        let before = std::mem::replace(&mut self.this, counting.and_then(|d| self.index.def(d).owner));
        self.expr(e);
        self.this = before;
    }

    /// Options in braces after a member or a function.
    fn member_options(&mut self, options: &[NamedExpr]) {
        for o in options {
            self.language(o.name.span, "an option of a declaration");
            match &*o.value.kind {
                ExprKind::Name(n) if self.index.lookup(self.at, &n.text).is_none() => self.language(n.span, "a word"),
                _ => drop(self.expr(&o.value)),
            }
        }
    }

    fn member_line(&mut self, m: &Member) {
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

    fn at_place(&mut self, at: &At) {
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

    fn asset_line(&mut self, line: &AssetLine, file: Option<Span>) {
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
                self.literal(literal, None);
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
                self.literal(&grid.literal, None);
                self.exprs(grid.at.iter().chain(&grid.pitch).chain(&grid.row));
            }
            _ => {}
        }
    }

    /// A field of a thing: one of its members, or of its geometry.
    fn asset_field(&mut self, f: &Field, kinds: &[DeclId]) {
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
            FieldValue::Literal(l) => self.literal(l, Some(&part)),
            FieldValue::Species(terms) => self.terms(terms),
        }
    }

    /// A type with values of its fields.
    fn literal(&mut self, literal: &AssetLiteral, _: Option<&[DeclId]>) {
        self.path(&literal.ty);
        let kinds: Vec<DeclId> = self.index.kind_named(self.at, &literal.ty).into_iter().collect();
        literal.fields.iter().for_each(|f| self.asset_field(f, &kinds));
    }

    fn lab_line(&mut self, line: &LabLine) {
        match &line.kind {
            LabLineKind::Error => {}
            LabLineKind::Setting { name, value } => {
                self.declares(name.span);
                self.expr(value);
            }
            LabLineKind::Instance { name, literal, relations, holding } => {
                self.declares(name.span);
                self.literal(literal, None);
                self.exprs(relations.iter().map(|r| &r.1));
                match holding {
                    Some(Holding::Expr(e)) => drop(self.expr(e)),
                    Some(Holding::Places(fills)) => {
                        for fill in fills {
                            for place in std::iter::once(&fill.from).chain(&fill.to) {
                                self.language(place.span, "a place of the grid");
                            }
                            self.expr(&fill.value);
                        }
                    }
                    None => {}
                }
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
    fn in_lab(&mut self, lab: Option<&Path>) {
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
    fn like(&mut self, workflow: Option<DefId>) {
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

    fn many(&mut self, of: &Path) {
        self.path(of);
        self.like(self.named(of));
    }

    fn study_line(&mut self, line: &StudyLine) {
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
    fn report(&mut self, e: &Expr) {
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

    fn fit_line(&mut self, line: &FitLine) {
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
    fn study_path(&mut self, e: &Expr) -> Found {
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
                        self.language(name.span, "a part of what is given");
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

    fn wire(&mut self, wire: &Wire) {
        let depth = self.scope.len();
        self.end = wire.span.end;
        let device = Sort::Thing(self.this.and_then(|k| self.index.decl_of(k)).into_iter().collect(), None);
        match &wire.kind {
            WireKind::Error => {}
            WireKind::Command { sig, exchange } => {
                let command = self.verb_of(&sig.verb, &device);
                let params = command.map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
                for p in sig.all_params() {
                    let param = params.iter().copied().find(|d| self.index.def(*d).name == p.name.text);
                    match param {
                        Some(param) => {
                            self.known(p.name.span, param);
                            self.enter(&p.name.text, param, p.name.span.start);
                        }
                        None => drop(self.bind(Kind::Parameter, &p.name, p.name.span, &Found::nothing())),
                    }
                }
                // What the command takes is seen in what is sent, options too.
                for param in params {
                    let name = self.index.def(param).name.clone();
                    self.scope.push((name, param));
                }
                self.exchange(exchange);
            }
            WireKind::Reading { path, condition, asks, .. } => {
                let kinds = match &device {
                    Sort::Thing(kinds, _) => kinds.clone(),
                    _ => Vec::new(),
                };
                let mut sort = Sort::Thing(kinds, None);
                for segment in &path.segments {
                    let member = self.index.member_of(&sort, &segment.text);
                    self.note(segment.span, member.as_ref().map_or(Meaning::Unknown, |m| m.meaning));
                    sort = member.map_or(Sort::Any, |m| m.sort);
                }
                self.exprs(condition);
                self.text(asks);
            }
            WireKind::Reply { fails, .. } => self.failure(fails),
            WireKind::Answers { with, .. } => self.text(with),
            WireKind::Fixed { when, condition, exchange } => {
                self.language(when.span, "when it is said");
                self.exprs(condition);
                self.exchange(exchange);
            }
            WireKind::Alive { condition, every, by, otherwise } => {
                self.exprs([condition, every]);
                self.verb_of(by, &device);
                self.verb_of(otherwise, &device);
            }
        }
        self.scope.truncate(depth);
    }

    fn exchange(&mut self, exchange: &matterix_lang::ast::Exchange) {
        exchange.sends.iter().for_each(|t| self.text(t));
        if let Some(until) = &exchange.until {
            self.text(&until.asks);
            self.expr(&until.timeout);
        }
    }
}
