//! States: allocated once all instances exist, before anything reads them.

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::model::{Domain, State};
use matterix_ir::scene::{Carrier, InstanceId};
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, Unit, codes};

use super::Mode;
use super::given::{HIDDEN, VALID};
use super::{Elaborator, ExtensiveKey, MemberKey};
use crate::ast::{Expr, ExprKind, MemberKind, NamedExpr, Role};
use crate::declare::SpeciesId;
use crate::declare::Type;
use crate::declare::tables::{MemberRef, OUTSIDE, is_true};
use crate::eval::{Num, Scope, Value};

impl<'a> Elaborator<'a> {
    /// Allocates the states of an instance.
    pub fn declare_states(&mut self, id: InstanceId) {
        for m in self.all_members(id).iter().copied() {
            let MemberKind::Value { role, name, ty, per, options, .. } = &m.member.kind else { continue };
            if !matches!(role, Role::State | Role::Extensive) {
                continue;
            }
            let ty = self.resolve_type(ty, m.module);
            let scale = self.scale_of(options, m.module, &ty);
            let full = format!("{}.{}", self.instances[id.0 as usize].name, name.text);
            if per.is_some() {
                let matter = self.is_matter(id, m);
                let is_outside = options.iter().any(|o| o.name.text == OUTSIDE && is_true(&o.value));
                for s in self.mixture_species(id) {
                    let species = self.tables.species.get(s).name.clone();
                    let index = self.allocate(id, format!("{full}[{species}]"), &ty, options, scale, m.member.span);
                    self.instances[id.0 as usize].amounts.entry(name.text.clone()).or_default().insert(s, index);
                    let key = ExtensiveKey { instance: id, member: name.text.clone(), species: Some(s), matter };
                    self.extensive.insert(key, index);
                    if is_outside {
                        self.outside.push((s, index));
                    }
                }
                continue;
            }
            if !self.is_there(options) {
                let Type::Quantity { dimension, .. } = ty else { continue };
                let zero = self.number(0.0, dimension, false);
                self.keep_value(id, m, &[false, true], &zero);
                continue;
            }
            let index = self.allocate(id, full, &ty, options, scale, m.member.span);
            let value = self.state_node(index, &ty);
            self.keep_value(id, m, &[false], &value);
            if *role == Role::Extensive {
                let key = ExtensiveKey { instance: id, member: name.text.clone(), species: None, matter: false };
                self.extensive.insert(key, index);
            }
        }
    }

    /// The value of a member now, and at the start, as `at_start` says.
    fn keep_value(&mut self, id: InstanceId, m: MemberRef<'a>, at_start: &[bool], value: &Value) {
        for at_start in at_start.iter().copied() {
            for (reported, pooled) in [(false, false), (true, false), (false, true), (true, true)] {
                let key = MemberKey::of(m, Mode { at_start, reported, pooled });
                self.instances[id.0 as usize].values.insert(key, value.clone());
            }
        }
    }

    fn allocate(
        &mut self,
        owner: InstanceId,
        name: String,
        ty: &Type,
        options: &'a [NamedExpr],
        scale: Option<f64>,
        span: Span,
    ) -> u32 {
        let domain = match ty {
            Type::Bool => Domain::Bool,
            Type::Instance { .. } => Domain::Instance,
            Type::Enum(words) => Domain::Enum(words.to_vec()),
            _ => Domain::Quantity(self.declared_unit(options, ty).unwrap_or_else(|| self.type_unit(ty))),
        };
        let initial = self.graph.number(f64::NAN);
        self.add_state(owner, State { name, domain, initial, scale, span })
    }

    /// Takes in a state of an instance; its number.
    pub fn add_state(&mut self, owner: InstanceId, state: State) -> u32 {
        let index = self.states.len() as u32;
        self.state_owner.push(owner);
        self.states.push(state);
        index
    }

    /// Instances with the states whose instances go along with them: `{ carries: true }`.
    pub fn carriers(&self) -> Vec<Carrier> {
        let mut out = Vec::new();
        for index in 0..self.instances.len() as u32 {
            let by = InstanceId(index);
            for m in self.all_members(by).iter().copied() {
                let MemberKind::Value { role: Role::State, name, options, .. } = &m.member.kind else { continue };
                if !options.iter().any(|o| o.name.text == "carries") {
                    continue;
                }
                let full = format!("{}.{}", self.instances[index as usize].name, name.text);
                let is_it = |s: &State| s.domain == Domain::Instance && s.name == full;
                out.extend(self.states.iter().position(is_it).map(|state| Carrier { by, state: state as u32 }));
            }
        }
        out
    }

