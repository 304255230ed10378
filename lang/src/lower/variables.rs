//! `var`: names that stand for another value after a later step. What they stand for is followed while the plan is written out, step by
//! step, so that a run never sees them. Where only the run decides whether or how often a step is done, they cannot change.

use matterix_ir::plan::StepId;
use matterix_ir::{Diagnostic, NodeId, Span, codes};

use super::Planner;
use crate::ast::{AssignOp, Binary, Block, Expr, Name, Stmt, StmtKind, Type as TypeText};
use crate::declare::Type;
use crate::eval::{Decided, Num, Scope, Value};
use crate::near;

/// Why only the run decides what is done in a block.
#[derive(Clone, Copy, Debug)]
pub(super) enum Undecided {
    Branch,
    Loop,
    Alternative,
    Handler,
    Guarded,
    Parallel,
    Job,
}

impl Undecided {
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Undecided::Branch => {
                ("only the run decides this `if`", "change it outside, or let a value known before the run decide")
            }
            Undecided::Loop => (
                "only the run decides how often this is repeated",
                "write `for` over a list, or `repeat` with a number known before the run",
            ),
            Undecided::Alternative => {
                ("only the run decides which alternative is done", "change it before or after the `try`")
            }
            Undecided::Handler => {
                ("only the run decides whether this fails", "change it before or after the block with the handler")
            }
            Undecided::Guarded => (
                "this block has failure handlers, and may end at any of its steps",
                "change it before or after the block",
            ),
            Undecided::Parallel => ("these branches go on at the same time", "change it before or after `parallel`"),
            Undecided::Job => ("this job goes on beside the following steps", "change it before or after `start`"),
        }
    }
}

/// A block that only the run decides about: names declared outside of it cannot change in it.
pub(super) struct Barrier {
    /// How many names are declared outside.
    depth: usize,
    why: Undecided,
    at: Span,
    /// What decides is not known yet: nothing is wrong, but what changes is unknown from there on.
    quiet: bool,
}

