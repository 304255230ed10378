//! Blocks and steps.

use super::{
    Sexp,
    exprs::{expr, maybe, named, path, ty},
    leaf, name, names, node, quoted,
};
use crate::ast::{AssignOp, Block, Call, Expr, Handlers, Name, Stmt, StmtKind, Text, TextPart};

pub(super) fn block(block: &Block) -> Sexp {
    node("block").with(block.stmts.iter().map(stmt))
}

pub(super) fn handlers(handlers: &Handlers) -> Vec<Sexp> {
    let on = handlers.on.iter().map(|(word, body)| node("on").with([name(word), block(body)]));
    on.chain(handlers.finally.iter().map(|body| node("finally").with([block(body)]))).collect()
}

fn call(call: &Call) -> Sexp {
    node("call")
        .with([node("words").with(names(&call.words))])
        .with(call.object.as_ref().map(expr))
        .with(labelled(&call.labelled))
        .with(named(&call.options))
}

pub(super) fn labelled(labelled: &[(Name, Expr)]) -> Vec<Sexp> {
    labelled.iter().map(|(label, value)| node(&label.text).with([expr(value)])).collect()
}

/// A plain text as such, another one with its parts.
pub(super) fn filled(text: &Text) -> Sexp {
    let part = |part: &TextPart| match part {
        TextPart::Plain(text) => quoted(text),
        TextPart::Value { value, digits, form } => node("value")
            .with([expr(value)])
            .with(digits.map(|d| leaf(format!(".{d}"))))
            .with(form.as_ref().map(|form| quoted(&form.text))),
    };
    match text.parts.as_slice() {
        [] => quoted(""),
        [TextPart::Plain(text)] => quoted(text),
        parts => node("text").with(parts.iter().map(part)),
    }
}

fn stmt(stmt: &Stmt) -> Sexp {
    match &stmt.kind {
        StmtKind::Error => leaf("error"),
        StmtKind::Let { name: word, ty: of, value } => {
            node("let").with([name(word)]).with(of.as_ref().map(ty)).with([expr(value)])
        }
        StmtKind::Var { name: word, ty: of, value } => {
            node("var").with([name(word)]).with(of.as_ref().map(ty)).with([expr(value)])
        }
        StmtKind::Set { name: word, op, value } => {
            let op = match op {
                AssignOp::Set => "set",
                AssignOp::Add => "add",
                AssignOp::Sub => "subtract",
            };
            node(op).with([name(word), expr(value)])
        }
        StmtKind::LetDo { name: word, call: step } => node("let-do").with([name(word), call(step)]),
        StmtKind::Step { name: word, body, handlers: on } => {
            node("step").with([name(word), block(body)]).with(handlers(on))
        }
        StmtKind::Wait { duration } => node("wait").with([expr(duration)]),
        StmtKind::WaitUntil { cond, timeout, handlers: on } => {
            node("wait-until").with([expr(cond)]).with(maybe("timeout", timeout.as_ref())).with(handlers(on))
        }
        StmtKind::If { cond, then, otherwise } => {
            node("if").with([expr(cond), block(then)]).with(otherwise.as_ref().map(block))
        }
        StmtKind::RepeatWhile { cond, max, body } => {
            node("repeat-while").with([expr(cond)]).with(maybe("max", max.as_ref())).with([block(body)])
        }
        StmtKind::Repeat { times, body } => node("repeat").with([expr(times), block(body)]),
        StmtKind::For { var, set, body } => node("for").with([name(var), expr(set), block(body)]),
        StmtKind::Within { limit, since, body, handlers: on } => {
            node("within").with([expr(limit), expr(since), block(body)]).with(handlers(on))
        }
        StmtKind::Hold { cond, duration, timeout, handlers: on } => {
            node("hold").with([expr(cond), expr(duration)]).with(maybe("timeout", timeout.as_ref())).with(handlers(on))
        }
        StmtKind::Keep { cond, body, handlers: on } => node("keep").with([expr(cond), block(body)]).with(handlers(on)),
        StmtKind::Try { alternatives, handlers: on } => {
            node("try").with(alternatives.iter().map(block)).with(handlers(on))
        }
        StmtKind::Retry { times } => node("retry").with([expr(times)]),
        StmtKind::Claim { assets, body } => node("claim").with(assets.iter().map(expr)).with([block(body)]),
        StmtKind::Sequence { body, handlers: on } => node("sequence").with([block(body)]).with(handlers(on)),
        StmtKind::Parallel { body, handlers: on } => node("parallel").with([block(body)]).with(handlers(on)),
        StmtKind::Start { name: word, body } => node("start").with([name(word), block(body)]),
        StmtKind::Await { name: word } => node("await").with([name(word)]),
        StmtKind::Fail { name: word, text } => {
            node("fail").with(word.as_ref().map(name)).with(text.as_ref().map(filled))
        }
        StmtKind::Expect { cond } => node("expect").with([expr(cond)]),
        StmtKind::Record { value, every } => node("record").with([expr(value), expr(every)]),
        StmtKind::Note(text) => node("note").with([filled(text)]),
        StmtKind::Ask(text) => node("ask").with([filled(text)]),
        StmtKind::Return { value } => node("return").with([expr(value)]),
        StmtKind::Run { workflow, options } => node("run").with([path(workflow)]).with(named(options)),
        StmtKind::Call(step) => call(step),
    }
}
