//! A lab: its settings, instances, places, contents and pair parameters.

use std::collections::BTreeMap;

use matterix_ir::scene::{InstanceId, Pose};
use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{
    self, AssetLine, AssetLiteral, Contents, Expr, Field, FieldValue, Holding, ItemKind, LabLineKind, Name,
};
use crate::declare::Type;
use crate::declare::tables::Kind;
use crate::eval::lab::instances::Setting;
use crate::eval::lab::{Elaborator, Pair};
use crate::eval::{Scope, Value};
use crate::names::DeclId;
use crate::near;

impl<'a> Elaborator<'a> {
    /// Builds the instances of a lab, then their states.
    pub fn lab(&mut self, id: DeclId) {
        let decl = self.tables.names.decl(id);
        let ItemKind::Lab { name, .. } = &decl.item.kind else { return };
        self.lab_name = name.span;
        let benches = self.open_labs(id);
        for bench in &benches {
            self.within_lab(&bench.within, |this| {
                for (id, relations, holding) in &bench.made {
                    this.place(*id, relations, bench.module);
                    if let Some(holding) = holding {
                        this.hold(*id, holding, bench.module);
                    }
                }
            });
        }
        self.place_labs();
        for bench in &benches {
            self.within_lab(&bench.within, |this| {
                for line in bench.lines {
                    if let LabLineKind::Between { a, b, fields } = &line.kind {
                        this.between(a, b, fields, bench.module);
                    }
                }
            });
        }
        for i in 0..self.instances.len() as u32 {
            self.declare_states(InstanceId(i));
        }
        self.foresee_targets();
        self.note_first_targets();
        self.judge_coverings();
    }

    pub(super) fn lab_setting(&mut self, name: &'a Name, value: &'a Expr, module: usize) {
        let v = self.expr(value, &mut Scope { lab: true, ..Scope::module(module) });
        let v = match self.tables.units.dimension("Temperature") {
            Some(def) if name.text == "ambient" => {
                let ty = Type::Quantity { dimension: def.dimension.clone(), point: true, optional: false };
                self.coerce(v, &ty, value.span, &name.text)
            }
            _ => v,
        };
        let v = match v {
            Value::Num(n) => Value::Num(self.name_param(&name.text, n, value.span)),
            other => other,
        };
        match self.settings.get(&name.text).cloned() {
            Some(first) => self.same_setting(name, &first, &v),
            None => {
                self.settings.insert(name.text.clone(), v);
            }
        }
    }

    pub(super) fn lab_instance(
        &mut self,
        name: &'a Name,
        literal: &'a AssetLiteral,
        module: usize,
    ) -> Option<InstanceId> {
        let full = format!("{}{}", self.within, name.text);
        if let Some(first) = self.find_instance(&full) {
            let span = self.instances[first.0 as usize].span;
            self.report(
                Diagnostic::error(
                    codes::DUPLICATE_NAME,
                    name.span,
                    format!("`{}` is declared twice", name.text),
                    "declared again here",
                )
                .because(span, "first declared here"),
            );
            return None;
        }
        let kind = self.kind_named(&literal.ty, module)?;
        if !self.tables.kinds.get(&kind).is_some_and(|k| k.is_asset) {
            let names = self.tables.names;
            let fits: Vec<String> = self
                .tables
                .kinds
                .values()
                .filter(|k| k.is_asset && k.has(kind))
                .map(|k| format!("{}::{}", names.modules[names.decl(k.id).module].name, k.name))
                .take(3)
                .collect();
            let mut d = Diagnostic::error(
                codes::WRONG_KIND,
                literal.ty.span,
                format!("`{}` is a capability, not a thing", self.tables.kind_name(kind)),
                "a lab contains assets",
            );
            d.help.extend(near::question(&fits));
            self.report(d);
            return None;
        }
        // What is wrong with the asset is said where it is declared.
        let unread = |k: &Kind<'a>| k.lines.iter().any(|(_, line)| matches!(line, AssetLine::Error(_)));
        if self.tables.kinds.get(&kind).is_some_and(unread) {
            return None;
        }
        self.check_fields(kind, &literal.fields);
        let settings = literal.fields.iter().map(|field| Setting { module, field, lab: true, of: None }).collect();
        Some(self.instantiate(full, vec![kind], settings, None, name.span))
    }