    fn state_node(&mut self, index: u32, ty: &Type) -> Value {
        let node = self.graph.add(Op::State(index));
        match ty {
            Type::Bool => Value::Bool(node),
            Type::Instance { .. } => Value::InstanceNode(node),
            Type::Int => self.num(node, crate::units::Dimension::one()),
            Type::Enum(words) => Value::Enum(node, words.clone()),
            Type::Quantity { dimension, point, .. } => {
                let Domain::Quantity(unit) = &self.states[index as usize].domain else { return Value::Error };
                let unit = Some(Arc::new(unit.clone()));
                Value::Num(Num { node, dimension: dimension.clone(), point: *point, unit, literal: false })
            }
            _ => Value::Error,
        }
    }

    /// `{ scale: 1 mmol }`: the magnitude below which differences do not matter.
    fn scale_of(&mut self, options: &'a [NamedExpr], module: usize, ty: &Type) -> Option<f64> {
        let o = options.iter().find(|o| o.name.text == "scale")?;
        let expected = match ty {
            Type::Quantity { dimension, .. } => {
                Type::Quantity { dimension: dimension.clone(), point: false, optional: false }
            }
            other => other.clone(),
        };
        let v = self.expr(&o.value, &mut Scope::module(module));
        match self.coerce(v, &expected, o.value.span, "scale") {
            Value::Num(n) => self.graph.constant(n.node),
            _ => None,
        }
    }

    /// Whether the option `hidden` keeps a derived member out of what is shown.
    pub fn is_hidden(&mut self, id: InstanceId, m: MemberRef<'a>, options: &'a [NamedExpr]) -> bool {
        let Some(o) = options.iter().find(|o| o.name.text == HIDDEN) else { return false };
        if is_true(&o.value) {
            return true;
        }
        let condition = self.expr(&o.value, &mut Scope::of_member(id, m));
        let known = match self.coerce(condition, &Type::Bool, o.value.span, HIDDEN) {
            Value::Bool(node) => self.glance(node),
            _ => return true,
        };
        if known.is_none() {
            let headline = "`hidden` cannot depend on the run";
            self.report(Diagnostic::error(codes::TYPE_MISMATCH, o.value.span, headline, "changes in a run"));
        }
        known.is_none_or(|truth| truth != 0.0)
    }

    /// Where the option `valid` says that the model of a derived member holds; absent where it always does.
    pub fn validity(&mut self, id: InstanceId, m: MemberRef<'a>, options: &'a [NamedExpr]) -> Option<NodeId> {
        let o = options.iter().find(|o| o.name.text == VALID)?;
        let condition = self.expr(&o.value, &mut Scope::of_member(id, m));
        let Value::Bool(node) = self.coerce(condition, &Type::Bool, o.value.span, VALID) else { return None };
        (self.glance(node) != Some(1.0)).then_some(node)
    }

    /// `{ unit: "mmol" }`: how the member is shown.
    pub fn declared_unit(&mut self, options: &'a [NamedExpr], ty: &Type) -> Option<Unit> {
        let o = options.iter().find(|o| o.name.text == "unit")?;
        let ExprKind::Text(text) = &*o.value.kind else { return None };
        let Type::Quantity { dimension, .. } = ty else { return None };
        match self.tables.unit(text) {
            Ok(r) if r.dimension.agrees(dimension) => Some(Arc::unwrap_or_clone(r.unit)),
            _ => {
                let wanted = self.tables.type_name(ty);
                self.report(Diagnostic::error(
                    codes::UNIT_MISMATCH,
                    o.value.span,
                    format!("`{text}` is not a unit of {wanted}"),
                    "cannot show this member",
                ));
                None
            }
        }
    }

    /// The unit a type is shown in where nothing says otherwise.
    pub fn type_unit(&self, ty: &Type) -> Unit {
        match ty {
            Type::Quantity { dimension, point: true, .. } => {
                self.tables.units.preferred_point(dimension).unwrap_or_else(|| self.tables.si(dimension))
            }
            Type::Quantity { dimension, .. } => {
                self.tables.units.percent(dimension).unwrap_or_else(|| self.tables.si(dimension))
            }
            _ => Unit::one(),
        }
    }

    /// The value of a scalar state: now, or (in initial mode) at the start.
    pub fn state_value(
        &mut self,
        id: InstanceId,
        m: MemberRef<'a>,
        name: &str,
        ty: &Type,
        initial: Option<&'a Expr>,
    ) -> Value {
        if !self.mode().at_start {
            // States of an instance are declared before they are read; here is only what could not be.
            return Value::Error;
        }
        if let Some(zero) = self.without(id, m, ty) {
            return zero;
        }
        if let Some(setting) = self.instances[id.0 as usize].setting(name)
            && let Some(e) = Self::field_expr(setting.value())
        {
            let within = self.within_of(id, setting.lab);
            let v = self.within_lab(&within, |this| this.typed(e, ty, &mut setting.scope(), name));
            return match v {
                Value::Num(n) => {
                    let full = format!("{}.{name}", self.instances[id.0 as usize].name);
                    Value::Num(self.name_param(&full, n, e.span))
                }
                other => other,
            };
        }
        match initial {
            Some(e) => self.typed(e, ty, &mut Scope::of_member(id, m), name),
            None if matches!(ty, Type::Instance { optional: true, .. }) => Value::Nothing,
            None if self.prototype => self.placeholder(ty, name),
            None => {
                let inst = &self.instances[id.0 as usize];
                let (inst_name, span) = (inst.name.clone(), inst.span);
                self.report(
                    Diagnostic::error(
                        codes::MISSING_FIELD,
                        span,
                        format!("`{inst_name}` needs an initial `{name}`"),
                        "not given, and it has no default",
                    )
                    .because(m.member.span, "declared here"),
                );
                Value::Error
            }
        }
    }

