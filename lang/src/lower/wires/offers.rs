//! What a lab offers to others: every command of its devices, written out apart from any workflow, and what they show.

use matterix_ir::offer::{Arranged, Kind, Offer, Parameter, Shown};
use matterix_ir::plan::Step;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Unit};

use super::{Arrangement, Mapped};
use crate::ast::{Clause, ClauseKind, ItemKind, Member, MemberKind, Param, Role, Sig};
use crate::elaborate::tables::MemberRef;
use crate::eval::{Scope, Type, Value};
use crate::lower::Planner;
use crate::lower::call::Bound;
use crate::names::verb_text;

/// A command with more arrangements is left to workflows.
const MOST: usize = 200;

impl<'a> Planner<'a, '_> {
    /// Notes everything that the devices of the lab can be told, and show.
    pub(in crate::lower) fn begin_offers(&mut self) {
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
        let arrangements = self.arrangements(sig, clauses, "", id, m.module, None);
        if arrangements.len() > MOST {
            return;
        }
        let Some(asked) = self.asked_for(sig, clauses, &arrangements, m.module) else { return };
        let (mut arranged, mut lasts, mut fails) = (Vec::new(), false, Vec::new());
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
            let needs = operation.needs.iter().map(|n| n.failure().to_owned());
            for failure in operation.fails.iter().cloned().chain(needs) {
                if !fails.contains(&failure) {
                    fails.push(failure);
                }
            }
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
            arranged.push(Arranged { things, locals, step });
        }
        if arranged.is_empty() {
            return;
        }
        self.offers.commands.push(Offer {
            device: Some(id),
            capability: self.lab.tables.kind_name(m.owner).to_string(),
            verb: verb_text(&sig.verb),
            docs: docs(m.member),
            parameters: asked,
            arrangements: arranged,
            lasts,
            fails,
        });
    }

    /// Skills of the file itself, each as it is called.
    pub(in crate::lower) fn offer_skills(&mut self, module: usize) {
        let names = self.lab.tables.names;
        for id in names.declared_by(module).collect::<Vec<_>>() {
            let item = names.decl(id).item;
            let ItemKind::Skill { sig, clauses, body: Some(body), handlers, .. } = &item.kind else { continue };
            let arrangements = self.arrangements(sig, clauses, "", InstanceId(0), module, None);
            if arrangements.len() > MOST {
                continue;
            }
            let Some(asked) = self.asked_for(sig, clauses, &arrangements, module) else { continue };
            let mut fails = vec!["need".to_string()];
            for clause in clauses {
                match &clause.kind {
                    ClauseKind::Fails(names) => fails.extend(names.iter().map(|n| n.text.clone())),
                    ClauseKind::Needs { refusal: Some(refusal), .. } => fails.push(refusal.failure.text.clone()),
                    _ => {}
                }
            }
            fails.dedup();
            let verb = verb_text(&sig.verb);
            let mut arranged = Vec::new();
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
                match lowered.filter(|_| !wrong && !self.never(steps)) {
                    Some((step, _)) => {
                        let locals = locals.into_iter().map(|(_, local)| local).collect();
                        arranged.push(Arranged { things, locals, step });
                    }
                    None => continue,
                }
            }
            if !arranged.is_empty() {
                self.offers.commands.push(Offer {
                    device: None,
                    capability: String::new(),
                    verb,
                    docs: item.docs.join(" "),
                    parameters: asked,
                    arrangements: arranged,
                    lasts: true,
                    fails,
                });
            }
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
            parameters.push(Parameter { name: p.name.text.clone(), kind });
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
        if options.iter().any(|o| o.name.text == "hidden") {
            return None;
        }
        let ty = self.lab.resolve_type(ty, m.module);
        let live = std::mem::replace(&mut self.lab.readings_live, true);
        let value = self.lab.member_value(id, m, name.span);
        self.lab.readings_live = live;
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
            docs: docs(m.member),
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
