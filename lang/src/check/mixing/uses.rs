//! Where the plan uses values that hazards watch: in conditions, kept values, records and texts of its own, in what its
//! operations do, and in the flows of processes. What steps of the library ask for themselves is no use.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::model::{Action, Event};
use matterix_ir::plan::{Condition, Plan, PlanStep, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{FileId, NodeId, Op, Span, Text, TextPart};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::elaborate::hazards::{Hazard, Watched};
use crate::eval::lab::Elaborator;

/// A flow of a process: its index, and the two mixtures.
pub(super) type Stream = (usize, InstanceId, InstanceId);

/// The hazards, by index, that are looked at where something is used.
#[derive(Default)]
pub(super) struct Uses {
    pub by_step: BTreeMap<StepId, Rc<[usize]>>,
    pub by_transfer: BTreeMap<(InstanceId, InstanceId), Vec<usize>>,
    pub by_stream: BTreeMap<Stream, Rc<[usize]>>,
    /// Those of values that laws and events of the user's own go by, with the place of the first of these.
    pub by_law: BTreeMap<usize, Span>,
}

impl Uses {
    /// What a plan uses of what hazards watch.
    pub fn new(
        lab: &Elaborator<'_>,
        plan: &Plan,
        events: &[Event],
        hazards: &[Hazard],
        library: &BTreeSet<FileId>,
    ) -> Uses {
        let mut uses = Uses::default();
        let mut finder = Finder { lab, watched: FxHashMap::default(), above: Vec::new(), known: FxHashMap::default() };
        for (i, hazard) in hazards.iter().enumerate() {
            let value = match hazard.watched {
                Watched::Steps | Watched::Given(_) => None,
                Watched::Value(node) => Some(node),
                Watched::Transfer(from, to, then) => {
                    uses.by_transfer.entry((from, to)).or_default().push(i);
                    then
                }
            };
            // A constant is the same node for all things that have it, so that its use does not say of which.
            if let Some(node) = value.filter(|node| !matches!(lab.graph.op(*node), Op::Const(_))) {
                finder.watched.entry(node).or_default().push(i);
            }
        }
        if finder.watched.is_empty() {
            return uses;
        }
        finder.look_up();
        let results = results(plan, library);
        for (i, step) in plan.steps.iter().enumerate() {
            let mut used = used_by(step, library);
            used.extend(result(step, &results));
            let found = finder.all(used);
            if !found.is_empty() {
                uses.by_step.insert(StepId(i as u32), found);
            }
        }
        for (span, node) in own_laws(lab, events, library) {
            for i in finder.below(node).iter() {
                uses.by_law.entry(*i).or_insert(span);
            }
        }
        for (stream, flows) in &lab.streams {
            let found = finder.all(vec![*flows]);
            if !found.is_empty() {
                uses.by_stream.insert(*stream, found);
            }
        }
        uses
    }
}

/// The kept values that are results of steps which the user has named, `let shown <- read meter`.
fn results(plan: &Plan, library: &BTreeSet<FileId>) -> BTreeSet<u32> {
    let own = plan.steps.iter().filter(|step| !library.contains(&step.span.file) && step.label.starts_with("let "));
    let named: FxHashSet<&str> = own.map(|step| step.label.as_str()).collect();
    // A result is kept under the whole text of its statement.
    (0..).zip(&plan.locals).filter(|(_, local)| named.contains(local.name.as_str())).map(|(i, _)| i).collect()
}

/// What a step gives as a result, which is used wherever the step stands.
fn result(step: &PlanStep, results: &BTreeSet<u32>) -> Option<NodeId> {
    match step.step {
        Step::Let { local, value } if results.contains(&local) => Some(value),
        _ => None,
    }
}

/// The values that laws and events of the user's own go by, with their places. What a reaction requires is its own.
fn own_laws(lab: &Elaborator<'_>, events: &[Event], library: &BTreeSet<FileId>) -> Vec<(Span, NodeId)> {
    let own = |span: Span| Some(span).filter(|span| !library.contains(&span.file));
    let places: Vec<Option<Span>> = lab.processes.iter().map(|p| own(p.span)).collect();
    let asked = lab.processes.iter().filter_map(|p| {
        let reaction = p.reaction.and_then(|r| own(lab.tables.reactions[r.0 as usize].span));
        Some((own(p.span).or(reaction)?, p.guard?))
    });
    let mut out: Vec<(Span, NodeId)> = asked.collect();
    let parts = lab.rates.values().chain(lab.flows.values()).flatten();
    out.extend(parts.filter_map(|c| Some((places[c.process]?, c.node))));
    for event in events {
        let Some(span) = own(event.span) else { continue };
        out.push((span, event.when));
        out.extend(event.actions.iter().flat_map(Action::sources).map(|node| (span, node)));
    }
    out
}

/// Finds watched values below others.
struct Finder<'l, 'a> {
    lab: &'l Elaborator<'a>,
    watched: FxHashMap<NodeId, Vec<usize>>,
    /// By node: whether it may rest on something that is watched.
    above: Vec<bool>,
    known: FxHashMap<NodeId, Rc<[usize]>>,
}

impl Finder<'_, '_> {
    fn all(&mut self, nodes: Vec<NodeId>) -> Rc<[usize]> {
        if let [one] = nodes.as_slice() {
            return self.below(*one);
        }
        let found: BTreeSet<usize> = nodes.into_iter().flat_map(|n| self.below(n).to_vec()).collect();
        found.into_iter().collect()
    }

    /// Marks what rests on something that is watched; readings may.
    fn look_up(&mut self) {
        for (i, op) in self.lab.graph.ops().iter().enumerate() {
            let operands = op.operands().any(|n| self.above[n.0 as usize]);
            let marked = operands || matches!(op, Op::Reading(_)) || self.watched.contains_key(&NodeId(i as u32));
            self.above.push(marked);
        }
    }

    /// The hazards that watch something a value rests on, the true values behind readings included.
    fn below(&mut self, node: NodeId) -> Rc<[usize]> {
        if let Some(known) = self.known.get(&node) {
            return known.clone();
        }
        let mut found = BTreeSet::new();
        let mut seen = FxHashSet::default();
        let mut todo = vec![node];
        while let Some(next) = todo.pop() {
            if !self.above[next.0 as usize] || !seen.insert(next) {
                continue;
            }
            found.extend(self.watched.get(&next).into_iter().flatten().copied());
            match self.lab.graph.op(next) {
                Op::Reading(r) => todo.push(self.lab.readings[r as usize].value),
                op => todo.extend(op.operands()),
            }
        }
        let found: Rc<[usize]> = found.into_iter().collect();
        self.known.insert(node, found.clone());
        found
    }
}

/// The values a step uses.
fn used_by(step: &PlanStep, library: &BTreeSet<FileId>) -> Vec<NodeId> {
    let own = |condition: &Condition| !library.contains(&condition.span.file);
    let stands_here = !library.contains(&step.span.file);
    let mut out = Vec::new();
    match &step.step {
        Step::Operation(o) => {
            out.extend(o.needs.iter().filter(|c| own(c)).map(|c| c.node));
            out.extend(o.until.iter().filter(|c| own(c)).map(|c| c.node));
            out.extend(o.at_start.iter().chain(&o.at_end).flat_map(Action::sources));
        }
        Step::Skill { needs, invariants, promises, .. } => {
            let asked = needs.iter().map(|c| &**c).chain(invariants).chain(promises);
            out.extend(asked.filter(|c| own(c)).map(|c| c.node));
        }
        Step::During { invariants, .. } => out.extend(invariants.iter().filter(|c| own(c)).map(|c| c.node)),
        Step::WaitUntil { condition, .. }
        | Step::Hold { condition, .. }
        | Step::Keep { condition, .. }
        | Step::If { condition, .. }
        | Step::RepeatWhile { condition, .. } => out.extend(Some(condition.node).filter(|_| own(condition))),
        Step::Expect(conditions) => out.extend(conditions.iter().filter(|c| own(c)).map(|c| c.node)),
        Step::Let { value, .. } if stands_here => out.push(*value),
        Step::Wait { duration } if stands_here => out.push(*duration),
        Step::Repeat { times, .. } if stands_here => out.push(*times),
        Step::Record { value, .. } => out.extend(value),
        Step::Note(text) | Step::Ask(text) if stands_here => shown(text, &mut out),
        _ => {}
    }
    out
}

fn shown(text: &Text, out: &mut Vec<NodeId>) {
    out.extend(text.parts.iter().filter_map(|part| match part {
        TextPart::Quantity { value, .. } => Some(*value),
        TextPart::Bool(node) => Some(*node),
        _ => None,
    }));
}
