//! What an event does, statement by statement: each sees what those before it have left.
//!
//! A `let`, and the condition of an `if`, is what it was at its place, whatever is assigned later. Where a later statement
//! changes what such a value rests on, a state of its own keeps it.

use std::collections::BTreeSet;

use matterix_ir::model::{Action, Domain, Kept, State, Stays};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Leaves, NodeId, Op, Span, codes};

use super::laws::Lines;
use crate::ast::{AssignOp, Law, LawKind};
use crate::eval::lab::Elaborator;
use crate::eval::{Num, Scope, Value};

/// The lines of an event.
struct Instant<'n> {
    actions: Vec<Action>,
    /// Values taken so far, in their order.
    taken: Vec<Taken>,
    /// Conditions that are open, by their number.
    open: Vec<usize>,
    /// Values that a state keeps, by their number.
    kept: BTreeSet<usize>,
    /// Name and place of the event.
    of: (&'n str, Span),
    /// The first thing it is about.
    owner: InstanceId,
}

/// A value that a statement takes.
struct Taken {
    nodes: Vec<NodeId>,
    /// The actions during which it is used: all from the first to before the second; to the end where there is none.
    from: usize,
    to: Option<usize>,
}

impl<'a> Lines<'a> for Instant<'_> {
    fn line(&mut self, lab: &mut Elaborator<'a>, law: &'a Law, guard: Option<NodeId>, scope: &mut Scope) {
        match &law.kind {
            LawKind::Assign { op: AssignOp::Set, target, value } => {
                self.actions.extend(lab.assignment(target, value, guard, scope));
            }
            LawKind::Assign { .. } => lab.report(
                Diagnostic::error(
                    codes::INVALID_LAW,
                    law.span,
                    "an event is instantaneous: it assigns a value and has no rate",
                    "not an assignment",
                )
                .help("write `x = x + ...`"),
            ),
            LawKind::Call(call) => {
                for action in lab.call_actions(call, law.span, scope) {
                    self.actions.push(lab.guarded_action(action, guard));
                }
            }
            _ => {}
        }
    }

    fn value(&mut self, lab: &mut Elaborator<'a>, value: Value) -> Value {
        let number = self.taken.len();
        let mut nodes = Vec::new();
        nodes_of(&value, &mut nodes);
        nodes.retain(|n| lab.graph.leaves(*n).meets(Leaves::STATE));
        let value = if self.kept.contains(&number) { self.keep(lab, value) } else { value };
        self.taken.push(Taken { nodes, from: self.actions.len(), to: None });
        value
    }

    fn open(&mut self, lab: &mut Elaborator<'a>, condition: NodeId) -> NodeId {
        self.open.push(self.taken.len());
        match self.value(lab, Value::Bool(condition)) {
            Value::Bool(kept) => kept,
            _ => condition,
        }
    }

    fn close(&mut self) {
        if let Some(number) = self.open.pop() {
            self.taken[number].to = Some(self.actions.len());
        }
    }
}

