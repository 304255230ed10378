//! Who a condition can hold for, read off its form, before it is written out for anybody: `touching(a, b)` holds for what stands on `a`
//! or bears it, and there are few of these among a thousand.
//!
//! What is found may be too many, never too few: for all others the condition is false whatever the run does. A form that says nothing
//! of it leaves all.

use std::collections::BTreeSet;

use matterix_ir::scene::InstanceId;

use super::Elaborator;
use crate::ast::{Arg, Binary, Expr, ExprKind, ItemKind, Param};
use crate::eval::{Scope, Value};
use crate::names::DeclId;

/// Instances that a condition can hold for.
pub type Candidates = BTreeSet<InstanceId>;

/// Calls in calls that are looked into.
const DEEPEST: usize = 8;

/// What the name that is asked about is called where an expression stands, and what the other names there mean.
struct Place<'s> {
    variable: &'s str,
    scope: &'s Scope,
    depth: usize,
}

/// What an expression is to the name that is asked about.
enum Side<'a> {
    /// The name.
    Variable,
    /// A member of it.
    Member(&'a str),
    /// These, whatever the name stands for; -1 is `nothing`.
    Targets(BTreeSet<i64>),
    /// Anything else.
    Open,
}

impl<'a> Elaborator<'a> {
    /// Who a condition can hold for as `variable`; nothing where its form does not say.
    pub(crate) fn candidates(&mut self, condition: &'a Expr, variable: &str, scope: &Scope) -> Option<Candidates> {
        if self.prototype || self.initial_mode {
            return None;
        }
        self.can_hold(condition, &Place { variable, scope, depth: 0 })
    }

    /// Who what is folded can come out for in another way than for anybody else, where the form says so: a sum over all bodies of what is
    /// zero for those that stand elsewhere asks those that stand here.
    pub(crate) fn folded(&mut self, fold: &str, body: &'a Expr, variable: &str, scope: &Scope) -> Option<Candidates> {
        let ExprKind::Call(callee, args) = &*body.kind else {
            return if fold == "any" { self.candidates(body, variable, scope) } else { None };
        };
        match (fold, args.as_slice()) {
            ("sum" | "max" | "min", [condition, _, otherwise]) if self.is_external(callee, "choose", scope) => {
                if args.iter().any(|a| a.name.is_some()) {
                    return None;
                }
                let neutral = match &*otherwise.value.kind {
                    ExprKind::Quantity(v, _) | ExprKind::Number(v) => fold != "sum" || *v == 0.0,
                    _ => false,
                };
                if neutral { self.candidates(&condition.value, variable, scope) } else { None }
            }
            ("any", _) => self.candidates(body, variable, scope),
            _ => None,
        }
    }

    fn can_hold(&mut self, e: &'a Expr, place: &Place<'_>) -> Option<Candidates> {
        match &*e.kind {
            ExprKind::Binary(Binary::And, a, b) => match (self.can_hold(a, place), self.can_hold(b, place)) {
                (Some(a), Some(b)) => Some(a.intersection(&b).copied().collect()),
                (a, b) => a.or(b),
            },
            ExprKind::Binary(Binary::Or, a, b) => {
                let mut all = self.can_hold(a, place)?;
                all.extend(self.can_hold(b, place)?);
                Some(all)
            }
            ExprKind::Binary(Binary::Eq, a, b) => match (self.side(a, place), self.side(b, place)) {
                (Side::Variable, Side::Targets(all)) | (Side::Targets(all), Side::Variable) => {
                    Some(all.iter().filter_map(|n| u32::try_from(*n).ok()).map(InstanceId).collect())
                }
                (Side::Member(name), Side::Targets(all)) | (Side::Targets(all), Side::Member(name)) => {
                    let pointing = self.pointing(name);
                    let those = all.iter().filter_map(|n| pointing.at.get(n)).flatten();
                    Some(those.chain(&pointing.anywhere).copied().collect())
                }
                _ => None,
            },
            ExprKind::Call(callee, args) => self.call_can_hold(callee, args, place),
            ExprKind::Fold { fold, var, set, body } if fold.text == "any" && var.text != place.variable => {
                self.any_can_hold(&var.text, set, body, place)
            }
            _ => None,
        }
    }

    /// Who `f(a, b)` can hold for, by what stands in its definition and by what a lab gives for pairs.
    fn call_can_hold(&mut self, callee: &'a Expr, args: &'a [Arg], place: &Place<'_>) -> Option<Candidates> {
        let (id, params, body) = self.definition(callee, place)?;
        if place.depth >= DEEPEST || args.len() > params.len() {
            return None;
        }
        let mut scope = Scope::module(self.tables.names.decl(id).module);
        let mut variable = None;
        for (position, arg) in args.iter().enumerate() {
            let param = match &arg.name {
                Some(name) => params.iter().find(|p| p.name.text == name.text)?,
                None => params.get(position)?,
            };
            match self.side(&arg.value, place) {
                Side::Variable if variable.is_none() => variable = Some(param.name.text.as_str()),
                Side::Variable => return None,
                Side::Targets(one) if one.len() == 1 => {
                    let one = one.first().and_then(|n| u32::try_from(*n).ok());
                    scope.bind(param.name.text.clone(), one.map_or(Value::Nothing, |i| Value::Instance(InstanceId(i))));
                }
                // Whatever it is, it hides what the name means elsewhere.
                _ => scope.bind(param.name.text.clone(), Value::Error),
            }
        }
        let variable = variable?;
        let mut found = match body {
            Some(body) => self.can_hold(body, &Place { variable, scope: &scope, depth: place.depth + 1 })?,
            None => Candidates::new(),
        };
        let name = crate::names::item_name(self.tables.names.decl(id).item).map(|(name, _)| name)?;
        let others: Vec<InstanceId> = scope.vars.iter().filter_map(|(_, v)| instance(v)).collect();
        let ends = self.pairs.iter().filter(|p| p.name == name).flat_map(|p| [(p.a, p.b), (p.b, p.a)]);
        found.extend(ends.filter(|(other, _)| others.is_empty() || others.contains(other)).map(|(_, end)| end));
        Some(found)
    }

