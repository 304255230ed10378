//! Where a skill gives its result: at the end of every way through it, as `return` keeps a value and ends nothing.

use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Block, Handlers, Stmt, StmtKind};

/// How a part of a skill ends.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    /// A `return` in it.
    returns: Option<Span>,
    /// Whether no way through it leads to what follows: each ends with `return`, `fail` or `retry`.
    closed: bool,
}

/// Findings on the `return`s of a skill that declares a result; `name` is where it says so.
pub fn check(verb: &str, name: Span, body: &Block, handlers: &Handlers) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let end = block(body, &mut found);
    let end = handled(end, handlers, &mut found);
    if let Some(returns) = end.returns.filter(|_| !end.closed && found.is_empty()) {
        let headline = format!("`{verb}` does not `return` a result on every path");
        let d = Diagnostic::error(codes::MISPLACED, name, headline, "declares a result");
        let d = d.because(returns, "returned only on this path");
        found.push(d.help("end the other paths with `return` or `fail` too"));
    }
    found
}

fn block(block: &Block, found: &mut Vec<Diagnostic>) -> End {
    let mut out = End::default();
    for (i, stmt) in block.stmts.iter().enumerate() {
        let end = statement(stmt, found);
        if let (Some(returns), Some(next)) = (end.returns, block.stmts.get(i + 1)) {
            let headline = "`return` does not end the skill: the steps after it still run";
            let d = Diagnostic::error(codes::MISPLACED, returns, headline, "does not end the skill here");
            found.push(
                d.because(next.span, "runs after it")
                    .help("put `return` last on its path; put the other steps into `else`"),
            );
        }
        out = End { returns: out.returns.or(end.returns), closed: out.closed || end.closed };
    }
    out
}

/// Parts of which one is done.
fn one_of(ends: impl IntoIterator<Item = End>) -> End {
    let both = |a: End, b: End| End { returns: a.returns.or(b.returns), closed: a.closed && b.closed };
    ends.into_iter().reduce(both).unwrap_or_default()
}

/// The same with the handlers of the part.
fn handled(body: End, handlers: &Handlers, found: &mut Vec<Diagnostic>) -> End {
    let mut ends = vec![body];
    ends.extend(handlers.on.iter().map(|(_, handler)| block(handler, found)));
    if let Some(finally) = &handlers.finally {
        let end = block(finally, found);
        nowhere(end, "`finally` runs on every path", found);
    }
    one_of(ends)
}

/// Reports a `return` that gives no result of the skill.
fn nowhere(end: End, why: &str, found: &mut Vec<Diagnostic>) {
    let Some(returns) = end.returns else { return };
    let headline = format!("`return` cannot stand here: {why}");
    let d = Diagnostic::error(codes::MISPLACED, returns, headline, "does not end the skill here");
    found.push(d.help("put `return` at the end of the skill"));
}

fn statement(stmt: &Stmt, found: &mut Vec<Diagnostic>) -> End {
    match &stmt.kind {
        StmtKind::Return { .. } => End { returns: Some(stmt.span), closed: true },
        StmtKind::Fail { .. } | StmtKind::Retry { .. } => End { returns: None, closed: true },
        StmtKind::If { then, otherwise, .. } => {
            let otherwise = otherwise.as_ref().map_or_else(End::default, |b| block(b, found));
            one_of([block(then, found), otherwise])
        }
        StmtKind::Try { alternatives, handlers } => {
            let ends: Vec<End> = alternatives.iter().map(|b| block(b, found)).collect();
            handled(one_of(ends), handlers, found)
        }
        StmtKind::Step { body, handlers, .. }
        | StmtKind::Sequence { body, handlers }
        | StmtKind::Keep { body, handlers, .. }
        | StmtKind::Within { body, handlers, .. } => {
            let end = block(body, found);
            handled(end, handlers, found)
        }
        StmtKind::Claim { body, .. } => block(body, found),
        StmtKind::Parallel { body, handlers } => {
            let ends: Vec<End> = body.stmts.iter().map(|branch| statement(branch, found)).collect();
            let any =
                End { returns: ends.iter().find_map(|end| end.returns), closed: ends.iter().any(|end| end.closed) };
            handled(any, handlers, found)
        }
        StmtKind::WaitUntil { handlers, .. } | StmtKind::Hold { handlers, .. } => {
            handled(End::default(), handlers, found)
        }
        StmtKind::Repeat { body, .. } | StmtKind::RepeatWhile { body, .. } | StmtKind::For { body, .. } => {
            let end = block(body, found);
            nowhere(end, "the loop continues", found);
            End::default()
        }
        StmtKind::Start { body, .. } => {
            let end = block(body, found);
            nowhere(end, "a job gives no result", found);
            End::default()
        }
        _ => End::default(),
    }
}
