//! Events: over what they are written out, what sets them off, and those that happen later than they are set off.
//!
//! A later event is three things that the rest of the program knows: an event that notes when it is due, a state that holds this, and an
//! event at that moment. So checks, the dry run and devices need nothing of their own for it.

use matterix_ir::model::{Action, Domain, Event, State};
use matterix_ir::plan::{Condition, Limit, Refusal};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, UnaryOp, Unit, codes};

use super::laws::has_calls;
use crate::ast::{self, Delay, ItemKind, MemberKind};
use crate::declare::Type;
use crate::declare::failures::PENDING;
use crate::eval::lab::Elaborator;
use crate::eval::{Scope, Value};

/// What happens by itself, and what must hold for that.
#[derive(Default)]
pub struct Happenings {
    /// In the order in which they fire within an instant.
    pub events: Vec<Event>,
    /// What must hold all the time.
    pub limits: Vec<Limit>,
}

impl<'a> Elaborator<'a> {
    /// Writes out every event, in the order of the text.
    pub fn events(&mut self) -> Happenings {
        let mut found: Vec<(&'a ast::Event, Scope, String)> = Vec::new();
        for i in 0..self.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.all_members(id).iter().copied() {
                if let MemberKind::Event(e) = &m.member.kind
                    && (!self.draft || has_calls(&e.laws))
                {
                    let name = format!("{}({})", e.name.text, self.instances[i as usize].name);
                    found.push((e, Scope::of_member(id, m), name));
                }
            }
        }
        for index in 0..self.tables.names.decls.len() {
            let decl = self.tables.names.decls[index];
            if let ItemKind::Event(e) = &decl.item.kind
                && (!self.draft || has_calls(&e.laws))
            {
                let mut tuples = self.tuples(&e.params, decl.module, Some(&e.when), &e.name);
                while let Some((scope, name)) = tuples.next(self) {
                    found.push((e, scope, name));
                }
            }
        }
        let mut out = Happenings::default();
        let mut noting = Vec::new();
        for (e, mut scope, name) in found {
            if self.enter(e.name.span) {
                self.event(e, &mut scope, name, (&mut noting, &mut out));
            }
            self.leave();
        }
        // A condition that another event of the same instant makes false was true all the same.
        noting.append(&mut out.events);
        Happenings { events: noting, ..out }
    }

    /// Writes out one event, unless it never happens or does nothing.
    fn event(
        &mut self,
        e: &'a ast::Event,
        scope: &mut Scope,
        name: String,
        (noting, out): (&mut Vec<Event>, &mut Happenings),
    ) -> Option<()> {
        let when = self.truth(&e.when, scope)?;
        if self.never(when) {
            return None;
        }
        let delay = match &e.delay {
            Some(delay) => Some((delay, self.delay(delay, scope)?)),
            None => None,
        };
        let actions = self.event_actions(&e.laws, scope, (&name, e.name.span));
        if actions.is_empty() {
            return None;
        }
        let event = Event { name, when, actions, span: e.name.span };
        match delay {
            Some((delay, time)) if !self.draft => noting.push(self.delayed(event, (delay, time), owner(scope), out)),
            _ => out.events.push(event),
        }
        Some(())
    }

    /// Checks an event by itself; its parameters are bound in the scope.
    pub fn check_event(&mut self, e: &'a ast::Event, scope: &mut Scope) {
        self.truth(&e.when, scope);
        if let Some(delay) = &e.delay {
            self.delay(delay, scope);
        }
        self.event_actions(&e.laws, scope, (&e.name.text, e.name.span));
    }

    /// How much later an event happens, s; a time below 0 is reported.
    fn delay(&mut self, delay: &'a Delay, scope: &mut Scope) -> Option<NodeId> {
        let ty = Type::Quantity { dimension: self.duration(), point: false, optional: false };
        let Value::Num(time) = self.typed(&delay.time, &ty, scope, "the delay") else { return None };
        if self.graph.constant(time.node).is_some_and(|v| v < 0.0) {
            let headline = "an event cannot happen before its condition is true";
            self.report(Diagnostic::error(codes::OUT_OF_RANGE, delay.time.span, headline, "below 0 s"));
            return None;
        }
        Some(time.node)
    }