    /// What a relation or a function that is written in the language is defined by; no definition where only labs say of what it holds.
    fn definition(&mut self, callee: &'a Expr, place: &Place<'_>) -> Option<(DeclId, &'a [Param], Option<&'a Expr>)> {
        let ExprKind::Name(name) = &*callee.kind else { return None };
        if name.text == place.variable || place.scope.var(&name.text).is_some() {
            return None;
        }
        let id = self.lookup(place.scope.module, &name.text)?;
        match &self.tables.names.decl(id).item.kind {
            ItemKind::Relation { params, definition, .. } => Some((id, params, definition.as_ref())),
            ItemKind::Fn { external: false, params, body: Some(body), .. } => Some((id, params, Some(body))),
            _ => None,
        }
    }

    /// Who `any(v in set: body)` can hold for: by each of a set that does not depend on who it is, or by way of their parts and wholes.
    fn any_can_hold(&mut self, var: &str, set: &'a Expr, body: &'a Expr, place: &Place<'_>) -> Option<Candidates> {
        let ExprKind::Call(callee, args) = &*set.kind else { return None };
        let [of, _] = args.as_slice() else { return None };
        let wholes = self.is_external(callee, "wholes", place.scope);
        if !wholes && !self.is_external(callee, "parts", place.scope) {
            return None;
        }
        match self.side(&of.value, place) {
            Side::Targets(_) => {
                let mut scope = place.scope.clone();
                let items = self.set(set, &mut scope)?;
                let mut all = Candidates::new();
                for item in items {
                    scope.bind(var, item);
                    let found = self.can_hold(body, &Place { scope: &scope, ..*place });
                    scope.vars.pop();
                    all.extend(found?);
                }
                Some(all)
            }
            Side::Variable => {
                let inner = self.can_hold(body, &Place { variable: var, ..*place })?;
                let mut all = Candidates::new();
                for i in inner {
                    if wholes {
                        all.insert(i);
                        self.all_parts(i, &mut all);
                    } else {
                        all.extend(std::iter::successors(Some(i), |i| self.instances[i.0 as usize].owner));
                    }
                }
                Some(all)
            }
            _ => None,
        }
    }

    /// Whether a callee is the function of this name that the compiler provides.
    fn is_external(&mut self, callee: &Expr, called: &str, scope: &Scope) -> bool {
        let ExprKind::Name(name) = &*callee.kind else { return false };
        if name.text != called || scope.var(called).is_some() {
            return false;
        }
        let id = self.lookup(scope.module, called);
        id.is_some_and(|id| matches!(self.tables.names.decl(id).item.kind, ItemKind::Fn { external: true, .. }))
    }

    /// An instance's parts, and theirs.
    fn all_parts(&self, of: InstanceId, out: &mut Candidates) {
        let instance = &self.instances[of.0 as usize];
        let children = instance.grids.iter().flat_map(|grid| grid.children.values());
        for part in instance.parts.values().chain(children) {
            if out.insert(*part) {
                self.all_parts(*part, out);
            }
        }
    }

    fn side(&mut self, e: &'a Expr, place: &Place<'_>) -> Side<'a> {
        match &*e.kind {
            ExprKind::Name(name) if name.text == place.variable => Side::Variable,
            ExprKind::Name(name) => match place.scope.var(&name.text) {
                Some(Value::Instance(i) | Value::Qualified(i, _)) => Side::Targets([i64::from(i.0)].into()),
                Some(Value::Nothing) => Side::Targets([-1].into()),
                Some(_) => Side::Open,
                None => match (name.text.as_str(), place.scope.this) {
                    ("nothing", _) => Side::Targets([-1].into()),
                    ("self", Some(this)) => Side::Targets([i64::from(this.0)].into()),
                    (member, Some(this)) => self.member_side(this, member),
                    _ => Side::Open,
                },
            },
            ExprKind::Member(base, name) => match self.side(base, place) {
                Side::Variable => Side::Member(&name.text),
                Side::Targets(one) if one.len() == 1 => {
                    let of = one.first().and_then(|n| u32::try_from(*n).ok());
                    of.map_or(Side::Open, |i| self.member_side(InstanceId(i), &name.text))
                }
                _ => Side::Open,
            },
            _ => Side::Open,
        }
    }

    /// What a member of an instance may point at.
    fn member_side(&mut self, id: InstanceId, name: &str) -> Side<'a> {
        let members = self.members_of(id, name);
        let [m] = *members else { return Side::Open };
        self.points_at(id, m).map_or(Side::Open, Side::Targets)
    }
}

fn instance(value: &Value) -> Option<InstanceId> {
    if let Value::Instance(i) = value { Some(*i) } else { None }
}
