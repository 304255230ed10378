//! Drivers for files that other programs run: what stands there for a command, as texts with values.

use std::collections::BTreeSet;

use matterix_ir::plan::{Condition, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::script::{Message, Wired, Wiring};
use matterix_ir::{Diagnostic, NodeId, Op, Span, TextPart, codes};

use super::Planner;
use super::call::Bound;
use crate::ast::{
    Arg, ClauseKind, Exchange, Expr, ExprKind, ItemKind, MemberKind, Name, Path, Sig, Text, Wire, WireKind,
};
use crate::declare::tables::MemberRef;
use crate::eval::{Scope, Value};
use crate::names::{DeclId, verb_text};

/// Kinds of files that a driver may be for.
const KNOWN: &[&str] = &["opentrons", "urscript"];

/// When a file begins.
const OPEN: &str = "open";

/// Whether a driver over this is for files.
pub fn is_known(transport: &Name) -> bool {
    KNOWN.contains(&transport.text.as_str())
}

/// A driver as it is declared.
#[derive(Clone, Copy)]
struct Driver<'a> {
    name: &'a Name,
    device: &'a Path,
    transport: &'a Name,
    settings: &'a [Arg],
    wires: &'a [Wire],
    module: usize,
}

/// What is said before anything else.
fn opening(wire: &Wire) -> Option<(&Exchange, Option<&Expr>)> {
    match &wire.kind {
        WireKind::Fixed { when, exchange, condition } if when.text == OPEN => Some((exchange, condition.as_ref())),
        _ => None,
    }
}

/// Whether a line of a driver is about a command: the same words, labels and numbers of parameters.
fn fits(line: &Sig, command: &Sig) -> bool {
    verb_text(&line.verb) == verb_text(&command.verb) && line.has_form_of(command)
}