impl<'a> Planner<'a, '_> {
    /// Does something about a block that only the run decides about.
    pub(super) fn undecided<R>(
        &mut self,
        why: Undecided,
        at: Span,
        scope: &mut Scope,
        work: impl FnOnce(&mut Self, &mut Scope) -> R,
    ) -> R {
        let quiet = self.lab.prototype && matches!(why, Undecided::Branch | Undecided::Loop);
        self.behind(Barrier { depth: scope.vars.len(), why, at, quiet }, |plan| work(plan, scope))
    }

    /// Does something behind a barrier.
    fn behind<R>(&mut self, barrier: Barrier, work: impl FnOnce(&mut Self) -> R) -> R {
        self.barriers.push(barrier);
        let result = work(self);
        self.barriers.pop();
        result
    }

    /// A block of which nothing decides but what is not known before a value is given: what it changes is unknown after it.
    fn unknown_block(&mut self, block: &'a Block, scope: &mut Scope) -> StepId {
        let barrier = Barrier { depth: scope.vars.len(), why: Undecided::Branch, at: block.span, quiet: true };
        self.behind(barrier, |plan| plan.block(block, scope))
    }

    /// Whether blocks change names that are declared outside of them.
    pub(super) fn changes<'b>(&self, blocks: impl IntoIterator<Item = &'b Block>, scope: &Scope) -> bool {
        fn any(stmts: &[Stmt], scope: &Scope) -> bool {
            stmts.iter().any(|stmt| match &stmt.kind {
                StmtKind::Set { name, .. } => scope.variable(&name.text).is_some(),
                kind => kind.blocks().into_iter().any(|block| any(&block.stmts, scope)),
            })
        }
        blocks.into_iter().any(|block| any(&block.stmts, scope))
    }

    /// `if` with branches that change names declared outside: only the branch that is taken is written out.
    pub(super) fn chosen_branch(
        &mut self,
        condition: NodeId,
        then: &'a Block,
        otherwise: Option<&'a Block>,
        scope: &mut Scope,
    ) -> Option<Option<StepId>> {
        if !self.changes(std::iter::once(then).chain(otherwise), scope) {
            return None;
        }
        match self.lab.before_run(condition) {
            Decided::Now(truth) => {
                let chosen = if truth != 0.0 { Some(then) } else { otherwise };
                Some(chosen.map(|block| self.block(block, scope)))
            }
            Decided::Later => {
                let mut steps = vec![self.unknown_block(then, scope)];
                steps.extend(otherwise.map(|block| self.unknown_block(block, scope)));
                Some(Some(self.add("sequence", then.span, matterix_ir::plan::Step::Sequence(steps))))
            }
            Decided::ByRun => None,
        }
    }

    /// `repeat n times` that changes names declared outside: each turn is written out.
    pub(super) fn turns(&mut self, times: NodeId, body: &'a Block, span: Span, scope: &mut Scope) -> Option<StepId> {
        if !self.changes([body], scope) {
            return None;
        }
        let count = match self.lab.before_run(times) {
            Decided::Now(count) => count,
            Decided::Later => return Some(self.unknown_block(body, scope)),
            Decided::ByRun => return None,
        };
        let mut turns = Vec::new();
        let mut turn = 0.0;
        while turn < count && self.lab.spend_on(span) && self.lab.has_room(self.steps.len()) {
            turn += 1.0;
            let step = self.block(body, scope);
            self.steps[step.0 as usize].label = format!("turn {turn}");
            turns.push(step);
        }
        let label = self.text(Span { end: body.span.start.max(span.start), ..span });
        Some(self.add(label.trim_end().to_owned(), span, matterix_ir::plan::Step::Sequence(turns)))
    }

    /// `var n = e`.
    pub(super) fn variable(
        &mut self,
        name: &Name,
        ty: Option<&'a TypeText>,
        value: &'a Expr,
        span: Span,
        scope: &mut Scope,
    ) -> Option<StepId> {
        let step = self.bind(name, ty, value, span, scope);
        let ty = ty.map_or(Type::Any, |ty| self.lab.resolve_type(ty, scope.module));
        scope.vary(ty);
        // What it decides is decided turn by turn, as what a loop's name decides.
        self.turns |= Scope::read_bit(scope.vars.len() - 1);
        step
    }

    /// `n += e`, `n -= e`, `n = e`.
    pub(super) fn set(
        &mut self,
        name: &Name,
        op: AssignOp,
        value: &'a Expr,
        span: Span,
        scope: &mut Scope,
    ) -> Option<StepId> {
        let Some((position, ty)) = scope.variable(&name.text) else {
            self.not_a_variable(name, op, scope);
            return None;
        };
        let barrier = self.barriers.iter().rev().find(|barrier| position < barrier.depth);
        let quiet = barrier.is_some_and(|barrier| barrier.quiet);
        if let Some(barrier) = barrier.filter(|barrier| !barrier.quiet) {
            let (reason, help) = barrier.why.words();
            let at = barrier.at;
            let headline = format!("`{}` cannot change here: {reason}", name.text);
            let d = Diagnostic::error(codes::UNDECIDED_CHANGE, span, headline, "changed here").because(at, reason);
            self.lab.report(d.help(help));
            scope.vars[position].1 = Value::Error;
            return None;
        }
        let new = match &ty {
            Type::Any => self.lab.expr(value, scope),
            ty if op == AssignOp::Set => self.lab.typed(value, ty, scope, &name.text),
            _ => self.lab.expr(value, scope),
        };
        let new = match new {
            Value::Concentration(..) if op == AssignOp::Set => {
                self.lab.kindless(value.span);
                Value::Error
            }
            new => new,
        };
        let old = std::mem::replace(&mut scope.vars[position].1, Value::Error);
        if quiet {
            return None;
        }
        let new = match op {
            AssignOp::Set => self.of_same_kind(name, &old, new, value.span),
            AssignOp::Add | AssignOp::Sub => self.changed(name, op, old, new, value.span, span),
        };
        let new = match &ty {
            Type::Any => new,
            ty => self.lab.coerce(new, ty, value.span, &name.text),
        };
        let (kept, steps) = self.keep(&name.text, new, span);
        scope.vars[position].1 = match kept {
            Value::Num(n) => Value::Num(Num { literal: false, ..n }),
            other => other,
        };
        match steps.as_slice() {
            [] => None,
            [one] => Some(*one),
            _ => Some(self.add(name.text.clone(), span, matterix_ir::plan::Step::Sequence(steps))),
        }
    }

    /// A sum, a difference, or a list with more elements.
    fn changed(&mut self, name: &Name, op: AssignOp, old: Value, new: Value, at: Span, span: Span) -> Value {
        match (self.lab.listed(old), self.lab.listed(new)) {
            (Value::Error, _) | (_, Value::Error) => Value::Error,
            (Value::List(mut items), Value::List(more)) if op == AssignOp::Add => {
                if let (Some(first), Some(next)) = (items.first(), more.first())
                    && !self.is_alike(first, next)
                {
                    let (first, next) = (self.shown_kind(first), self.shown_kind(next));
                    let headline = format!("`{}` is a list of {first} and cannot take {next}", name.text);
                    self.lab.report(Diagnostic::error(codes::TYPE_MISMATCH, at, headline, format!("this is {next}")));
                    return Value::Error;
                }
                self.lab.spend_on_items(more.len());
                items.extend(more);
                Value::List(items)
            }
            (Value::List(_), other) if op == AssignOp::Add => {
                let (kind, written) = (self.shown_kind(&other), self.text(at));
                let headline = format!("`{}` is a list, and this is {kind}", name.text);
                let d = Diagnostic::error(codes::TYPE_MISMATCH, at, headline, "not a list");
                self.lab.report(d.guess(format!("write `[{written}]`"), at, format!("[{written}]")));
                Value::Error
            }
            (old, new) => {
                let op = if op == AssignOp::Add { Binary::Add } else { Binary::Sub };
                self.lab.arith(op, old, new, name.span, at, span)
            }
        }
    }

    /// A new value, reported if it is of another kind than the old one.
    fn of_same_kind(&mut self, name: &Name, old: &Value, new: Value, at: Span) -> Value {
        if self.is_alike(old, &new) {
            return new;
        }
        let (was, is) = (self.shown_kind(old), self.shown_kind(&new));
        let code = match (old, &new) {
            (Value::Num(_), Value::Num(_)) => codes::UNIT_MISMATCH,
            _ => codes::TYPE_MISMATCH,
        };
        let headline = format!("`{}` is {was} and cannot become {is}", name.text);
        self.lab.report(Diagnostic::error(code, at, headline, format!("this is {is}")));
        Value::Error
    }

    fn is_alike(&self, old: &Value, new: &Value) -> bool {
        match (old, new) {
            (Value::Error | Value::Nothing, _) | (_, Value::Error | Value::Nothing) => true,
            (Value::Num(a), Value::Num(b)) => a.dimension.agrees(&b.dimension) && a.point == b.point,
            (Value::Enum(_, a), Value::Enum(_, b)) => a == b,
            (a, b) => a.what() == b.what(),
        }
    }

    fn shown_kind(&self, value: &Value) -> String {
        match value {
            Value::Num(n) => self.lab.describe(n),
            other => other.what().to_owned(),
        }
    }

    /// What is assigned to is no `var`.
    fn not_a_variable(&mut self, name: &Name, op: AssignOp, scope: &mut Scope) {
        let text = &name.text;
        if scope.var(text).is_some() {
            let headline = format!("`{text}` does not change: it is no `var`");
            let d = Diagnostic::error(codes::MISPLACED, name.span, headline, "cannot change");
            self.lab.report(d.help(format!(
                "declare it with `var {text} = ...`, or give the new value another name: `let ... = ...`"
            )));
            return;
        }
        if self.lab.of_lab(text, scope).is_some() {
            let headline = format!("`{text}` belongs to the lab: a step cannot assign it");
            self.lab.report(Diagnostic::error(codes::MISPLACED, name.span, headline, "not a `var`"));
            return;
        }
        let variables = scope.variables.iter().filter_map(|(at, _)| scope.vars.get(*at)).map(|(name, _)| name.clone());
        let near = near::nearest(text, variables);
        let mut d = near::unknown(name, format!("there is no `var {text}` here"), "not declared");
        if near.is_empty() {
            d = match op {
                AssignOp::Set => d.guess(format!("write `let {text} = ...`"), name.span, format!("let {text}")),
                _ => d.help(format!("declare it first: `var {text} = ...`")),
            };
        }
        self.lab.report(near::proposed(d, &near, name.span));
    }
}
