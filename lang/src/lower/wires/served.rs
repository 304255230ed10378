//! Commands of a device apart from any plan: for emulators, for what is repeated, and to check a driver by itself.

use std::collections::BTreeSet;

use matterix_ir::plan::{Condition, Operation};
use matterix_ir::scene::InstanceId;
use matterix_ir::wire::Served;
use matterix_ir::{Diagnostic, Op, Span, codes};

use super::{Mapped, bind, command_sig};
use crate::ast::{self, Clause, ItemKind, MemberKind, Name, Sig, WireKind};
use crate::declare::Type;
use crate::eval::{Num, Scope, Value};
use crate::lower::Planner;
use crate::lower::call::Bound;
use crate::names::{DeclId, names_in, verb_text};

/// Values of parameters, and the locals among them.
#[derive(Clone, Default)]
pub(super) struct Arrangement {
    pub values: Vec<(String, Value)>,
    pub locals: Vec<(String, u32)>,
}

/// More arrangements of things than a lab has.
const MOST: usize = 10_000;

impl<'a> Planner<'a, '_> {
    /// The command of a line, for every arrangement of the things it is about; its quantities are locals of the plan.
    pub(super) fn served(
        &mut self,
        mapped: Mapped<'a>,
        (line, exchange, span): (&'a Sig, &'a ast::Exchange, Span),
        instance: InstanceId,
        module: usize,
        host: Option<InstanceId>,
    ) -> Vec<Served> {
        let (sig, clauses, of, own): (&'a Sig, &'a [Clause], usize, &str) = match mapped {
            Mapped::Command(m) => match &m.member.kind {
                MemberKind::Command { sig, clauses } => (sig, clauses, m.module, ""),
                _ => return Vec::new(),
            },
            Mapped::Skill(id, sig, own) => match &self.lab.tables.names.decl(id).item.kind {
                ItemKind::Skill { clauses, .. } => (sig, clauses, self.lab.tables.names.decl(id).module, own),
                _ => return Vec::new(),
            },
        };
        let mut said = BTreeSet::new();
        for part in exchange.sends.iter().flat_map(|text| &text.parts) {
            if let ast::TextPart::Value { value, .. } = part {
                names_in(value, &mut said);
            }
        }
        let arrangements = self.arrangements((sig, clauses, own), &said, instance, of, host);
        let mut out = Vec::new();
        for Arrangement { values, locals: arguments } in arrangements {
            let mut scope = Scope::of(instance, module);
            bind(line, &values, &mut scope);
            let Some((operation, _)) = self.operation_of(mapped, sig, clauses, Bound { values }, instance, of) else {
                continue;
            };
            // What can never begin in this lab is not served.
            if !self.lab.prototype && operation.needs.iter().any(|n| self.lab.graph.constant(n.node) == Some(0.0)) {
                continue;
            }
            if let Some(exchange) = self.exchange(exchange, span, &mut scope) {
                out.push(Served { arguments, operation, exchange });
            }
        }
        out
    }

    /// Every arrangement of the things that a command is about, as far as the lab has them; `said` are the names that a line mentions.
    pub(super) fn arrangements(
        &mut self,
        (sig, clauses, own): (&'a Sig, &'a [Clause], &str),
        said: &BTreeSet<&str>,
        instance: InstanceId,
        of: usize,
        host: Option<InstanceId>,
    ) -> Vec<Arrangement> {
        let mut arrangements = vec![Arrangement::default()];
        let options = clauses.iter().filter_map(|clause| match &clause.kind {
            ast::ClauseKind::Option(p) => Some(p),
            _ => None,
        });
        for (p, is_option) in sig.all_params().map(|p| (p, false)).chain(options.map(|p| (p, true))) {
            let ty = p.ty.as_ref().map(|ty| self.lab.resolve_parameter_type(ty, of));
            let name = p.name.text.clone();
            let (values, local): (Vec<Value>, Option<u32>) = match ty {
                _ if name == own => (vec![Value::Instance(instance)], None),
                Some(ty)
                    if is_option
                        && said.contains(name.as_str())
                        && !matches!(ty, Type::Instance { .. } | Type::List(_)) =>
                {
                    self.open_value(&ty, &name)
                }
                // What the command takes where nothing is said, as the line says nothing of it.
                ty if is_option && p.default.is_some() => {
                    let value = p
                        .default
                        .as_ref()
                        .map(|e| self.lab.typed(e, &ty.unwrap_or(Type::Any), &mut Scope::module(of), &p.name.text));
                    (vec![value.unwrap_or(Value::Error)], None)
                }
                Some(Type::Instance { kinds, .. }) if !self.lab.prototype => {
                    let all = self.all_of(&kinds, instance, host);
                    (all.into_iter().map(Value::Instance).collect(), None)
                }
                Some(Type::List(of)) if !self.lab.prototype && matches!(*of, Type::Instance { .. }) => {
                    let Type::Instance { kinds, .. } = &*of else { return Vec::new() };
                    let all = self.all_of(kinds, instance, host);
                    (self.one_or_a_column(&all).into_iter().map(Value::List).collect(), None)
                }
                Some(ty) => self.open_value(&ty, &name),
                None => (vec![Value::Error], None),
            };
            arrangements = arrangements
                .into_iter()
                .flat_map(|before| {
                    let (name, local) = (name.clone(), local);
                    values.clone().into_iter().map(move |v| {
                        let mut next = before.clone();
                        next.values.push((name.clone(), v));
                        next.locals.extend(local.map(|l| (name.clone(), l)));
                        next
                    })
                })
                .take(MOST)
                .collect();
        }
        arrangements
    }

    /// The things of these kinds that a command of a device can be about: over the line of another device only what belongs
    /// to that.
    fn all_of(&self, kinds: &[DeclId], device: InstanceId, host: Option<InstanceId>) -> Vec<InstanceId> {
        let all = (0..self.lab.instances.len() as u32).map(InstanceId);
        let fits = |i: &InstanceId| {
            kinds.iter().all(|k| self.lab.instance_is(*i, *k)) && host.is_none_or(|h| self.reaches(h, device, *i))
        };
        all.filter(fits).collect()
    }

    /// Lists that a command can be about: each thing by itself, and each column of a grid of them.
    fn one_or_a_column(&self, all: &[InstanceId]) -> Vec<Vec<Value>> {
        let mut columns: Vec<Vec<InstanceId>> = Vec::new();
        for grid in self.lab.instances.iter().flat_map(|i| &i.grids) {
            let mut last = None;
            for (place, child) in grid.children.iter().filter(|(_, child)| all.contains(child)) {
                match columns.last_mut() {
                    Some(column) if last == Some(place.column) => column.push(*child),
                    _ => columns.push(vec![*child]),
                }
                last = Some(place.column);
            }
        }
        let ones = all.iter().map(|i| vec![*i]);
        let lists = ones.chain(columns.into_iter().filter(|c| c.len() > 1));
        lists.map(|list| list.into_iter().map(Value::Instance).collect()).collect()
    }

    /// A value that is known only when it comes over the line.
    fn open_value(&mut self, ty: &Type, name: &str) -> (Vec<Value>, Option<u32>) {
        if *ty == Type::Bool {
            let local = self.local(name, matterix_ir::Unit::one());
            return (vec![Value::Bool(self.lab.graph.add(Op::Local(local)))], Some(local));
        }
        let (dimension, point, words) = match ty {
            Type::Quantity { dimension, point, .. } => (dimension.clone(), *point, None),
            Type::Int => match Type::ratio() {
                Type::Quantity { dimension, .. } => (dimension, false, None),
                _ => return (Vec::new(), None),
            },
            Type::Enum(words) => match Type::ratio() {
                Type::Quantity { dimension, .. } => (dimension, false, Some(words.clone())),
                _ => return (Vec::new(), None),
            },
            other => return (vec![self.lab.placeholder(other, name)], None),
        };
        let local = self.local(name, self.lab.tables.si(&dimension));
        let node = self.lab.graph.add(Op::Local(local));
        let value = match words {
            Some(words) => Value::Enum(node, words),
            None => Value::Num(Num { node, dimension, point, unit: None, literal: false }),
        };
        (vec![value], Some(local))
    }

    /// The command with these values, and what must hold while it lasts.
    pub(super) fn operation_of(
        &mut self,
        mapped: Mapped<'a>,
        sig: &'a Sig,
        clauses: &'a [Clause],
        bound: Bound,
        instance: InstanceId,
        module: usize,
    ) -> Option<(Operation, Vec<Condition>)> {
        let mut scope = match mapped {
            Mapped::Command(m) => Scope::of_member(instance, m),
            Mapped::Skill(..) => Scope::module(module),
        };
        for (name, v) in &bound.values {
            scope.bind(name.clone(), v.clone());
        }
        let (mut operation, invariants) = self.operation(sig, clauses, &bound, &mut scope)?;
        if let Mapped::Command(m) = mapped {
            operation.capability = Some(self.lab.tables.kind_name(m.owner).to_string());
            operation.at_start = std::mem::take(&mut operation.at_end);
        }
        operation.device = Some(instance);
        if !operation.claims.contains(&instance) {
            operation.claims.insert(0, instance);
        }
        Some((operation, invariants))
    }

    /// The command without arguments that these words mean, by the line the same driver has for it.
    pub(super) fn by_name(&mut self, verb: &[Name], instance: InstanceId, module: usize) -> Option<Served> {
        let text = verb_text(verb);
        let span = verb.first()?.span.to(verb.last()?.span);
        let mut commands = self.lab.commands_of(instance, &text).into_iter();
        let own = commands.find(|m| command_sig(m).is_some_and(|s| s.all_params().next().is_none()));
        let Some(m) = own else {
            let headline = format!("the device has no command `{text}` without arguments");
            self.lab.report(Diagnostic::error(
                codes::DRIVER_LINE,
                span,
                headline,
                "only such a command can be repeated",
            ));
            return None;
        };
        let line = self.lines_beside(span).iter().find_map(|w| match &w.kind {
            WireKind::Command { sig, exchange }
                if verb_text(&sig.verb) == text && sig.all_params().next().is_none() =>
            {
                Some((sig, exchange, w.span))
            }
            _ => None,
        });
        let Some((sig, exchange, at)) = line else {
            let headline = format!("the driver has no line for `{text}`");
            self.lab.report(Diagnostic::error(codes::DRIVER_LINE, span, headline, "no line sends this"));
            return None;
        };
        self.served(Mapped::Command(m), (sig, exchange, at), instance, module, None).into_iter().next()
    }

    /// The lines of the driver that a place in the text belongs to.
    fn lines_beside(&self, at: Span) -> &'a [ast::Wire] {
        let names = self.lab.tables.names;
        names
            .decls
            .iter()
            .find_map(|d| match &d.item.kind {
                ItemKind::Driver { wires, .. }
                    if d.item.span.file == at.file && (d.item.span.start..d.item.span.end).contains(&at.start) =>
                {
                    Some(wires.as_slice())
                }
                _ => None,
            })
            .unwrap_or_default()
    }
}
