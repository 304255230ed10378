//! What a device is left doing where nothing tells it to end: whether its driver has to say how it is made safe.
//!
//! A device stays on by a command that sets a switch which another one turns off, or a number that a law goes by: a heating power, a
//! speed, a flow. It goes on where its driver asks it for the end of what it does. What only moves a lid or a label is neither.

use std::collections::BTreeSet;

use matterix_ir::scene::InstanceId;
use matterix_ir::wire::{Driver, Transport};
use matterix_ir::{Diagnostic, codes};

use super::command_sig;
use super::hosted::Under;
use crate::ast::{Clause, ClauseKind, Effect, Expr, ExprKind, Law, LawKind, MemberKind, Role, Type, Wire, WireKind};
use crate::lower::Planner;
use crate::names::{names_in, verb_text};

/// What a driver says to leave a device safe.
const SAFE: &str = "safe";

impl<'a> Planner<'a, '_> {
    /// Whether one of its commands brings the device into a state that it stays in.
    pub(super) fn stays_on(&self, wires: &'a [Wire], instance: InstanceId, under: Option<Under<'a>>) -> bool {
        let goes_on =
            wires.iter().any(|w| matches!(&w.kind, WireKind::Command { exchange, .. } if exchange.until.is_some()));
        let host_is_made_safe = under.is_some_and(|under| has_safe(under.wires));
        goes_on && !host_is_made_safe || self.switched_on(wires, instance)
    }

    /// Reports a driver that does not say how its device is made safe, though it is left on where a run breaks off.
    pub(super) fn check_safe(&mut self, driver: &Driver, wires: &'a [Wire]) {
        if !self.lab.prototype || !driver.stays_on || has_safe(wires) {
            return;
        }
        let headline =
            format!("the driver `{}` has no `safe` line: it cannot switch its device off after a failure", driver.name);
        let d = Diagnostic::warning(codes::NO_SAFE, driver.span, headline, "the device may stay on");
        let help = match driver.transport {
            Transport::Sila { .. } => {
                "add a line `safe sends \"...\"`; for a driver made from a definition, declare `param safe_call: Text` in its capability and name the call in the asset"
            }
            _ => "add a line `safe sends \"...\"`: it is sent when a run fails or is stopped",
        };
        self.lab.report(d.help(help));
    }

    fn switched_on(&self, wires: &'a [Wire], instance: InstanceId) -> bool {
        let by_laws = self.followed_by_laws(instance);
        let own: Vec<(&'a Expr, &'a Expr)> = wires.iter().flat_map(|w| self.assigned(w, instance)).collect();
        let off = set_to(&own, "false");
        let is_switch = set_to(&own, "true").iter().any(|name| off.contains(name));
        let is_followed = |name: &str| by_laws.contains(name) && self.is_number(instance, name);
        is_switch || own.iter().filter_map(|(target, _)| named(target)).any(is_followed)
    }

    /// What the command of a line sets: targets and values.
    fn assigned(&self, w: &'a Wire, instance: InstanceId) -> Vec<(&'a Expr, &'a Expr)> {
        let WireKind::Command { sig, .. } = &w.kind else { return Vec::new() };
        let own = self.lab.commands_of(instance, &verb_text(&sig.verb)).into_iter();
        let meant = own.filter(|m| command_sig(m).is_some_and(|of| sig.has_form_of(of)));
        let clauses = meant.flat_map(|m| match &m.member.kind {
            MemberKind::Command { clauses, .. } => clauses.as_slice(),
            _ => &[],
        });
        clauses.flat_map(assignments).collect()
    }

    fn is_number(&self, instance: InstanceId, name: &str) -> bool {
        self.lab.members_of(instance, name).iter().any(|m| match &m.member.kind {
            MemberKind::Value { role: Role::State, ty, .. } => ty.words.is_empty() && !is_bool(ty),
            _ => false,
        })
    }

    /// The members that laws go by, themselves or through what follows from them.
    fn followed_by_laws(&self, instance: InstanceId) -> BTreeSet<&'a str> {
        let mut names = BTreeSet::new();
        let members = self.lab.all_members(instance);
        for m in members.iter() {
            if let MemberKind::Process(process) = &m.member.kind {
                process.guard.iter().for_each(|guard| names_in(guard, &mut names));
                process.laws.iter().for_each(|law| names_in_law(law, &mut names));
            }
        }
        for (_, process) in &self.lab.tables.processes {
            process.guard.iter().for_each(|guard| names_in(guard, &mut names));
            process.laws.iter().for_each(|law| names_in_law(law, &mut names));
        }
        loop {
            let before = names.len();
            for m in members.iter() {
                if let MemberKind::Value { role: Role::Derived, name, value: Some(value), .. } = &m.member.kind
                    && names.contains(name.text.as_str())
                {
                    names_in(value, &mut names);
                }
            }
            if names.len() == before {
                return names;
            }
        }
    }
}

/// The members that are set to this word.
fn set_to<'e>(assigned: &[(&'e Expr, &'e Expr)], word: &str) -> BTreeSet<&'e str> {
    let is_word = |value: &Expr| matches!(&*value.kind, ExprKind::Name(n) if n.text == word);
    assigned.iter().filter(|(_, value)| is_word(value)).filter_map(|(target, _)| named(target)).collect()
}

fn has_safe(wires: &[Wire]) -> bool {
    wires.iter().any(|w| matches!(&w.kind, WireKind::Fixed { when, .. } if when.text == SAFE))
}

fn is_bool(ty: &Type) -> bool {
    ty.paths.iter().any(|path| path.segments.last().is_some_and(|s| s.text == "Bool"))
}

fn assignments(clause: &Clause) -> Vec<(&Expr, &Expr)> {
    let ClauseKind::Effect(effects) = &clause.kind else { return Vec::new() };
    let assigned = effects.iter().filter_map(|effect| match effect {
        Effect::Assign(target, value) => Some((target, value)),
        Effect::Call(_) | Effect::Each { .. } => None,
    });
    assigned.collect()
}

/// The member that an effect sets: `active`, `self.speed`.
fn named(target: &Expr) -> Option<&str> {
    match &*target.kind {
        ExprKind::Name(name) | ExprKind::Member(_, name) => Some(&name.text),
        _ => None,
    }
}

fn names_in_law<'e>(law: &'e Law, out: &mut BTreeSet<&'e str>) {
    match &law.kind {
        LawKind::Error => {}
        LawKind::Let { value, .. } | LawKind::Assign { value, .. } | LawKind::Call(value) => names_in(value, out),
        LawKind::For { body, .. } => body.iter().for_each(|law| names_in_law(law, out)),
        LawKind::If { cond, then, otherwise } => {
            names_in(cond, out);
            then.iter().chain(otherwise).for_each(|law| names_in_law(law, out));
        }
    }
}
