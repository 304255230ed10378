//! What a path of a study or a fit names: `target`, `bench.beaker.initial[HI]`, `ethyl_iodide.rate.Ea`.

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Op, codes};

use crate::ast::{Expr, ExprKind};
use crate::eval::Value;
use crate::eval::lab::Elaborator;
use crate::eval::lab::free::Named;
use crate::near;

/// What may vary, for messages.
const KINDS: &str = "these can vary: parameters of the workflow and of things, the initial contents of vessels (`beaker.initial[HI]`), settings of the lab, arguments of rate laws (`reaction.rate.Ea`)";

/// A path as the names of parameters are written; none where it is no path.
pub fn written(e: &Expr) -> Option<String> {
    Some(match &*e.kind {
        ExprKind::Name(n) => n.text.clone(),
        ExprKind::Scoped(path) => path.segments.last()?.text.clone(),
        ExprKind::Member(base, name) => format!("{}.{}", written(base)?, name.text),
        ExprKind::IndexWord(base, word) => format!("{}[{}]", written(base)?, word.text),
        ExprKind::Index(base, index) => format!("{}[{}]", written(base)?, written(index)?),
        ExprKind::Call(callee, args) => {
            let args: Option<Vec<String>> = args.iter().map(|a| written(&a.value)).collect();
            format!("{}({})", written(callee)?, args?.join(", "))
        }
        _ => return None,
    })
}

impl Elaborator<'_> {
    /// The parameter that a path names, or a report.
    pub(super) fn free(&mut self, path: &Expr, lab: &str) -> Option<Named> {
        let text = written(path);
        let Some(text) = text else {
            if !matches!(*path.kind, ExprKind::Error) {
                let d = Diagnostic::error(codes::CANNOT_VARY, path.span, "this cannot vary", "not a name");
                self.report(d.help(KINDS));
            }
            return None;
        };
        let own = text.strip_prefix(lab).and_then(|rest| rest.strip_prefix('.')).unwrap_or(&text).to_string();
        let own = self.answering(own);
        let value = self.silently(|this| this.member_at(&own, path));
        let found: Vec<Named> = self.open.named(&own).cloned().collect();
        match found.as_slice() {
            [one] if self.open.is_fixed(one.param) => {
                let headline = format!("`{text}` cannot vary: the lab or the plan depends on it");
                let d = Diagnostic::error(codes::CANNOT_VARY, path.span, headline, "fixed before the runs");
                self.report(
                    d.because(one.span, "its value")
                        .help("write a lab or a workflow for each value, and a study for each"),
                );
                None
            }
            [one] => Some(one.clone()),
            [] => {
                let mut d = match value {
                    Some(value) => self.fixed_by(&text, value, path),
                    None => self.unknown_path(&text, &own, path),
                };
                d.help.extend(self.instead_at(&own));
                self.report(d);
                None
            }
            [first, rest @ ..] => {
                let headline = format!("`{text}` is given at {} places", found.len());
                let mut d = Diagnostic::error(codes::AMBIGUOUS_NAME, path.span, headline, "several values");
                d = d.because(first.span, "one of them");
                for other in rest {
                    d = d.because(other.span, "another");
                }
                self.report(d);
                None
            }
        }
    }

    /// A path to a member that the only part of a thing answers for, with that part: `cup.contents.air` of `cup.air`.
    fn answering(&self, path: String) -> String {
        let Some((instance, member)) = path.rsplit_once('.') else { return path };
        let Some(thing) = self.instances.iter().position(|i| i.name == instance) else { return path };
        if self.has_member(InstanceId(thing as u32), member) {
            return path;
        }
        let mut fitting = self.instances[thing].parts.values().filter(|p| self.has_member(**p, member));
        match (fitting.next(), fitting.next()) {
            (Some(part), None) => format!("{}.{member}", self.instances[part.0 as usize].name),
            _ => path,
        }
    }

    /// What a member of an instance is worth; it becomes a parameter of the model if it is given as a number.
    fn member_at(&mut self, path: &str, at: &Expr) -> Option<Value> {
        let (instance, member) = path.rsplit_once('.')?;
        let id = InstanceId(self.instances.iter().position(|i| i.name == instance)? as u32);
        let found = self.members_of(id, member);
        let values: Vec<Value> = found.iter().map(|m| self.member_value(id, *m, at.span)).collect();
        values.into_iter().next()
    }

    /// What to give in place of a derived member.
    fn instead_at(&self, path: &str) -> Option<String> {
        let (instance, member) = path.rsplit_once('.')?;
        let thing = self.instances.iter().position(|i| i.name == instance)?;
        self.instead_of(InstanceId(thing as u32), member)
    }

    /// Does something whose findings are another's.
    pub(super) fn silently<T>(&mut self, what: impl FnOnce(&mut Self) -> T) -> T {
        let (kept, reported) = (self.diagnostics.len(), self.reported);
        let result = what(self);
        self.diagnostics.truncate(kept);
        self.reported = reported;
        result
    }

    /// Why a member is no parameter.
    fn fixed_by(&self, text: &str, value: Value, path: &Expr) -> Diagnostic {
        let found = |headline: String, label: &str| Diagnostic::error(codes::CANNOT_VARY, path.span, headline, label);
        let Value::Num(n) = value else {
            let headline = format!("`{text}` cannot vary: it is not a number");
            return found(headline, value.what()).help(KINDS);
        };
        let below = self.graph.schedule([n.node]);
        if below.iter().any(|n| matches!(self.graph.op(*n), Op::State(_))) {
            return found(format!("`{text}` cannot vary: it changes during the run"), "not given").help(KINDS);
        }
        let names: Vec<String> = below
            .iter()
            .filter_map(|n| match self.graph.op(*n) {
                Op::Param(i) => self.open.name_of(i).map(|name| format!("`{name}`")),
                _ => None,
            })
            .collect();
        match names.is_empty() {
            true => found(format!("`{text}` cannot vary"), "not given as a number").help(KINDS),
            false => found(format!("`{text}` follows from {}", names.join(", ")), "not given on its own")
                .help("vary one of these instead"),
        }
    }

    fn unknown_path(&self, text: &str, own: &str, path: &Expr) -> Diagnostic {
        if self.open.leaves(own) {
            let headline = format!("`{text}` cannot vary: it is not a number");
            return Diagnostic::error(codes::CANNOT_VARY, path.span, headline, "not a quantity").help(KINDS);
        }
        let near = near::nearest(own, self.open.names());
        let headline = format!("unknown parameter `{text}`");
        let mut d = Diagnostic::error(codes::UNKNOWN_PARAMETER, path.span, headline, "not a parameter");
        d.help.extend(near::question(&near));
        if near.is_empty() {
            d = d.help(KINDS);
        }
        d
    }
}
