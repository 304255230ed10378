//! Members of instances: parameters, states, derived quantities, flows, parts; and what stands in `[ ]`.

use std::borrow::Cow;

use matterix_ir::model::{Domain, Reading};
use matterix_ir::plan::Term;
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, Leaves, Op, Span, codes};

use super::{Decided, Num, Scope, Value, known_too_late};
use crate::ast::{Expr, ExprKind, FieldValue, ItemKind, MemberKind, Name, NamedExpr, Role};
use crate::declare::Tables;
use crate::declare::tables::MemberRef;
use crate::declare::{SpeciesId, Type};
use crate::eval::lab::Mode;
use crate::eval::lab::free::Bound;
use crate::eval::lab::instances::Setting;
use crate::eval::lab::written::GEOMETRY;
use crate::eval::lab::{Elaborator, MemberKey};
use crate::names::DeclId;
use crate::near;
use crate::units::Dimension;

impl<'a> Elaborator<'a> {
    /// `base.name`.
    pub fn member(&mut self, base: Value, name: &Name) -> Value {
        match base {
            Value::Error => Value::Error,
            Value::Instance(id) => self.instance_member(id, name),
            Value::Qualified(id, kind) => {
                let found = self.tables.members(kind, &name.text);
                self.pick(id, found, name)
            }
            Value::Included(lab) => self.included_member(&lab, name),
            Value::Species(s) => self.species_property(s, name),
            Value::Reaction(r) => self.reaction_member(r, name),
            Value::Step(start, end) => self.step_member(start, end, name),
            Value::Range(low, high) => match name.text.as_str() {
                "min" => Value::Num(*low),
                "max" => Value::Num(*high),
                _ => self.no_member(&Value::Range(low, high), name, vec!["min".into(), "max".into()]),
            },
            Value::InstanceNode(_) => {
                self.report(known_too_late(&format!("the thing whose `{}` is used", name.text), name.span));
                Value::Error
            }
            Value::Grid(id, grid) => match self.grid_member(id, grid, &name.text) {
                Some(value) => value,
                None => {
                    let children = self.listed(Value::Grid(id, grid));
                    self.member(children, name)
                }
            },
            Value::Row(table, row) => self.cell(table, row, name),
            Value::List(items) => match self.column_of(&items, name) {
                Some(column) => column,
                None => self.list_member(items, name),
            },
            Value::Tuple(items) if items.len() == 2 => match name.text.as_str() {
                "first" => items[0].clone(),
                "second" => items[1].clone(),
                _ => self.no_member(&Value::Tuple(items), name, vec!["first".into(), "second".into()]),
            },
            other => self.no_member(&other, name, Vec::new()),
        }
    }

    /// `.count`, `.first`, `.last`, `.flat` (without lists in it) and `.pairs` (each with the next) of a list.
    fn list_member(&mut self, items: Vec<Value>, name: &Name) -> Value {
        let end = match name.text.as_str() {
            "count" => return self.number(items.len() as f64, Dimension::one(), false),
            "flat" => return Value::List(Value::List(items).flat()),
            "pairs" => return Value::List(items.windows(2).map(|two| Value::Tuple(two.to_vec())).collect()),
            "first" => items.first(),
            "last" => items.last(),
            _ => {
                let known = ["count", "first", "flat", "last", "pairs"].map(String::from).to_vec();
                return self.no_member(&Value::List(items), name, known);
            }
        };
        if let Some(value) = end {
            return value.clone();
        }
        let headline = format!("the list is empty: it has no `{}`", name.text);
        self.report(Diagnostic::error(codes::EMPTY_RANGE, name.span, headline, "empty list"));
        Value::Error
    }

    fn no_member(&mut self, base: &Value, name: &Name, known: Vec<String>) -> Value {
        let mut d = Diagnostic::error(
            codes::UNKNOWN_MEMBER,
            name.span,
            format!("{} has no `{}`", base.what(), name.text),
            "not a member",
        );
        d.help.extend(near::question(&near::nearest(&name.text, known)));
        self.report(d);
        Value::Error
    }

    fn step_member(&mut self, start: u32, end: u32, name: &Name) -> Value {
        let duration = self.duration();
        let node = match name.text.as_str() {
            "start" => self.graph.add(Op::Local(start)),
            "end" => self.graph.add(Op::Local(end)),
            "elapsed" => {
                // Until its end is known (a number equals itself), a step lasts to now.
                let (now, since) = (self.graph.add(Op::Time), self.graph.add(Op::Local(start)));
                let end = self.graph.add(Op::Local(end));
                let ended = self.graph.binary(BinaryOp::Eq, end, end);
                let until = self.graph.select(ended, end, now);
                self.graph.binary(BinaryOp::Sub, until, since)
            }
            _ => {
                let known = vec!["start".into(), "end".into(), "elapsed".into()];
                return self.no_member(&Value::Step(start, end), name, known);
            }
        };
        self.num(node, duration)
    }