    fn place(&mut self, id: InstanceId, relations: &'a [(Name, Expr)], module: usize) {
        for (label, operand) in relations {
            if label.text == "with" {
                let mut scope = Scope { lab: true, ..Scope::module(module) };
                if let Some(rpy) = self.turned(operand, &mut scope) {
                    let pose = &mut self.instances[id.0 as usize].pose;
                    *pose = Pose::turned(pose.position, rpy);
                }
                continue;
            }
            let v = self.expr(operand, &mut Scope { lab: true, ..Scope::module(module) });
            match (label.text.as_str(), v) {
                (_, Value::Error) => {}
                ("at", Value::Tuple(items)) => {
                    if let Some(position) = self.position(&items, operand) {
                        self.instances[id.0 as usize].pose.position = position;
                        self.instances[id.0 as usize].at = Some(operand.span);
                    }
                }
                ("at", Value::Num(n)) if n.point => {
                    let what = self.describe(&n);
                    let headline = format!("`at` expects a position `(x, y, z) mm`, found {what}");
                    let d = Diagnostic::error(codes::TYPE_MISMATCH, operand.span, headline, format!("this is {what}"));
                    self.report(d.help("give the initial temperature once, after the whole `holding ...`"));
                }
                ("at", other) => {
                    self.expected("a position `(x, y, z) mm`", &other, operand.span);
                }
                (word, Value::Instance(on)) if on != id => {
                    self.instances[id.0 as usize].placed.push((word.to_string(), on));
                }
                (_, Value::Instance(_)) => self.report(Diagnostic::error(
                    codes::CIRCULAR,
                    operand.span,
                    "a thing cannot be placed on itself",
                    "this is the same instance",
                )),
                (_, other) => {
                    self.expected("an instance of the lab", &other, operand.span);
                }
            }
        }
    }

    fn hold(&mut self, id: InstanceId, holding: &'a Holding, module: usize) {
        match &holding.contents {
            Contents::Expr(e) => self.hold_in(id, e, holding.at.as_ref(), module),
            Contents::Places(fills) => self.fill(id, fills, holding.at.as_ref(), module),
        }
    }

