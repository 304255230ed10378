//! Steps of workflows, skills and tests.

use matterix_lang::ast::{Block, Handlers, Stmt, StmtKind};

use super::{Found, Walk};
use crate::index::Kind;

impl Walk<'_> {
    /// Steps in braces, and what happens where they fail.
    pub(super) fn guarded(&mut self, body: &Block, handlers: &Handlers) {
        self.block(body);
        self.handlers(handlers);
    }

    fn block(&mut self, block: &Block) {
        self.inside(block.span, |this| block.stmts.iter().for_each(|s| this.stmt(s)));
    }

    fn handlers(&mut self, handlers: &Handlers) {
        for (name, block) in &handlers.on {
            self.failure(name);
            self.block(block);
        }
        if let Some(block) = &handlers.finally {
            self.block(block);
        }
    }

    fn stmt(&mut self, s: &Stmt) {
        match &s.kind {
            StmtKind::Error => {}
            StmtKind::Set { name, value, .. } => {
                self.name(name, &[]);
                self.expr(value);
            }
            StmtKind::Let { name, ty, value } | StmtKind::Var { name, ty, value } => {
                if let Some(ty) = ty {
                    self.ty(ty);
                }
                let found = self.expr(value);
                let sort = ty.as_ref().map_or(found.sort, |ty| self.index.typed(self.at, Some(ty), None));
                self.bind(Kind::Variable, name, s.span, &Found { sort, def: found.def });
            }
            StmtKind::LetDo { name, call } => {
                let skill = self.call(call);
                let sort = skill.map_or(Found::nothing().sort, |d| self.index.def(d).sort.clone());
                self.bind(Kind::Variable, name, s.span, &Found::of(sort));
            }
            StmtKind::Step { name, body, handlers } => {
                self.bind(Kind::Step, name, s.span, &Found::of(matterix_lang::semantic_index::Sort::Step));
                self.guarded(body, handlers);
            }
            StmtKind::Wait { duration } => drop(self.expr(duration)),
            StmtKind::WaitUntil { cond, timeout, handlers } => {
                self.exprs(std::iter::once(cond).chain(timeout));
                self.handlers(handlers);
            }
            StmtKind::If { cond, then, otherwise } => {
                self.expr(cond);
                self.block(then);
                otherwise.iter().for_each(|b| self.block(b));
            }
            StmtKind::RepeatWhile { cond, max, body } => {
                self.exprs(std::iter::once(cond).chain(max));
                self.block(body);
            }
            StmtKind::Repeat { times, body } => {
                self.expr(times);
                self.block(body);
            }
            StmtKind::For { var, set, body } => {
                let set = self.expr(set);
                let each = match &set.sort {
                    // A grid of a thing is gone through place by place.
                    matterix_lang::semantic_index::Sort::Thing(..) => {
                        self.index.element_of(&set.sort).unwrap_or(set.sort)
                    }
                    other => self.each(other),
                };
                self.inside(body.span, |this| {
                    this.bind(Kind::Variable, var, s.span, &Found::of(each));
                    this.block(body);
                });
            }
            StmtKind::Within { limit, since, body, handlers } => {
                self.exprs([limit, since]);
                self.guarded(body, handlers);
            }
            StmtKind::Hold { cond, duration, timeout, handlers } => {
                self.exprs([cond, duration].into_iter().chain(timeout));
                self.handlers(handlers);
            }
            StmtKind::Keep { cond, body, handlers } => {
                self.expr(cond);
                self.guarded(body, handlers);
            }
            StmtKind::Try { alternatives, handlers } => {
                alternatives.iter().for_each(|b| self.block(b));
                self.handlers(handlers);
            }
            StmtKind::Retry { times } => drop(self.expr(times)),
            StmtKind::Claim { assets, body } => {
                self.exprs(assets);
                self.block(body);
            }
            StmtKind::Sequence { body, handlers } | StmtKind::Parallel { body, handlers } => {
                self.guarded(body, handlers);
            }
            StmtKind::Start { name, body } => {
                self.block(body);
                self.job(name, s.span);
            }
            StmtKind::Await { name } => self.awaited(name),
            StmtKind::Fail { name, text } => {
                if let Some(name) = name {
                    self.index.failure_here(name, s.span);
                    self.failure(name);
                }
                text.iter().for_each(|t| self.text(t));
            }
            StmtKind::Expect { cond } => drop(self.expr(cond)),
            StmtKind::Record { value, every } => self.exprs([value, every]),
            StmtKind::Note(text) | StmtKind::Ask(text) => self.text(text),
            StmtKind::Return { value } => drop(self.expr(value)),
            StmtKind::Run { workflow, options } => {
                self.path(workflow);
                let params = self.named(workflow).map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
                self.options(options, &params);
            }
            StmtKind::Call(call) => drop(self.call(call)),
        }
    }
}
