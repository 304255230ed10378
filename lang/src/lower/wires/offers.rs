//! What a lab offers to others: every command of its devices, written out apart from any workflow, and what they show.

use std::collections::BTreeSet;
use std::sync::Arc;

use matterix_ir::graph::Op;
use matterix_ir::offer::{About, Arranged, Failure, Kind, Offer, Parameter, Shown};
use matterix_ir::plan::{Condition, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Unit};

use super::ranges::bounds;
use super::{Arrangement, Mapped, SELF};
use crate::ast::{Clause, ClauseKind, ExprKind, ItemKind, Member, MemberKind, Param, Role, Sig, TextPart, Type as Ty};
use crate::declare::Type;
use crate::declare::tables::MemberRef;
use crate::eval::lab::Mode;
use crate::eval::{Scope, Value};
use crate::lower::Planner;
use crate::lower::call::Bound;
use crate::names::{DeclId, verb_text};

/// A command with more arrangements is left to workflows.
const MOST: usize = 200;

/// What must hold before something is done, and the parameters that stand in it with their locals.
type Need = (Vec<Arc<Condition>>, Vec<(String, u32)>);

impl<'a> Planner<'a, '_> {
    /// Notes everything that the devices of the lab can be told, and show.
    pub(in crate::lower) fn begin_offers(&mut self, lab: DeclId) {
        if !self.draft {
            self.describe(lab);
        }
        for index in 0..self.lab.instances.len() as u32 {
            let id = InstanceId(index);
            let members = self.lab.all_members(id);
            let is_top = self.lab.instances[index as usize].owner.is_none();
            for m in members.iter().copied() {
                match &m.member.kind {
                    MemberKind::Command { .. } => self.offer(id, m),
                    MemberKind::Value { role: Role::Reading | Role::State | Role::Derived, .. }
                        if is_top && !self.draft =>
                    {
                        let shown = self.shown_of(id, m);
                        self.offers.shown.extend(shown);
                    }
                    _ => {}
                }
            }
        }
    }

    fn offer(&mut self, id: InstanceId, m: MemberRef<'a>) {
        let MemberKind::Command { sig, clauses } = &m.member.kind else { return };
        let arrangements = self.arrangements((sig, clauses, ""), &BTreeSet::new(), id, m.module, None);
        if arrangements.len() > MOST {
            return;
        }
        let Some(mut asked) = self.asked_for(sig, clauses, &arrangements, m.module) else { return };
        let (mut arranged, mut lasts, mut fails, mut needs) = (Vec::new(), false, Vec::new(), Vec::new());
        for Arrangement { values, locals } in arrangements {
            let things = things(&asked, &values);
            let bound = Bound { values: values.clone() };
            let Some((operation, invariants)) =
                self.operation_of(Mapped::Command(m), sig, clauses, bound, id, m.module)
            else {
                continue;
            };
            if operation.needs.iter().any(|n| self.lab.graph.constant(n.node) == Some(0.0)) {
                continue;
            }
            lasts |= operation.takes.is_some() || operation.until.is_some();
            let declared = operation.fails.iter().map(|name| Failure { name: name.clone(), help: None });
            note(&mut fails, declared.chain(operation.needs.iter().map(|n| failure_of(n))));
            needs.push((operation.needs.clone(), locals.clone()));
            let verb = verb_text(&sig.verb);
            let label = format!("{verb} {}", self.lab.instances[id.0 as usize].name);
            let span = sig.span;
            let step = self.add(label, span, Step::Operation(Box::new(operation)));
            self.call_wires(step, sig, &Bound { values }, Some(id));
            // A device may also take its time.
            lasts |= self.drivers.iter().any(|(_, d)| d.call(step).is_some_and(|e| e.until.is_some()));
            let step = match invariants.is_empty() {
                true => step,
                false => {
                    let label = self.steps[step.0 as usize].label.clone();
                    self.add(label, span, Step::During { invariants, body: step })
                }
            };
            let locals = locals.into_iter().map(|(_, local)| local).collect();
            arranged.push(Arranged { things, locals, step, result: None });
        }
        if arranged.is_empty() {
            return;
        }
        self.bound(&mut asked, &needs);
        self.offers.commands.push(Offer {
            device: Some(id),
            capability: self.lab.tables.kind_name(m.owner).to_string(),
            verb: verb_text(&sig.verb),
            docs: described(docs(m.member), clauses),
            parameters: asked,
            arrangements: arranged,
            lasts,
            result: None,
            fails,
        });
    }

    /// Skills of the file itself, each as it is called.
    pub(in crate::lower) fn offer_skills(&mut self, module: usize) {
        let names = self.lab.tables.names;
        for id in names.declared_by(module).collect::<Vec<_>>() {
            let item = names.decl(id).item;
            let ItemKind::Skill { sig, clauses, body: Some(body), handlers, .. } = &item.kind else { continue };
            let arrangements = self.arrangements((sig, clauses, ""), &BTreeSet::new(), InstanceId(0), module, None);
            if arrangements.len() > MOST {
                continue;
            }
            let Some(mut asked) = self.asked_for(sig, clauses, &arrangements, module) else { continue };
            let mut fails = vec![Failure { name: "need".to_string(), help: None }];
            for clause in clauses {
                match &clause.kind {
                    ClauseKind::Fails(names) => {
                        note(&mut fails, names.iter().map(|n| Failure { name: n.text.clone(), help: None }));
                    }
                    ClauseKind::Needs { refusal: Some(refusal), .. } => {
                        let (name, help) = (refusal.failure.text.clone(), refusal.help.clone());
                        note(&mut fails, std::iter::once(Failure { name, help }));
                    }
                    _ => {}
                }
            }
            let verb = verb_text(&sig.verb);
            let (mut arranged, mut needs, mut result) = (Vec::new(), Vec::new(), None);
            for Arrangement { values, locals } in arrangements {
                let things = things(&asked, &values);
                let mut scope = Scope::module(module);
                values.into_iter().for_each(|(name, value)| scope.bind(name, value));
                let (steps, found) = (self.steps.len(), self.lab.diagnostics.len());
                self.open.push(id);
                let lowered = self.skill_body(sig, clauses, body, handlers, &verb, sig.span, &mut scope);
                self.open.pop();
                // What makes no sense with these things is not offered with them.
                let wrong = self.lab.diagnostics[found..].iter().any(Diagnostic::is_error);
                self.lab.diagnostics.truncate(found);
                let Some((step, value)) = lowered.filter(|_| !wrong && !self.never(steps)) else { continue };
                let returned = self.returned(value);
                if let (None, Some(local), Some(ty)) = (&result, returned, &sig.result) {
                    result = Some(self.result_kind(ty, local, module));
                }
                needs.push((self.needs_of(step), locals.clone()));
                let locals = locals.into_iter().map(|(_, local)| local).collect();
                arranged.push(Arranged { things, locals, step, result: returned });
            }
            if !arranged.is_empty() {
                self.bound(&mut asked, &needs);
                self.offers.commands.push(Offer {
                    device: None,
                    capability: String::new(),
                    verb,
                    docs: described(item.docs.join(" "), clauses),
                    parameters: asked,
                    arrangements: arranged,
                    lasts: true,
                    result,
                    fails,
                });
            }
        }
    }

    /// Notes what the declarations of the devices, their capabilities and the lab say to people.
    fn describe(&mut self, lab: DeclId) {
        let names = self.lab.tables.names;
        let docs = |id: DeclId| plain(&names.decl(id).item.docs.join(" "));
        let mut about = vec![About { device: None, capability: String::new(), docs: docs(lab) }];
        for index in 0..self.lab.instances.len() as u32 {
            let id = InstanceId(index);
            let own: Vec<String> = self.lab.instances[index as usize].kinds.iter().map(|k| docs(*k)).collect();
            about.push(About { device: Some(id), capability: String::new(), docs: own.join(" ") });
            let mut capabilities: Vec<DeclId> = self.lab.all_members(id).iter().map(|m| m.owner).collect();
            capabilities.sort_unstable();
            capabilities.dedup();
            about.extend(capabilities.into_iter().map(|owner| About {
                device: Some(id),
                capability: self.lab.tables.kind_name(owner).to_string(),
                docs: docs(owner),
            }));
        }
        about.retain(|a| !a.docs.is_empty());
        self.offers.about = about;
    }

    /// Notes the ranges that the needs of a command set for its parameters, whatever things it is about.
    fn bound(&self, asked: &mut [Parameter], needs: &[Need]) {
        let known = |node| self.lab.glance(node);
        for parameter in asked.iter_mut().filter(|p| matches!(p.kind, Kind::Quantity { .. } | Kind::Whole)) {
            let each = needs.iter().filter_map(|(needs, locals)| {
                let local = locals.iter().find(|(name, _)| *name == parameter.name)?.1;
                Some(bounds(&self.lab.graph, needs, local, &known))
            });
            parameter.bounds = each.reduce(matterix_ir::offer::Bounds::around).unwrap_or_default();
        }
    }

    /// The needs of a skill that is written out.
    fn needs_of(&self, step: StepId) -> Vec<Arc<Condition>> {
        match &self.steps[step.0 as usize].step {
            Step::Skill { needs, .. } => needs.clone(),
            Step::Guarded { body, .. } => self.needs_of(*body),
            _ => Vec::new(),
        }
    }

    /// The local that receives what a skill returns.
    fn returned(&self, value: Option<Value>) -> Option<u32> {
        let Some(Value::Num(n)) = value else { return None };
        match self.lab.graph.op(n.node) {
            Op::Local(local) => Some(local),
            _ => None,
        }
    }

    /// What values a skill returns, in the unit of what is returned.
    fn result_kind(&mut self, ty: &'a Ty, local: u32, module: usize) -> Kind {
        match self.lab.resolve_type(ty, module) {
            Type::Int => Kind::Whole,
            ty => self.number_kind(&ty, Some(self.locals[local as usize].unit.clone())),
        }
    }

    /// Whether a skill written out from this node on needs what never holds.
    fn never(&self, from: usize) -> bool {
        let mut needs = self.steps[from..].iter().filter_map(|s| match &s.step {
            Step::Skill { needs, .. } => Some(needs),
            _ => None,
        });
        needs.any(|n| n.iter().any(|n| self.lab.graph.constant(n.node) == Some(0.0)))
    }

    /// The parameters of a call and its options without a default; nothing where one cannot be said from outside.
    fn asked_for(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        arrangements: &[Arrangement],
        module: usize,
    ) -> Option<Vec<Parameter>> {
        let options = clauses.iter().filter_map(|c| match &c.kind {
            ClauseKind::Option(p) if p.default.is_none() => Some(p),
            _ => None,
        });
        let asked: Vec<&Param> = sig.all_params().chain(options).collect();
        let mut parameters = Vec::new();
        for p in asked {
            let kind = self.kind_of(p, arrangements, module)?;
            let declared = p.ty.as_ref().map_or(String::new(), |ty| self.text(ty.span));
            parameters.push(Parameter { name: p.name.text.clone(), kind, declared, bounds: Default::default() });
        }
        Some(parameters)
    }

    /// What a parameter takes, where that can be said from outside.
    fn kind_of(&mut self, p: &'a Param, arrangements: &[Arrangement], module: usize) -> Option<Kind> {
        let ty = p.ty.as_ref()?;
        Some(match self.lab.resolve_parameter_type(ty, module) {
            Type::Quantity { optional: true, .. } => return None,
            ty @ Type::Quantity { .. } => self.number_kind(&ty, None),
            Type::Int => Kind::Whole,
            Type::Bool => Kind::Truth,
            Type::Enum(words) => Kind::Words(words.to_vec()),
            Type::Instance { .. } => {
                let of = |a: &Arrangement| match a.values.iter().find(|(n, _)| *n == p.name.text)?.1 {
                    Value::Instance(i) => Some(i),
                    _ => None,
                };
                let mut things: Vec<InstanceId> = arrangements.iter().filter_map(of).collect();
                things.sort_unstable();
                things.dedup();
                Kind::Things(things)
            }
            _ => return None,
        })
    }

    fn number_kind(&self, ty: &Type, unit: Option<Unit>) -> Kind {
        let unit = unit.unwrap_or_else(|| self.lab.type_unit(ty));
        let bases = match ty {
            Type::Quantity { dimension, .. } => self.lab.tables.units.in_bases(dimension),
            _ => None,
        };
        Kind::Quantity { unit, bases }
    }

    /// A reading, a state or what follows from states, where it is a number, a truth or a word.
    fn shown_of(&mut self, id: InstanceId, m: MemberRef<'a>) -> Option<Shown> {
        let MemberKind::Value { name, ty, options, .. } = &m.member.kind else { return None };
        if self.lab.is_hidden(id, m, options) {
            return None;
        }
        let ty = self.lab.resolve_type(ty, m.module);
        let mode = Mode { reported: true, ..self.lab.mode() };
        let value = self.lab.in_mode(mode, |lab| lab.member_value(id, m, name.span));
        let (kind, value) = match (value, &ty) {
            (Value::Num(n), Type::Quantity { .. }) => {
                let unit = self.lab.declared_unit(options, &ty);
                (self.number_kind(&ty, unit), n.node)
            }
            (Value::Num(n), Type::Int) => (Kind::Whole, n.node),
            (Value::Bool(node), _) => (Kind::Truth, node),
            (Value::Enum(node, words), _) => (Kind::Words(words.to_vec()), node),
            _ => return None,
        };
        Some(Shown {
            device: id,
            capability: self.lab.tables.kind_name(m.owner).to_string(),
            name: name.text.clone(),
            docs: plain(&docs(m.member)),
            kind,
            value,
        })
    }
}

