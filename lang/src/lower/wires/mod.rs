//! Drivers: how the commands and readings of a device go over its line.
//!
//! A driver is written out for every device of the lab that it fits, and to check it by itself for a stand-in: what was
//! checked is what runs. A line maps a command of the device, or a primitive skill of whose parameters one, `self`, is the
//! device. What is sent is an expression of the command's arguments and the device's members.

mod forms;
mod framing;
mod hosted;
mod left;
mod lines;
mod message;
mod modbus;
mod offers;
mod pattern;
mod ranges;
mod served;
mod transport;

use matterix_ir::NodeId;
use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_ir::wire::{self, Driver};
use matterix_ir::{Diagnostic, Span, codes};

pub(crate) use self::forms::Speech;
use self::served::Arrangement;
use super::call::Bound;
use super::{Planner, script};
use crate::ast::{Expr, ItemKind, Sig, Wire, WireKind};
use crate::declare::tables::MemberRef;
use crate::eval::{Scope, Value};
use crate::names::{DeclId, verb_text};

/// What is asked of drivers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wires {
    /// Nothing: the program is simulated.
    #[default]
    Off,
    /// What the plan says to its devices.
    Called,
    /// Also what their devices may be told by others.
    Served,
    /// What all devices may be told by others, and what drivers say for it; the workflow is left out.
    Offered,
}

/// What a line of a driver maps.
#[derive(Clone, Copy)]
pub(super) enum Mapped<'a> {
    /// A command of the device.
    Command(MemberRef<'a>),
    /// A primitive skill; which of its parameters is the device.
    Skill(DeclId, &'a Sig, &'a str),
}

/// The name of the parameter that is the device.
const SELF: &str = "self";

