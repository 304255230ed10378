//! Laws, effects and clauses.

use matterix_lang::ast::{
    Clause, ClauseKind, Effect, Expr, Goal, Law, LawKind, Manner, Name, Param, Refusal, Sig, Text,
};

use super::{Found, Walk};
use crate::index::Kind;

impl Walk<'_> {
    pub(super) fn laws(&mut self, laws: &[Law]) {
        for law in laws {
            match &law.kind {
                LawKind::Error => {}
                LawKind::Let { name, value } => {
                    let found = self.expr(value);
                    self.bind(Kind::Variable, name, law.span, &found);
                }
                LawKind::For { var, set, body } => {
                    let set = self.expr(set);
                    let each = self.each(&set.sort);
                    self.inside(law.span, |this| {
                        this.bind(Kind::Variable, var, law.span, &Found::of(each));
                        this.laws(body);
                    });
                }
                LawKind::If { cond, then, otherwise } => {
                    self.expr(cond);
                    self.inside(law.span, |this| this.laws(then));
                    self.inside(law.span, |this| this.laws(otherwise));
                }
                LawKind::Assign { target, value, .. } => self.assign(target, value),
                LawKind::Call(call) => {
                    self.effect_call(call);
                }
            }
        }
    }

    fn assign(&mut self, target: &Expr, value: &Expr) {
        let found = self.expr(target);
        let words = self.words_of(&found);
        self.expr_among(value, &words);
    }

    /// `move(q, from: a, to: b)`, `rinse(m)`, `soil(a, from: b)`.
    fn effect_call(&mut self, call: &Expr) {
        if let matterix_lang::ast::ExprKind::Call(callee, args) = &*call.kind {
            if let matterix_lang::ast::ExprKind::Name(n) = &*callee.kind {
                self.language(n.span, "an effect on the contents of vessels");
            }
            for arg in args {
                if let Some(name) = &arg.name {
                    self.language(name.span, "an argument");
                }
                self.expr(&arg.value);
            }
            return;
        }
        self.expr(call);
    }

    fn effects(&mut self, effects: &[Effect]) {
        for effect in effects {
            match effect {
                Effect::Assign(target, value) => self.assign(target, value),
                Effect::Call(call) => self.effect_call(call),
                Effect::Each { var, set, effects } => {
                    let set = self.expr(set);
                    let each = self.each(&set.sort);
                    let end = self.end;
                    let block = matterix_ir::Span { end: end.max(var.span.end), ..var.span };
                    self.inside(block, |this| {
                        this.bind(Kind::Variable, var, var.span, &Found::of(each));
                        this.effects(effects);
                    });
                }
            }
        }
    }

    pub(super) fn refusal(&mut self, refusal: Option<&Refusal>) {
        let Some(refusal) = refusal else { return };
        self.failure(&refusal.failure);
        if let Some(because) = &refusal.because {
            self.text(because);
        }
    }

    /// The name of a failure.
    pub(super) fn failure(&mut self, name: &Name) {
        match self.index.failure(&name.text).or_else(|| self.index.hazard(&name.text)) {
            Some(def) => self.known(name.span, def),
            None => self.language(name.span, "a failure raised by the language"),
        }
    }

    /// The signature of a skill or command; its parameters are seen from here on.
    pub(super) fn signature(&mut self, sig: &Sig, clauses: &[Clause]) {
        if let Some(span) = super::super::collect::verb_span(&sig.verb) {
            self.declares(span);
        }
        for p in sig.all_params() {
            self.param(p);
        }
        for of in sig.all_params().filter_map(|p| p.of.as_ref()) {
            let meant = sig.all_params().find(|p| p.name.text == of.text);
            if let Some(def) = meant.and_then(|p| self.index.declared_at(p.name.span)) {
                self.known(of.span, def);
            }
        }
        for (label, params) in &sig.labelled {
            match params.first().and_then(|p| self.index.declared_at(p.name.span)) {
                Some(def) => self.known(label.span, def),
                None => self.language(label.span, "a preposition"),
            }
        }
        if let Some(result) = &sig.result {
            self.ty(result);
        }
        let options: Vec<_> = clauses
            .iter()
            .filter_map(|c| match &c.kind {
                ClauseKind::Option(p) => Some(p),
                _ => None,
            })
            .collect();
        for p in &options {
            self.param(p);
        }
        let params: Vec<&Param> = sig.all_params().chain(options.iter().copied()).collect();
        self.enter_params(params.into_iter());
    }

    pub(super) fn clauses(&mut self, clauses: &[Clause]) {
        for clause in clauses {
            self.clause(&clause.kind);
        }
    }

    fn clause(&mut self, clause: &ClauseKind) {
        match clause {
            ClauseKind::Needs { cond, refusal }
            | ClauseKind::Presumes { cond, refusal, .. }
            | ClauseKind::Warns { cond, refusal } => {
                self.condition(cond, refusal.as_ref());
            }
            ClauseKind::While(e) | ClauseKind::Until(e) => drop(self.expr(e)),
            ClauseKind::Fails(names) => names.iter().for_each(|n| self.failure(n)),
            ClauseKind::Effect(effects) => self.effects(effects),
            ClauseKind::Takes { nominal, bounds } => self.exprs(std::iter::once(nominal).chain(bounds)),
            ClauseKind::Option(_) => {}
            ClauseKind::Says { text, when } => {
                self.text(text);
                self.exprs(when);
            }
            ClauseKind::Moves { mover, manner, to, within } => {
                self.expr(mover);
                match manner {
                    Manner::Free | Manner::Straight | Manner::Driving => {}
                    Manner::Upright(e) => drop(self.expr(e)),
                    Manner::Tilted(a, b) => self.exprs([a, b]),
                }
                match to {
                    Goal::Frame { at, by } => self.exprs(std::iter::once(at).chain(by)),
                    Goal::Shift(e) | Goal::Joints(e) => drop(self.expr(e)),
                    Goal::Home => {}
                }
                self.exprs(within);
            }
            ClauseKind::Grips { item, at, by } => self.exprs(std::iter::once(item).chain(at).chain([by])),
            ClauseKind::Leads { handle, by } => self.exprs([handle, by]),
            ClauseKind::Frees { item, on, by } => self.exprs(std::iter::once(item).chain(on).chain([by])),
        }
    }

    /// A condition and what is said where it does not hold, which may name what `all` goes through.
    pub(super) fn condition(&mut self, cond: &Expr, refusal: Option<&Refusal>) {
        self.expr(cond);
        let Some(because) = refusal.and_then(|r| r.because.as_ref()) else { return self.refusal(refusal) };
        if let Some(refusal) = refusal {
            self.failure(&refusal.failure);
        }
        self.said_of(cond, because);
    }

    /// What is said of a condition, which may name what it goes through.
    pub(super) fn said_of(&mut self, cond: &Expr, words: &Text) {
        self.inside(words.span, |this| {
            this.enter_folds(cond);
            this.text(words);
        });
    }

    /// The variables that a condition goes through.
    fn enter_folds(&mut self, e: &Expr) {
        match &*e.kind {
            matterix_lang::ast::ExprKind::Fold { var, body, .. } => {
                if let Some(id) = self.index.declared_at(var.span) {
                    self.scope.push((var.text.clone(), id));
                }
                self.enter_folds(body);
            }
            matterix_lang::ast::ExprKind::Binary(_, a, b) => {
                self.enter_folds(a);
                self.enter_folds(b);
            }
            matterix_lang::ast::ExprKind::Unary(_, inner) => self.enter_folds(inner),
            _ => {}
        }
    }
}