    /// Evaluates all initial values; what an instance holds goes into its amounts.
    pub fn initialise(&mut self) {
        for i in 0..self.instances.len() as u32 {
            let amounts: Vec<(SpeciesId, u32)> = self.amounts_in(InstanceId(i)).collect();
            for (s, index) in amounts {
                let held = self.instances[i as usize].contents.iter().find(|(c, _)| *c == s).map(|c| c.1);
                let node = held.unwrap_or_else(|| self.graph.number(0.0));
                self.states[index as usize].initial = node;
            }
        }
        // A parameter that nothing reads must be given all the same.
        for i in 0..self.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.all_members(id).iter().copied() {
                if let MemberKind::Value { role: Role::Param, name, .. } = &m.member.kind
                    && !self.is_idle(id, m)
                {
                    self.member_value(id, m, name.span);
                }
            }
        }
        self.in_mode(Mode::START, Self::initialise_states);
    }

    fn initialise_states(&mut self) {
        for i in 0..self.instances.len() as u32 {
            let id = InstanceId(i);
            self.initialise_each_species(id);
            for m in self.all_members(id).iter().copied() {
                let MemberKind::Value { role: Role::State | Role::Extensive, name, per: None, options, .. } =
                    &m.member.kind
                else {
                    continue;
                };
                self.check_contents_given(id, options);
                let value = self.member_value(id, m, name.span);
                let current = self.instances[i as usize].values.get(&MemberKey::of(m, Mode::default()));
                let index = match current {
                    Some(
                        Value::Num(Num { node, .. })
                        | Value::Bool(node)
                        | Value::InstanceNode(node)
                        | Value::Enum(node, _),
                    ) => match self.graph.op(*node) {
                        Op::State(index) => index,
                        _ => continue,
                    },
                    _ => continue,
                };
                let Some(node) = self.value_node(&value) else { continue };
                self.states[index as usize].initial = node;
            }
        }
    }

    /// Own quantities of each species begin as their declaration, or what is given for them, says; matter is what is held.
    fn initialise_each_species(&mut self, id: InstanceId) {
        for m in self.all_members(id).iter().copied() {
            let MemberKind::Value { role: Role::Extensive, name, ty, per: Some(_), .. } = &m.member.kind else {
                continue;
            };
            let of = self.instances[id.0 as usize].amounts.get(&name.text);
            let states: Vec<u32> = of.into_iter().flat_map(BTreeMap::values).copied().collect();
            if states.is_empty() || self.is_matter(id, m) {
                continue;
            }
            let ty = self.resolve_type(ty, m.module);
            let value = self.begins_with(id, m, &ty);
            let Some(node) = self.value_node(&value) else { continue };
            states.into_iter().for_each(|state| self.states[state as usize].initial = node);
        }
    }

    /// The value at the start of a quantity of each species.
    pub fn begins_with(&mut self, id: InstanceId, m: MemberRef<'a>, ty: &Type) -> Value {
        let MemberKind::Value { name, value, .. } = &m.member.kind else { return Value::Error };
        let mode = Mode { at_start: true, ..self.mode };
        self.in_mode(mode, |lab| lab.state_value(id, m, &name.text, ty, value.as_ref()))
    }

    /// The node of a value that a state can hold.
    pub fn value_node(&mut self, value: &Value) -> Option<NodeId> {
        match value {
            Value::Num(n) => Some(n.node),
            Value::Bool(n) | Value::InstanceNode(n) | Value::Enum(n, _) => Some(*n),
            Value::Instance(i) | Value::Qualified(i, _) => Some(self.graph.number(f64::from(i.0))),
            Value::Nothing => Some(self.graph.number(-1.0)),
            Value::Unlimited => Some(self.graph.number(f64::INFINITY)),
            _ => None,
        }
    }

    /// The product of two nodes.
    pub fn times(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.graph.binary(BinaryOp::Mul, a, b)
    }

    /// The sum of two nodes.
    pub fn plus(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.graph.binary(BinaryOp::Add, a, b)
    }

    /// The species that can get into a mixture.
    pub fn mixture_species(&self, id: InstanceId) -> Vec<SpeciesId> {
        if let Some(of) = &self.instances[id.0 as usize].composition {
            return of.iter().map(|(s, _)| *s).collect();
        }
        if self.prototype {
            return self.tables.species.iter().take(1).map(|s| s.0).collect();
        }
        let name = &self.instances[id.0 as usize].name;
        self.reach.of(name)
    }
}