impl<'a> Planner<'a, '_> {
    /// Drivers of all devices of the lab, without what the plan says to them.
    pub(super) fn begin_wires(&mut self) {
        if self.wires == Wires::Off {
            return;
        }
        let names = self.lab.tables.names;
        for index in 0..names.decls.len() as u32 {
            let id = DeclId(index);
            let ItemKind::Driver { device, transport, .. } = &names.decl(id).item.kind else { continue };
            if script::is_known(transport) {
                continue;
            }
            let Some(kind) = self.lab.kind_named(device, names.decl(id).module) else { continue };
            let under = self.under(transport, names.decl(id).module);
            for instance in self.lab.instances_of(kind).iter().copied() {
                if under.is_some_and(|under| self.host(under, instance).is_none()) {
                    continue;
                }
                if let Some(driver) = self.driver(id, instance) {
                    self.drivers.push((id, driver));
                }
            }
        }
    }

    /// How long a watchdog waits, s: longer than until it hears something again.
    fn patience(&mut self, of: &'a Expr, every: NodeId, scope: &mut Scope) -> Option<NodeId> {
        let node = self.duration_node(of, scope, "within")?;
        let (every, patience) = (self.lab.graph.constant(every), self.lab.graph.constant(node));
        if let (Some(every), Some(patience)) = (every, patience)
            && every >= patience
        {
            let headline = format!("the watchdog waits {patience} s, but a message comes only every {every} s");
            let d = Diagnostic::error(codes::TYPE_MISMATCH, of.span, headline, "the device would stop before");
            self.lab.report(d.help("repeat the command at least twice in that time: one reply may be lost"));
            return None;
        }
        Some(node)
    }

    /// Notes what is said for an operation.
    pub(super) fn call_wires(&mut self, step: StepId, of: &Sig, bound: &Bound, device: Option<InstanceId>) {
        if self.wires == Wires::Off || self.draft {
            return;
        }
        for at in 0..self.drivers.len() {
            let (id, instance) = (self.drivers[at].0, self.drivers[at].1.instance);
            let Some((line, sig)) = self.line_for(id, of, bound, device, instance) else { continue };
            let module = self.lab.tables.names.decl(id).module;
            let mut scope = Scope::of(instance, module);
            bind(sig, &bound.values, &mut scope);
            self.speech = Speech::of(&self.drivers[at].1.framing);
            if let Some(exchange) = self.exchange(line.0, line.1, &mut scope) {
                self.drivers[at].1.calls.push((step, exchange));
            }
        }
    }

    /// The line of a driver that says how an operation is told to an instance, with the call form it gives.
    #[allow(clippy::type_complexity)]
    fn line_for(
        &self,
        driver: DeclId,
        of: &Sig,
        bound: &Bound,
        device: Option<InstanceId>,
        instance: InstanceId,
    ) -> Option<((&'a crate::ast::Exchange, Span), &'a Sig)> {
        let ItemKind::Driver { wires, .. } = &self.lab.tables.names.decl(driver).item.kind else { return None };
        wires.iter().find_map(|w| {
            let WireKind::Command { sig, exchange } = &w.kind else { return None };
            if verb_text(&sig.verb) != verb_text(&of.verb) || !sig.has_form_of(of) {
                return None;
            }
            let is_it = match self_of(sig) {
                Some(at) => {
                    matches!(bound.values.get(at)?.1, Value::Instance(i) | Value::Qualified(i, _) if i == instance)
                }
                None => device == Some(instance),
            };
            is_it.then_some(((exchange, w.span), sig))
        })
    }

    /// A driver on an instance, which may be a stand-in; nothing where its line cannot be understood.
    pub fn driver(&mut self, id: DeclId, instance: InstanceId) -> Option<Driver> {
        let decl = self.lab.tables.names.decl(id);
        let ItemKind::Driver { name, transport, args, wires, .. } = &decl.item.kind else { return None };
        let module = decl.module;
        let under = self.under(transport, module);
        let line = match under {
            Some(under) => self.line_of(under, transport, args)?,
            None => self.transport(transport, args, name.span, module)?,
        };
        let host = under.and_then(|under| self.host(under, instance));
        let mut driver = Driver {
            name: name.text.clone(),
            instance,
            transport: line.transport,
            host,
            framing: line.framing,
            address: line.address,
            timeout: line.timeout,
            identity: Vec::new(),
            open: Vec::new(),
            close: Vec::new(),
            halt: Vec::new(),
            safe: Vec::new(),
            stays_on: false,
            play: Vec::new(),
            alive: Vec::new(),
            told: Vec::new(),
            ignores: Vec::new(),
            answers: Vec::new(),
            refusals: Vec::new(),
            calls: Vec::new(),
            served: Vec::new(),
            span: name.span,
        };
        self.repeated(wires);
        self.speech = Speech::of(&driver.framing);
        // What stands where a message has no word for it is not on this line.
        let lenient = std::mem::replace(&mut self.lenient, driver.host.is_some());
        let mut opens = 0;
        for w in wires {
            let applies = self.applies(w, instance, module);
            opens += usize::from(applies && matches!(&w.kind, WireKind::Fixed { when, .. } if when.text == "open"));
            if applies {
                self.line(w, instance, module, &mut driver);
            }
        }
        self.lenient = lenient;
        if driver.host.is_some() && driver.open.len() < opens {
            return None;
        }
        for w in under.map_or(&[][..], |u| u.wires) {
            if let WireKind::Reply { .. } = &w.kind {
                self.line(w, instance, module, &mut driver);
            }
        }
        driver.stays_on = self.stays_on(wires, instance, under);
        self.check_safe(&driver, wires);
        self.check_messages(&driver, wires, under);
        Some(driver)
    }

    /// Whether a line that is said of some devices only is said of this one; what is decided later is reported.
    fn applies(&mut self, w: &'a Wire, instance: InstanceId, module: usize) -> bool {
        let WireKind::Fixed { condition: Some(condition), .. } = &w.kind else { return true };
        let Some(node) = self.lab.truth(condition, &mut Scope::of(instance, module)) else { return false };
        match self.lab.known(node) {
            Some(holds) => holds != 0.0 || self.lab.prototype,
            None if self.lab.prototype => true,
            None => {
                let headline = "messages outside of commands cannot depend on the run";
                self.wrong(condition.span, headline, "changes during a run", "use only values given in the lab");
                false
            }
        }
    }

    fn line(&mut self, w: &'a Wire, instance: InstanceId, module: usize, driver: &mut Driver) {
        let mut scope = Scope::of(instance, module);
        match &w.kind {
            WireKind::Error => {}
            WireKind::Fixed { when, exchange, .. } => {
                let Some(exchange) = self.exchange(exchange, w.span, &mut scope) else { return };
                match when.text.as_str() {
                    "identity" => driver.identity.extend(self.identity(exchange, &driver.framing)),
                    "open" => driver.open.push(exchange),
                    "close" => driver.close.push(exchange),
                    "halt" => driver.halt.push(exchange),
                    "play" => driver.play.push(exchange),
                    _ => driver.safe.push(exchange),
                }
            }
            WireKind::Reply { text, fails } => {
                let pattern = crate::ast::Pattern { text: text.clone(), span: w.span };
                if let Some((reply, _)) = self.pattern(&pattern) {
                    driver.refusals.push(wire::Refusal { reply, failure: fails.text.clone() });
                }
            }
            WireKind::Answers { asked, with } => {
                let (asked, with) = (self.pattern(asked), self.answer_text(with, &mut scope));
                driver.answers.extend(asked.zip(with).map(|((asked, _), with)| (asked, with)));
            }
            WireKind::Reading { path, condition, asks, expects } => {
                let told = self.told(path, asks, expects, w.span, &mut scope);
                let condition = condition.as_ref().map(|c| self.lab.truth(c, &mut scope));
                if let (Some(told), true) = (told, condition != Some(None)) {
                    add_told(driver, wire::Told { condition: condition.flatten(), ..told });
                }
            }
            WireKind::Hears { path, condition, text, every } => {
                if matches!(driver.framing, wire::Framing::Json | wire::Framing::Calls) || driver.host.is_some() {
                    let help = "query it: `reading ... asks ... expects ...`";
                    self.wrong(
                        w.span,
                        "only a device with its own line can send messages by itself",
                        "never received",
                        help,
                    );
                    return;
                }
                let told = self.heard(path, text, every, w.span, &mut scope);
                let condition = condition.as_ref().map(|c| self.lab.truth(c, &mut scope));
                if let (Some(told), true) = (told, condition != Some(None)) {
                    driver.told.push(wire::Told { condition: condition.flatten(), ..told });
                }
            }
            WireKind::Ignores { text } => driver.ignores.extend(self.pattern(text).map(|(pattern, _)| pattern)),
            WireKind::Alive { condition, every, within, by, otherwise } => {
                let Some(node) = self.lab.truth(condition, &mut scope) else { return };
                let Some(every) = self.duration_node(every, &mut scope, "every") else { return };
                let within = match within.as_ref().map(|of| self.patience(of, every, &mut scope)) {
                    Some(None) => return,
                    patience => patience.flatten(),
                };
                let Some(repeated) = self.by_name(by, instance, module) else { return };
                let at_end = if otherwise.is_empty() { None } else { self.by_name(otherwise, instance, module) };
                driver.alive.push(wire::Alive { condition: node, every, within, repeated, at_end });
            }
            WireKind::Command { sig, exchange } => {
                let Some(mapped) = self.mapped(sig, instance, module) else { return };
                if self.lab.prototype || self.wires == Wires::Served {
                    let host = driver.host.as_ref().map(|h| h.instance);
                    driver.served.extend(self.served(mapped, (sig, exchange, w.span), instance, module, host));
                }
            }
        }
    }

    /// What a line maps; what is wrong with its form is reported on stand-ins only.
    fn mapped(&mut self, sig: &'a Sig, instance: InstanceId, module: usize) -> Option<Mapped<'a>> {
        let verb = verb_text(&sig.verb);
        if let Some(at) = self_of(sig) {
            let names = self.lab.tables.names;
            let skill = names.lookup(module, &verb).and_then(|id| match &names.decl(id).item.kind {
                ItemKind::Skill { sig: of, external: true, .. } if sig.has_form_of(of) => Some((id, of)),
                _ => None,
            });
            let found = skill.and_then(|(id, of)| Some(Mapped::Skill(id, of, &of.all_params().nth(at)?.name.text)));
            if found.is_none() {
                self.not_mapped(sig, "primitive skill", &[]);
            }
            return found;
        }
        let own = self.lab.commands_of(instance, &verb);
        let found = own.iter().find(|m| command_sig(m).is_some_and(|of| sig.has_form_of(of)));
        if found.is_none() {
            let forms: Vec<String> = own.iter().filter_map(|m| command_sig(m)).map(|of| self.form(of)).collect();
            self.not_mapped(sig, "command of the device", &forms);
        }
        found.copied().map(Mapped::Command)
    }

    fn not_mapped(&mut self, sig: &Sig, what: &str, forms: &[String]) {
        let headline = format!("no {what} has the signature `{}`", self.form(sig));
        let mut d = Diagnostic::error(codes::DRIVER_LINE, sig.span, headline, "no step ever sends this");
        for form in forms {
            d = d.help(format!("its signature is `{form}`"));
        }
        self.lab.report(d);
    }

    /// A line for what has one already.
    fn repeated(&mut self, wires: &'a [Wire]) {
        let key = |w: &Wire| match &w.kind {
            WireKind::Command { sig, .. } => Some(self.form(sig)),
            WireKind::Reading { path, asks, expects, .. } => {
                // What asks the same and is answered otherwise is another form of the answer.
                let first = wires.iter().find_map(|w| match &w.kind {
                    WireKind::Reading { path: of, asks, .. } if words(of) == words(path) => Some(asks),
                    _ => None,
                });
                let form = if first.is_some_and(|first| first.parts == asks.parts) {
                    format!(" {}", expects.text)
                } else {
                    String::new()
                };
                Some(format!("reading {}{form}", words(path)))
            }
            WireKind::Hears { path, .. } => Some(format!("reading {}", words(path))),
            WireKind::Ignores { text } => Some(format!("ignores {}", text.text)),
            WireKind::Reply { text, .. } => Some(format!("reply {text}")),
            _ => None,
        };
        let keys: Vec<Option<String>> = wires.iter().map(key).collect();
        for (i, key) in keys.iter().enumerate().filter_map(|(i, k)| Some((i, k.as_ref()?))) {
            if let Some(first) = keys[..i].iter().position(|k| k.as_ref() == Some(key)) {
                let headline = "the driver has two lines for this";
                let d = Diagnostic::error(codes::DRIVER_LINE, wires[i].span, headline, "the second line");
                self.lab.report(d.because(wires[first].span, "the first line"));
            }
        }
    }
}

/// A line for a reading; one that asks what another one asks is one more form of the answer to that.
fn add_told(driver: &mut Driver, told: wire::Told) {
    let same =
        driver.told.iter_mut().find(|t| t.heard.is_none() && t.name == told.name && t.asks.pieces == told.asks.pieces);
    match same {
        Some(first) => {
            let wire::Told { expects, shows, condition, .. } = told;
            first.also.push(wire::Alternative { expects, shows, condition });
        }
        None => driver.told.push(told),
    }
}

fn words(path: &crate::ast::Path) -> String {
    path.segments.iter().map(|s| s.text.as_str()).collect::<Vec<_>>().join(".")
}

fn command_sig<'a>(m: &MemberRef<'a>) -> Option<&'a Sig> {
    match &m.member.kind {
        crate::ast::MemberKind::Command { sig, .. } => Some(sig),
        _ => None,
    }
}

/// Which parameter is the device.
fn self_of(sig: &Sig) -> Option<usize> {
    sig.all_params().position(|p| p.name.text == SELF)
}

/// The parameters of a driver's line stand for the values of the command's, in their order; options have their names.
fn bind(sig: &Sig, values: &[(String, Value)], scope: &mut Scope) {
    for (name, value) in values.iter().skip(sig.all_params().count()) {
        scope.bind(name.clone(), value.clone());
    }
    for (p, (_, value)) in sig.all_params().zip(values) {
        if p.name.text != SELF {
            scope.bind(p.name.text.clone(), value.clone());
        }
    }
}