    /// What the places of a grid hold; `at` is how warm those are that say nothing else.
    fn fill(&mut self, id: InstanceId, fills: &'a [ast::Fill], at: Option<&'a Expr>, module: usize) {
        let mut filled: BTreeMap<InstanceId, Span> = BTreeMap::new();
        for fill in fills {
            let span = fill.to.as_ref().map_or(fill.from.span, |to| fill.from.span.to(to.span));
            let Some((_, grid)) = self.grid_of(&Value::Instance(id)) else {
                let (name, kind) = (self.instances[id.0 as usize].name.clone(), self.kind_names(id));
                self.report(
                    Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        span,
                        format!("`{name}` ({kind}) has no separate places to fill"),
                        "it has no such place",
                    )
                    .help("write its contents without braces: `holding 10 g of water`"),
                );
                return;
            };
            for child in self.children_at(id, grid, &fill.from, fill.to.as_ref()).unwrap_or_default() {
                if let Some(first) = filled.insert(child, span) {
                    let name = self.instances[child.0 as usize].name.clone();
                    let headline = format!("`{name}` is filled twice");
                    self.report(
                        Diagnostic::error(codes::DUPLICATE_NAME, span, headline, "filled again here")
                            .because(first, "filled here"),
                    );
                    return;
                }
                self.hold_in(child, &fill.value, fill.at.as_ref().or(at), module);
            }
        }
    }

    fn hold_in(&mut self, id: InstanceId, e: &'a Expr, at: Option<&'a Expr>, module: usize) {
        let inst = &self.instances[id.0 as usize];
        let (name, declared) = (inst.name.clone(), inst.span);
        let Some(target) = self.mixture_of(id) else {
            let kind = self.kind_names(id);
            let mut d = Diagnostic::error(
                codes::TYPE_MISMATCH,
                e.span,
                format!("`{name}` ({kind}) cannot hold anything"),
                "it has no contents",
            )
            .because(declared, "declared here");
            let first = self.grid_of(&Value::Instance(id)).and_then(|(id, grid)| self.first_place(id, grid));
            if let Some((place, _)) = first {
                d = d.help(format!("name the place: `holding {{ {place}: ... }}`"));
            }
            self.report(d);
            return;
        };
        let before = self.held.len();
        let contents = self.contents(e, &name, module);
        self.held[before..].iter_mut().for_each(|held| held.mixture = Some(target));
        self.instances[target.0 as usize].contents = contents;
        self.instances[target.0 as usize].origin = Some(super::contents::origin(e));
        if let Some(at) = at {
            self.start_at(target, at, module);
        }
    }

    fn between(&mut self, a: &'a Expr, b: &'a Expr, fields: &'a [Field], module: usize) {
        let mut side = |e: &'a Expr| match self.expr(e, &mut Scope { lab: true, ..Scope::module(module) }) {
            Value::Instance(i) => Some(i),
            other => {
                self.expected("an instance of the lab", &other, e.span);
                None
            }
        };
        let at = a.span.to(b.span);
        let (Some(a), Some(b)) = (side(a), side(b)) else { return };
        for f in fields {
            let FieldValue::Expr(value) = &f.value else { continue };
            let is_pair = |k: &ItemKind| match k {
                ItemKind::Fn { params, .. } => params.len() == 2,
                ItemKind::Relation { params, definition, .. } => params.len() == 2 && definition.is_none(),
                _ => false,
            };
            let names = self.tables.names;
            let known = names.lookup(module, &f.key.text).filter(|id| is_pair(&names.decl(*id).item.kind));
            let of_things = known.is_some_and(|id| match &names.decl(id).item.kind {
                ItemKind::Fn { params, .. } => params.iter().all(|p| match &p.ty {
                    Some(ty) => {
                        matches!(self.resolve_type(ty, names.decl(id).module), Type::Instance { .. } | Type::Any)
                    }
                    None => true,
                }),
                _ => true,
            });
            let Some(id) = known.filter(|_| of_things) else {
                let mut d = self.tables.names.unknown(module, &f.key, "pair parameter", is_pair);
                d.help.push("pair parameters are functions of two bodies, such as `conductance`, or relations without a definition".into());
                self.report(d);
                continue;
            };
            let Some((a, b)) = self.ordered(id, (a, b), &f.key, at) else { continue };
            let symmetric = self.is_symmetric(id);
            let same = |p: &&Pair<'_>| {
                let order = (p.a, p.b) == (a, b) || symmetric && (p.b, p.a) == (a, b);
                order && p.name == f.key.text && p.within == self.within
            };
            if let Some(first) = self.pairs.iter().find(same) {
                let headline = format!("`{}` is given twice for the same two things", f.key.text);
                let d = Diagnostic::error(codes::DUPLICATE_NAME, f.key.span, headline, "given again here");
                let d = d.because(first.value.span, "first given here");
                self.report(d);
                continue;
            }
            let within = self.within.clone();
            let name = f.key.text.clone();
            self.pairs.push(Pair { a, b, symmetric, name, value, module, within, resolved: None });
        }
    }

    /// Two things in the order in which a function takes them: as written, or the other way round where their kinds fit only
    /// so. Reports two that fit in neither order.
    fn ordered(
        &mut self,
        function: DeclId,
        (a, b): (InstanceId, InstanceId),
        name: &Name,
        at: Span,
    ) -> Option<(InstanceId, InstanceId)> {
        let decl = self.tables.names.decl(function);
        let (ItemKind::Fn { params, .. } | ItemKind::Relation { params, .. }) = &decl.item.kind else { return None };
        let types: Vec<Type> = params
            .iter()
            .map(|p| p.ty.as_ref().map_or(Type::Any, |ty| self.resolve_parameter_type(ty, decl.module)))
            .collect();
        let fits = |id: InstanceId, ty: &Type| match ty {
            Type::Instance { kinds, .. } => kinds.iter().all(|k| self.instance_is(id, *k)),
            Type::Any => true,
            _ => false,
        };
        let [first, second] = types.as_slice() else { return None };
        if fits(a, first) && fits(b, second) {
            return Some((a, b));
        }
        if fits(b, first) && fits(a, second) {
            return Some((b, a));
        }
        let shown = |id: InstanceId| format!("`{}` ({})", self.instances[id.0 as usize].name, self.kind_names(id));
        let headline = format!("`{}` does not apply to {} and {}", name.text, shown(a), shown(b));
        let wanted: Vec<String> = types.iter().map(|ty| self.tables.type_name(ty)).collect();
        let said = format!("it takes {} and {}", wanted[0], wanted[1]);
        self.report(
            Diagnostic::error(codes::TYPE_MISMATCH, name.span, headline, said)
                .because(at, "these two have other types"),
        );
        None
    }

    /// Whether a function or relation of two things is declared to be the same in either order.
    fn is_symmetric(&self, id: DeclId) -> bool {
        match &self.tables.names.decl(id).item.kind {
            ItemKind::Relation { symmetric, .. } => *symmetric,
            ItemKind::Fn { options, .. } => {
                options.iter().any(|o| o.name.text == SYMMETRIC && crate::declare::tables::is_true(&o.value))
            }
            _ => false,
        }
    }
}

/// The option of a function of two things that says that their order does not matter.
pub(crate) const SYMMETRIC: &str = "symmetric";
