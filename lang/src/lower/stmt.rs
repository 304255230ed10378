//! Statements, one construct at a time.

use std::collections::BTreeSet;
use std::sync::Arc;

use matterix_ir::plan::{Caught, Step, StepId};
use matterix_ir::{Diagnostic, Leaves, NodeId, Op, Span, Text, Unit, codes};

use super::Planner;
use super::variables::Undecided;
use crate::ast::{Binary, Expr, ExprKind, Handlers, Name, Param, Stmt, StmtKind};
use crate::declare::Type;
use crate::eval::lab::choices::Choice;
use crate::eval::{Num, Scope, Value, known_too_late};
use crate::task::Given;

impl<'a> Planner<'a, '_> {
    /// Lowers a statement; none where it has no run-time part or is wrong (which is reported).
    pub fn stmt(&mut self, s: &'a Stmt, scope: &mut Scope) -> Option<StepId> {
        if (self.of_no_use)() {
            return None;
        }
        let step = (self.lab.enter(s.span) && self.lab.has_room(self.steps.len())).then(|| self.statement(s, scope));
        self.lab.leave();
        let step = step.flatten();
        // An `if` that its condition decides leaves its steps out on purpose.
        if step.is_none() && !matches!(s.kind, StmtKind::If { .. }) {
            begun(s, &mut self.jobs);
        }
        step
    }

    fn statement(&mut self, s: &'a Stmt, scope: &mut Scope) -> Option<StepId> {
        let label = self.text(head(s));
        let step = match &s.kind {
            StmtKind::Error => return None,
            StmtKind::Call(call) => return self.call(call, s.span, scope).map(|c| c.0),
            StmtKind::Let { name, ty, value } => return self.bind(name, ty.as_ref(), value, s.span, scope),
            StmtKind::Var { name, ty, value } => return self.variable(name, ty.as_ref(), value, s.span, scope),
            StmtKind::Set { name, op, value } => return self.set(name, *op, value, s.span, scope),
            StmtKind::LetDo { name, call } => {
                let Some((step, value)) = self.call(call, s.span, scope) else {
                    // What is wrong with the call has been said; the name is there all the same.
                    self.unshadowed(name, scope);
                    scope.bind(name.text.clone(), Value::Error);
                    return None;
                };
                self.unshadowed(name, scope);
                match value {
                    Some(v) => scope.bind(name.text.clone(), v),
                    None => {
                        scope.bind(name.text.clone(), Value::Error);
                        self.lab.report(
                            Diagnostic::error(
                                codes::TYPE_MISMATCH,
                                call.span,
                                "this step has no result",
                                "returns nothing",
                            )
                            .because(name.span, "named here")
                            .help("a skill returns a result with `return` and declares it with `-> Type`"),
                        );
                    }
                }
                return Some(step);
            }
            StmtKind::Step { name, body, handlers } => {
                if matches!(scope.var(&name.text), Some(Value::Step(..))) {
                    self.lab.report(
                        Diagnostic::error(
                            codes::DUPLICATE_NAME,
                            name.span,
                            format!("two steps have the name `{}`", name.text),
                            "used again here",
                        )
                        .help("choose another name, so that `.start` and `.end` are unambiguous"),
                    );
                }
                let seconds = self.seconds();
                let start = self.local(format!("{}.start", name.text), seconds.clone());
                let end = self.local(format!("{}.end", name.text), seconds);
                scope.bind(name.text.clone(), Value::Step(start, end));
                let inner = self.handled(body, handlers, scope);
                let named = Step::Named { name: name.text.clone(), start, end, body: inner };
                let id = self.add(format!("step {}", name.text), s.span, named);
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::Wait { duration } => Step::Wait { duration: self.duration_node(duration, scope, "wait")? },
            StmtKind::WaitUntil { cond, timeout, handlers } => {
                let condition = self.deciding(cond, scope)?;
                let timeout = self.optional_duration(timeout.as_ref(), scope)?;
                let mut waits = if timeout.is_none() { self.own_waits(&condition, s.span) } else { Vec::new() };
                if waits.is_empty() {
                    let id = self.add(label.clone(), s.span, Step::WaitUntil { condition, timeout });
                    return Some(self.with_handlers(&label, s.span, id, handlers, scope));
                }
                let duration = self.lab.graph.number(0.0);
                let after = self.add(label.clone(), s.span, Step::Wait { duration });
                if let Some(wiring) = &mut self.wiring {
                    wiring.awaited.insert(after, condition);
                }
                waits.push(after);
                let id = self.add(label.clone(), s.span, Step::Sequence(waits));
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::Hold { cond, duration, timeout, handlers } => {
                let condition = self.deciding(cond, scope)?;
                let duration = self.duration_node(duration, scope, "for")?;
                let timeout = self.optional_duration(timeout.as_ref(), scope)?;
                let id = self.add(label.clone(), s.span, Step::Hold { condition, duration, timeout });
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::Keep { cond, body, handlers } => {
                let condition = self.deciding(cond, scope)?;
                let body = self.handled(body, handlers, scope);
                let id = self.add(label.clone(), s.span, Step::Keep { condition, body });
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::Within { limit, since, body, handlers } => {
                let limit = self.duration_node(limit, scope, "within")?;
                let since = self.duration_node(since, scope, "after")?;
                let body = self.handled(body, handlers, scope);
                let id = self.add(label.clone(), s.span, Step::Within { limit, since, body });
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::If { cond, then, otherwise } => {
                let seen = scope.reads.replace(0);
                let Some(condition) = self.deciding(cond, scope) else {
                    begun(s, &mut self.jobs);
                    return None;
                };
                let read = scope.reads.replace(scope.reads.get() | seen);
                // In a skill the arguments may decide it, in a loop the turn: the other branch need not make sense then.
                let given = match self.open.as_slice() {
                    [] => read & self.turns != 0,
                    [_, ..] => !self.lab.prototype || self.open.len() > 1,
                };
                if self.open.is_empty() && read & self.parameters != 0 {
                    self.lab.by_parameters.insert(cond.span);
                }
                if given && let Some(truth) = self.lab.graph.constant(condition.node) {
                    let chosen = if truth != 0.0 { Some(then) } else { otherwise.as_ref() };
                    return chosen.map(|block| self.block(block, scope));
                }
                if let Some(chosen) = self.chosen_branch(condition.node, then, otherwise.as_ref(), scope) {
                    return chosen;
                }
                let (then, otherwise) = self.undecided(Undecided::Branch, cond.span, scope, |plan, scope| {
                    (plan.block(then, scope), otherwise.as_ref().map(|b| plan.block(b, scope)))
                });
                Step::If { condition, then, otherwise }
            }
            StmtKind::Repeat { times, body } => {
                let at = times.span;
                let times = self.count(times, scope)?;
                if let Some(turns) = self.turns(times, body, s.span, scope) {
                    return Some(turns);
                }
                let body = self.undecided(Undecided::Loop, at, scope, |plan, scope| plan.block(body, scope));
                Step::Repeat { times, body }
            }
            StmtKind::RepeatWhile { cond, max, body } => {
                let condition = self.deciding(cond, scope)?;
                let Some(max) = max else {
                    self.lab.report(
                        Diagnostic::error(codes::MISSING_FIELD, s.span, "a loop needs a bound", "could run forever")
                            .help("write `repeat while ... max 100 { }`"),
                    );
                    return None;
                };
                let max = self.count(max, scope)?;
                let body = self.undecided(Undecided::Loop, cond.span, scope, |plan, scope| plan.block(body, scope));
                Step::RepeatWhile { condition, max, body }
            }
            StmtKind::For { var, set, body } => {
                let items = match self.lab.set(set, scope) {
                    // Of a stand-in not everything is known: what would be done with each is looked at all the same.
                    None if self.lab.prototype => vec![Value::Error],
                    items => items?,
                };
                self.unshadowed(var, scope);
                let mut turns = Vec::new();
                let outside = self.turns;
                self.turns |= Scope::read_bit(scope.vars.len());
                for item in items {
                    let depth = scope.vars.len();
                    let shown = self.lab.spoken(&item);
                    let row = self.lab.row_span(&item);
                    scope.bind(var.text.clone(), item);
                    let turn = self.block(body, scope);
                    if let Some(shown) = shown {
                        self.steps[turn.0 as usize].label = format!("{} = {shown}", var.text);
                    }
                    if let Some(row) = row {
                        self.lab.rows.insert(turn, row);
                    }
                    turns.push(turn);
                    // A step of a turn is that turn's own.
                    scope.vars.truncate(depth);
                }
                self.turns = outside;
                Step::Sequence(turns)
            }
            StmtKind::Try { alternatives, handlers } => {
                let steps = self.undecided(Undecided::Alternative, head(s), scope, |plan, scope| {
                    alternatives.iter().map(|b| plan.block(b, scope)).collect()
                });
                let id = self.add("try", s.span, Step::Try(steps));
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::Retry { times } => {
                if self.handlers == 0 {
                    self.lab.report(
                        Diagnostic::error(
                            codes::MISPLACED,
                            s.span,
                            "`retry` is only for failure handlers",
                            "not in a handler",
                        )
                        .help("write `{ ... } on slip { retry 2 }`"),
                    );
                    return None;
                }
                Step::Retry { times: self.count(times, scope)? }
            }
            StmtKind::Claim { assets, body } => {
                let mut claims = Vec::new();
                for a in assets {
                    match self.lab.expr(a, scope) {
                        Value::Instance(i) | Value::Qualified(i, _) => claims.push(i),
                        Value::InstanceNode(_) => {
                            let thing = self.text(a.span);
                            self.lab.report(known_too_late(&format!("`{thing}`"), a.span));
                        }
                        other => {
                            self.lab.expected("an instance to claim", &other, a.span);
                        }
                    }
                }
                Step::Claim { claims, body: self.block(body, scope) }
            }
            StmtKind::Sequence { body, handlers } => return Some(self.guarded(&label, s.span, body, handlers, scope)),
            StmtKind::Parallel { body, handlers } => {
                let depth = scope.vars.len();
                let branches =
                    self.undecided(Undecided::Parallel, head(s), scope, |plan, scope| plan.statements(body, scope));
                super::leave(scope, depth);
                let id = self.add("parallel", s.span, Step::Parallel(branches));
                return Some(self.with_handlers(&label, s.span, id, handlers, scope));
            }
            StmtKind::Start { name, body } => {
                self.jobs.insert(name.text.clone());
                let body = self.undecided(Undecided::Job, head(s), scope, |plan, scope| plan.block(body, scope));
                Step::Start { job: name.text.clone(), body }
            }
            StmtKind::Await { name } => {
                if !self.jobs.contains(&name.text) {
                    let near = crate::near::nearest(&name.text, &self.jobs);
                    let mut d = crate::near::unknown(
                        name,
                        format!("no job `{}` is started before this", name.text),
                        "not started",
                    );
                    d.help.extend(crate::near::question(&near));
                    self.lab.report(d);
                    return None;
                }
                Step::Await { job: name.text.clone() }
            }
            StmtKind::Fail { name, text } => {
                let text = match text {
                    Some(text) => self.lab.filled(text, scope)?,
                    None => Text::default(),
                };
                let name = name.as_ref().map_or("failure", |n| n.text.as_str()).to_string();
                if !self.failures.contains(&name) {
                    Arc::make_mut(&mut self.failures).insert(name.clone());
                }
                Step::Fail { name, text }
            }
            StmtKind::Expect { cond } => {
                let mut parts = Vec::new();
                conjuncts(cond, &mut parts);
                let mut conditions = Vec::new();
                for part in parts {
                    conditions.push(self.condition(part, scope)?);
                }
                Step::Expect(conditions)
            }
            StmtKind::Record { value, every } => return self.record(value, every, s.span, scope),
            StmtKind::Note(text) => Step::Note(self.lab.filled(text, scope)?),
            StmtKind::Ask(text) => Step::Ask(self.lab.filled(text, scope)?),
            StmtKind::Return { value } => return self.give(value, s.span, scope),
            StmtKind::Run { .. } => {
                self.lab.report(
                    Diagnostic::error(
                        codes::MISPLACED,
                        s.span,
                        "`run` must be the first statement of a test",
                        "not the first statement",
                    )
                    .help("a test with its own steps, `test NAME in LAB { }`, cannot run a workflow"),
                );
                return None;
            }
        };
        Some(self.add(label, s.span, step))
    }

    /// Wraps a node in its failure handlers, if it has any.
    pub fn with_handlers(
        &mut self,
        label: &str,
        span: Span,
        body: StepId,
        handlers: &'a Handlers,
        scope: &mut Scope,
    ) -> StepId {
        if handlers.on.is_empty() && handlers.finally.is_none() {
            return body;
        }
        let mut caught = Vec::new();
        for (i, (name, block)) in handlers.on.iter().enumerate() {
            self.check_failure(name);
            if let Some((first, _)) = handlers.on[..i].iter().find(|(n, _)| n.text == name.text) {
                let headline = format!("`{}` has two handlers here", name.text);
                let d = Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, "this handler never runs");
                self.lab.report(d.because(first.span, "this handler takes it"));
            }
            self.handlers += 1;
            let step = self.undecided(Undecided::Handler, name.span, scope, |plan, scope| plan.block(block, scope));
            self.handlers -= 1;
            let which = if name.text == "failure" { Caught::Any } else { Caught::Named(name.text.clone()) };
            caught.push((which, step));
        }
        let finally = handlers.finally.as_ref().map(|b| {
            self.undecided(Undecided::Handler, Span { end: b.span.start, ..b.span }, scope, |plan, scope| {
                plan.block(b, scope)
            })
        });
        self.add(label, span, Step::Guarded { body, handlers: caught, finally })
    }

    /// A name that would hide an instance of the lab is reported.
    fn unshadowed(&mut self, name: &Name, scope: &Scope) {
        let Some(hidden) = self.lab.of_lab(&name.text, scope) else { return };
        let headline = format!("the lab already has the name `{}`", name.text);
        let mut d = Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, "would hide the one of the lab");
        if let Value::Instance(id) = hidden {
            d = d.because(self.lab.instances[id.0 as usize].span, "declared here");
        }
        self.lab.report(d.help("choose another name"));
    }

    /// A value that only a run will have.
    fn unknown_value(&mut self, ty: &Type, name: &str) -> Value {
        let before = self.lab.params.len();
        let value = self.lab.placeholder(ty, name);
        for p in &mut self.lab.params[before..] {
            p.value = f64::NAN;
        }
        value
    }

    fn seconds(&self) -> Unit {
        Unit::scaled("s", 1.0)
    }

    /// A duration's node, s; one that is negative whatever happens is reported where it stands.
    pub fn duration_node(&mut self, e: &'a Expr, scope: &mut Scope, what: &str) -> Option<NodeId> {
        let node = self.time_node(e, scope, what)?;
        if self.lab.graph.constant(node).is_some_and(|v| v < 0.0) {
            let headline = "a duration cannot be negative";
            self.lab.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "negative duration"));
            return None;
        }
        Some(node)
    }

    /// The node of a time of either sign, s.
    pub fn time_node(&mut self, e: &'a Expr, scope: &mut Scope, what: &str) -> Option<NodeId> {
        let v = self.lab.expr(e, scope);
        let ty = Type::Quantity { dimension: self.lab.duration(), point: false, optional: false };
        match self.lab.coerce(v, &ty, e.span, what) {
            Value::Num(n) => Some(n.node),
            _ => None,
        }
    }

    fn optional_duration(&mut self, e: Option<&'a Expr>, scope: &mut Scope) -> Option<Option<NodeId>> {
        match e {
            Some(e) => self.duration_node(e, scope, "timeout").map(Some),
            None => Some(None),
        }
    }

    fn count(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<NodeId> {
        let v = self.lab.expr(e, scope);
        match self.lab.coerce(v, &Type::ratio(), e.span, "number of times") {
            Value::Num(n) => {
                if let Some(v) = self.lab.graph.constant(n.node)
                    && (v < 0.0 || v.fract() != 0.0)
                {
                    self.lab.report(Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        e.span,
                        "the number of turns must be a whole number, 0 or more",
                        "not such a number",
                    ));
                    return None;
                }
                Some(n.node)
            }
            _ => None,
        }
    }

    /// `let x = e`: a value that depends on the run is taken now and kept.
    pub(super) fn bind(
        &mut self,
        name: &Name,
        ty: Option<&'a crate::ast::Type>,
        value: &'a Expr,
        span: Span,
        scope: &mut Scope,
    ) -> Option<StepId> {
        let ty = ty.map_or(Type::Any, |ty| self.lab.resolve_type(ty, scope.module));
        let seen = scope.reads.replace(0);
        let mut v = self.lab.typed(value, &ty, scope, &name.text);
        let read = scope.reads.replace(scope.reads.get() | seen);
        if let Value::Concentration(..) = v {
            self.lab.kindless(value.span);
            v = Value::Error;
        }
        self.unshadowed(name, scope);
        let (kept, steps) = self.keep(&name.text, v, span);
        // What follows from a turn's thing is that turn's own.
        if read & self.turns != 0 {
            self.turns |= Scope::read_bit(scope.vars.len());
        }
        scope.bind(name.text.clone(), kept);
        match steps.as_slice() {
            [] => None,
            [one] => Some(*one),
            _ => Some(self.add(format!("let {}", name.text), span, Step::Sequence(steps))),
        }
    }

    /// Keeps what depends on the run in locals; returns how later text sees it.
    pub(super) fn keep(&mut self, name: &str, v: Value, span: Span) -> (Value, Vec<StepId>) {
        match v {
            Value::Num(n) => {
                let (kept, steps) = self.keep_number(name, n, span);
                (Value::Num(kept), steps)
            }
            Value::Bool(n) if self.depends_on_run(n) => {
                let (node, step) = self.keep_node(name, n, Unit::one(), span);
                (Value::Bool(node), vec![step])
            }
            Value::InstanceNode(n) => {
                let (node, step) = self.keep_node(name, n, Unit::one(), span);
                self.lab.targets.keep(node, n);
                (Value::InstanceNode(node), vec![step])
            }
            Value::Enum(n, words) if self.depends_on_run(n) => {
                let (node, step) = self.keep_node(name, n, Unit::one(), span);
                (Value::Enum(node, words), vec![step])
            }
            Value::Tuple(items) => {
                let mut steps = Vec::new();
                let kept = items
                    .into_iter()
                    .enumerate()
                    .map(|(i, item)| {
                        let (v, s) = self.keep(&format!("{name}[{i}]"), item, span);
                        steps.extend(s);
                        v
                    })
                    .collect();
                (Value::Tuple(kept), steps)
            }
            Value::Range(low, high) => {
                let (low, mut steps) = self.keep_number(&format!("{name}.min"), *low, span);
                let (high, more) = self.keep_number(&format!("{name}.max"), *high, span);
                steps.extend(more);
                (Value::Range(Box::new(low), Box::new(high)), steps)
            }
            other => (other, Vec::new()),
        }
    }

    fn keep_number(&mut self, name: &str, n: Num, span: Span) -> (Num, Vec<StepId>) {
        if !self.depends_on_run(n.node) {
            return (n, Vec::new());
        }
        let unit = self.lab.unit_of(&n);
        let (node, step) = self.keep_node(name, n.node, unit, span);
        (Num { node, literal: false, ..n }, vec![step])
    }

    fn keep_node(&mut self, name: &str, value: NodeId, unit: Unit, span: Span) -> (NodeId, StepId) {
        let local = self.local(name, unit);
        let step = self.add(format!("let {name}"), span, Step::Let { local, value });
        (self.lab.graph.add(Op::Local(local)), step)
    }

    /// Whether a value is one that is kept already.
    pub(super) fn is_kept(&self, value: &Value) -> bool {
        let (Value::Num(Num { node, .. }) | Value::Bool(node) | Value::InstanceNode(node) | Value::Enum(node, _)) =
            value
        else {
            return false;
        };
        matches!(self.lab.graph.op(*node), Op::Local(_))
    }

    /// Whether a value asks a device what it shows.
    pub(super) fn asks_a_device(&self, value: &Value) -> bool {
        let asks = |node: NodeId| self.lab.graph.leaves(node).meets(Leaves::READING);
        match value {
            Value::Num(n) => asks(n.node),
            Value::Bool(n) | Value::InstanceNode(n) | Value::Enum(n, _) => asks(*n),
            Value::Range(low, high) => asks(low.node) || asks(high.node),
            Value::Tuple(items) => items.iter().any(|item| self.asks_a_device(item)),
            _ => false,
        }
    }

    fn depends_on_run(&self, node: NodeId) -> bool {
        self.lab.graph.leaves(node).meets(Leaves::LIVE)
    }

    /// `return e`.
    fn give(&mut self, value: &'a Expr, span: Span, scope: &mut Scope) -> Option<StepId> {
        let v = self.lab.expr(value, scope);
        let Some(Some(slot)) = self.results.last().cloned() else {
            let (headline, help) = if self.results.is_empty() {
                ("`return` is only for skills", "a workflow has no result; use `record` or `expect`")
            } else {
                ("this skill declares no result", "declare the type of the result in its signature: `-> Mass`")
            };
            self.lab.report(Diagnostic::error(codes::MISPLACED, span, headline, "this value is not used").help(help));
            return None;
        };
        let Value::Num(n) = self.lab.coerce(v, &slot.ty, value.span, "result") else {
            if let Some(Some(slot)) = self.results.last_mut() {
                slot.value = Some(Value::Error);
            }
            return None;
        };
        let node = self.lab.graph.add(Op::Local(slot.local));
        if let Some(unit) = &n.unit {
            self.locals[slot.local as usize].unit = Unit::clone(unit);
        }
        if let Some(Some(slot)) = self.results.last_mut() {
            slot.value = Some(Value::Num(Num { node, literal: false, ..n.clone() }));
        }
        let label = self.text(span);
        Some(self.add(label, span, Step::Let { local: slot.local, value: n.node }))
    }

    fn record(&mut self, value: &'a Expr, every: &'a Expr, span: Span, scope: &mut Scope) -> Option<StepId> {
        let v = self.lab.expr(value, scope);
        let interval = self.duration_node(every, scope, "every")?;
        if self.lab.graph.constant(interval) == Some(0.0) {
            let headline = "the interval of `record` cannot be 0";
            self.lab.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                every.span,
                headline,
                "no time between two samples",
            ));
            return None;
        }
        let (nodes, unit) = match v {
            Value::Num(n) => {
                let unit = self.lab.unit_of(&n);
                (vec![n.node], unit)
            }
            Value::Bool(n) => (vec![n], Unit::one()),
            Value::Tuple(items) => {
                let nums: Vec<Num> = items
                    .into_iter()
                    .filter_map(|i| match i {
                        Value::Num(n) => Some(n),
                        _ => None,
                    })
                    .collect();
                let unit = nums.first().map_or_else(Unit::one, |n| self.lab.shown(n));
                (nums.iter().map(|n| n.node).collect(), unit)
            }
            Value::Concentration(..) => {
                self.lab.kindless(value.span);
                return None;
            }
            other => {
                self.lab.expected("a quantity to record", &other, value.span);
                return None;
            }
        };
        let name = self.column(value.span, scope);
        let label = self.text(span);
        Some(self.add(label, span, Step::Record { name, value: nodes, unit, every: interval }))
    }

    /// Binds a workflow's parameters: given from outside, or their defaults. Returns them as shown.
    pub fn workflow_parameters(
        &mut self,
        params: &'a [Param],
        given: &[Given<'a>],
        scope: &mut Scope,
    ) -> Vec<(String, String)> {
        let mut shown = Vec::new();
        for p in params {
            let ty = p.ty.as_ref().map_or(Type::Any, |ty| self.lab.resolve_parameter_type(ty, scope.module));
            let given = given.iter().find(|g| g.name.text == p.name.text);
            let role = matches!(ty, Type::Instance { .. });
            let is_open = given.is_none()
                && matches!(ty, Type::Quantity { .. } | Type::Int)
                && self.lab.open.leaves(&p.name.text);
            let (value, span) = match (given, &p.default) {
                _ if is_open => (self.unknown_value(&ty, &p.name.text), p.name.span),
                (Some(g), _) => {
                    let mut scope = Scope { lab: true, ..Scope::module(g.module) };
                    (self.lab.hinted(g.value, &ty, &mut scope), g.value.span)
                }
                (None, Some(e)) => (self.lab.hinted(e, &ty, scope), e.span),
                (None, None) if role => (self.choose_role(p, &ty, scope), p.name.span),
                // Checked by itself, a workflow may have any value; a run needs one.
                (None, None) if !self.to_run => (self.unknown_value(&ty, &p.name.text), p.name.span),
                (None, None) => {
                    self.lab.report(
                        Diagnostic::error(
                            codes::MISSING_FIELD,
                            p.name.span,
                            format!("parameter `{}` has no value", p.name.text),
                            "it has no default",
                        )
                        .help(format!("give it with `--set {}=...`, or add a default `= ...`", p.name.text)),
                    );
                    (Value::Error, p.name.span)
                }
            };
            let v = self.lab.coerce(value, &ty, span, &p.name.text);
            let v = match v {
                Value::Num(n) => {
                    if let (Some(unit), Some(si)) = (&n.unit, self.lab.graph.constant(n.node)) {
                        shown.push((p.name.text.clone(), unit.show(si)));
                    } else if let Some(si) = self.lab.graph.constant(n.node) {
                        shown.push((p.name.text.clone(), matterix_ir::quantity::show_number(si)));
                    }
                    let named = self.lab.name_param(&p.name.text, n, span);
                    if let (true, Op::Param(i)) = (is_open, self.lab.graph.op(named.node)) {
                        self.lab.open.add(&p.name.text, i, &named, span);
                    }
                    if ty == Type::Int {
                        self.lab.open.whole(self.lab.graph.op(named.node));
                    }
                    if let (None, Op::Param(i)) = (given, self.lab.graph.op(named.node)) {
                        self.lab.defaulted.insert(i);
                    }
                    Value::Num(named)
                }
                Value::Bool(node) => {
                    let node = self.chosen(&p.name.text, node, given, &["false", "true"]);
                    let truth = self.lab.graph.constant(node).map(|v| if v == 0.0 { "false" } else { "true" });
                    shown.extend(truth.map(|t| (p.name.text.clone(), t.to_string())));
                    Value::Bool(node)
                }
                Value::Enum(node, words) => {
                    let node = self.chosen(&p.name.text, node, given, &words);
                    let word = self.lab.graph.constant(node).and_then(|v| words.get(v as usize));
                    shown.extend(word.map(|w| (p.name.text.clone(), w.clone())));
                    Value::Enum(node, words)
                }
                Value::Instance(id) => {
                    let v = self.check_role(p, Value::Instance(id), span, scope);
                    shown.push((p.name.text.clone(), self.lab.instances[id.0 as usize].name.clone()));
                    v
                }
                other => other,
            };
            scope.bind(p.name.text.clone(), v);
            self.check_allowed(p, span, scope);
        }
        shown
    }

    /// The node of a parameter that is a truth value or a word: what it is given or supposed to have, or its default.
    fn chosen<W: AsRef<str>>(&mut self, name: &str, node: NodeId, given: Option<&Given<'a>>, words: &[W]) -> NodeId {
        let Some(word) = self.lab.graph.constant(node).and_then(|v| words.get(v as usize)) else { return node };
        if given.is_some() {
            return node;
        }
        let supposed = self.supposed.as_ref().filter(|choice| choice.name == name);
        let other = supposed.and_then(|choice| words.iter().position(|word| word.as_ref() == choice.word));
        if let Some(index) = other {
            return self.lab.graph.number(index as f64);
        }
        let words: Vec<String> = words.iter().map(|word| word.as_ref().to_owned()).collect();
        self.lab.choices.push(Choice { name: name.to_owned(), word: word.as_ref().to_owned(), words });
        node
    }
}