impl<'a> Planner<'a, '_> {
    fn script(&self, id: DeclId) -> Option<Driver<'a>> {
        let decl = self.lab.tables.names.decl(id);
        match &decl.item.kind {
            ItemKind::Driver { name, device, transport, args: settings, wires } => {
                Some(Driver { name, device, transport, settings, wires, module: decl.module })
            }
            _ => None,
        }
    }

    /// The drivers of an instance over a wire: those of its own type go before those of what that extends, and of two for
    /// the same type the later one, so that one of the user goes before one of the library.
    fn drivers_of(&self, device: InstanceId, transport: &str) -> Vec<Driver<'a>> {
        let names = self.lab.tables.names;
        let of = |d: Driver<'a>| Some((names.lookup(d.module, &d.device.segments.last()?.text)?, d));
        let all = (0..names.decls.len() as u32).rev().filter_map(|i| self.script(DeclId(i)));
        let all: Vec<_> = all.filter(|d| d.transport.text == transport).filter_map(of).collect();
        let kinds = self.lab.ancestors_of(device);
        kinds.iter().flat_map(|kind| all.iter().filter(move |(of, _)| of == kind)).map(|(_, d)| *d).collect()
    }

    /// Notes what a device is told when a command begins.
    pub(super) fn say(&mut self, device: InstanceId, command: &Sig, bound: &Bound, step: StepId) {
        let Some(transport) = self.wiring.as_ref().map(|w| w.transport.clone()).filter(|_| !self.draft) else { return };
        let drivers = self.drivers_of(device, &transport);
        let lines = drivers.iter().flat_map(|d| d.wires.iter().map(move |wire| (d, wire)));
        let line = lines.into_iter().find_map(|(driver, wire)| match &wire.kind {
            WireKind::Command { sig, exchange } if fits(sig, command) => Some((driver, sig, &exchange.sends)),
            _ => None,
        });
        let Some((driver, sig, sends)) = line else { return };
        let mut scope = Scope::of(device, driver.module);
        for (name, value) in &bound.values {
            scope.bind(name.clone(), value.clone());
        }
        for (own, (_, value)) in sig.all_params().zip(&bound.values) {
            scope.bind(own.name.text.clone(), value.clone());
        }
        let step = self.carried_out(step);
        let messages = self.messages(sends, &mut scope);
        if let Some(wiring) = &mut self.wiring {
            wiring.steps.insert(step, messages);
        }
    }

    /// The operation itself, without what watches over it.
    fn carried_out(&self, step: StepId) -> StepId {
        match &self.steps[step.0 as usize].step {
            Step::During { body, .. } => *body,
            _ => step,
        }
    }

    /// The waits of devices' own that a file says in place of a wait for a condition: commands without arguments that last until something holds, such as
    /// `settle MODULE`, if the condition depends on nothing else that changes than theirs do.
    pub(super) fn own_waits(&mut self, condition: &Condition, span: Span) -> Vec<StepId> {
        let Some(transport) = self.wiring.as_ref().map(|w| w.transport.clone()).filter(|_| !self.draft) else {
            return Vec::new();
        };
        let mut open = self.states_of(condition.node);
        let mut found = Vec::new();
        for id in (0..self.lab.instances.len() as u32).map(InstanceId) {
            if open.is_empty() {
                break;
            }
            for m in self.lab.all_members(id).iter().copied() {
                let MemberKind::Command { sig, clauses } = &m.member.kind else { continue };
                let lasts = clauses.iter().find_map(|clause| match &clause.kind {
                    ClauseKind::Until(e) => Some(e),
                    _ => None,
                });
                let Some(lasts) = lasts.filter(|_| sig.all_params().next().is_none()) else { continue };
                let mut scope = Scope::of_member(id, m);
                let Some(until) = self.lab.truth(lasts, &mut scope) else { continue };
                let covered = self.states_of(until);
                if !open.iter().any(|state| covered.contains(state)) || !self.has_line(id, sig, &transport) {
                    continue;
                }
                found.push((id, m));
                open.retain(|state| !covered.contains(state));
                break;
            }
        }
        if !open.is_empty() {
            return Vec::new();
        }
        found.into_iter().filter_map(|(id, m)| self.own_wait(id, m, span)).collect()
    }

    /// Whether a driver of a device over a wire has a line for a command.
    fn has_line(&self, device: InstanceId, command: &Sig, transport: &str) -> bool {
        let drivers = self.drivers_of(device, transport);
        let is_line = |wire: &Wire| matches!(&wire.kind, WireKind::Command { sig, .. } if fits(sig, command));
        drivers.iter().flat_map(|d| d.wires).any(is_line)
    }

    /// A command of a device that has no arguments, as a step.
    fn own_wait(&mut self, id: InstanceId, m: MemberRef<'a>, span: Span) -> Option<StepId> {
        let MemberKind::Command { sig, clauses } = &m.member.kind else { return None };
        let bound = Bound { values: Vec::new() };
        let (mut operation, _) = self.operation(sig, clauses, &bound, &mut Scope::of_member(id, m))?;
        operation.device = Some(id);
        operation.claims.insert(0, id);
        let label = format!("{} {}", verb_text(&sig.verb), self.lab.instances[id.0 as usize].name);
        let needs = operation.needs.clone();
        let mut step = self.add(label.clone(), span, Step::Operation(Box::new(operation)));
        self.say(id, sig, &bound, step);
        self.note_call(sig, &bound, Some((id, true)), step);
        // A device that was switched off waits for nothing.
        for need in needs {
            let condition = Condition::clone(&need);
            step = self.add(label.clone(), span, Step::If { condition, then: step, otherwise: None });
        }
        Some(step)
    }

    /// The states that a value depends on; none where it depends on anything else that changes.
    fn states_of(&self, node: NodeId) -> BTreeSet<u32> {
        let (mut states, mut other) = (BTreeSet::new(), false);
        self.lab.graph.visit(node, |op| match op {
            Op::State(state) => drop(states.insert(state)),
            Op::Time | Op::Reading(_) | Op::Local(_) => other = true,
            _ => {}
        });
        if other { BTreeSet::new() } else { states }
    }

    /// Notes an operation as it is called, with its values in place of the arguments.
    pub(super) fn note_call(&mut self, sig: &Sig, bound: &Bound, device: Option<(InstanceId, bool)>, step: StepId) {
        if self.draft || self.wiring.is_none() {
            return;
        }
        let mut parts = vec![TextPart::Plain(verb_text(&sig.verb))];
        let name = device.map(|(id, object)| (self.lab.instances[id.0 as usize].name.clone(), object));
        if let Some((name, true)) = &name {
            parts.push(TextPart::Plain(format!(" {name}")));
        }
        let label = |text: &str, parts: &mut Vec<TextPart>| parts.push(TextPart::Plain(format!(" {text}")));
        let groups =
            std::iter::once((None, &sig.params)).chain(sig.labelled.iter().map(|(l, params)| (Some(l), params)));
        for (word, params) in groups {
            for (i, p) in params.iter().enumerate() {
                let value = match bound.values.iter().find(|(n, _)| *n == p.name.text) {
                    Some((_, Value::Nothing)) | None => continue,
                    // Of one there is no list.
                    Some((_, Value::List(items))) if items.len() == 1 => items[0].clone(),
                    Some((_, value)) => value.clone(),
                };
                match word {
                    Some(word) if i == 0 => label(&word.text, &mut parts),
                    _ if i > 0 => parts.push(TextPart::Plain(",".to_string())),
                    _ => {}
                }
                parts.push(TextPart::Plain(" ".to_string()));
                if !self.lab.showable(value, sig.span, &mut parts) {
                    return;
                }
            }
        }
        if let Some((name, false)) = &name {
            label(&format!("by {name}"), &mut parts);
        }
        let step = self.carried_out(step);
        if let Some(wiring) = &mut self.wiring {
            wiring.calls.insert(step, matterix_ir::Text { parts });
        }
    }

    fn messages(&mut self, sends: &'a [Text], scope: &mut Scope) -> Vec<Message> {
        let message = |text, span| Message { text, span, condition: None };
        sends.iter().filter_map(|text| Some(message(self.lab.filled(text, scope)?, text.span))).collect()
    }

    /// The wiring with all devices, where it is asked for.
    pub(super) fn wired(&mut self) -> Option<Wiring> {
        let transport = self.wiring.as_ref()?.transport.clone();
        let mut devices = Vec::new();
        let count = if self.draft { 0 } else { self.lab.instances.len() as u32 };
        for id in (0..count).map(InstanceId) {
            let drivers = self.drivers_of(id, &transport);
            let Some(driver) = drivers.first() else { continue };
            let has_open = |d: &&Driver<'a>| d.wires.iter().any(|w| opening(w).is_some());
            let mut said = Vec::new();
            if let Some(first) = drivers.iter().find(has_open) {
                let mut scope = Scope::of(id, first.module);
                for wire in first.wires {
                    let Some((exchange, condition)) = opening(wire) else { continue };
                    let condition = match condition.map(|c| self.lab.truth(c, &mut scope)) {
                        Some(None) => continue,
                        known => known.flatten(),
                    };
                    let messages = self.messages(&exchange.sends, &mut scope).into_iter();
                    said.extend(messages.map(|m| Message { condition, ..m }));
                }
            }
            let mut settings: Vec<(String, String)> = Vec::new();
            for d in &drivers {
                let mut scope = Scope::of(id, d.module);
                for setting in d.settings.iter().filter_map(|s| self.setting(s, &mut scope)) {
                    if !settings.iter().any(|(name, _)| *name == setting.0) {
                        settings.push(setting);
                    }
                }
            }
            devices.push(Wired {
                device: id,
                driver: driver.name.text.clone(),
                settings,
                opens: said,
                span: driver.name.span,
            });
        }
        let mut wiring = self.wiring.take()?;
        wiring.devices = devices;
        Some(wiring)
    }

    /// What a driver says of its wire, as text.
    fn setting(&mut self, arg: &'a Arg, scope: &mut Scope) -> Option<(String, String)> {
        let name = arg.name.as_ref()?.text.clone();
        let text = match &*arg.value.kind {
            ExprKind::Name(word) => word.text.clone(),
            _ => match self.lab.expr(&arg.value, scope) {
                Value::Text(text) => text,
                _ => self.text(arg.value.span),
            },
        };
        Some((name, text))
    }

    /// Checks a driver by itself, on a stand-in for its device.
    pub fn check_script(&mut self, id: DeclId) {
        let Some(driver) = self.script(id) else { return };
        let Some(kind) = self.lab.kind_named(driver.device, driver.module) else { return };
        let device = self.lab.prototype_of(vec![kind], self.lab.tables.kind_name(kind));
        let commands = self.lab.all_members(device);
        for wire in driver.wires {
            match &wire.kind {
                WireKind::Command { sig, exchange } => {
                    self.only_sends(driver.transport, wire, exchange);
                    let command = commands.iter().find_map(|m| match &m.member.kind {
                        MemberKind::Command { sig: own, clauses } if fits(sig, own) => Some((m, own, clauses)),
                        _ => None,
                    });
                    let Some((member, own, clauses)) = command else {
                        self.no_command(sig, driver.device);
                        continue;
                    };
                    let mut scope = Scope::of(device, driver.module);
                    let bound = self.stand_ins(own, clauses, member.module, &mut scope);
                    for (name, (_, value)) in sig.all_params().zip(&bound.values) {
                        scope.bind(name.name.text.clone(), value.clone());
                    }
                    self.messages(&exchange.sends, &mut scope);
                }
                WireKind::Fixed { when, exchange, condition } if when.text == OPEN => {
                    self.only_sends(driver.transport, wire, exchange);
                    let mut scope = Scope::of(device, driver.module);
                    if let Some(condition) = condition {
                        self.lab.truth(condition, &mut scope);
                    }
                    self.messages(&exchange.sends, &mut scope);
                }
                WireKind::Fixed { when, .. } => {
                    let what = format!("lines for `{}`", when.text);
                    self.not_said(driver.transport, wire.span, &what);
                }
                WireKind::Alive { .. } => self.not_said(driver.transport, wire.span, "repeated lines"),
                WireKind::Reading { .. } | WireKind::Hears { .. } => {
                    self.not_said(driver.transport, wire.span, "readings")
                }
                WireKind::Reply { .. } | WireKind::Answers { .. } | WireKind::Ignores { .. } => {
                    self.not_said(driver.transport, wire.span, "replies");
                }
                WireKind::Error => {}
            }
        }
    }

    /// A file hears nothing.
    fn only_sends(&mut self, transport: &Name, wire: &Wire, exchange: &Exchange) {
        if exchange.expects.is_some() || exchange.until.is_some() {
            self.not_said(transport, wire.span, "replies");
        }
    }

    fn not_said(&mut self, transport: &Name, span: Span, what: &str) {
        let headline = format!("`{}` is written to a file, and a file has no {what}", transport.text);
        self.lab.report(Diagnostic::error(codes::MISPLACED, span, headline, "remove this"));
    }

    fn no_command(&mut self, sig: &Sig, device: &Path) {
        let kind = device.segments.last().map_or("", |n| n.text.as_str());
        let headline = format!("`{kind}` has no command of the form `{}`", self.form(sig));
        let d = Diagnostic::about(kind, codes::UNKNOWN_VERB, sig.span, headline, "not one of its commands");
        self.lab.report(d.help("use the verb, labels and number of parameters of the command"));
    }
}
