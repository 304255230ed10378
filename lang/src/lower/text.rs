//! Labels and conditions in the words of the source.

use std::collections::BTreeSet;

use matterix_ir::plan::Condition;
use matterix_ir::{Diagnostic, Span, codes};

use super::Planner;
use crate::ast::{Clause, ClauseKind, Expr, ItemKind, MemberKind, Name};
use crate::eval::Scope;
use crate::names::{Names, near};

/// Failures the executor itself raises, and `failure`, which stands for all.
const BUILT_IN: &[&str] = &["timeout", "broken", "late", "max", "need", "promise", "claimed", "job", "failure"];

/// Every failure that a `fails` clause declares.
pub fn declared_failures(names: &Names<'_>) -> BTreeSet<String> {
    let mut out: BTreeSet<String> = BUILT_IN.iter().map(|s| (*s).to_string()).collect();
    let mut add = |clauses: &[Clause]| {
        for c in clauses {
            if let ClauseKind::Fails(names) = &c.kind {
                out.extend(names.iter().map(|n| n.text.clone()));
            }
        }
    };
    for decl in &names.decls {
        match &decl.item.kind {
            ItemKind::Skill { clauses, .. } => add(clauses),
            ItemKind::Capability { members, .. } => {
                for m in members {
                    if let MemberKind::Command { clauses, .. } = &m.kind {
                        add(clauses);
                    }
                }
            }
            _ => {}
        }
    }
    out
}

impl<'a> Planner<'a, '_> {
    /// The source under a span on one line, shortened.
    pub fn text(&self, span: Span) -> String {
        let text = self.sources.slice(span).split_whitespace().collect::<Vec<_>>().join(" ");
        if text.chars().count() <= 100 { text } else { text.chars().take(97).chain("...".chars()).collect() }
    }

    /// A condition with what it compares.
    pub fn condition(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Condition> {
        self.lab.comparisons.clear();
        let node = self.lab.truth(e, scope)?;
        let compared = std::mem::take(&mut self.lab.comparisons);
        let compared = compared
            .into_iter()
            .map(|(span, mut c)| {
                c.text = self.text(span);
                c
            })
            .collect();
        Some(Condition { node, text: self.text(e.span), span: e.span, compared })
    }

    /// A failure name in a handler must be one that something can raise.
    pub fn check_failure(&mut self, name: &Name) {
        if self.failures.contains(&name.text) {
            return;
        }
        let near = near::nearest(&name.text, &self.failures);
        let mut d = Diagnostic::error(
            codes::UNKNOWN_NAME,
            name.span,
            format!("nothing fails with `{}`", name.text),
            "no step or skill declares this failure",
        );
        d.help.extend(near::question(&near));
        if let Some(best) = near.first() {
            d = d.fix(format!("replace with `{best}`"), name.span, best.clone());
        }
        self.lab.report(d);
    }
}