    /// An event that happens so much later than it is set off; what notes that it is to happen.
    fn delayed(
        &mut self,
        event: Event,
        (delay, time): (&Delay, NodeId),
        owner: InstanceId,
        out: &mut Happenings,
    ) -> Event {
        let Event { name, when, actions, span } = event;
        let (yes, no, now) = (self.graph.number(1.0), self.graph.number(0.0), self.graph.add(Op::Time));
        let pending = self.noted(owner, format!("{name}.pending"), Domain::Bool, span);
        let moment = self.noted(owner, format!("{name}.due"), Domain::Quantity(Unit::scaled("s", 1.0)), span);
        let (is_pending, due) = (self.graph.add(Op::State(pending)), self.graph.add(Op::State(moment)));
        let later = self.graph.binary(BinaryOp::Add, now, time);
        let set = |state, value| Action::Assign { state, value, span };

        let mut noting = vec![set(moment, later), set(pending, yes)];
        if !delay.sustained {
            let again = self.noted(owner, format!("{name}.again"), Domain::Bool, span);
            noting.insert(0, set(again, is_pending));
            let once = self.graph.add(Op::State(again));
            let once = self.graph.unary(UnaryOp::Not, once);
            let text = format!("{name} must happen before it is triggered again");
            let help =
                "it was triggered again before it happened: make its condition true less often, or its delay shorter";
            out.limits.push(limit(owner, (once, span), (PENDING, text, help)));
        }
        if self.graph.constant(time).is_none() {
            // What the delay is before it is taken does not matter.
            let early = self.noted(owner, format!("{name}.early"), Domain::Bool, span);
            let below = self.graph.binary(BinaryOp::Lt, time, no);
            noting.push(set(early, below));
            let was_below = self.graph.add(Op::State(early));
            let fits = self.graph.unary(UnaryOp::Not, was_below);
            let text = format!("the delay of {name} must be at least 0 s");
            let help = "an event cannot happen before its condition is true";
            out.limits.push(limit(owner, (fits, delay.time.span), ("out_of_range", text, help)));
        }
        let set_off = Event { name: format!("{name}.set_off"), when, actions: noting, span };

        let is_due = self.graph.binary(BinaryOp::Le, due, now);
        // A condition that ends at that very moment has held long enough.
        let happens = self.graph.binary(BinaryOp::And, is_pending, is_due);
        let mut all = vec![set(pending, no)];
        all.extend(actions);
        out.events.push(Event { name: name.clone(), when: happens, actions: all, span });
        if delay.sustained {
            let ceased = self.graph.unary(UnaryOp::Not, when);
            let in_time = self.graph.binary(BinaryOp::And, is_pending, ceased);
            let actions = vec![set(pending, no)];
            out.events.push(Event { name: format!("{name}.called_off"), when: in_time, actions, span });
        }
        set_off
    }

    /// A state that an event keeps for itself; 0 at the start.
    fn noted(&mut self, owner: InstanceId, name: String, domain: Domain, span: Span) -> u32 {
        let initial = self.graph.number(0.0);
        self.add_state(owner, State { name, domain, initial, scale: Some(1.0), span })
    }
}

/// The thing that an event is about, the first of several.
pub(super) fn owner(scope: &Scope) -> InstanceId {
    let bound = scope.vars.iter().find_map(|(_, v)| if let Value::Instance(i) = v { Some(*i) } else { None });
    scope.this.or(bound).unwrap_or(InstanceId(0))
}

/// What must hold for a delayed event about `owner`; `words` are the failure where it does not, what it asks for, and how to mend it.
fn limit(owner: InstanceId, (node, span): (NodeId, Span), words: (&str, String, &str)) -> Limit {
    let (failure, text, help) = words;
    let refusal = Refusal { failure: failure.to_string(), help: Some(help.to_string()), said: Vec::new() };
    let (compared, terms, each) = (Vec::new(), Vec::new(), Vec::new());
    Limit { instance: owner, condition: Condition { node, text, span, compared, terms, refusal: Some(refusal), each } }
}