/// Adds the jobs that a statement starts: where it cannot be written out, whoever waits for them is not wrong.
fn begun(stmt: &Stmt, jobs: &mut BTreeSet<String>) {
    if let StmtKind::Start { name, .. } = &stmt.kind {
        jobs.insert(name.text.clone());
    }
    stmt.kind.blocks().into_iter().flat_map(|block| &block.stmts).for_each(|inner| begun(inner, jobs));
}

/// The part of a statement that names it: without its block.
fn head(s: &Stmt) -> Span {
    match &s.kind {
        StmtKind::WaitUntil { timeout, cond, .. } => {
            Span { end: timeout.as_ref().map_or(cond.span.end, |t| t.span.end), ..s.span }
        }
        StmtKind::Hold { timeout, duration, .. } => {
            Span { end: timeout.as_ref().map_or(duration.span.end, |t| t.span.end), ..s.span }
        }
        kind => match kind.blocks().first() {
            Some(block) => Span { end: block.span.start.max(s.span.start), ..s.span },
            None => s.span,
        },
    }
}

/// The parts of an `and`.
fn conjuncts<'a>(e: &'a Expr, out: &mut Vec<&'a Expr>) {
    match &*e.kind {
        ExprKind::Binary(Binary::And, a, b) => {
            conjuncts(a, out);
            conjuncts(b, out);
        }
        _ => out.push(e),
    }
}
