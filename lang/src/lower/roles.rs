//! Roles: parameters of a workflow that an instance of its lab takes.

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, codes};

use super::Planner;
use crate::ast::{Binary, Expr, ExprKind, Param};
use crate::declare::Type;
use crate::eval::Decided;
use crate::eval::lab::free::Bound;
use crate::eval::{Scope, Value};
use crate::names::DeclId;

/// An instance of the lab before a role.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The instance.
    pub id: InstanceId,
    /// Why it cannot take the role, if it cannot.
    pub refused: Option<String>,
}

/// At most so many fitting instances are listed.
const MOST_FITTING: usize = 4;

/// At most so many refused instances are listed.
const MOST_REFUSED: usize = 6;

impl<'a> Planner<'a, '_> {
    /// The instance that takes a role when nobody says which: the only one that fits.
    pub fn choose_role(&mut self, p: &'a Param, ty: &Type, scope: &mut Scope) -> Value {
        let Type::Instance { kinds, optional } = ty else { return Value::Error };
        let all = self.candidates(p, kinds, scope);
        let name = &p.name.text;
        let fitting: Vec<InstanceId> = all.iter().filter(|c| c.refused.is_none()).map(|c| c.id).collect();
        match fitting.as_slice() {
            [one] => Value::Instance(*one),
            [] if *optional => Value::Nothing,
            // Checked by itself, a workflow may be done with any of them.
            [first, ..] if !self.to_run => Value::Instance(*first),
            [] => {
                let lab = self.lab.lab_name;
                let lab_text = self.text(lab);
                let wanted = self.wanted(p, ty);
                let headline = format!("no thing in `{lab_text}` can be `{name}`");
                let label = format!("must be {wanted}");
                let mut d = Diagnostic::error(codes::UNBOUND_ROLE, p.name.span, headline, label);
                d = d.because(lab, "no thing of this lab fits");
                d.help.extend(self.refusals(&all));
                self.lab.report(d);
                Value::Error
            }
            many => {
                let name_of = |i: &InstanceId| format!("`{}`", self.lab.instances[i.0 as usize].name);
                let mut names: Vec<String> = many.iter().take(MOST_FITTING).map(name_of).collect();
                let more = many.len() - names.len();
                names.extend((more > 0).then(|| format!("{more} more")));
                let headline = format!("`{name}` could be {}: choose one", names.join(" or "));
                let first = self.lab.instances[many[0].0 as usize].name.clone();
                let mut d = Diagnostic::error(codes::UNBOUND_ROLE, p.name.span, headline, "several things fit");
                for i in many.iter().take(MOST_FITTING) {
                    let inst = &self.lab.instances[i.0 as usize];
                    d = d.because(inst.span, format!("`{}` fits", inst.name));
                }
                self.lab.report(d.help(format!("choose with `--set {name}={first}`, or in the `run` of a test")));
                Value::Error
            }
        }
    }

    /// Checks an instance that was named for a role against its `where`.
    pub fn check_role(&mut self, p: &'a Param, value: Value, span: matterix_ir::Span, scope: &mut Scope) -> Value {
        let (Value::Instance(id), Some(condition)) = (&value, condition_of(p)) else { return value };
        let Some(reason) = self.refused(p, *id, condition, scope) else { return value };
        let name = self.lab.instances[id.0 as usize].name.clone();
        let headline = format!("`{name}` cannot be `{}`: {reason}", p.name.text);
        let d = Diagnostic::error(codes::UNBOUND_ROLE, span, headline, "does not fit");
        self.lab.report(d.because(condition.span, "required here"));
        Value::Error
    }

    /// Checks the value of a parameter that is no thing, which was bound last, against what it may be.
    pub fn check_allowed(&mut self, p: &'a Param, span: matterix_ir::Span, scope: &mut Scope) {
        let Some(condition) = condition_of(p) else { return };
        let name = &p.name.text;
        let value = match scope.vars.last() {
            Some((_, Value::Error | Value::Instance(_) | Value::Qualified(..) | Value::Nothing)) | None => return,
            Some((_, value)) => value.clone(),
        };
        // A study keeps to it as well.
        if let (ExprKind::Binary(Binary::In, _, allowed), Value::Num(n)) = (&*condition.kind, &value)
            && matches!(&*allowed.kind, ExprKind::Range(..))
            && let Value::Range(low, high) = self.lab.expr(allowed, scope)
            && let (Some(low), Some(high)) = (self.lab.glance(low.node), self.lab.glance(high.node))
        {
            let op = self.lab.graph.op(n.node);
            self.lab.open.bound(op, Bound::AtLeast, low);
            self.lab.open.bound(op, Bound::AtMost, high);
        }
        let Some(found) = self.condition(condition, scope) else { return };
        if matches!(self.lab.before_run(found.node), Decided::Now(0.0)) {
            let is = match &value {
                Value::Num(n) => self.lab.glance(n.node).map(|v| format!("is {}", self.lab.unit_of(n).show(v))),
                Value::Text(text) => Some(format!("is \"{text}\"")),
                _ => None,
            };
            let is = is.unwrap_or_else(|| "is not allowed".to_owned());
            let allowed = match &*condition.kind {
                ExprKind::Binary(Binary::In, _, allowed) => format!("must be in `{}`", self.text(allowed.span)),
                _ => format!("`{}` must hold", self.text(condition.span)),
            };
            let headline = format!("`{name}` {is}, and {allowed}");
            let d = Diagnostic::error(codes::OUT_OF_RANGE, span, headline, "not allowed");
            self.lab.report(d.because(condition.span, "required here"));
        }
    }

    /// Every asset of the lab, with why it cannot take a role.
    pub fn candidates(&mut self, p: &'a Param, kinds: &[DeclId], scope: &mut Scope) -> Vec<Candidate> {
        let mut out = Vec::new();
        for i in 0..self.lab.instances.len() {
            let id = InstanceId(i as u32);
            let own = &self.lab.instances[i].kinds;
            if !own.iter().all(|k| self.lab.tables.kinds.get(k).is_some_and(|k| k.is_asset)) {
                continue;
            }
            let missing = kinds.iter().find(|k| !self.lab.instance_is(id, **k));
            let refused = match (missing, condition_of(p)) {
                (Some(kind), _) => Some(format!("not a {}", self.lab.tables.kind_name(*kind))),
                (None, Some(condition)) => self.refused(p, id, condition, scope),
                (None, None) => None,
            };
            out.push(Candidate { id, refused });
        }
        out
    }

    /// Why an instance does not satisfy the `where` of a role, if it does not.
    fn refused(&mut self, p: &Param, id: InstanceId, condition: &'a Expr, scope: &mut Scope) -> Option<String> {
        scope.bind(p.name.text.clone(), Value::Instance(id));
        let found = self.condition(condition, scope);
        scope.vars.pop();
        let Some(found) = found else { return Some(format!("`{}` does not apply to it", self.text(condition.span))) };
        match self.lab.known(found.node) {
            None => {
                self.lab.report(
                    Diagnostic::error(
                        codes::MISPLACED,
                        condition.span,
                        "`where` is decided before the run and cannot depend on it",
                        "depends on the run",
                    )
                    .help("use only parameters here; check states with `needs` or `expect`"),
                );
                Some(format!("`{}` depends on the run", found.text))
            }
            Some(holds) if holds != 0.0 => None,
            Some(_) => {
                let measured = found.compared.first().and_then(|c| Some(c.unit.show(self.lab.glance(c.value)?)));
                let measured = measured.map_or_else(String::new, |m| format!(" (it is {m})"));
                Some(format!("`{}` is false{measured}", found.text))
            }
        }
    }

    /// Lines of help on why instances were refused: those that come nearest first.
    fn refusals(&self, all: &[Candidate]) -> Vec<String> {
        let line = |c: &Candidate| {
            let reason = c.refused.as_deref()?;
            let name = &self.lab.instances[c.id.0 as usize].name;
            Some(format!("`{name}` ({}): {reason}", self.lab.kind_names(c.id)))
        };
        let mut lines: Vec<String> = all.iter().filter_map(line).collect();
        lines.sort_by_key(|l| l.contains("): not a "));
        let more = lines.len().saturating_sub(MOST_REFUSED);
        lines.truncate(MOST_REFUSED);
        lines.extend((more > 0).then(|| format!("and {more} more")));
        lines
    }

    /// A role's type in the words of the text.
    fn wanted(&self, p: &Param, ty: &Type) -> String {
        let kinds = self.lab.tables.type_name(ty);
        match condition_of(p) {
            Some(c) => format!("{kinds} where `{}`", self.text(c.span)),
            None => kinds,
        }
    }

    /// Why a lab cannot host a workflow: a line for each role that nothing in it can take.
    pub fn lacking(&mut self, params: &'a [Param], given: &[crate::task::Given<'a>], scope: &mut Scope) -> Vec<String> {
        let mut out = Vec::new();
        for p in params {
            let Some(ty) = &p.ty else { continue };
            let Type::Instance { kinds, optional } = self.lab.resolve_parameter_type(ty, scope.module) else {
                continue;
            };
            let named = given.iter().find(|g| g.name.text == p.name.text);
            if let Some(g) = named {
                if let crate::ast::ExprKind::Name(n) = &*g.value.kind
                    && self.lab.find_instance(&n.text).is_none()
                {
                    out.push(format!("it has no `{}`", n.text));
                }
                continue;
            }
            let all = self.candidates(p, &kinds, scope);
            let first = all.iter().find(|c| c.refused.is_none()).map(|c| c.id);
            match first {
                Some(id) => scope.bind(p.name.text.clone(), Value::Instance(id)),
                None if optional || p.default.is_some() => {}
                None => {
                    let wanted = self.wanted(p, &Type::Instance { kinds, optional });
                    let nearest = self.refusals(&all).into_iter().find(|l| !l.contains("): not a "));
                    let nearest = nearest.map_or_else(String::new, |l| format!("; {l}"));
                    out.push(format!("no thing can be `{}`, {wanted}{nearest}", p.name.text));
                }
            }
        }
        out
    }
}

/// The `where` of a parameter.
pub fn condition_of(p: &Param) -> Option<&Expr> {
    p.ty.as_ref().and_then(|ty| ty.condition.as_ref())
}