/// The things among values, in the order of the parameters.
fn things(asked: &[Parameter], values: &[(String, Value)]) -> Vec<InstanceId> {
    let thing = |p: &Parameter| match values.iter().find(|(name, _)| *name == p.name)?.1 {
        Value::Instance(i) => Some(i),
        _ => None,
    };
    asked.iter().filter_map(thing).collect()
}

fn docs(member: &Member) -> String {
    member.docs.join(" ")
}

/// A comment without the targets of its links, which lead to pages of the library.
fn plain(docs: &str) -> String {
    let mut out = String::new();
    let mut rest = docs;
    while let Some((before, link)) = rest.split_once('[') {
        out += before;
        let parts = link.split_once("](").and_then(|(text, after)| Some((text, after.split_once(')')?.1)));
        (rest, out) = match parts.filter(|(text, _)| !text.contains('[')) {
            Some((text, after)) => (after, out + text),
            None => (link, out + "["),
        };
    }
    out + rest
}

/// A documentation comment; without one, the words in which a protocol for people says it.
fn described(docs: String, clauses: &[Clause]) -> String {
    if !docs.is_empty() {
        return plain(&docs);
    }
    let mut out = String::new();
    for clause in clauses {
        let ClauseKind::Says { text, when: None } = &clause.kind else { continue };
        for part in &text.parts {
            match part {
                TextPart::Plain(plain) => out += plain,
                TextPart::Value { value, .. } => match &*value.kind {
                    ExprKind::Name(name) if name.text == SELF => out += "it",
                    ExprKind::Name(name) => out += &format!("`{}`", name.text),
                    _ => out += "...",
                },
            }
        }
    }
    let mut letters = out.chars();
    match letters.next() {
        Some(first) => format!("{}{}.", first.to_uppercase(), letters.as_str()),
        None => out,
    }
}

fn failure_of(need: &Condition) -> Failure {
    Failure { name: need.failure().to_owned(), help: need.advice() }
}

/// Adds failures to a list that has each name once, with the first advice that is given for it.
fn note(fails: &mut Vec<Failure>, more: impl Iterator<Item = Failure>) {
    for failure in more {
        match fails.iter_mut().find(|f| f.name == failure.name) {
            Some(known) => known.help = known.help.take().or(failure.help),
            None => fails.push(failure),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn links_lose_their_targets() {
        assert_eq!(
            plain("An [`IntegratingHeater`](thermal.mtx) (a [1, 2] list)."),
            "An `IntegratingHeater` (a [1, 2] list)."
        );
        assert_eq!(plain("[a [b](c)"), "[a b");
    }
}
