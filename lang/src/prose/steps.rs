//! Statements as numbered steps.

use super::list::{Group, List, Step};
use super::{Prose, words};
use crate::ast::{AssignOp, Binary, Block, Expr, ExprKind, Handlers, Stmt, StmtKind};
use crate::eval::Value;
use matterix_ir::listing::joined;

/// At most so many members of a set are listed.
const MOST_LISTED: usize = 12;

impl<'a> Prose<'a, '_> {
    /// A block; names that it declares end with it.
    pub(super) fn block(&mut self, block: &'a Block) -> List {
        let depth = self.vars.len();
        let mut steps = Vec::new();
        for stmt in &block.stmts {
            self.stmt(stmt, &mut steps);
        }
        self.vars.truncate(depth);
        List { steps, ..List::default() }
    }

    fn stmt(&mut self, stmt: &'a Stmt, out: &mut Vec<Step>) {
        let before = out.len();
        match &stmt.kind {
            StmtKind::Error => {}
            StmtKind::Sequence { body, handlers } if handlers.on.is_empty() && handlers.finally.is_none() => {
                out.extend(self.block(body).steps);
                return;
            }
            StmtKind::If { cond, then, otherwise } => {
                let text = format!("If {}:", self.condition(cond));
                let list = self.block(then);
                let mut step = Step::with(text, list);
                self.otherwise(otherwise.as_ref(), &mut step.groups);
                out.push(step);
            }
            StmtKind::Expect { cond } => self.expect(cond, out),
            _ => {
                let step = self.one(stmt);
                out.push(step);
            }
        }
        for step in &mut out[before..] {
            // Where a sentence leads to steps, the reference goes before the colon.
            let place = self.place(stmt.span);
            step.text = match step.text.strip_suffix(':') {
                Some(lead) => format!("{lead} {place}:"),
                None => format!("{} {place}", step.text),
            };
        }
    }

    fn otherwise(&mut self, block: Option<&'a Block>, groups: &mut Vec<Group>) {
        let Some(block) = block else { return };
        if let [Stmt { kind: StmtKind::If { cond, then, otherwise }, .. }] = block.stmts.as_slice() {
            let lead = format!("Otherwise, if {}:", self.condition(cond));
            let list = self.block(then);
            groups.push(Group { lead, list });
            return self.otherwise(otherwise.as_ref(), groups);
        }
        let list = self.block(block);
        groups.push(Group { lead: "Otherwise:".to_string(), list });
    }

    /// Each part of an expectation is a check of its own.
    fn expect(&mut self, cond: &'a Expr, out: &mut Vec<Step>) {
        if let ExprKind::Binary(Binary::And, a, b) = &*cond.kind {
            self.expect(a, out);
            return self.expect(b, out);
        }
        out.push(Step::new(format!("Check that {}.", self.condition(cond))));
    }

    fn one(&mut self, stmt: &'a Stmt) -> Step {
        match &stmt.kind {
            StmtKind::Let { name, value, .. } => {
                let text = format!("Write down {} as _{}_.", self.say(value), words::plain(&name.text));
                self.vars.push(name.text.clone());
                Step::new(text)
            }
            StmtKind::Var { name, value, .. } => {
                let text = format!("Begin with _{}_ at {}.", words::plain(&name.text), self.say(value));
                self.vars.push(name.text.clone());
                Step::new(text)
            }
            StmtKind::Set { name, op, value } => {
                let (name, value) = (words::plain(&name.text), self.say(value));
                Step::new(match op {
                    AssignOp::Set => format!("From here on, _{name}_ is {value}."),
                    AssignOp::Add => format!("Add {value} to _{name}_."),
                    AssignOp::Sub => format!("Subtract {value} from _{name}_."),
                })
            }
            StmtKind::LetDo { name, call } => {
                let mut step = self.call(call);
                step.text = format!("{} Write down the result as _{}_.", step.text, words::plain(&name.text));
                self.vars.push(name.text.clone());
                step
            }
            StmtKind::Call(call) => self.call(call),
            StmtKind::Step { name, body, handlers } => {
                let list = self.block(body);
                self.guarded(Step::with(format!("“{}”:", words::plain(&name.text)), list), handlers)
            }
            StmtKind::Wait { duration } => Step::new(format!("Wait {}.", self.say(duration))),
            StmtKind::WaitUntil { cond, timeout, handlers } => {
                let limit = timeout.as_ref().map(|t| format!(", at most {}", self.say(t))).unwrap_or_default();
                let text = format!("Wait until {}{limit}.", self.condition(cond));
                self.guarded(Step::new(text), handlers)
            }
            StmtKind::Hold { cond, duration, timeout, handlers } => {
                let limit = timeout.as_ref().map(|t| format!(", at most {} in all", self.say(t))).unwrap_or_default();
                let (cond, time) = (self.condition(cond), self.say(duration));
                self.guarded(
                    Step::new(format!("Wait until {cond} and has stayed so for {time} without a break{limit}.")),
                    handlers,
                )
            }
            StmtKind::Keep { cond, body, handlers } => {
                let text = format!("Do the following, and make sure throughout that {}:", self.condition(cond));
                let list = self.block(body);
                self.guarded(Step::with(text, list), handlers)
            }
            StmtKind::Within { limit, since, body, handlers } => {
                let text = format!("Within {} after {}, start this:", self.say(limit), self.say(since));
                let list = self.block(body);
                self.guarded(Step::with(text, list), handlers)
            }
            StmtKind::Repeat { times, body } => {
                let times = self.say(times);
                let text = match times.as_str() {
                    "1" => "Do once:".to_string(),
                    "2" => "Do this twice:".to_string(),
                    _ => format!("Repeat {times} times:"),
                };
                Step::with(text, self.block(body))
            }
            StmtKind::RepeatWhile { cond, max, body } => {
                let max = max.as_ref().map(|m| format!(" (at most {} times)", self.say(m))).unwrap_or_default();
                let text = format!("As long as {}, repeat{max}:", self.condition(cond));
                Step::with(text, self.block(body))
            }
            StmtKind::For { var, set, body } => {
                let text = self.for_each(&var.text, set);
                self.vars.push(var.text.clone());
                let list = self.block(body);
                self.vars.pop();
                Step::with(text, list)
            }
            StmtKind::Sequence { body, handlers } => {
                let list = self.block(body);
                self.guarded(Step::with("Do this in order:", list), handlers)
            }
            StmtKind::Parallel { body, handlers } => {
                let list = List { at_once: true, ..self.block(body) };
                self.guarded(
                    Step::with("Do all of this at the same time, and continue when all of it is done:", list),
                    handlers,
                )
            }
            StmtKind::Start { name, body } => {
                let text = format!("Start “{}”, and continue meanwhile:", words::plain(&name.text));
                Step::with(text, self.block(body))
            }
            StmtKind::Await { name } => Step::new(format!("Wait until “{}” is done.", words::plain(&name.text))),
            StmtKind::Try { alternatives, handlers } => {
                let mut all = alternatives.iter();
                let first = all.next().map(|block| self.block(block)).unwrap_or_default();
                let mut step = Step::with("Try this:", first);
                for block in all {
                    let list = self.block(block);
                    step.groups.push(Group { lead: "If that fails, try this instead:".to_string(), list });
                }
                self.guarded(step, handlers)
            }
            StmtKind::Retry { times } => {
                Step::new(format!("Repeat the failed steps, up to {} times.", self.say(times)))
            }
            StmtKind::Claim { assets, body } => {
                let all: Vec<String> = assets.iter().map(|a| self.say(a)).collect();
                let text = format!("Reserve {} for these steps:", joined(&all, "and"));
                Step::with(text, self.block(body))
            }
            StmtKind::Fail { name, text } => {
                let name = name.as_ref().map(|n| format!(" (failure: {})", words::plain(&n.text))).unwrap_or_default();
                let why = text.as_ref().map(|t| format!(": {}", self.text(t))).unwrap_or_default();
                Step::new(format!("Stop{why}{name}."))
            }
            StmtKind::Record { value, every } => {
                Step::new(format!("From here on, write down {} every {}.", self.say(value), self.say(every)))
            }
            StmtKind::Note(text) => Step::new(format!("Write down: “{}”.", self.text(text))),
            StmtKind::Ask(text) => Step::new(format!("Make sure and confirm: “{}”.", self.text(text))),
            StmtKind::Return { value } => Step::new(format!("The result is {}.", self.say(value))),
            StmtKind::Expect { .. } | StmtKind::If { .. } | StmtKind::Run { .. } | StmtKind::Error => Step::default(),
        }
    }

    /// `For each well w of A1 to H1 of plate:`, with the members where there are not too many.
    fn for_each(&mut self, var: &str, set: &'a Expr) -> String {
        let text = format!("For each _{}_ of {}", words::plain(var), self.say(set));
        let value = self.value(set);
        let listed: Option<Vec<String>> = match self.lab.listed(value) {
            Value::List(items) if items.len() <= MOST_LISTED && !matches!(&*set.kind, ExprKind::List(_)) => {
                items.iter().map(|v| self.member_of_set(v)).collect()
            }
            _ => None,
        };
        match listed {
            Some(all) if !all.is_empty() => format!("{text} ({}):", short(&all).join(", ")),
            _ => format!("{text}:"),
        }
    }

    fn member_of_set(&self, value: &Value) -> Option<String> {
        match value {
            Value::Num(n) => {
                let unit = self.lab.unit_of(n);
                Some(words::quantity(&unit.show(self.lab.glance(n.node)?)))
            }
            Value::Tuple(items) => {
                let items: Option<Vec<String>> = items.iter().map(|i| self.member_of_set(i)).collect();
                items.map(|items| items.join(" and "))
            }
            other => self.lab.spoken(other),
        }
    }

    fn guarded(&mut self, mut step: Step, handlers: &'a Handlers) -> Step {
        step.groups.extend(self.handlers(handlers));
        step
    }

    /// What failures lead to, and what is done in any case.
    pub(super) fn handlers(&mut self, handlers: &'a Handlers) -> Vec<Group> {
        let mut out = Vec::new();
        for (name, block) in &handlers.on {
            let lead = format!("{}:", self.failure(&name.text));
            out.push(Group { lead, list: self.block(block) });
        }
        if let Some(block) = &handlers.finally {
            out.push(Group { lead: "In any case, at the end:".to_string(), list: self.block(block) });
        }
        out
    }

    /// When a handler is called for.
    pub(super) fn failure(&self, name: &str) -> String {
        match name {
            "timeout" => "If it takes longer".to_string(),
            "late" => "If it is too late".to_string(),
            "max" => "If the condition is still not met after that".to_string(),
            "broken" => "If that is no longer so".to_string(),
            "failure" => "If anything else goes wrong".to_string(),
            "need" => "If something that a step needs is missing".to_string(),
            other => format!("If it fails ({})", words::plain(other)),
        }
    }
}

/// Places of one thing without its name: `plate[A1]` is A1.
fn short(all: &[String]) -> Vec<String> {
    let place = |text: &str| {
        text.strip_suffix(']').and_then(|t| t.split_once('[')).map(|(of, at)| (of.to_string(), at.to_string()))
    };
    let split: Option<Vec<Vec<(String, String)>>> =
        all.iter().map(|member| member.split(" and ").map(place).collect()).collect();
    let Some(split) = split else { return all.to_vec() };
    let mut of = split.iter().flatten().map(|p| &p.0);
    let first = of.next();
    if of.any(|o| Some(o) != first) {
        return all.to_vec();
    }
    split.into_iter().map(|m| m.into_iter().map(|p| p.1).collect::<Vec<_>>().join(" and ")).collect()
}
