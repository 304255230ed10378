//! The names of failures that a file may raise or handle.

use std::collections::BTreeSet;

use matterix_ir::plan::Motion;

use super::fields::word;
use crate::ast::{self, Clause, ClauseKind, ItemKind, MemberKind};
use crate::names::Names;

/// The option of a state that names the failure of a use while it holds.
pub const BARS: &str = "bars";

/// Failures of the language: `failure`, which stands for all, those that the executor itself raises, and the one of a run in which
/// substances meet that must not.
pub const FAILURES: [&str; 12] =
    ["failure", "timeout", "late", "max", "broken", "need", "promise", "claimed", "wrong_reagent", "job", PENDING, MIX];

/// The failure of a delayed event that is set off again before it has happened.
pub const PENDING: &str = "event_pending";

/// The failure of a run in which substances meet that must not.
const MIX: &str = "incompatible_mix";

/// What a run may fail with at any step: what must not meet, and hazards.
pub fn dangers(names: &Names<'_>) -> BTreeSet<String> {
    let hazards = names.decls.iter().filter_map(|decl| match &decl.item.kind {
        ItemKind::Hazard { grave: true, name, .. } => Some(name.text.clone()),
        _ => None,
    });
    hazards.chain([MIX.to_string()]).collect()
}

/// Every failure that something declares or the executor raises.
pub fn declared_failures(names: &Names<'_>) -> BTreeSet<String> {
    let mut out: BTreeSet<String> = FAILURES.into_iter().chain(Motion::FAILURES).map(String::from).collect();
    out.extend(dangers(names));
    let add = |clauses: &[Clause], out: &mut BTreeSet<String>| {
        for c in clauses {
            match &c.kind {
                ClauseKind::Fails(names) => out.extend(names.iter().map(|n| n.text.clone())),
                ClauseKind::Needs { refusal, .. } => out.extend(refusal.iter().map(|r| r.failure.text.clone())),
                _ => {}
            }
        }
    };
    for decl in &names.decls {
        match &decl.item.kind {
            ItemKind::Driver { wires, .. } => out.extend(wires.iter().filter_map(|w| match &w.kind {
                ast::WireKind::Reply { fails, .. } => Some(fails.text.clone()),
                _ => None,
            })),
            ItemKind::Skill { clauses, .. } => add(clauses, &mut out),
            ItemKind::Capability { members, .. } => {
                for m in members {
                    match &m.kind {
                        MemberKind::Command { clauses, .. } => add(clauses, &mut out),
                        MemberKind::Limit { at_end: false, refusal, .. } => {
                            out.extend(refusal.iter().map(|r| r.failure.text.clone()))
                        }
                        MemberKind::Value { options, .. } => {
                            out.extend(word(options, BARS).map(str::to_owned));
                        }
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    out
}
