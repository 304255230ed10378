//! Leaves: commands of devices and primitive skills, with what they need, change and take.

use std::sync::Arc;

use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Operation, Presumption, Step, StepId, Takes};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Op, Span, codes};

use super::Planner;
use super::call::Bound;
use super::clauses::Outcome;
use crate::ast::{Binary, Call, Clause, ClauseKind, Effect, Expr, MemberKind, Sig};
use crate::declare::Type;
use crate::declare::tables::MemberRef;
use crate::escapes::undeclared;
use crate::eval::{Scope, Value};
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
        let object_is_device = sig.params.is_empty() && object.is_some();
        let mut bound = self.bind_arguments(sig, clauses, m.module, call, object, true, scope)?;
        // What a device shows is asked for when the command is given.
        let kept = self.keep_arguments(&mut bound, span, Self::asks_a_device);
        let mut inner = Scope::of_member(device, m);
        for (name, v) in &bound.values {
            inner.bind(name.clone(), v.clone());
        }
        let label = self.call_label((sig, &bound), (call, scope), Some((device, object_is_device)));
        let label = label.unwrap_or_else(|| self.text(span));
        let (mut operation, invariants) = self.operation(sig, clauses, &bound, &mut inner)?;
        operation.capability = Some(self.lab.tables.kind_name(owner).to_string());
        operation.device = Some(device);
        if !operation.claims.contains(&device) {
            operation.claims.insert(0, device);
        }
        operation.at_start = std::mem::take(&mut operation.at_end);
        let step = self.during(sig, label.clone(), span, operation, invariants, &bound);
        self.say(device, sig, &bound, step);
        self.note_call(sig, &bound, Some((device, object_is_device)), step);
        Some(self.after(kept, label, span, step))
    }

    /// An operation with what must hold while it lasts.
    fn during(
        &mut self,
        sig: &Sig,
        label: String,
        span: Span,
        operation: Operation,
        invariants: Vec<Condition>,
        bound: &Bound,
    ) -> StepId {
        let device = operation.device;
        let body = self.add(label.clone(), span, Step::Operation(Box::new(operation)));
        self.call_wires(body, sig, bound, device);
        if invariants.is_empty() { body } else { self.add(label, span, Step::During { invariants, body }) }
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
        let (mut operation, invariants) = self.operation(sig, clauses, bound, inner)?;
        operation.device = bound.values.iter().find_map(|(_, v)| match v {
            Value::Instance(i) => Some(*i),
            _ => None,
        });
        let step = self.during(sig, label.to_string(), span, operation, invariants, bound);
        self.note_call(sig, bound, None, step);
        Some(step)
    }

    pub(super) fn operation(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        bound: &Bound,
        inner: &mut Scope,
    ) -> Option<(Operation, Vec<Condition>)> {
        let mut invariants = Vec::new();
        let said = std::mem::take(&mut self.said);
        let mut operation = Operation {
            verb: verb_text(&sig.verb),
            arguments: self.driver_arguments(bound),
            needs: said.into_iter().map(Arc::new).chain(self.asked(sig, clauses, inner)).collect(),
            ..Operation::default()
        };
        // What can never begin is written out in silence: what it would do may make no sense.
        let mut sound = None;
        for clause in clauses {
            if matches!(clause.kind, ClauseKind::Option(_) | ClauseKind::Says { .. }) {
                continue;
            }
            if let ClauseKind::Fails(names) = &clause.kind {
                operation.fails.extend(names.iter().map(|n| n.text.clone()));
                continue;
            }
            if clause.kind.is_motion() && operation.motion.is_some() {
                self.lab.report(Diagnostic::error(
                    codes::MISPLACED,
                    clause.span,
                    "one step of a robot can have only one motion",
                    "the second motion",
                ));
                return None;
            }
            if !matches!(clause.kind, ClauseKind::Effect(_))
                && (self.is_drafted(clause.span) || self.defers(clause, inner))
            {
                continue;
            }
            match (self.outcome(clause, inner, |this, inner| this.clause(clause, inner))?, &clause.kind) {
                (Outcome::Condition(need), ClauseKind::Needs { .. }) => {
                    let never = !self.lab.prototype && self.lab.graph.constant(need.node) == Some(0.0);
                    operation.needs.push(need);
                    if never && sound.is_none() {
                        sound = Some(self.lab.diagnostics.len());
                    }
                }
                (Outcome::Condition(c), ClauseKind::Presumes { ever, .. }) => {
                    let condition = Arc::unwrap_or_clone(c);
                    operation.presumes.push(Presumption { condition, ever: *ever, warns: false });
                }
                (Outcome::Condition(c), ClauseKind::Warns { .. }) => {
                    let condition = Arc::unwrap_or_clone(c);
                    operation.presumes.push(Presumption { condition, ever: false, warns: true });
                }
                (Outcome::Condition(c), ClauseKind::Until(_)) => operation.until = Some(Arc::unwrap_or_clone(c)),
                (Outcome::Condition(c), _) => invariants.push(Arc::unwrap_or_clone(c)),
                (Outcome::Takes(takes), _) => operation.takes = Some(takes),
                (Outcome::Effect(actions), _) => operation.at_end.extend(actions),
                (Outcome::Motion(motion), _) => operation.motion = Some(motion),
            }
        }
        if let Some(sound) = sound {
            self.lab.diagnostics.truncate(sound);
        }
        operation.claims = self.claims(&operation.at_end);
        if operation.is_at_once() {
            operation.reads = self.reads(&operation);
        }
        Some((operation, invariants))
    }

    /// Whether an effect sets a state that holds an instance: a thing is moved.
    fn is_reference(&mut self, target: &'a Expr, inner: &mut Scope) -> bool {
        matches!(self.lab.expr(target, inner), Value::InstanceNode(_))
    }

    /// Whether a draft looks at a condition once it knows all that the plan moves.
    fn defers(&mut self, clause: &'a Clause, inner: &Scope) -> bool {
        use ClauseKind::{Needs, Presumes, Warns};
        let defers = self.draft && matches!(clause.kind, Needs { .. } | Presumes { .. } | Warns { .. });
        if defers {
            self.deferred.push((clause, inner.clone()));
        }
        defers
    }

    /// Looks at what was deferred.
    pub(super) fn catch_up(&mut self) {
        self.lab.targets.close();
        self.lab.targets.settle();
        let deferred = std::mem::take(&mut self.deferred);
        self.reported(|plan| {
            for (clause, mut scope) in deferred {
                plan.need(clause, &mut scope);
            }
        });
    }

    /// What comes of a clause of an operation that says something of it; none where it is wrong.
    fn clause(&mut self, clause: &'a Clause, inner: &mut Scope) -> Option<Outcome> {
        Some(match &clause.kind {
            ClauseKind::Needs { .. } | ClauseKind::Presumes { .. } | ClauseKind::Warns { .. } => {
                Outcome::Condition(Arc::new(self.need(clause, inner)?))
            }
            ClauseKind::While(e) | ClauseKind::Until(e) => Outcome::Condition(Arc::new(self.condition(e, inner)?)),
            ClauseKind::Takes { nominal, bounds } => Outcome::Takes(self.takes(nominal, bounds.as_ref(), inner)?),
            ClauseKind::Effect(effects) => {
                Outcome::Effect(effects.iter().flat_map(|e| self.effect(e, clause.span, inner)).collect())
            }
            ClauseKind::Moves { .. }
            | ClauseKind::Grips { .. }
            | ClauseKind::Frees { .. }
            | ClauseKind::Leads { .. } => Outcome::Motion(self.motion(&clause.kind, inner)?),
            ClauseKind::Fails(_) | ClauseKind::Option(_) | ClauseKind::Says { .. } => return None,
        })
    }

    /// What the types of the parameters ask for with `where`.
    pub fn asked(&mut self, sig: &'a Sig, clauses: &'a [Clause], inner: &mut Scope) -> Vec<Arc<Condition>> {
        let options = clauses.iter().filter_map(|c| match &c.kind {
            ClauseKind::Option(p) => Some(p),
            _ => None,
        });
        let asked = sig.all_params().chain(options).filter_map(super::roles::condition_of);
        asked.filter_map(|e| self.condition(e, inner)).map(Arc::new).collect()
    }

    fn effect(&mut self, effect: &'a Effect, span: Span, inner: &mut Scope) -> Vec<Action> {
        match effect {
            // A draft asks for what is moved where, not for values.
            Effect::Assign(target, value) if self.is_drafted(value.span) && !self.is_reference(target, inner) => {
                Vec::new()
            }
            Effect::Assign(target, value) => self.lab.assignment(target, value, None, inner).into_iter().collect(),
            Effect::Call(call) if self.is_drafted(call.span) && self.lab.note_move(call, inner) => Vec::new(),
            Effect::Call(call) => self.lab.call_actions(call, span, inner),
            Effect::Each { var, set, effects } => {
                let mut out = Vec::new();
                for item in self.lab.set(set, inner).unwrap_or_default() {
                    inner.bind(var.text.clone(), item);
                    for effect in effects {
                        out.extend(self.effect(effect, span, inner));
                    }
                    inner.vars.pop();
                }
                out
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
        let nominal = self.time_node(nominal, inner, "takes")?;
        let bounds = match bounds {
            None => None,
            Some(e) => {
                let v = self.lab.expr(e, inner);
                let ty = Type::Quantity { dimension: self.lab.duration(), point: false, optional: false };
                match self.lab.coerce(v, &Type::Range(ty.into()), e.span, "takes") {
                    Value::Range(a, b) => Some((a.node, b.node)),
                    _ => return None,
                }
            }
        };
        Some(Takes { nominal, bounds })
    }

    /// The whole instances that actions write.
    fn claims(&self, actions: &[Action]) -> Vec<InstanceId> {
        let mut out = Vec::new();
        for action in actions {
            match action {
                Action::Assign { state, .. } => out.push(self.lab.outermost(self.lab.state_owner[*state as usize])),
                Action::Move { from, to, .. } => {
                    for mixture in [from, to] {
                        out.extend(self.lab.mixtures.get(*mixture as usize).map(|i| self.lab.outermost(*i)));
                    }
                }
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// The states that the needs and effects of an operation look at.
    fn reads(&self, operation: &Operation) -> Vec<u32> {
        let mut out = Vec::new();
        let values = operation.at_end.iter().flat_map(|action| {
            let kept = action.but().iter().map(|kept| kept.stays.source());
            action.assigned().map(|_| action.source()).into_iter().chain(kept)
        });
        for node in operation.needs.iter().map(|need| need.node).chain(values) {
            self.lab.graph.visit(node, |op| {
                if let Op::State(state) = op {
                    out.push(state);
                }
            });
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// What a skill with a body needs, keeps, promises and takes.
    #[allow(clippy::type_complexity)]
    pub fn contract(
        &mut self,
        clauses: &'a [Clause],
        inner: &mut Scope,
    ) -> (Vec<Arc<Condition>>, Vec<Condition>, Vec<Condition>, Option<Takes>) {
        let (mut needs, mut invariants, mut promises, mut takes) = (Vec::new(), Vec::new(), Vec::new(), None);
        for clause in clauses {
            if self.is_drafted(clause.span) || self.defers(clause, inner) {
                continue;
            }
            match &clause.kind {
                ClauseKind::Needs { .. } => needs.extend(self.need(clause, inner).map(Arc::new)),
                ClauseKind::Presumes { .. } | ClauseKind::Warns { .. } => self.lab.report(Diagnostic::error(
                    codes::MISPLACED,
                    clause.span,
                    "a skill with a body can have neither `presumes` nor `warns`",
                    "for a command or an `extern skill`",
                )),
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
                    "a skill with a body cannot have `until`: it lasts as long as its steps",
                    "`until` is for a command",
                )),
                ClauseKind::Moves { .. }
                | ClauseKind::Grips { .. }
                | ClauseKind::Frees { .. }
                | ClauseKind::Leads { .. } => {
                    self.lab.report(Diagnostic::error(
                        codes::MISPLACED,
                        clause.span,
                        "a skill with a body cannot have a motion: its steps move",
                        "for an `extern skill` or a command",
                    ));
                }
                ClauseKind::Fails(_) | ClauseKind::Option(_) | ClauseKind::Says { .. } => {}
            }
        }
        (needs, invariants, promises, takes)
    }

    /// An effect of a skill with a body is a promise: the place has the value when the body ends.
    fn promise(&mut self, effect: &'a Effect, inner: &mut Scope) -> Option<Condition> {
        let (target, value) = match effect {
            Effect::Assign(target, value) => (target, value),
            Effect::Call(e) => {
                self.lab
                    .report(crate::declare::types::unsupported(e.span, "transfers as effects of a skill with a body"));
                return None;
            }
            Effect::Each { set, .. } => {
                self.lab.report(crate::declare::types::unsupported(set.span, "effects for each of a set"));
                return None;
            }
        };
        let (a, b) = self.lab.sides(target, value, inner);
        let Value::Bool(node) = self.lab.compare(Binary::Eq, a, b, target.span, value.span) else { return None };
        Some(self.bare(node, target.span.to(value.span)))
    }
}

impl<'a> Planner<'a, '_> {
    /// Checks a command by itself, on a stand-in for its device.
    pub fn check_command(&mut self, device: InstanceId, sig: &'a Sig, clauses: &'a [Clause], m: MemberRef<'a>) {
        let mut scope = Scope::of_member(device, m);
        let bound = self.stand_ins(sig, clauses, m.module, &mut scope);
        self.check_phrases(clauses, &mut scope);
        self.operation(sig, clauses, &bound, &mut scope);
    }

    /// What a `says` clause names must be there.
    fn check_phrases(&mut self, clauses: &'a [Clause], scope: &mut Scope) {
        for clause in clauses {
            let ClauseKind::Says { text, when } = &clause.kind else { continue };
            for part in &text.parts {
                if let crate::ast::TextPart::Value { value, .. } = part {
                    self.lab.expr(value, scope);
                }
            }
            if let Some(when) = when {
                self.lab.truth(when, scope);
            }
        }
    }

    /// Checks a skill by itself, on stand-ins for its parameters.
    pub fn check_skill(&mut self, id: DeclId) {
        let decl = self.lab.tables.names.decl(id);
        let crate::ast::ItemKind::Skill { sig, clauses, body, handlers, .. } = &decl.item.kind else { return };
        let mut scope = Scope::module(decl.module);
        let bound = self.stand_ins(sig, clauses, decl.module, &mut scope);
        self.check_phrases(clauses, &mut scope);
        match body {
            None => {
                self.operation(sig, clauses, &bound, &mut scope);
            }
            Some(body) => {
                self.open.push(id);
                let lowered = self.skill_body(sig, clauses, body, handlers, "", sig.span, &mut scope);
                self.open.pop();
                if let Some((root, _)) = lowered {
                    let found = undeclared(sig, clauses, decl.item.span, &self.steps, root);
                    found.into_iter().for_each(|d| self.lab.report(d));
                }
            }
        }
    }

    pub(super) fn stand_ins(&mut self, sig: &'a Sig, clauses: &'a [Clause], module: usize, scope: &mut Scope) -> Bound {
        let options = clauses.iter().filter_map(|c| match &c.kind {
            ClauseKind::Option(p) => Some(p),
            _ => None,
        });
        for p in sig.all_params().chain(options) {
            let ty = p.ty.as_ref().map(|ty| self.lab.resolve_parameter_type(ty, module));
            let value = ty.map_or(Value::Error, |ty| self.lab.placeholder(&ty, &p.name.text));
            if let Value::Instance(id) = value {
                self.lab.instances[id.0 as usize].span = p.name.span;
            }
            scope.bind(p.name.text.clone(), value);
        }
        Bound { values: scope.vars.clone() }
    }
}