impl Instant<'_> {
    /// The value as states keep it from here on.
    fn keep(&mut self, lab: &mut Elaborator<'_>, value: Value) -> Value {
        match value {
            Value::Num(n) => {
                let domain = Domain::Quantity(lab.unit_of(&n));
                Value::Num(Num { node: self.kept_node(lab, n.node, domain), ..n })
            }
            Value::Bool(n) => Value::Bool(self.kept_node(lab, n, Domain::Bool)),
            Value::Enum(n, words) => Value::Enum(self.kept_node(lab, n, Domain::Enum(words.to_vec())), words),
            Value::InstanceNode(n) => Value::InstanceNode(self.kept_node(lab, n, Domain::Instance)),
            Value::Tuple(items) => Value::Tuple(items.into_iter().map(|v| self.keep(lab, v)).collect()),
            Value::List(items) => Value::List(items.into_iter().map(|v| self.keep(lab, v)).collect()),
            Value::Range(a, b) => match (self.keep(lab, Value::Num(*a)), self.keep(lab, Value::Num(*b))) {
                (Value::Num(a), Value::Num(b)) => Value::Range(Box::new(a), Box::new(b)),
                _ => Value::Error,
            },
            other => other,
        }
    }

    fn kept_node(&mut self, lab: &mut Elaborator<'_>, node: NodeId, domain: Domain) -> NodeId {
        if !lab.graph.leaves(node).meets(Leaves::STATE) {
            return node;
        }
        let name = format!("{}.kept[{}]", self.of.0, self.actions.len());
        let initial = lab.graph.number(if domain == Domain::Instance { -1.0 } else { 0.0 });
        let state = lab.add_state(self.owner, State { name, domain, initial, scale: Some(1.0), span: self.of.1 });
        lab.note_target(state, node);
        self.actions.push(Action::Assign { state, value: node, span: self.of.1 });
        lab.graph.add(Op::State(state))
    }

    /// The numbers of the values that a later action changes while they are still used.
    fn overtaken(&self, lab: &Elaborator<'_>) -> BTreeSet<usize> {
        if self.taken.iter().all(|t| t.nodes.is_empty()) {
            return BTreeSet::new();
        }
        let changed: Vec<BTreeSet<u32>> = self.actions.iter().map(|a| lab.changed_by(a)).collect();
        let mut out = BTreeSet::new();
        for (number, taken) in self.taken.iter().enumerate() {
            let end = taken.to.unwrap_or(changed.len()).saturating_sub(1);
            let later: BTreeSet<u32> = changed.get(taken.from..end).into_iter().flatten().flatten().copied().collect();
            if later.is_empty() {
                continue;
            }
            let rests_on = |n: &NodeId| matches!(lab.graph.op(*n), Op::State(s) if later.contains(&s));
            if lab.graph.schedule(taken.nodes.iter().copied()).iter().any(rests_on) {
                out.insert(number);
            }
        }
        out
    }
}

fn nodes_of(value: &Value, out: &mut Vec<NodeId>) {
    match value {
        Value::Num(n) => out.push(n.node),
        Value::Bool(n) | Value::Enum(n, _) | Value::InstanceNode(n) => out.push(*n),
        Value::Tuple(items) | Value::List(items) => items.iter().for_each(|v| nodes_of(v, out)),
        Value::Range(a, b) => out.extend([a.node, b.node]),
        _ => {}
    }
}

impl<'a> Elaborator<'a> {
    /// What the lines of an event do, in the order of the text; `of` is its name and place.
    pub(super) fn event_actions(&mut self, laws: &'a [Law], scope: &mut Scope, of: (&str, Span)) -> Vec<Action> {
        let owner = super::events::owner(scope);
        let new = |kept| Instant { actions: Vec::new(), taken: Vec::new(), open: Vec::new(), kept, of, owner };
        let mut lines = new(BTreeSet::new());
        self.each_law(laws, None, scope, &mut lines);
        let kept = lines.overtaken(self);
        if kept.is_empty() || self.prototype {
            return lines.actions;
        }
        let mut lines = new(kept);
        self.each_law(laws, None, scope, &mut lines);
        lines.actions
    }

    /// An action that does nothing where a condition does not hold.
    fn guarded_action(&mut self, action: Action, guard: Option<NodeId>) -> Action {
        let Some(g) = guard else { return action };
        match action {
            Action::Move { fraction, but, from, to, span } => {
                let zero = self.graph.number(0.0);
                // What is not done has no shares that could be out of range.
                let but = but.iter().map(|kept| self.guarded_kept(*kept, g)).collect();
                Action::Move { fraction: self.graph.select(g, fraction, zero), but, from, to, span }
            }
            Action::Assign { state, value, span } => {
                let old = self.graph.add(Op::State(state));
                Action::Assign { state, value: self.graph.select(g, value, old), span }
            }
        }
    }

    fn guarded_kept(&mut self, kept: Kept, guard: NodeId) -> Kept {
        let zero = self.graph.number(0.0);
        let mut guarded = |node| self.graph.select(guard, node, zero);
        let stays = match kept.stays {
            Stays::Share(node) => Stays::Share(guarded(node)),
            Stays::Amount(node) => Stays::Amount(guarded(node)),
        };
        Kept { stays, ..kept }
    }

    /// The states that an action changes.
    fn changed_by(&self, action: &Action) -> BTreeSet<u32> {
        match action {
            Action::Assign { state, .. } => [*state].into(),
            Action::Move { from, to, .. } => {
                let ends = [from, to].map(|m| self.mixtures.get(*m as usize).copied());
                let held = self.extensive.iter().filter(|(k, _)| ends.contains(&Some(k.instance)));
                held.map(|(_, state)| *state).collect()
            }
        }
    }
}
