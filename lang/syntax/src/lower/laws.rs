//! Processes, events and their laws.

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower,
};
use crate::ast::{AssignOp, Delay, Event, Expr, Law, LawKind, Process};

impl Lower<'_> {
    pub(super) fn process(&mut self, node: Node) -> Process {
        let mut kids = Kids::of(node);
        let name = self.name_in(&mut kids);
        let params = self.params_in(&mut kids);
        let guard = if kids.has(Rule::kw_while) { Some(self.expr_in(&mut kids)) } else { None };
        Process { name, params, guard, laws: self.laws_in(&mut kids) }
    }

    pub(super) fn event(&mut self, node: Node) -> Event {
        let mut kids = Kids::of(node);
        let name = self.name_in(&mut kids);
        let params = self.params_in(&mut kids);
        let when = self.expr_in(&mut kids);
        let delay = kids.eat(Rule::sustained).or_else(|| kids.eat(Rule::delayed)).map(|node| {
            let sustained = node.as_rule() == Rule::sustained;
            Delay { sustained, time: self.expr_in(&mut Kids::of(node)) }
        });
        Event { name, params, when, delay, laws: self.laws_in(&mut kids) }
    }

    fn laws_in(&mut self, kids: &mut Kids) -> Vec<Law> {
        kids.eat(Rule::laws).map_or_else(Vec::new, |node| self.laws(node))
    }

    fn laws(&mut self, node: Node) -> Vec<Law> {
        let mut laws = Vec::new();
        let mut kids = Kids::of(node);
        let mut before = None;
        while let Some(part) = kids.take() {
            let (start, span) = (part.as_span().start(), self.span(&part));
            match part.as_rule() {
                Rule::end => continue,
                Rule::bad_rest => self.mistakes.rest(Rule::only_law, before.unwrap_or(start), &part),
                Rule::bad_law => {
                    self.mistakes.line(Rule::only_law, before, &part);
                    laws.push(Law { kind: LawKind::Error, span });
                    for inner in Kids::of(part).all(Rule::laws) {
                        laws.extend(self.laws(inner));
                    }
                }
                _ => {
                    let kind = self.law(part);
                    laws.push(Law { kind, span });
                }
            }
            before = Some(start);
        }
        laws
    }

    fn law(&mut self, node: Node) -> LawKind {
        let rule = node.as_rule();
        let mut kids = Kids::of(node);
        match rule {
            Rule::law_let => LawKind::Let { name: self.name_in(&mut kids), value: self.expr_in(&mut kids) },
            Rule::law_for => LawKind::For {
                var: self.name_in(&mut kids),
                set: self.expr_in(&mut kids),
                body: self.laws_in(&mut kids),
            },
            Rule::law_if => self.law_if(&mut kids),
            _ => {
                let target = self.expr_in(&mut kids);
                let Some(op) = assign_op(&mut kids) else { return LawKind::Call(target) };
                LawKind::Assign { target, op, value: self.expr_in(&mut kids) }
            }
        }
    }

    /// `else if` is an `else` of one `if`.
    fn law_if(&mut self, kids: &mut Kids) -> LawKind {
        let mut branches: Vec<(Expr, Vec<Law>)> = Vec::new();
        while let Some(cond) = kids.eat(Rule::cond) {
            let cond = self.expr(cond);
            branches.push((cond, self.laws_in(kids)));
        }
        let mut otherwise = self.laws_in(kids);
        if let Some((cond, _)) = branches.get(super::MAX_BRANCHES) {
            self.too_many_branches(cond.span);
            branches.truncate(super::MAX_BRANCHES);
        }
        while let Some((cond, then)) = branches.pop() {
            let span = then.iter().fold(cond.span, |span, law| span.to(law.span));
            let kind = LawKind::If { cond, then, otherwise };
            if branches.is_empty() {
                return kind;
            }
            otherwise = vec![Law { kind, span }];
        }
        LawKind::Error
    }
}

/// How something changes, if that is what stands next.
pub(super) fn assign_op(kids: &mut Kids) -> Option<AssignOp> {
    Some(match kids.eat(Rule::assign)?.as_str() {
        "+=" => AssignOp::Add,
        "-=" => AssignOp::Sub,
        _ => AssignOp::Set,
    })
}