    /// The dimension of time.
    pub fn duration(&self) -> Dimension {
        self.tables.units.dimension("Duration").map_or_else(Dimension::any, |d| d.dimension.clone())
    }

    fn instance_member(&mut self, id: InstanceId, name: &Name) -> Value {
        if name.text == "species" && self.per_species(id) {
            let set = self.mixture_species(id);
            return Value::List(set.into_iter().map(Value::Species).collect());
        }
        if let Some(part) = self.instances[id.0 as usize].parts.get(&name.text) {
            return Value::Instance(*part);
        }
        if let Some(grid) = self.instances[id.0 as usize].grids.iter().position(|g| g.name == name.text) {
            return Value::Grid(id, grid);
        }
        if let Some(frame) = self.frame(id, &name.text) {
            return frame;
        }
        let found = self.members_of(id, &name.text);
        if !found.is_empty() {
            return self.pick(id, &found, name);
        }
        let kind = self.ancestors_of(id).into_iter().find(|k| self.tables.kind_name(*k) == name.text);
        if let Some(kind) = kind {
            return Value::Qualified(id, kind);
        }
        if name.text == "basis" && self.is_mixture(id) {
            return Value::Method(Box::new(Value::Instance(id)), "basis".into());
        }
        if let Some((id, grid)) = self.grid_of(&Value::Instance(id))
            && let Some(value) = self.grid_member(id, grid, &name.text)
        {
            return value;
        }
        // A vessel answers for its contents: `beaker.color`, `beaker.volume`.
        let parts: Vec<InstanceId> = self.instances[id.0 as usize].parts.values().copied().collect();
        let mut answering = parts.into_iter().filter(|p| self.has_member(*p, &name.text));
        if let (Some(part), None) = (answering.next(), answering.next()) {
            return self.instance_member(part, name);
        }
        if let Some(part) = self.instances[id.0 as usize].only_part().filter(|p| self.has_member(*p, &name.text)) {
            return self.instance_member(part, name);
        }
        self.unknown_member(id, name)
    }

    fn unknown_member(&mut self, id: InstanceId, name: &Name) -> Value {
        let inst = &self.instances[id.0 as usize];
        let (inst_name, span) = (inst.name.clone(), inst.span);
        let kind = self.kind_names(id);
        let near = near::nearest(&name.text, self.member_names(id));
        let mut d = Diagnostic::error(
            codes::UNKNOWN_MEMBER,
            name.span,
            format!("`{inst_name}` ({kind}) has no `{}`", name.text),
            "not a member",
        );
        if !self.prototype {
            d = d.because(span, format!("`{inst_name}` is declared here"));
        }
        d = near::proposed(d, &near, name.span);
        self.report(d);
        Value::Error
    }

