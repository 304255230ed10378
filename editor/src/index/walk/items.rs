//! Items: what is declared at the top of a file.

use matterix_lang::ast::{Expr, ExprKind, FieldValue, Item, ItemKind, Name, Path, StmtKind};
use matterix_lang::elaborate::hazards::transfer;
use matterix_lang::semantic_index::Sort;

use super::{Found, Walk};
use crate::index::{Kind, Meaning};

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
                        self.language(n.span, "the rest, up to the whole");
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
            ItemKind::Interaction { between, fields, .. } => {
                self.terms(between);
                self.reaction_fields(fields);
            }
            ItemKind::Reaction { reactants, products, fields, .. }
            | ItemKind::Equilibrium { reactants, products, fields, .. } => {
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
            ItemKind::Accept { name, .. } => self.global(name),
            ItemKind::Hazard { params, of, after, when, because, .. } => {
                self.params(params);
                if let Some(share) = of.iter().chain(after).find_map(share_moved) {
                    self.bind(Kind::Variable, share, item.span, &Found::of(Sort::number()));
                }
                self.exprs(of.iter().chain(after));
                self.expr(when);
                because.iter().for_each(|words| self.said_of(when, words));
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
                self.exprs(e.delay.iter().map(|d| &d.time));
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
            ItemKind::Table { source, columns, .. } => {
                self.language(source.0.span, "a format of files that tables come from");
                for column in columns {
                    let def = self.declares(column.name.span);
                    self.ty(&column.ty);
                    column.unit.iter().for_each(|unit| self.unit(unit));
                    let words = def.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
                    column.default.iter().for_each(|e| drop(self.expr_among(e, &words)));
                }
            }
            ItemKind::Const { ty, value, .. } => {
                ty.iter().for_each(|t| self.ty(t));
                let words = self.item.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
                self.expr_among(value, &words);
            }
            ItemKind::Framing { fields, .. } => {
                // Parts of frames and checksums are words of the language.
                for f in fields {
                    self.language(f.key.span, "a field of a framing");
                    if let FieldValue::Expr(e) = &f.value {
                        self.frame_words(e);
                    }
                }
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
                    let is_framing = arg.name.as_ref().is_some_and(|n| n.text == "framing");
                    match &*arg.value.kind {
                        ExprKind::Name(n) if is_framing => {
                            let framing = self.index.lookup(self.at, &n.text);
                            match framing.filter(|d| self.index.def(*d).kind == Kind::Framing) {
                                Some(def) => self.known(n.span, def),
                                None => self.language(n.span, "a framing"),
                            }
                        }
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
}

/// The name that `move(share, from: a, to: b)` gives to the share.
fn share_moved(of: &Expr) -> Option<&Name> {
    match &*transfer(of)?.0.kind {
        ExprKind::Name(n) => Some(n),
        _ => None,
    }
}
