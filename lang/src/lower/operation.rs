//! Leaves: commands of devices and primitive skills, with what they need, change and take.

use std::collections::BTreeSet;

use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Operation, Step, StepId, Takes};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, Span, codes};

use super::Planner;
use super::call::Bound;
use crate::ast::{Call, Clause, ClauseKind, Effect, MemberKind, Sig};
use crate::elaborate::tables::MemberRef;
use crate::eval::{Scope, Type, Value};
use crate::names::{DeclId, verb_text};

impl<'a> Planner<'a, '_> {
    /// A command of a device.
    pub fn command(
        &mut self,
        owner: DeclId,
        m: MemberRef<'a>,
        call: &'a Call,
        object: Option<(Value, Span)>,
        span: Span,
        scope: &mut Scope,
    ) -> Option<StepId> {
        let MemberKind::Command { sig, clauses } = &m.member.kind else { return None };
        let device = self.device(sig, &object, call, scope)?;
        let bound = self.bind_arguments(sig, clauses, m.module, call, object, true, scope)?;
        let mut inner = Scope::of_member(device, m);
        for (name, v) in &bound.values {
            inner.bind(name.clone(), v.clone());
        }
        let label = self.text(span);
        let mut operation = self.operation(sig, clauses, &bound, &mut inner)?;
        operation.capability = Some(self.lab.tables.kind_name(owner).to_string());
        operation.device = Some(device);
        if !operation.claims.contains(&device) {
            operation.claims.insert(0, device);
        }
        operation.at_start = std::mem::take(&mut operation.at_end);
        Some(self.add(label, span, Step::Operation(Box::new(operation))))
    }

    /// A skill without a body.
    pub fn primitive(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        bound: &Bound,
        label: &str,
        span: Span,
        inner: &mut Scope,
    ) -> Option<StepId> {
        let mut operation = self.operation(sig, clauses, bound, inner)?;
        operation.device = bound.values.iter().find_map(|(_, v)| match v {
            Value::Instance(i) => Some(*i),
            _ => None,
        });
        Some(self.add(label, span, Step::Operation(Box::new(operation))))
    }

    fn operation(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        bound: &Bound,
        inner: &mut Scope,
    ) -> Option<Operation> {
        let mut operation = Operation {
            verb: verb_text(&sig.verb),
            capability: None,
            device: None,
            arguments: self.driver_arguments(bound),
            needs: Vec::new(),
            at_start: Vec::new(),
            at_end: Vec::new(),
            takes: None,
            until: None,
            claims: Vec::new(),
            fails: Vec::new(),
        };
        for clause in clauses {
            match &clause.kind {
                ClauseKind::Needs(e) => operation.needs.push(self.condition(e, inner)?),
                ClauseKind::While(e) => {
                    let d = crate::eval::types::unsupported(e.span, "`while` conditions of a command");
                    self.lab.report(d);
                }
                ClauseKind::Fails(names) => operation.fails.extend(names.iter().map(|n| n.text.clone())),
                ClauseKind::Until(e) => operation.until = Some(self.condition(e, inner)?),
                ClauseKind::Takes { nominal, bounds } => {
                    operation.takes = Some(self.takes(nominal, bounds.as_ref(), inner)?);
                }
                ClauseKind::Effect(effects) => {
                    for effect in effects {
                        operation.at_end.extend(self.effect(effect, clause.span, inner));
                    }
                }
                ClauseKind::Option(_) => {}
            }
        }
        operation.claims = self.claims(&operation.at_end);
        Some(operation)
    }

    fn effect(&mut self, effect: &'a Effect, span: Span, inner: &mut Scope) -> Option<Action> {
        match effect {
            Effect::Assign(target, value) => self.lab.assignment(target, value, None, inner),
            Effect::Call(call) => {
                let (fraction, from, to) = self.lab.move_call(call, false, inner)?;
                Some(self.lab.move_action(fraction, from, to, span))
            }
        }
    }

    /// `takes NOMINAL in LOW .. HIGH`.
    pub fn takes(
        &mut self,
        nominal: &'a crate::ast::Expr,
        bounds: Option<&'a crate::ast::Expr>,
        inner: &mut Scope,
    ) -> Option<Takes> {
        let nominal = self.duration_node(nominal, inner, "takes")?;
        let bounds = match bounds {
            None => None,
            Some(e) => {
                let v = self.lab.expr(e, inner);
                let ty = Type::Quantity { dimension: self.lab.duration(), point: false, optional: false };
                match self.lab.coerce(v, &Type::Range(Box::new(ty)), e.span, "takes") {
                    Value::Range(a, b) => Some((a.node, b.node)),
                    _ => return None,
                }
            }
        };
        Some(Takes { nominal, bounds })
    }

    /// The whole instances that actions write.
    fn claims(&self, actions: &[Action]) -> Vec<InstanceId> {
        let mut out = BTreeSet::new();
        for action in actions {
            match action {
                Action::Assign { state, .. } => {
                    out.insert(self.top(self.lab.state_owner[*state as usize]));
                }
                Action::Move { from, to, .. } => {
                    for mixture in [from, to] {
                        let id = (0..self.lab.instances.len() as u32)
                            .map(InstanceId)
                            .filter(|i| self.lab.per_species(*i).is_some())
                            .nth(*mixture as usize);
                        out.extend(id.map(|i| self.top(i)));
                    }
                }
            }
        }
        out.into_iter().collect()
    }

    fn top(&self, mut id: InstanceId) -> InstanceId {
        while let Some(owner) = self.lab.instances[id.0 as usize].owner {
            id = owner;
        }
        id
    }

    /// What a skill with a body needs, keeps, promises and takes.
    #[allow(clippy::type_complexity)]
    pub fn contract(
        &mut self,
        clauses: &'a [Clause],
        inner: &mut Scope,
    ) -> (Vec<Condition>, Vec<Condition>, Vec<Condition>, Option<Takes>) {
        let (mut needs, mut invariants, mut promises, mut takes) = (Vec::new(), Vec::new(), Vec::new(), None);
        for clause in clauses {
            match &clause.kind {
                ClauseKind::Needs(e) => needs.extend(self.condition(e, inner)),
                ClauseKind::While(e) => invariants.extend(self.condition(e, inner)),
                ClauseKind::Effect(effects) => {
                    for effect in effects {
                        promises.extend(self.promise(effect, inner));
                    }
                }
                ClauseKind::Takes { nominal, bounds } => takes = self.takes(nominal, bounds.as_ref(), inner),
                ClauseKind::Until(e) => self.lab.report(Diagnostic::error(
                    codes::MISPLACED,
                    e.span,
                    "a skill with a body lasts as long as its steps",
                    "`until` belongs to a command",
                )),
                ClauseKind::Fails(_) | ClauseKind::Option(_) => {}
            }
        }
        (needs, invariants, promises, takes)
    }

    /// An effect of a skill with a body is a promise: the place has the value when the body ends.
    fn promise(&mut self, effect: &'a Effect, inner: &mut Scope) -> Option<Condition> {
        let Effect::Assign(target, value) = effect else {
            if let Effect::Call(e) = effect {
                let d = crate::eval::types::unsupported(e.span, "promised transfers");
                self.lab.report(d);
            }
            return None;
        };
        let (a, b) = (self.lab.expr(target, inner), self.lab.expr(value, inner));
        let (x, y) = (self.lab.value_node(&a)?, self.lab.value_node(&b)?);
        let node = self.lab.graph.binary(BinaryOp::Eq, x, y);
        let span = target.span.to(value.span);
        Some(Condition { node, text: self.text(span), span, compared: Vec::new() })
    }
}

