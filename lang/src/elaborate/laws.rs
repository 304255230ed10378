//! Processes and events over the instances of the lab.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Kept};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, UnaryOp, codes};

use super::held_back::{BUT, HeldBack};
use super::pairs;
use super::tuples::Tuples;
use crate::ast::{self, Arg, AssignOp, Expr, ExprKind, ItemKind, Law, LawKind, MemberKind, Name, Param, Role};
use crate::declare::tables::MemberRef;
use crate::declare::{ReactionId, Type};
use crate::eval::lab::{Contribution, Elaborator, Mode, ProcessInstance};
use crate::eval::{Num, Scope, Value};
use crate::names::DeclId;

/// A law waiting to be written out for its instances.
#[derive(Clone)]
struct Job<'a> {
    process: &'a ast::Process,
    scope: Scope,
    name: String,
}

/// What a `move` takes from where to where.
pub struct Moving {
    /// The share of what does not stay behind; per second, where it has a rate.
    pub fraction: NodeId,
    /// What stays behind.
    pub but: Box<[Kept]>,
    /// The mixtures.
    pub from: InstanceId,
    /// Where it goes.
    pub to: InstanceId,
}

/// What is made of the lines of a law.
pub(super) trait Lines<'a> {
    /// An assignment or a call, given the condition around it.
    fn line(&mut self, lab: &mut Elaborator<'a>, law: &'a Law, guard: Option<NodeId>, scope: &mut Scope);

    /// The value of a `let`, as what follows sees it.
    fn value(&mut self, _: &mut Elaborator<'a>, value: Value) -> Value {
        value
    }

    /// The condition of an `if`, as the lines under it see it.
    fn open(&mut self, _: &mut Elaborator<'a>, condition: NodeId) -> NodeId {
        condition
    }

    /// The lines under the condition that was taken last end.
    fn close(&mut self) {}
}

/// The lines of a process: all see the state of one instant.
struct Rates<'o> {
    out: &'o mut Vec<(Target, NodeId, Span)>,
}

impl<'a> Lines<'a> for Rates<'_> {
    fn line(&mut self, lab: &mut Elaborator<'a>, law: &'a Law, guard: Option<NodeId>, scope: &mut Scope) {
        let first = self.out.len();
        match &law.kind {
            LawKind::Assign { target, op, value } => lab.law_assign(target, *op, value, law.span, scope, self.out),
            LawKind::Call(call) => lab.law_move(call, guard, scope, self.out),
            _ => {}
        }
        let Some(g) = guard else { return };
        let zero = lab.graph.number(0.0);
        self.out[first..].iter_mut().for_each(|(_, node, _)| *node = lab.graph.select(g, *node, zero));
    }
}

/// What a law body contributes to.
enum Target {
    Flow(InstanceId, DeclId, String),
    Derivative(u32),
}

/// Whether lines call anything, as those do that move or soil.
pub(super) fn has_calls(laws: &[Law]) -> bool {
    laws.iter().any(|law| match &law.kind {
        LawKind::Call(_) => true,
        LawKind::For { body, .. } => has_calls(body),
        LawKind::If { then, otherwise, .. } => has_calls(then) || has_calls(otherwise),
        LawKind::Error | LawKind::Let { .. } | LawKind::Assign { .. } => false,
    })
}

impl<'a> Elaborator<'a> {
    /// Writes out every process that the plan can make run. Processes that read flows come after all others.
    pub fn processes(&mut self) {
        let mut waiting = Vec::new();
        for job in self.own_processes() {
            if !self.process(&job) {
                waiting.push(job);
            }
        }
        for (decl, process) in self.tables.processes.clone() {
            if self.draft && !has_calls(&process.laws) {
                continue;
            }
            let module = self.tables.names.decl(decl).module;
            let mut tuples = self.tuples(&process.params, module, process.guard.as_ref(), &process.name);
            while let Some((scope, name)) = tuples.next(self) {
                let job = Job { process, scope, name };
                if !self.process(&job) {
                    waiting.push(job);
                }
            }
        }
        self.flows_sealed = true;
        for job in waiting {
            self.process(&job);
        }
    }

