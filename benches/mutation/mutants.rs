//! The operators: what is done to one statement.

use matterix_ir::{FileId, Span};
use matterix_lang::ast::{Block, ExprKind, File, Stmt};

use crate::tree;

/// What is done to a statement. Fixed: figures of different times can be compared only where these are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operator {
    /// It is left out.
    Drop,
    /// It changes places with the next one.
    Swap,
    /// It is done twice.
    Double,
    /// One quantity in it is 2, 0.5 or 1000 times what it was.
    Perturb,
    /// One instance or place in a call is another of the same type.
    Replace,
}

impl Operator {
    /// In the order of the table.
    pub const ALL: [Operator; 5] =
        [Operator::Drop, Operator::Swap, Operator::Double, Operator::Perturb, Operator::Replace];

    /// As shown.
    pub fn name(self) -> &'static str {
        match self {
            Operator::Drop => "drop",
            Operator::Swap => "swap",
            Operator::Double => "double",
            Operator::Perturb => "perturb",
            Operator::Replace => "replace",
        }
    }
}

/// Factors of a perturbed quantity.
const FACTORS: [f64; 3] = [2.0, 0.5, 1000.0];

/// A text with one mistake.
pub struct Mutant {
    /// What was done.
    pub operator: Operator,
    /// Line of the statement, from 1.
    pub line: usize,
    /// What stood there.
    pub before: String,
    /// What stands there now.
    pub after: String,
    /// Whether only statements that judge or tell are concerned.
    pub judges: bool,
    /// The whole text.
    pub text: String,
}

/// All mutants of a text, in the order of its statements.
pub fn all(text: &str, file: &File) -> Vec<Mutant> {
    let mut out = Vec::new();
    let instances = tree::instances(file);
    for block in tree::blocks(file) {
        // `else if` and `start job = call` are blocks of one statement without braces.
        let braces = text[block.span.start as usize..].starts_with('{');
        for (i, stmt) in block.stmts.iter().enumerate() {
            if braces {
                whole(text, stmt, &mut out);
                out.extend(block.stmts.get(i + 1).map(|next| swapped(text, stmt, next)));
            }
            quantities(text, stmt, &mut out);
            replaced(text, stmt, &instances, &places(file), &mut out);
        }
    }
    out
}

fn cut(text: &str, span: Span) -> &str {
    &text[span.start as usize..span.end as usize]
}

fn mutant(text: &str, stmt: &Stmt, operator: Operator, span: Span, new: &str) -> Mutant {
    let shown = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let text_after = format!("{}{new}{}", &text[..span.start as usize], &text[span.end as usize..]);
    let grown = stmt.span.end as usize + new.len() - span.len();
    let after = text_after.get(stmt.span.start as usize..grown).unwrap_or(new);
    Mutant {
        operator,
        line: text[..stmt.span.start as usize].matches('\n').count() + 1,
        before: shown(cut(text, stmt.span)),
        after: shown(after),
        judges: tree::judges(stmt),
        text: text_after,
    }
}

fn whole(text: &str, stmt: &Stmt, out: &mut Vec<Mutant>) {
    out.push(mutant(text, stmt, Operator::Drop, stmt.span, ""));
    let twice = format!("{0}\n{0}", cut(text, stmt.span));
    out.push(mutant(text, stmt, Operator::Double, stmt.span, &twice));
}

fn swapped(text: &str, stmt: &Stmt, next: &Stmt) -> Mutant {
    let span = Span::new(stmt.span.file, stmt.span.start as usize, next.span.end as usize);
    let between = &text[stmt.span.end as usize..next.span.start as usize];
    let new = format!("{}{between}{}", cut(text, next.span), cut(text, stmt.span));
    let mut m = mutant(text, &Stmt { kind: stmt.kind.clone(), span }, Operator::Swap, span, &new);
    m.judges = tree::judges(stmt) && tree::judges(next);
    m
}

fn quantities(text: &str, stmt: &Stmt, out: &mut Vec<Mutant>) {
    for e in tree::expressions(stmt) {
        tree::each(e, &mut |e| {
            let ExprKind::Quantity(value, unit) = &*e.kind else { return };
            for factor in FACTORS {
                let number = Span::new(e.span.file, e.span.start as usize, unit.span.start as usize);
                let blanks: String = cut(text, number).chars().rev().take_while(|c| c.is_whitespace()).collect();
                let new = format!("{}{blanks}", value * factor);
                out.push(mutant(text, stmt, Operator::Perturb, number, &new));
            }
        });
    }
}

fn replaced(text: &str, stmt: &Stmt, instances: &[(&str, String)], places: &[(String, String)], out: &mut Vec<Mutant>) {
    for (name, span) in tree::names(stmt) {
        let Some((_, ty)) = instances.iter().find(|i| i.0 == name) else { continue };
        if let Some((other, _)) = instances.iter().find(|i| i.0 != name && i.1 == *ty) {
            out.push(mutant(text, stmt, Operator::Replace, span, other));
        }
    }
    for e in tree::arguments(stmt) {
        tree::each(e, &mut |e| {
            let ExprKind::IndexWord(of, place) = &*e.kind else { return };
            let ExprKind::Name(of) = &*of.kind else { return };
            if !instances.iter().any(|i| i.0 == of.text) {
                return;
            }
            if let Some((_, other)) = places.iter().find(|p| p.0 == of.text && p.1 != place.text) {
                out.push(mutant(text, stmt, Operator::Replace, place.span, other));
            }
        });
    }
}

/// Places that the statements of a file name: of what, and which.
fn places(file: &File) -> Vec<(String, String)> {
    let mut out = Vec::new();
    for stmt in tree::blocks(file).into_iter().flat_map(|b: &Block| &b.stmts) {
        for e in tree::expressions(stmt) {
            tree::each(e, &mut |e| match &*e.kind {
                ExprKind::IndexWord(of, place) => {
                    if let ExprKind::Name(of) = &*of.kind {
                        out.push((of.text.clone(), place.text.clone()));
                    }
                }
                ExprKind::IndexRange(of, from, to) => {
                    if let ExprKind::Name(of) = &*of.kind {
                        out.extend([from, to].map(|p| (of.text.clone(), p.text.clone())));
                    }
                }
                _ => {}
            });
        }
    }
    out
}

/// The tree of a text that was found without errors.
pub fn tree_of(text: &str) -> File {
    matterix_lang::syntax::parse(FileId(0), text).0
}