impl<'a> Planner<'a, '_> {
    /// Checks a command by itself, on a stand-in for its device.
    pub fn check_command(&mut self, device: InstanceId, sig: &'a Sig, clauses: &'a [Clause], m: MemberRef<'a>) {
        let mut scope = Scope::of_member(device, m);
        let bound = self.stand_ins(sig, clauses, m.module, &mut scope);
        self.operation(sig, clauses, &bound, &mut scope);
    }

    /// Checks a skill by itself, on stand-ins for its parameters.
    pub fn check_skill(&mut self, id: DeclId) {
        let decl = self.lab.tables.names.decl(id);
        let crate::ast::ItemKind::Skill { sig, clauses, body, handlers, .. } = &decl.item.kind else { return };
        let mut scope = Scope::module(decl.module);
        let bound = self.stand_ins(sig, clauses, decl.module, &mut scope);
        match body {
            None => {
                self.operation(sig, clauses, &bound, &mut scope);
            }
            Some(body) => {
                self.open.push(id);
                self.skill_body(sig, clauses, body, handlers, "", sig.span, &mut scope);
                self.open.pop();
            }
        }
    }

    fn stand_ins(&mut self, sig: &'a Sig, clauses: &'a [Clause], module: usize, scope: &mut Scope) -> Bound {
        crate::check::bind(self.lab, &sig.params, module, scope);
        for (_, params) in &sig.labelled {
            crate::check::bind(self.lab, params, module, scope);
        }
        for clause in clauses {
            if let ClauseKind::Option(p) = &clause.kind {
                crate::check::bind(self.lab, std::slice::from_ref(p), module, scope);
            }
        }
        Bound { values: scope.vars.clone() }
    }
}