    /// The processes that things have of themselves.
    fn own_processes(&mut self) -> Vec<Job<'a>> {
        let mut jobs = Vec::new();
        for i in 0..self.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.all_members(id).iter().copied() {
                let MemberKind::Process(process) = &m.member.kind else { continue };
                if self.draft && !has_calls(&process.laws) {
                    continue;
                }
                let name = format!("{}({})", process.name.text, self.instances[i as usize].name);
                jobs.push(Job { process, scope: Scope::of_member(id, m), name });
            }
        }
        jobs
    }

    /// Every tuple of different instances, species and reactions that fits the parameters, as scopes; once per unordered pair
    /// where the condition asks for a symmetric relation of the two.
    pub(super) fn tuples(
        &mut self,
        params: &'a [Param],
        module: usize,
        guard: Option<&'a Expr>,
        name: &'a Name,
    ) -> Tuples<'a> {
        let sets = self.sets(params, module);
        let is_instance = |set: &Vec<Value>| matches!(set.first(), Some(Value::Instance(_)));
        let instances: Vec<&str> =
            params.iter().zip(&sets).filter(|(_, set)| is_instance(set)).map(|(p, _)| p.name.text.as_str()).collect();
        let names = self.tables.names;
        let relation = |id| matches!(names.decl(id).item.kind, ItemKind::Relation { symmetric: true, .. });
        let symmetric = |name: &str| names.lookup(module, name).is_some_and(relation);
        let pair = guard.and_then(|g| pairs::unordered(g, &instances, &symmetric));
        let position = |name: &str| params.iter().position(|p| p.name.text == name);
        let unordered = pair.and_then(|(a, b)| Some((position(a)?, position(b)?))).map(|(a, b)| (a.min(b), a.max(b)));
        Tuples::new(params, (module, name), guard, sets, unordered)
    }

    /// What each parameter may stand for, instances in their order.
    pub(super) fn sets(&mut self, params: &'a [Param], module: usize) -> Vec<Vec<Value>> {
        params.iter().map(|p| self.fitting(p, module)).collect()
    }

    fn fitting(&mut self, p: &'a Param, module: usize) -> Vec<Value> {
        match p.ty.as_ref().map(|ty| self.resolve_type(ty, module)) {
            Some(Type::Instance { kinds, .. }) => (0..self.instances.len() as u32)
                .map(InstanceId)
                .filter(|i| kinds.iter().all(|k| self.instance_is(*i, *k)))
                .map(Value::Instance)
                .collect(),
            Some(Type::Reaction) => {
                (0..self.tables.reactions.len() as u32).map(|r| Value::Reaction(ReactionId(r))).collect()
            }
            Some(Type::Species) => self.reach.anywhere().into_iter().map(Value::Species).collect(),
            _ => Vec::new(),
        }
    }

    /// Which of two things a law takes first that exists once for both: the one that the lab names first in what it gives
    /// between them, else the one that is declared first.
    pub(super) fn goes_first(&self, a: InstanceId, b: InstanceId) -> bool {
        let given = |x, y| self.pairs.iter().any(|p| !p.symmetric && (p.a, p.b) == (x, y));
        match (given(a, b), given(b, a)) {
            (true, false) => a != b,
            (false, true) => false,
            _ => a < b,
        }
    }

    pub(super) fn show(&self, v: &Value) -> String {
        match v {
            Value::Instance(i) => self.instances[i.0 as usize].name.clone(),
            Value::Species(s) => self.tables.species.get(*s).name.clone(),
            Value::Reaction(r) => self.tables.reactions[r.0 as usize].name.clone(),
            _ => String::new(),
        }
    }

    /// Writes out one process; false if it reads a flow that is not complete yet.
    fn process(&mut self, job: &Job<'a>) -> bool {
        let written = !self.enter(job.process.name.span) || self.write_process(job);
        self.leave();
        written
    }

    fn write_process(&mut self, job: &Job<'a>) -> bool {
        let mut scope = job.scope.clone();
        self.touched_flow = false;
        let guard = match &job.process.guard {
            Some(g) => match self.truth(g, &mut scope) {
                Some(node) if self.never(node) => return true,
                Some(node) => Some(node).filter(|n| self.graph.constant(*n).is_none()),
                None => return true,
            },
            None => None,
        };
        let index = self.processes.len();
        let reaction = job.scope.vars.iter().find_map(|(_, v)| match v {
            Value::Reaction(r) => Some(*r),
            _ => None,
        });
        let span = job.process.name.span;
        self.processes.push(ProcessInstance { name: job.name.clone(), guard, reaction, span });
        let mut found = Vec::new();
        self.law_body(&job.process.laws, &mut scope, &mut found);
        if self.touched_flow && !self.flows_sealed {
            self.processes.truncate(index);
            self.streams.retain(|s, _| s.0 < index);
            self.touched_flow = false;
            return false;
        }
        for (target, node, span) in found {
            let contribution = Contribution { process: index, node, span };
            match target {
                Target::Flow(id, owner, name) => self.flows.entry((id, owner, name)).or_default().push(contribution),
                Target::Derivative(state) => self.rates.entry(state).or_default().push(contribution),
            }
        }
        true
    }

    /// Goes through the lines of a law; each assignment and call comes with what the `if` around it ask for.
    pub(super) fn each_law(
        &mut self,
        laws: &'a [Law],
        guard: Option<NodeId>,
        scope: &mut Scope,
        lines: &mut dyn Lines<'a>,
    ) {
        let depth = scope.vars.len();
        for law in laws {
            match &law.kind {
                LawKind::Error => {}
                LawKind::Let { name, value } => {
                    let v = self.expr(value, scope);
                    let v = lines.value(self, v);
                    scope.bind(name.text.clone(), v);
                }
                LawKind::For { var, set, body } => {
                    for item in self.set(set, scope).unwrap_or_default() {
                        scope.bind(var.text.clone(), item);
                        self.each_law(body, guard, scope, lines);
                        scope.vars.pop();
                    }
                }
                LawKind::If { cond, then, otherwise } => {
                    let Some(c) = self.truth(cond, scope) else { continue };
                    let c = lines.open(self, c);
                    let not = self.graph.unary(UnaryOp::Not, c);
                    for (laws, c) in [(then, c), (otherwise, not)] {
                        let both = guard.map_or(c, |g| self.graph.binary(BinaryOp::And, g, c));
                        if self.prototype || !self.never(both) {
                            self.each_law(laws, Some(both), scope, lines);
                        }
                    }
                    lines.close();
                }
                LawKind::Assign { .. } | LawKind::Call(_) => lines.line(self, law, guard, scope),
            }
        }
        scope.vars.truncate(depth);
    }

    /// What the lines of a process contribute.
    fn law_body(&mut self, laws: &'a [Law], scope: &mut Scope, out: &mut Vec<(Target, NodeId, Span)>) {
        self.each_law(laws, None, scope, &mut Rates { out });
    }

    fn law_assign(
        &mut self,
        target: &'a Expr,
        op: AssignOp,
        value: &'a Expr,
        span: Span,
        scope: &mut Scope,
        out: &mut Vec<(Target, NodeId, Span)>,
    ) {
        let v = self.expr(value, scope);
        let (place, prime) = match &*target.kind {
            ExprKind::Prime(inner) => (inner, true),
            _ => (target, false),
        };
        if !prime {
            let Some((id, m)) = self.flow_target(place, scope) else {
                self.report(
                    Diagnostic::error(
                        codes::INVALID_LAW,
                        span,
                        "a process can change only flows and derivatives",
                        "not a flow",
                    )
                    .help("write `x' += rate` for a state; only an event assigns `x = value`"),
                );
                return;
            };
            if op == AssignOp::Set {
                self.report(
                    Diagnostic::error(
                        codes::INVALID_LAW,
                        span,
                        "a flow is a sum of contributions: it cannot be assigned",
                        "assigned here",
                    )
                    .help("use `+=` or `-=`, so that other processes can contribute"),
                );
                return;
            }
            let MemberKind::Value { name, ty, .. } = &m.member.kind else { return };
            let ty = self.resolve_type(ty, m.module);
            let v = if op == AssignOp::Sub { self.signed(v) } else { v };
            if let Value::Num(n) = self.coerce(v, &ty, value.span, &name.text) {
                out.push((Target::Flow(id, m.owner, name.text.clone()), n.node, span));
            }
            return;
        }
        let pooled = Mode { pooled: true, ..self.mode() };
        let current = self.in_mode(pooled, |lab| lab.expr(place, scope));
        let Value::Num(state) = current else {
            self.expected("a continuous state", &current, place.span);
            return;
        };
        let rate_dimension = state.dimension.over(&self.duration());
        let ty = Type::Quantity { dimension: rate_dimension, point: false, optional: false };
        let v = if op == AssignOp::Sub { self.signed(v) } else { v };
        let Value::Num(n) = self.coerce(v, &ty, value.span, "rate of change") else { return };
        match self.graph.op(state.node) {
            Op::State(index) => out.push((Target::Derivative(index), n.node, span)),
            _ if self.prototype => {}
            _ if self.writes(place, n.node, scope) => {}
            _ => self.report(Diagnostic::error(
                codes::INVALID_LAW,
                place.span,
                "only a state has a derivative",
                "not a state",
            )),
        }
    }

    fn signed(&mut self, v: Value) -> Value {
        match v {
            Value::Num(n) => Value::Num(Num { node: self.graph.unary(UnaryOp::Neg, n.node), ..n }),
            other => other,
        }
    }

    /// The flow that a place names, without reading it.
    fn flow_target(&mut self, place: &'a Expr, scope: &mut Scope) -> Option<(InstanceId, MemberRef<'a>)> {
        let (id, name) = match &*place.kind {
            ExprKind::Name(n) => (scope.this?, n),
            ExprKind::Member(base, n) => match self.expr(base, scope) {
                Value::Instance(id) | Value::Qualified(id, _) => (id, n),
                _ => return None,
            },
            _ => return None,
        };
        let m = self.members_of(id, &name.text).first().copied()?;
        matches!(&m.member.kind, MemberKind::Value { role: Role::Flow, .. }).then_some((id, m))
    }

    /// `move(q, from: a, to: b)` as a flow of everything: the fraction per second of each extensive quantity.
    fn law_move(
        &mut self,
        call: &'a Expr,
        guard: Option<NodeId>,
        scope: &mut Scope,
        out: &mut Vec<(Target, NodeId, Span)>,
    ) {
        let Some(Moving { fraction: rate, from, to, .. }) = self.move_call(call, true, scope) else { return };
        self.moves.insert((from, to));
        let zero = self.graph.number(0.0);
        let flows = self.graph.binary(BinaryOp::Lt, zero, rate);
        let flows = guard.map_or(flows, |g| self.graph.binary(BinaryOp::And, g, flows));
        let stream = (self.processes.len().saturating_sub(1), from, to);
        let before = self.streams.get(&stream).copied();
        let either = before.map_or(flows, |b| self.graph.binary(BinaryOp::Or, b, flows));
        self.streams.insert(stream, either);
        let keys: Vec<_> =
            self.extensive.iter().filter(|(k, _)| k.instance == from).map(|(k, i)| (k.clone(), *i)).collect();
        for (key, index) in keys {
            let state = self.graph.add(Op::State(index));
            let flow = self.times(state, rate);
            let less = self.graph.unary(UnaryOp::Neg, flow);
            out.push((Target::Derivative(index), less, call.span));
            let there = crate::eval::lab::ExtensiveKey { instance: to, ..key };
            match self.extensive.get(&there) {
                Some(target) => out.push((Target::Derivative(*target), flow, call.span)),
                None => self.warn_of_loss(from, to, &there.member, call.span),
            }
        }
    }

    /// Warns of a flow that takes something along which the mixture where it ends has no place for.
    fn warn_of_loss(&mut self, from: InstanceId, to: InstanceId, member: &str, at: Span) {
        if self.prototype {
            return;
        }
        let (from, to) = (self.spoken_name(from), self.spoken_name(to));
        let headline = format!("`{to}` has no `{member}`: the `{member}` of the contents of `{from}` would be lost");
        let d = Diagnostic::warning(codes::BALANCE_BREACH, at, headline, "would be lost");
        self.report(d.help(format!("give `{to}` contents that have `{member}` as well")));
    }

    /// `move(...)` or `rinse(...)` as what it does in an instant.
    pub fn call_actions(&mut self, call: &'a Expr, span: Span, scope: &mut Scope) -> Vec<Action> {
        if let ExprKind::Call(callee, args) = &*call.kind
            && matches!(&*callee.kind, ExprKind::Name(n) if n.text == "rinse")
        {
            let [arg] = args.as_slice() else {
                self.report(
                    Diagnostic::about(
                        "rinse",
                        codes::WRONG_ARGUMENTS,
                        call.span,
                        "`rinse` needs one thing",
                        "which thing?",
                    )
                    .help("write `rinse(thing)`"),
                );
                return Vec::new();
            };
            return match self.expr(&arg.value, scope) {
                Value::Instance(i) => self.rinse(self.walls_of(i), span),
                Value::Error => Vec::new(),
                other => {
                    self.expected("a vessel", &other, arg.value.span);
                    Vec::new()
                }
            };
        }
        if let ExprKind::Call(callee, args) = &*call.kind
            && matches!(&*callee.kind, ExprKind::Name(n) if n.text == "soil")
        {
            return self.soil_call(call, args, span, scope);
        }
        match self.move_call(call, false, scope) {
            Some(moving) => self.transfer_actions(moving, span),
            None => Vec::new(),
        }
    }

    /// Notes where `move(...)` goes, whatever amount it is; false where that takes a closer look.
    pub fn note_move(&mut self, call: &'a Expr, scope: &mut Scope) -> bool {
        let ExprKind::Call(callee, args) = &*call.kind else { return false };
        if !matches!(&*callee.kind, ExprKind::Name(n) if n.text == "move") {
            return false;
        }
        let mut end = |name: &str| {
            let arg = args.iter().find(|a| a.name.as_ref().is_some_and(|n| n.text == name))?;
            match self.expr(&arg.value, scope) {
                Value::Instance(i) => self.mixture_in(i, arg.value.span),
                _ => None,
            }
        };
        let (Some(from), Some(to)) = (end("from"), end("to")) else { return false };
        self.moves.insert((from, to));
        true
    }

    /// `soil(a, from: b)`: the walls of `a` have touched what those of `b` have; `soil(a, from: b, when: c)` if so.
    fn soil_call(&mut self, call: &'a Expr, args: &'a [Arg], span: Span, scope: &mut Scope) -> Vec<Action> {
        let (to, from, when) = match args {
            [to, from] => (to, from, None),
            [to, from, when] if when.name.as_ref().is_some_and(|n| n.text == "when") => (to, from, Some(when)),
            _ => return self.soil_form(call.span),
        };
        if to.name.is_some() || from.name.as_ref().is_none_or(|n| n.text != "from") {
            return self.soil_form(call.span);
        }
        let mut ends = Vec::new();
        for arg in [from, to] {
            match self.expr(&arg.value, scope) {
                Value::Instance(i) => ends.push(self.walls_of(i)),
                Value::Error => return Vec::new(),
                other => {
                    self.expected("a thing with walls", &other, arg.value.span);
                    return Vec::new();
                }
            }
        }
        let when = match when {
            Some(when) => {
                let value = self.expr(&when.value, scope);
                let Value::Bool(node) = self.coerce(value, &Type::Bool, when.value.span, "when") else {
                    return Vec::new();
                };
                Some(node)
            }
            None => None,
        };
        if when.is_some_and(|node| self.graph.constant(node) == Some(0.0)) {
            return Vec::new();
        }
        self.soiled.insert((ends[0], ends[1]));
        let mut actions = self.inherit(ends[0], ends[1], span);
        for action in &mut actions {
            if let (Action::Assign { state, value, .. }, Some(when)) = (action, when) {
                let before = self.graph.add(Op::State(*state));
                *value = self.graph.select(when, *value, before);
            }
        }
        actions
    }

    fn soil_form(&mut self, at: Span) -> Vec<Action> {
        self.report(
            Diagnostic::about(
                "soil",
                codes::WRONG_ARGUMENTS,
                at,
                "`soil` needs a thing and `from` another",
                "which things?",
            )
            .help("write `soil(thing, from: other)`"),
        );
        Vec::new()
    }

    /// What remembers for a thing what it has touched: its contents, or itself where it has none.
    pub fn walls_of(&self, id: InstanceId) -> InstanceId {
        self.mixture_of(id).unwrap_or(id)
    }

    /// A transfer with what it does to the lineage of its destination.
    fn transfer_actions(&mut self, moving: Moving, span: Span) -> Vec<Action> {
        let (from, to) = (moving.from, moving.to);
        let mut out = vec![self.move_action(moving, span)];
        out.extend(self.inherit(from, to, span));
        out
    }

    /// `move(q, from: a, to: b, but: each(s in set: share))`: the fraction (per second if `rate`) and the mixtures.
    pub fn move_call(&mut self, call: &'a Expr, rate: bool, scope: &mut Scope) -> Option<Moving> {
        let ExprKind::Call(callee, args) = &*call.kind else { return None };
        if !matches!(&*callee.kind, ExprKind::Name(n) if n.text == "move") {
            self.report(
                Diagnostic::error(
                    codes::INVALID_LAW,
                    callee.span,
                    "only `move(...)` may be a line of its own here",
                    "has no effect",
                )
                .help("write `move(quantity, from: a, to: b)`"),
            );
            return None;
        }
        let mut quantity = None;
        let mut ends: BTreeMap<&str, InstanceId> = BTreeMap::new();
        let mut but = None;
        for arg in args {
            if arg.name.as_ref().is_some_and(|n| n.text == BUT) {
                but = Some(&arg.value);
                continue;
            }
            let v = self.expr(&arg.value, scope);
            match (arg.name.as_ref().map(|n| n.text.as_str()), v) {
                (_, Value::Error) => return None,
                (None, Value::Num(n)) => quantity = Some((n, arg.value.span)),
                (Some(end @ ("from" | "to")), Value::Instance(i)) => {
                    let mixture = self.mixture_in(i, arg.value.span)?;
                    ends.insert(end, mixture);
                }
                (_, other) => {
                    self.expected("`move(quantity, from: a, to: b)`", &other, arg.value.span);
                    return None;
                }
            }
        }
        let (Some((q, at)), Some(&from), Some(&to)) = (quantity, ends.get("from"), ends.get("to")) else {
            self.report(
                Diagnostic::about(
                    "move",
                    codes::WRONG_ARGUMENTS,
                    call.span,
                    "`move` needs a quantity, `from` and `to`",
                    "incomplete",
                )
                .help("write `move(quantity, from: a, to: b)`"),
            );
            return None;
        };
        let held = match but {
            Some(but) if rate => {
                let headline = "holding something back from a transfer with a rate is not supported yet";
                let d = Diagnostic::error(codes::UNSUPPORTED, but.span, headline, "not supported yet");
                self.report(
                    d.help("move it in an event or an effect, or write what flows as rates of amounts and heat"),
                );
                return None;
            }
            Some(but) => self.held_back(but, from, scope)?,
            None => HeldBack::default(),
        };
        let moving = |fraction, held: HeldBack| Some(Moving { fraction, but: held.kept, from, to });
        let amount = if rate { q.dimension.times(&self.duration()) } else { q.dimension.clone() };
        if amount.is_one() {
            return moving(q.node, held);
        }
        if let Some(m) = self.size_in(from, &amount) {
            let Value::Num(size) = self.member_value(from, m, at) else { return None };
            let size = self.free_size(size.node, &held);
            let mut share = self.graph.binary(BinaryOp::Div, q.node, size);
            self.note_place(share, call.span);
            // What follows what is left takes nothing of nothing; what moves at once may be nothing in an empty vessel, too, which has no amounts.
            let left = |(key, _): &(&crate::eval::lab::ExtensiveKey, &u32)| key.instance == from;
            let left: BTreeSet<u32> = self.extensive.iter().filter(left).map(|(_, state)| *state).collect();
            let is_positive = self.graph.constant(q.node).is_some_and(|amount| amount > 0.0);
            let follows = self.graph.depends(q.node, |op| matches!(op, Op::State(s) if left.contains(s)));
            if follows || (!rate && !is_positive) {
                let zero = self.graph.number(0.0);
                let nothing = self.graph.binary(BinaryOp::Le, q.node, zero);
                share = self.graph.select(nothing, q.node, share);
            }
            return moving(share, held);
        }
        let found = self.describe(&q);
        self.report(Diagnostic::error(
            codes::UNIT_MISMATCH,
            at,
            format!("give the moved contents as mass, volume or fraction, not as {found}"),
            format!("this is {found}"),
        ));
        None
    }

    fn mixture_in(&mut self, id: InstanceId, span: Span) -> Option<InstanceId> {
        let mixture = self.mixture_of(id);
        if mixture.is_none() {
            let name = self.instances[id.0 as usize].name.clone();
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                span,
                format!("`{name}` has no contents"),
                "it is not a vessel",
            ));
        }
        mixture
    }

    /// A transfer; mixtures are numbered in the order of the instances.
    fn move_action(&mut self, moving: Moving, span: Span) -> Action {
        let Moving { fraction, but, from, to } = moving;
        self.moves.insert((from, to));
        let (from, to) = (self.mixture_index(from), self.mixture_index(to));
        Action::Move { fraction, but, from, to, span }
    }

    /// `place = value` as an action; with a condition the place keeps its value where it does not hold.
    pub fn assignment(
        &mut self,
        target: &'a Expr,
        value: &'a Expr,
        guard: Option<NodeId>,
        scope: &mut Scope,
    ) -> Option<Action> {
        let place = self.expr(target, scope);
        let (ty, mut node) = match &place {
            Value::Num(n) => {
                (Type::Quantity { dimension: n.dimension.clone(), point: n.point, optional: true }, n.node)
            }
            Value::Bool(n) => (Type::Bool, *n),
            Value::InstanceNode(n) => (Type::Instance { kinds: [].into(), optional: true }, *n),
            Value::Enum(n, words) => (Type::Enum(words.clone()), *n),
            Value::Error => return None,
            other => {
                self.expected("a state", other, target.span);
                return None;
            }
        };
        let v = self.typed(value, &ty, scope, "value");
        let mut new = self.value_node(&v)?;
        if let Some(changed) = self.pooled_change(target, (node, new), scope) {
            (node, new) = changed;
        }
        let Op::State(state) = self.graph.op(node) else {
            if !self.prototype && !self.writes(target, new, scope) {
                self.report(
                    Diagnostic::error(codes::INVALID_LAW, target.span, "only a state can be assigned", "not a state")
                        .help("parameters are fixed, and derived quantities follow from states"),
                );
            }
            return None;
        };
        self.note_target(state, new);
        if let Some(g) = guard {
            new = self.graph.select(g, new, node);
        }
        Some(Action::Assign { state, value: new, span: target.span.to(value.span) })
    }
}