    /// The members an instance has under a name; more than one is ambiguous.
    pub fn members_of(&self, id: InstanceId, name: &str) -> Cow<'a, [MemberRef<'a>]> {
        let tables: &'a Tables<'a> = self.tables;
        let kinds = &self.instances[id.0 as usize].kinds;
        if let [kind] = kinds.as_slice()
            && let found @ ([] | [_]) = tables.members(*kind, name)
        {
            return Cow::Borrowed(found);
        }
        let mut found: Vec<MemberRef<'a>> = Vec::new();
        for kind in kinds {
            for m in self.tables.members(*kind, name) {
                if !found.iter().any(|f| std::ptr::eq(f.member, m.member)) {
                    found.push(*m);
                }
            }
        }
        Cow::Owned(if found.len() > 1 { self.tables.visible(found) } else { found })
    }

    /// Of several members with one name, the one that the text of a capability means: its own or an inherited one.
    pub fn own_member(&self, id: InstanceId, owner: Option<DeclId>, name: &str) -> Option<MemberRef<'a>> {
        let found = self.members_of(id, name);
        let own = self.tables.members(owner.filter(|_| found.len() > 1)?, name);
        let mut meant = found.iter().copied().filter(|f| own.iter().any(|o| std::ptr::eq(o.member, f.member)));
        meant.next().filter(|_| meant.next().is_none())
    }

    /// The first declaration of the ring that leads from `id` back to it, if `id` is open already. To name the same
    /// one wherever the ring is entered makes it one finding.
    pub fn ring(&self, open: &[DeclId], id: DeclId) -> Option<(String, Span)> {
        let start = open.iter().position(|o| *o == id)?;
        let first = open[start..].iter().min()?;
        crate::names::item_name(self.tables.names.decl(*first).item)
    }

    /// Whether an instance has a member (or part, or frame) of this name.
    pub fn has_member(&self, id: InstanceId, name: &str) -> bool {
        let inst = &self.instances[id.0 as usize];
        inst.parts.contains_key(name)
            || inst.grids.iter().any(|g| g.name == name)
            || !self.members_of(id, name).is_empty()
            || (name == "species" && self.per_species(id))
            || (name == "basis" && self.is_mixture(id))
    }

    /// Names of all members, for suggestions.
    pub fn member_names(&self, id: InstanceId) -> Vec<String> {
        let inst = &self.instances[id.0 as usize];
        let mut names: Vec<String> = inst.parts.keys().cloned().collect();
        names.extend(inst.grids.iter().map(|g| g.name.clone()));
        for kind in &inst.kinds {
            let Some(info) = self.tables.kinds.get(kind) else { continue };
            names.extend(
                info.members
                    .iter()
                    .filter_map(|m| crate::declare::tables::member_name(m.member))
                    .map(|n| n.text.clone()),
            );
        }
        names
    }

    fn pick(&mut self, id: InstanceId, found: &[MemberRef<'a>], name: &Name) -> Value {
        match found {
            [one] => self.member_value(id, *one, name.span),
            [] => self.unknown_member(id, name),
            many => {
                let owners: Vec<String> =
                    many.iter().map(|m| format!("`{}.{}`", self.tables.kind_name(m.owner), name.text)).collect();
                let inst = self.instances[id.0 as usize].name.clone();
                self.report(
                    Diagnostic::error(
                        codes::AMBIGUOUS_NAME,
                        name.span,
                        format!("`{inst}` has several members `{}`", name.text),
                        "ambiguous",
                    )
                    .help(format!("write {}", owners.join(" or "))),
                );
                Value::Error
            }
        }
    }

    /// The value of a member, made once per instance.
    pub fn member_value(&mut self, id: InstanceId, m: MemberRef<'a>, at: Span) -> Value {
        self.note_member(at, m);
        let MemberKind::Value { role, name, .. } = &m.member.kind else {
            return match &m.member.kind {
                MemberKind::Frame { name, .. } => Value::Frame(id, name.text.clone()),
                _ => Value::Error,
            };
        };
        if *role == Role::Flow {
            return self.read_flow(id, m, at);
        }
        let key = MemberKey::of(m, self.mode());
        if let Some(v) = self.instances[id.0 as usize].values.get(&key) {
            let v = v.clone();
            self.note_term(id, m, &v);
            return v;
        }
        let open = (id, key);
        if self.open_members.contains(&open) {
            self.report(Diagnostic::error(
                codes::CIRCULAR,
                name.span,
                format!("`{}` depends on itself", name.text),
                "its value would depend on itself",
            ));
            return Value::Error;
        }
        self.open_members.push(open);
        let flow_before = std::mem::take(&mut self.touched_flow);
        let value = self.define(|lab| lab.make_member(id, m));
        self.open_members.pop();
        let cache = !self.touched_flow;
        self.touched_flow |= flow_before;
        if cache {
            self.instances[id.0 as usize].values.insert(key, value.clone());
        }
        self.note_term(id, m, &value);
        value
    }

    /// Notes a member that a condition names itself, not inside a definition it uses.
    fn note_term(&mut self, id: InstanceId, m: MemberRef<'a>, value: &Value) {
        let Some(observed) = &self.observed else { return };
        if !self.open_members.is_empty() || !self.open_calls.is_empty() {
            return;
        }
        let MemberKind::Value { name, ty, options, .. } = &m.member.kind else { return };
        let (Value::Num(Num { node, .. }) | Value::Bool(node) | Value::InstanceNode(node) | Value::Enum(node, _)) =
            *value
        else {
            return;
        };
        if observed.terms.iter().any(|t| t.node == node) || !self.graph.leaves(node).meets(Leaves::STATE) {
            return;
        }
        let domain = match value {
            Value::Num(_) => {
                let ty = self.resolve_type(ty, m.module);
                Domain::Quantity(self.declared_unit(options, &ty).unwrap_or_else(|| self.type_unit(&ty)))
            }
            Value::Bool(_) => Domain::Bool,
            Value::Enum(_, words) => Domain::Enum(words.to_vec()),
            _ => Domain::Instance,
        };
        let name = format!("{}.{}", self.spoken_name(id), name.text);
        if let Some(observed) = &mut self.observed {
            observed.terms.push(Term { name, node, domain });
        }
    }

    /// The name of the thing that answers for an instance: the vessel for its only part.
    pub fn spoken_name(&self, mut id: InstanceId) -> String {
        let owner = |id: InstanceId| self.instances[id.0 as usize].owner;
        if let Some(above) = owner(id).filter(|o| self.instances[o.0 as usize].parts.len() == 1) {
            id = above;
        }
        while let Some(above) = owner(id).filter(|o| self.instances[o.0 as usize].only_part() == Some(id)) {
            id = above;
        }
        self.instances[id.0 as usize].name.clone()
    }

    fn make_member(&mut self, id: InstanceId, m: MemberRef<'a>) -> Value {
        let MemberKind::Value { role, name, ty, per, value, options } = &m.member.kind else { return Value::Error };
        let ty = self.resolve_type(ty, m.module);
        if *role == Role::Param || *role == Role::Derived {
            let instance = &self.instances[id.0 as usize];
            let setting = match role {
                Role::Param => instance.setting(&name.text),
                // What an asset's line says of its shape is no value: the `room` of a vessel is what still fits in.
                _ if GEOMETRY.contains(&name.text.as_str()) => None,
                _ => instance.redefined(id, &name.text),
            };
            if let Some(value) = self.started(id, m, &ty) {
                return value;
            }
            if let Some(setting) = setting {
                let value = self.param(id, &name.text, &ty, setting);
                if let FieldValue::Expr(at) = setting.value() {
                    self.check_limits(&value, at.span, &name.text, &ty, options, (Some(id), m.module));
                }
                return value;
            }
        }
        match role {
            Role::Param => match value {
                Some(e) => self.param_default(id, &name.text, &ty, e, m.module),
                None if self.prototype => self.placeholder(&ty, &name.text),
                None if matches!(ty, Type::Instance { optional: true, .. }) => Value::Nothing,
                None => {
                    self.missing_param(id, m, &name.text, &ty);
                    Value::Error
                }
            },
            Role::Derived => match value {
                Some(e) => self.typed(e, &ty, &mut Scope::of_member(id, m), &name.text),
                None => Value::Error,
            },
            Role::State => self.state_value(id, m, &name.text, &ty, value.as_ref()),
            Role::Extensive if per.is_some() => Value::Method(Box::new(Value::Instance(id)), name.text.clone()),
            Role::Extensive => self.state_value(id, m, &name.text, &ty, value.as_ref()),
            Role::Reading => self.reading(id, m, &name.text, &ty, value.as_ref(), options),
            Role::Part => match self.instances[id.0 as usize].parts.get(&name.text) {
                Some(part) => Value::Instance(*part),
                None => Value::Nothing,
            },
            Role::Flow => Value::Error,
        }
    }

    /// `{ above: 0 J/K }`, `{ at_least: 0 W }`, `{ at_most: payload }`: what a parameter may be; members of the thing it belongs to may be
    /// named.
    pub fn check_limits(
        &mut self,
        value: &Value,
        at: Span,
        name: &str,
        ty: &Type,
        options: &'a [NamedExpr],
        (this, module): (Option<InstanceId>, usize),
    ) {
        let Value::Num(n) = value else { return };
        let Some(given) = self.glance(n.node) else { return };
        for o in options {
            let Some(bound) = Bound::of(&o.name.text) else { continue };
            let mut scope = this.map_or_else(|| Scope::module(module), |id| Scope::of(id, module));
            let v = self.expr(&o.value, &mut scope);
            // What has no limit here holds.
            if v == Value::Unlimited {
                continue;
            }
            let Value::Num(limit) = self.coerce(v, ty, o.value.span, &o.name.text) else { continue };
            let Some(limit) = self.glance(limit.node) else { continue };
            self.open.bound(self.graph.op(n.node), bound, limit);
            if bound.holds(given, limit) {
                continue;
            }
            let unit = self.unit_of(n);
            self.report(
                Diagnostic::error(
                    codes::OUT_OF_RANGE,
                    at,
                    format!("`{name}` cannot be {}", unit.show(given)),
                    format!("must be {} {}", bound.words(), unit.show(limit)),
                )
                .because(o.value.span, "its limit is here"),
            );
        }
    }

    fn missing_param(&mut self, id: InstanceId, m: MemberRef<'a>, name: &str, ty: &Type) {
        let inst = &self.instances[id.0 as usize];
        let (inst_name, span) = (inst.name.clone(), inst.span);
        let expected = self.tables.type_name(ty);
        self.report(
            Diagnostic::error(
                codes::MISSING_FIELD,
                span,
                format!("`{inst_name}` needs `{name}`: {expected}"),
                "not given, and it has no default",
            )
            .because(m.member.span, format!("`{}` declares it here", self.tables.kind_name(m.owner)))
            .help(format!("give it in the braces: `{{ {name}: ... }}`")),
        );
    }

    fn param(&mut self, id: InstanceId, name: &str, ty: &Type, setting: Setting<'a>) -> Value {
        match setting.value() {
            FieldValue::Expr(e) => {
                let within = self.within_of(id, setting.lab);
                let v = self.within_lab(&within, |this| this.typed(e, ty, &mut setting.scope(), name));
                self.as_param(id, name, ty, v, e.span)
            }
            FieldValue::Fields(_) | FieldValue::Literal(_) | FieldValue::Species(_) => Value::Error,
        }
    }

    fn param_default(&mut self, id: InstanceId, name: &str, ty: &Type, e: &'a Expr, module: usize) -> Value {
        let v = self.typed(e, ty, &mut Scope::of(id, module), name);
        self.as_param(id, name, ty, v, e.span)
    }

    /// Constants become parameters of the model, so that a study can vary them.
    pub fn as_param(&mut self, id: InstanceId, name: &str, ty: &Type, value: Value, span: Span) -> Value {
        let full = format!("{}.{name}", self.instances[id.0 as usize].name);
        match value {
            Value::Num(n) => {
                let n = self.name_param(&full, n, span);
                if *ty == Type::Int {
                    self.open.whole(self.graph.op(n.node));
                }
                Value::Num(n)
            }
            Value::Range(a, b) => {
                let low = self.name_param(&format!("{full}.min"), *a, span);
                let high = self.name_param(&format!("{full}.max"), *b, span);
                Value::Range(Box::new(low), Box::new(high))
            }
            other => other,
        }
    }

    /// A constant as a named parameter; anything else as it is.
    pub fn name_param(&mut self, name: &str, n: Num, span: Span) -> Num {
        let Some(value) = self.graph.constant(n.node).filter(|v| v.is_finite()) else { return n };
        if self.prototype {
            return n;
        }
        let again = self.open.named(name).find(|o| o.span == span && self.params[o.param as usize].value == value);
        let index = match again {
            Some(known) => known.param,
            None => {
                let unit = self.unit_of(&n);
                let index = self.params.len() as u32;
                self.params.push(matterix_ir::model::Param { name: name.to_string(), value, unit, span });
                self.open.add(name, index, &n, span);
                index
            }
        };
        Num { node: self.graph.add(Op::Param(index)), literal: false, ..n }
    }

    fn reading(
        &mut self,
        id: InstanceId,
        m: MemberRef<'a>,
        name: &str,
        ty: &Type,
        value: Option<&'a Expr>,
        options: &'a [NamedExpr],
    ) -> Value {
        let Some(e) = value else { return Value::Error };
        let outer = self.enter_mode(Mode { reported: false, ..self.mode() });
        let v = self.expr(e, &mut Scope::of_member(id, m));
        let v = self.coerce(v, ty, e.span, name);
        let mut found: [Option<f64>; 3] = [None; 3];
        for (i, key) in ["resolution", "noise", "period"].iter().enumerate() {
            let Some(o) = options.iter().find(|o| o.name.text == *key) else { continue };
            let v = self.expr(&o.value, &mut Scope::of_member(id, m));
            let expected = if *key == "period" {
                Type::Quantity { dimension: self.duration(), point: false, optional: false }
            } else {
                difference(ty)
            };
            if let Value::Num(n) = self.coerce(v, &expected, o.value.span, key) {
                found[i] = self.known(n.node);
            }
        }
        self.enter_mode(outer);
        let Value::Num(n) = v else { return v };
        if !outer.reported {
            return Value::Num(n);
        }
        let full = format!("{}.{name}", self.instances[id.0 as usize].name);
        let unit = self.declared_unit(options, ty).unwrap_or_else(|| self.unit_of(&n));
        let index = self.readings.len() as u32;
        let [resolution, noise, period] = found;
        self.readings.push(Reading {
            name: full,
            instance: id,
            value: n.node,
            resolution,
            noise,
            period,
            unit: unit.clone(),
            span: m.member.span,
        });
        Value::Num(Num { node: self.graph.add(Op::Reading(index)), unit: Some(unit.into()), literal: false, ..n })
    }

    /// `x[word]`.
    pub fn index(&mut self, base: Value, word: &Name, scope: &mut Scope) -> Value {
        if let Some(Value::Error) = scope.var(&word.text) {
            return Value::Error;
        }
        // A place goes before a local of the same name.
        let local = scope.var(&word.text).filter(|_| !self.is_place(&base, &word.text)).cloned();
        if let Some(local) = local
            && self.grid_of(&base).is_some()
        {
            return self.grid_at(&base, local, word.span);
        }
        if let Some(found) = self.grid_index(&base, word, None) {
            return found;
        }
        match base {
            Value::Error => Value::Error,
            Value::Instance(id) | Value::Qualified(id, _) => {
                if self.indexed(id).is_none() {
                    return self.has_no_contents(id, &word.text, word.span);
                }
                match self.species_named(word, scope) {
                    Some(s) => self.of_species(Value::Instance(id), s, word.span),
                    None => Value::Error,
                }
            }
            method @ Value::Method(..) => match self.species_named(word, scope) {
                Some(s) => self.of_species(method, s, word.span),
                None => Value::Error,
            },
            list @ (Value::List(_) | Value::Tuple(_)) => {
                let at = match word.text.parse::<f64>() {
                    Ok(v) => self.number(v, Dimension::one(), true),
                    Err(_) => self.name_of(word, scope),
                };
                self.element(list, at, word.span)
            }
            other => {
                self.report(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    word.span,
                    format!("`[ ]` does not apply to {}", other.what()),
                    "it has no parts",
                ));
                Value::Error
            }
        }
    }

    /// `list[2]`, counted from 0, and `list[2 .. 5]`.
    pub fn index_number(&mut self, base: Value, index: &'a Expr, scope: &mut Scope) -> Value {
        if let ExprKind::Range(from, to) = &*index.kind {
            return self.slice(base, from, to, scope);
        }
        let at = self.expr(index, scope);
        if self.grid_of(&base).is_some() {
            return self.grid_at(&base, at, index.span);
        }
        match (&base, &at) {
            (Value::Error, _) | (_, Value::Error) => Value::Error,
            (Value::Method(..) | Value::Instance(_) | Value::Qualified(..), Value::Species(s)) => {
                let name = Name { text: self.tables.species.get(*s).name.clone(), span: index.span };
                if self.is_refused_as_gas(*s, &name) {
                    return Value::Error;
                }
                self.of_species(base, *s, index.span)
            }
            (Value::Method(..), _) => self.expected("a species", &at, index.span),
            _ => self.element(base, at, index.span),
        }
    }

    /// `x[S]`: the concentration of a species in the contents of a thing, or `m.amount[S]`, a quantity of it.
    fn of_species(&mut self, base: Value, s: SpeciesId, span: Span) -> Value {
        match base {
            Value::Instance(id) | Value::Qualified(id, _) => {
                let Some(target) = self.indexed(id) else {
                    let name = self.tables.species.get(s).name.clone();
                    return self.has_no_contents(id, &name, span);
                };
                self.note_asked(target, s);
                Value::Concentration(target, s)
            }
            Value::Method(of, member) => {
                let Value::Instance(id) = *of else { return Value::Error };
                self.note_asked(id, s);
                self.amount(id, &member, s)
            }
            _ => Value::Error,
        }
    }

    fn has_no_contents(&mut self, id: InstanceId, species: &str, span: Span) -> Value {
        let name = self.instances[id.0 as usize].name.clone();
        let headline = format!("`{name}` has no contents with `{species}`");
        self.report(Diagnostic::error(codes::TYPE_MISMATCH, span, headline, "it has no contents"));
        Value::Error
    }

    fn element(&mut self, base: Value, at: Value, span: Span) -> Value {
        let (Value::List(items) | Value::Tuple(items), Value::Num(n)) = (&base, &at) else {
            let wrong = if matches!(base, Value::List(_) | Value::Tuple(_)) { at } else { base };
            return self.expected("a list and a whole number", &wrong, span);
        };
        let (items, node) = (items.clone(), n.node);
        let number = match self.number_before_run(node, "the number of an element", span) {
            Decided::Now(number) => number,
            // Whichever it is, it is of the kind of the first.
            Decided::Later if self.prototype => return items.into_iter().next().unwrap_or(Value::Error),
            Decided::Later | Decided::ByRun => return Value::Error,
        };
        let whole = number >= 0.0 && number.fract() == 0.0;
        match items.get(number as usize).filter(|_| whole) {
            Some(item) => item.clone(),
            // One element stands for all of a list that is not known yet.
            None if self.prototype && whole && items.len() == 1 => items[0].clone(),
            None => self.no_element(&items, number, span),
        }
    }

    /// The species in the brackets of `m.amount[S]`, reported if there is none.
    fn species_named(&mut self, word: &Name, scope: &Scope) -> Option<SpeciesId> {
        match self.species_meant(word, scope) {
            Ok(s) => s.filter(|s| !self.is_refused_as_gas(*s, word)),
            Err(d) => {
                self.report(*d);
                None
            }
        }
    }

    /// The species that a name means in the brackets of `m.amount[S]`: a parameter, a member of the thing itself, a constant, or else a
    /// species by its own name; none if its value is an error that was reported.
    pub fn species_meant(&mut self, word: &Name, scope: &Scope) -> Result<Option<SpeciesId>, Box<Diagnostic>> {
        let value = self.value_named(word, scope);
        match value {
            Some(Value::Species(s)) => return Ok(Some(s)),
            Some(Value::Error) => return Ok(None),
            _ => {}
        }
        let found = self.tables.species.lookup(self.tables.names, scope.module, word);
        match (found, value) {
            (Ok(s), _) => Ok(Some(s)),
            (Err(_), Some(other)) => {
                let headline = format!("`{}` is {}, not a species", word.text, other.what());
                Err(Box::new(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    word.span,
                    headline,
                    "a species is expected here",
                )))
            }
            (Err(unknown), None) => Err(unknown),
        }
    }

    /// What a name stands for that is no species by its own name, as far as a species may be given to it.
    fn value_named(&mut self, word: &Name, scope: &Scope) -> Option<Value> {
        if let Some(value) = scope.var(&word.text) {
            return Some(value.clone());
        }
        if let Some(this) = scope.this
            && let Some(m) = self
                .own_member(this, scope.owner, &word.text)
                .or_else(|| self.members_of(this, &word.text).first().copied())
            && let MemberKind::Value { role: Role::Param, .. } = &m.member.kind
        {
            return Some(self.member_value(this, m, word.span));
        }
        if let Some(value) = self.of_lab(&word.text, scope) {
            return Some(value);
        }
        let id = self.lookup(scope.module, &word.text)?;
        match &self.tables.names.decl(id).item.kind {
            ItemKind::Const { .. } => Some(self.declared(id, word)),
            _ => None,
        }
    }

    /// The mixture `x[S]` asks: the instance itself or its one part with contents.
    fn indexed(&self, id: InstanceId) -> Option<InstanceId> {
        if self.is_mixture(id) {
            return Some(id);
        }
        let mut parts = self.instances[id.0 as usize].parts.values().filter(|p| self.is_mixture(**p));
        match (parts.next(), parts.next()) {
            (Some(p), None) => Some(*p),
            _ => None,
        }
    }

    /// The concentration of a species in the kind `wanted` asks for.
    pub fn concentration(&mut self, id: InstanceId, s: SpeciesId, wanted: &Num, span: Span) -> Option<Value> {
        let views = self.views(id);
        let mut kinds = Vec::new();
        for (module, param, ty, value, owner) in views {
            let ty = self.resolve_type(ty, module);
            let Type::Quantity { dimension, .. } = &ty else { continue };
            if !dimension.agrees(&wanted.dimension) {
                kinds.push(dimension.clone());
                continue;
            }
            let def = self.tables.species.get(s);
            let counts = self
                .tables
                .units
                .dimension("Amount")
                .is_some_and(|a| a.dimension.over(dimension).is_free_of(&a.dimension));
            if def.by_mass && counts {
                let (name, declared) = (def.name.clone(), def.span);
                self.report(
                    Diagnostic::error(
                        codes::CONCENTRATION_KIND,
                        span,
                        format!("`{name}` is declared `by: mass` and has no amount of substance"),
                        "it has no amount in mol",
                    )
                    .because(declared, "declared `by: mass` here")
                    .help("use a mass fraction (`as %w/w`) or a mass concentration (`as g/L`)"),
                );
                return None;
            }
            let kind = (owner, dimension.clone());
            let known = self.view_values.get(&(id, s)).and_then(|of| of.get(&kind));
            if let Some(v) = known.filter(|_| !self.mode().pooled) {
                return Some(v.clone());
            }
            let mut scope = Scope::of(id, module);
            scope.bind(param.name.text.clone(), Value::Species(s));
            let v = self.define(|lab| lab.expr(value, &mut scope));
            let v = self.coerce(v, &ty, value.span, "view");
            if !self.mode().at_start && !self.mode().pooled {
                self.view_values.entry((id, s)).or_default().insert(kind, v.clone());
            }
            return Some(v);
        }
        let found = self.describe(wanted);
        let kinds: Vec<String> = kinds.iter().map(|k| self.tables.units.describe(k, false)).collect();
        self.report(
            Diagnostic::error(
                codes::CONCENTRATION_KIND,
                span,
                format!("a concentration cannot be compared with {found}"),
                format!("used as {found}"),
            )
            .help(format!("kinds of concentration: {}", kinds.join(", "))),
        );
        None
    }

    /// The amount of a species in a mixture, or another quantity of it: a state; where the species can never get there, zero
    /// for matter, and for others what they begin with.
    pub fn amount(&mut self, id: InstanceId, member: &str, s: SpeciesId) -> Value {
        let Some((ty, m)) = self.extensive_type(id, member) else { return Value::Error };
        let Type::Quantity { dimension, .. } = &ty else { return Value::Error };
        let dimension = dimension.clone();
        if let Some(of) = &self.instances[id.0 as usize].composition {
            let given = of.iter().find(|(there, _)| *there == s).map(|(_, node)| *node);
            let node = given.unwrap_or_else(|| self.graph.number(0.0));
            return self.num(node, dimension);
        }
        let index = self.instances[id.0 as usize].amounts.get(member).and_then(|of| of.get(&s)).copied();
        let node = match index {
            Some(i) if self.mode().at_start => self.states[i as usize].initial,
            Some(i) => match self.is_matter(id, m).then(|| self.settled_amount(id, s)).flatten() {
                Some(settled) => settled,
                None => self.graph.add(Op::State(i)),
            },
            None if self.is_matter(id, m) || self.prototype => self.graph.number(0.0),
            None => return self.begins_with(id, m, &ty),
        };
        self.num(node, dimension)
    }

    /// Notes a species asked for that can never get into this mixture.
    fn note_asked(&mut self, mixture: InstanceId, s: SpeciesId) {
        let can_be = self.instances[mixture.0 as usize].amounts.values().any(|of| of.contains_key(&s));
        if let Some(observed) = self.observed.as_mut().filter(|_| !can_be) {
            observed.absent.push((mixture, s));
        }
    }

    fn species_property(&mut self, s: SpeciesId, name: &Name) -> Value {
        let def = self.tables.species.get(s);
        match name.text.as_str() {
            "molar_mass" => {
                let node = self.graph.number(def.molar_mass);
                let dimension = self.tables.units.named("Mass").over(&self.tables.units.named("Amount"));
                return self.num(node, dimension);
            }
            "charge" => {
                let charge = def.charge();
                return self.number(f64::from(charge), Dimension::one(), false);
            }
            "splits" => {
                let splits = f64::from(u8::from(self.splits(s)));
                return Value::Bool(self.graph.number(splits));
            }
            "ions" => return Value::List(def.dissolves.iter().map(|(i, _)| Value::Species(*i)).collect()),
            "count" => return Value::Method(Box::new(Value::Species(s)), "count".into()),
            _ => {}
        }
        let (by_mass, molar_mass) = (def.by_mass, def.molar_mass);
        if let Some((_, known)) =
            self.known_properties.get(&s).and_then(|of| of.iter().find(|(n, _)| **n == *name.text))
        {
            return known.clone();
        }
        if let Some(v) = self.property(s, &name.text) {
            return self.known_property(s, &name.text, v);
        }
        let per_amount = |this: &mut Self, specific: Value| match specific {
            Value::Num(n) => {
                let m = this.graph.number(molar_mass);
                let node = this.graph.binary(BinaryOp::Mul, n.node, m);
                let dimension =
                    n.dimension.times(&this.tables.units.named("Mass").over(&this.tables.units.named("Amount")));
                this.num(node, dimension)
            }
            other => other,
        };
        // What follows from another stated property by definition of density and specific heat.
        let derived = match name.text.as_str() {
            "molar_volume" => self.property(s, "density").map(|v| match v {
                Value::Num(n) => {
                    let m = self.graph.number(molar_mass);
                    let node = self.graph.binary(BinaryOp::Div, m, n.node);
                    let mass = self.tables.units.named("Mass").over(&self.tables.units.named("Amount"));
                    self.num(node, mass.over(&n.dimension))
                }
                other => other,
            }),
            "heat_capacity" => self.property(s, "specific_heat").map(|v| per_amount(self, v)),
            _ => None,
        };
        if let Some(v) = derived {
            return self.known_property(s, &name.text, v);
        }
        let Some(ty) = self.property_type(&name.text) else {
            let known = self.tables.properties.keys().map(ToString::to_string);
            let known = known.chain(["charge", "splits", "ions", "count"].map(String::from)).collect();
            return self.no_member(&Value::Species(s), name, known);
        };
        if self.prototype {
            return match ty {
                Type::Quantity { .. } => self.placeholder(&ty, &name.text),
                _ => self.number(1.0, Dimension::any(), false),
            };
        }
        if let Some(v) = self.property_by_default(s, &name.text) {
            return self.known_property(s, &name.text, v);
        }
        let def = self.tables.species.get(s);
        let by = if by_mass { "`specific_heat`" } else { "`heat_capacity`" };
        let wanted = match name.text.as_str() {
            "molar_volume" => "`density`".to_string(),
            "heat_capacity" => by.to_string(),
            other => format!("`{other}`"),
        };
        let (species, span) = (def.name.clone(), def.span);
        self.report(
            Diagnostic::error(
                codes::MISSING_PROPERTY,
                span,
                format!("`{species}` has no {wanted}, but a law needs it"),
                format!("{wanted} is missing"),
            )
            .because(name.span, "needed by this law")
            .help(format!("add {wanted} to the species, with its source")),
        );
        Value::Error
    }

    /// Keeps the value of a species' property: it is asked for at every mixture that the species can get into.
    fn known_property(&mut self, s: SpeciesId, name: &str, value: Value) -> Value {
        if value != Value::Error && !self.prototype {
            self.known_properties.entry(s).or_default().push((name.into(), value.clone()));
        }
        value
    }

    /// The kinds an instance has, itself included, most derived first.
    pub fn ancestors_of(&self, id: InstanceId) -> Vec<DeclId> {
        let kinds = &self.instances[id.0 as usize].kinds;
        kinds.iter().filter_map(|k| self.tables.kinds.get(k)).flat_map(|k| k.ancestors.iter().copied()).collect()
    }
}

fn difference(ty: &Type) -> Type {
    match ty {
        Type::Quantity { dimension, .. } => {
            Type::Quantity { dimension: dimension.clone(), point: false, optional: false }
        }
        other => other.clone(),
    }
}
