//! What may not be used any more: `state disposed: Bool = false { bars: used_after_disposal }`.
//!
//! While such a state holds, no command or primitive skill may name its thing or a part of it, or change any of them. That is asked of
//! whatever uses it, so that nobody who writes a skill has to think of it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::model::{Action, Domain};
use matterix_ir::plan::{Argument, Condition, Operation, Refusal, Step, Term};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Op, UnaryOp};

use super::Planner;
use crate::ast::MemberKind;
use crate::declare::failures::BARS;
use crate::declare::fields::word;

impl Planner<'_, '_> {
    /// Asks of every operation that uses what another one of the plan may bar that it is not barred.
    pub(super) fn ask_for_barred(&mut self) {
        let bars = self.bars();
        if bars.is_empty() {
            return;
        }
        let mut steps = std::mem::take(&mut self.steps);
        for step in &mut steps {
            if let Step::Operation(operation) = &mut step.step {
                self.ask_of(operation, &bars);
            }
        }
        self.steps = steps;
    }

    /// What the operations of the plan may bar: by thing, the state with the condition that it does not hold.
    fn bars(&mut self) -> BTreeMap<InstanceId, Vec<(u32, Arc<Condition>)>> {
        let operations = self.steps.iter().filter_map(|step| match &step.step {
            Step::Operation(operation) => Some(operation),
            _ => None,
        });
        let assigned = operations.flat_map(|o| o.at_start.iter().chain(&o.at_end)).filter_map(Action::assigned);
        let truths: BTreeSet<u32> =
            assigned.filter(|state| self.lab.states[*state as usize].domain == Domain::Bool).collect();
        let mut out: BTreeMap<InstanceId, Vec<(u32, Arc<Condition>)>> = BTreeMap::new();
        for state in truths {
            if let Some(condition) = self.not_barred(state) {
                let owner = self.lab.state_owner[state as usize];
                out.entry(owner).or_default().push((state, Arc::new(condition)));
            }
        }
        out
    }

    /// The condition that a state which bars its thing does not hold.
    fn not_barred(&mut self, state: u32) -> Option<Condition> {
        let owner = self.lab.state_owner[state as usize];
        let full = self.lab.states[state as usize].name.clone();
        let (_, member) = full.rsplit_once('.')?;
        let members = self.lab.all_members(owner);
        let (failure, span) = members.iter().find_map(|m| match &m.member.kind {
            MemberKind::Value { name, options, .. } if name.text == member => {
                Some((word(options, BARS)?.to_owned(), name.span))
            }
            _ => None,
        })?;
        let node = self.lab.graph.add(Op::State(state));
        let not = self.lab.graph.unary(UnaryOp::Not, node);
        let spoken = format!("{}.{member}", self.lab.spoken_name(owner));
        Some(Condition {
            node: not,
            text: format!("not {spoken}"),
            span,
            compared: Vec::new(),
            terms: vec![Term { name: spoken, node, domain: Domain::Bool }],
            refusal: Some(Refusal { failure, help: None, said: Vec::new() }),
            each: Vec::new(),
        })
    }

    fn ask_of(&self, operation: &mut Operation, bars: &BTreeMap<InstanceId, Vec<(u32, Arc<Condition>)>>) {
        let mut used: BTreeSet<InstanceId> = BTreeSet::new();
        for thing in self.things_of(operation) {
            used.extend(self.wholes(thing).filter(|whole| bars.contains_key(whole)));
        }
        // Where the operation looks at that itself, it knows better what is meant.
        let own: BTreeSet<String> = operation.needs.iter().map(|need| need.failure().to_owned()).collect();
        for (state, condition) in used.iter().filter_map(|thing| bars.get(thing)).flatten() {
            if own.contains(condition.failure()) {
                continue;
            }
            operation.needs.push(condition.clone());
            if operation.is_at_once() {
                operation.reads.push(*state);
                operation.reads.sort_unstable();
            }
        }
    }

    /// The things that an operation names, and those that it changes.
    fn things_of(&self, operation: &Operation) -> BTreeSet<InstanceId> {
        let mut out: BTreeSet<InstanceId> = operation.device.into_iter().collect();
        for (_, argument) in &operation.arguments {
            match argument {
                Argument::Instance(id) => out.extend([*id]),
                Argument::Instances(ids) => out.extend(ids),
                Argument::Quantity(..) | Argument::Text(_) | Argument::Word(..) => {}
            }
        }
        for action in operation.at_start.iter().chain(&operation.at_end) {
            match action {
                Action::Assign { state, .. } => out.extend([self.lab.state_owner[*state as usize]]),
                Action::Move { from, to, .. } => {
                    out.extend([from, to].into_iter().filter_map(|m| self.lab.mixtures.get(*m as usize)));
                }
            }
        }
        out
    }

    /// A thing, and what it is a part of.
    fn wholes(&self, thing: InstanceId) -> impl Iterator<Item = InstanceId> {
        std::iter::successors(Some(thing), |id| self.lab.instances[id.0 as usize].owner)
    }
}