impl<'a> Elaborator<'a> {
    /// What an assignment to an amount at equilibrium does to the amount that was put there: it changes by the same.
    fn pooled_change(
        &mut self,
        target: &'a Expr,
        (settled, new): (NodeId, NodeId),
        scope: &mut Scope,
    ) -> Option<(NodeId, NodeId)> {
        let Op::Solved(..) = self.graph.op(settled) else { return None };
        let pooled = Mode { pooled: true, ..self.mode() };
        let Value::Num(put) = self.in_mode(pooled, |lab| lab.expr(target, scope)) else { return None };
        Some((put.node, self.moved_to(new, settled, put.node)))
    }

    /// A value that is counted from one number, counted from another one.
    fn moved_to(&mut self, value: NodeId, from: NodeId, to: NodeId) -> NodeId {
        match self.graph.op(value) {
            _ if value == from => to,
            Op::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), a, b) if self.is_counted_from(a, from) => {
                let a = self.moved_to(a, from, to);
                self.graph.binary(op, a, b)
            }
            _ => {
                let change = self.graph.binary(BinaryOp::Sub, value, from);
                self.graph.binary(BinaryOp::Add, to, change)
            }
        }
    }

    /// Whether a sum begins with a number.
    fn is_counted_from(&self, value: NodeId, from: NodeId) -> bool {
        match self.graph.op(value) {
            _ if value == from => true,
            Op::Binary(BinaryOp::Add | BinaryOp::Sub, a, _) => self.is_counted_from(a, from),
            _ => false,
        }
    }

    /// Checks a process by itself; its parameters are bound in the scope.
    pub fn check_process(&mut self, p: &'a ast::Process, scope: &mut Scope) {
        self.flows_sealed = true;
        if let Some(g) = &p.guard {
            self.truth(g, scope);
        }
        let mut found = Vec::new();
        self.law_body(&p.laws, scope, &mut found);
        self.check_antisymmetry(p, found);
    }

    /// What one body loses the other must gain: a process of two bodies that contributes to one flow of both.
    fn check_antisymmetry(&mut self, p: &'a ast::Process, found: Vec<(Target, NodeId, Span)>) {
        let mut sums: BTreeMap<(DeclId, String), (Vec<InstanceId>, NodeId)> = BTreeMap::new();
        for (target, node, _) in found {
            let Target::Flow(id, owner, name) = target else { continue };
            let zero = self.graph.number(0.0);
            let entry = sums.entry((owner, name)).or_insert((Vec::new(), zero));
            if !entry.0.contains(&id) {
                entry.0.push(id);
            }
            entry.1 = self.graph.binary(BinaryOp::Add, entry.1, node);
        }
        for ((_, flow), (bodies, sum)) in sums {
            if p.params.len() == 2 && !bodies.is_empty() && self.graph.constant(sum) != Some(0.0) {
                self.report(
                    Diagnostic::error(
                        codes::FLOW_UNBALANCED,
                        p.name.span,
                        format!(
                            "`{}` does not conserve `{flow}`: one body does not gain the amount that the other loses",
                            p.name.text
                        ),
                        "the two contributions do not cancel",
                    )
                    .help("contribute the same quantity with `-=` to one body and `+=` to the other"),
                );
            }
        }
    }
}
