//! What stands where in a statement: the blocks below it, its own expressions, its arguments.

use matterix_ir::Span;
use matterix_lang::ast::{Block, Expr, ExprKind, File, Handlers, ItemKind, LabLineKind, Stmt, StmtKind};

/// Every block of the workflows and skills of a file, outer ones first.
pub fn blocks(file: &File) -> Vec<&Block> {
    let mut out = Vec::new();
    for item in &file.items {
        match &item.kind {
            ItemKind::Workflow { body, handlers, .. } => below(Some(body), handlers, &mut out),
            ItemKind::Skill { body, handlers, .. } => below(body.as_ref(), handlers, &mut out),
            _ => {}
        }
    }
    out
}

/// Names of the workflows of a file, in order.
pub fn workflows(file: &File) -> Vec<&str> {
    let named = file.items.iter().filter_map(|i| match &i.kind {
        ItemKind::Workflow { name, .. } => Some(name.text.as_str()),
        _ => None,
    });
    named.collect()
}

/// Instances that the labs of a file declare: name, and type as written.
pub fn instances(file: &File) -> Vec<(&str, String)> {
    let mut out = Vec::new();
    for item in &file.items {
        let ItemKind::Lab { lines, .. } = &item.kind else { continue };
        for line in lines {
            if let LabLineKind::Instance { name, literal, .. } = &line.kind {
                let segments: Vec<&str> = literal.ty.segments.iter().map(|s| s.text.as_str()).collect();
                out.push((name.text.as_str(), segments.join("::")));
            }
        }
    }
    out
}

fn below<'a>(body: Option<&'a Block>, handlers: &'a Handlers, out: &mut Vec<&'a Block>) {
    let blocks = body.into_iter().chain(handlers.on.iter().map(|h| &h.1)).chain(&handlers.finally);
    for block in blocks {
        out.push(block);
        for stmt in &block.stmts {
            nested(stmt, out);
        }
    }
}

fn nested<'a>(stmt: &'a Stmt, out: &mut Vec<&'a Block>) {
    match &stmt.kind {
        StmtKind::Step { body, handlers, .. }
        | StmtKind::Within { body, handlers, .. }
        | StmtKind::Keep { body, handlers, .. }
        | StmtKind::Sequence { body, handlers }
        | StmtKind::Parallel { body, handlers } => below(Some(body), handlers, out),
        StmtKind::WaitUntil { handlers, .. } | StmtKind::Hold { handlers, .. } => below(None, handlers, out),
        StmtKind::If { then, otherwise, .. } => {
            for block in std::iter::once(then).chain(otherwise) {
                below(Some(block), NONE, out);
            }
        }
        StmtKind::RepeatWhile { body, .. }
        | StmtKind::Repeat { body, .. }
        | StmtKind::For { body, .. }
        | StmtKind::Claim { body, .. }
        | StmtKind::Start { body, .. } => below(Some(body), NONE, out),
        StmtKind::Try { alternatives, handlers } => {
            for block in alternatives {
                below(Some(block), NONE, out);
            }
            below(None, handlers, out);
        }
        _ => {}
    }
}

const NONE: &Handlers = &Handlers { on: Vec::new(), finally: None };

/// Whether a statement judges or tells what was done, and does nothing itself.
pub fn judges(stmt: &Stmt) -> bool {
    matches!(stmt.kind, StmtKind::Expect { .. } | StmtKind::Record { .. } | StmtKind::Note(_) | StmtKind::Ask(_))
}

/// Expressions of a statement, without those of the blocks below it.
pub fn expressions(stmt: &Stmt) -> Vec<&Expr> {
    match &stmt.kind {
        StmtKind::Let { value, .. } | StmtKind::Return { value } => vec![value],
        StmtKind::Wait { duration } => vec![duration],
        StmtKind::WaitUntil { cond, timeout, .. } => std::iter::once(cond).chain(timeout).collect(),
        StmtKind::If { cond, .. } | StmtKind::Keep { cond, .. } | StmtKind::Expect { cond } => vec![cond],
        StmtKind::RepeatWhile { cond, max, .. } => std::iter::once(cond).chain(max).collect(),
        StmtKind::Repeat { times, .. } | StmtKind::Retry { times } => vec![times],
        StmtKind::For { set, .. } => vec![set],
        StmtKind::Within { limit, since, .. } => vec![limit, since],
        StmtKind::Hold { cond, duration, timeout, .. } => [cond, duration].into_iter().chain(timeout).collect(),
        StmtKind::Claim { assets, .. } => assets.iter().collect(),
        StmtKind::Record { value, every } => vec![value, every],
        StmtKind::Call(_) | StmtKind::LetDo { .. } => arguments(stmt),
        _ => Vec::new(),
    }
}

/// Arguments of a call that are expressions.
pub fn arguments(stmt: &Stmt) -> Vec<&Expr> {
    let (StmtKind::Call(call) | StmtKind::LetDo { call, .. }) = &stmt.kind else { return Vec::new() };
    call.object.iter().chain(call.labelled.iter().map(|l| &l.1)).chain(call.options.iter().map(|o| &o.value)).collect()
}

/// Names in a call that may name an instance, with where they stand.
pub fn names(stmt: &Stmt) -> Vec<(&str, Span)> {
    let (StmtKind::Call(call) | StmtKind::LetDo { call, .. }) = &stmt.kind else { return Vec::new() };
    let mut out: Vec<(&str, Span)> = call.words.iter().map(|w| (w.text.as_str(), w.span)).collect();
    for e in arguments(stmt) {
        each(e, &mut |e| {
            if let ExprKind::Name(name) = &*e.kind {
                out.push((name.text.as_str(), name.span));
            }
        });
    }
    out
}

/// Calls `f` for an expression and all within it, in the order of the text.
pub fn each<'a>(e: &'a Expr, f: &mut dyn FnMut(&'a Expr)) {
    f(e);
    match &*e.kind {
        ExprKind::Member(x, _)
        | ExprKind::IndexWord(x, _)
        | ExprKind::IndexRange(x, _, _)
        | ExprKind::Prime(x)
        | ExprKind::Unary(_, x)
        | ExprKind::Of(x, _)
        | ExprKind::As(x, _) => each(x, f),
        ExprKind::Index(a, b) | ExprKind::Binary(_, a, b) | ExprKind::Range(a, b) => {
            each(a, f);
            each(b, f);
        }
        ExprKind::Call(callee, args) => {
            each(callee, f);
            args.iter().for_each(|a| each(&a.value, f));
        }
        ExprKind::Fold { set, body, .. } => {
            each(set, f);
            each(body, f);
        }
        ExprKind::Tuple(items, _) | ExprKind::List(items) => items.iter().for_each(|i| each(i, f)),
        _ => {}
    }
}
