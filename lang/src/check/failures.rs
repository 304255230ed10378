//! Steps that a failure leaves undone, and handlers for failures that nothing raises.

use std::cell::LazyCell;
use std::collections::BTreeSet;

use matterix_ir::model::Event;
use matterix_ir::plan::{Caught, Motion, Plan, PlanStep, Step, StepId};
use matterix_ir::{Diagnostic, Op, Span, codes};

use crate::ast::{ItemKind, WireKind};
use crate::elaborate::mixtures::changed;
use crate::escapes::fails;
use crate::eval::lab::Elaborator;
use crate::names::verb_text;

/// Steps of a file that nothing gets to, as a `fail` stands before them in their block; each place once.
pub fn beyond(plan: &Plan, within: Span) -> Vec<Diagnostic> {
    let mut out: Vec<Diagnostic> = Vec::new();
    for step in &plan.steps {
        let Step::Sequence(list) = &step.step else { continue };
        let all: Vec<&PlanStep> = list.iter().map(|id| plan.get(*id)).collect();
        let Some(at) = all.iter().position(|step| matches!(step.step, Step::Fail { .. })) else { continue };
        let (fails, Some(next)) = (all[at].span, all.get(at + 1).map(|step| step.span)) else { continue };
        if next.file != within.file || next.is_empty() || out.iter().any(|d| d.span() == next) {
            continue;
        }
        let headline = "steps after `fail` are never reached";
        let d = Diagnostic::warning(codes::DEAD_BRANCH, next, headline, "never reached");
        out.push(d.because(fails, "always fails here").help("remove the steps, or put the `fail` into an `if`"));
    }
    out
}

/// Handlers of a workflow for failures that nothing in their block raises, though others do; each once.
pub fn idle(plan: &Plan, within: Span, lab: &Elaborator<'_>, events: &[Event]) -> Vec<Diagnostic> {
    let tables = lab.tables;
    let handles = |s: &PlanStep| matches!(&s.step, Step::Guarded { handlers, .. } if !handlers.is_empty());
    if !plan.steps.iter().any(handles) {
        return Vec::new();
    }
    // A driver may know failures that no step declares.
    let drivers = tables.names.decls.iter().filter_map(|decl| match &decl.item.kind {
        ItemKind::Driver { wires, .. } => Some(wires),
        _ => None,
    });
    let told: BTreeSet<&str> = drivers
        .flatten()
        .filter_map(|wire| match &wire.kind {
            WireKind::Reply { fails, .. } => Some(fails.text.as_str()),
            _ => None,
        })
        .collect();
    let declared = tables.failures();
    let dangers = tables.dangers();
    let set = LazyCell::new(|| {
        let extensive = lab.extensive_by_mixture();
        events.iter().flat_map(|event| changed(&event.actions, &extensive)).collect()
    });
    let mut out: Vec<Diagnostic> = Vec::new();
    let mut needed: BTreeSet<Span> = BTreeSet::new();
    for step in &plan.steps {
        let Step::Guarded { body, handlers, .. } = &step.step else { continue };
        let raised = raised(plan, *body, true);
        for (place, (caught, handler)) in handlers.iter().enumerate() {
            let at = plan.get(*handler).span;
            let own = at.file == within.file && within.start <= at.start && at.end <= within.end;
            let before = handlers[..place].iter().find(|(other, _)| matches!(other, Caught::Any) || other == caught);
            if let Some((_, first)) = before.filter(|_| own && !out.iter().any(|d| d.span() == at)) {
                let headline = "an earlier handler takes the same failures";
                let d = Diagnostic::warning(codes::DEAD_BRANCH, at, headline, "never reached");
                let d = d.because(plan.get(*first).span, "the first handler that fits runs");
                out.push(d.help("put the handler for all failures last"));
                continue;
            }
            let Caught::Named(name) = caught else { continue };
            let by_time = || takes_time(plan, *body) && may_flow(plan, lab, &set, name);
            let known = raised.contains(name) || told.contains(name.as_str()) || dangers.contains(name);
            if known || by_time() || is_declared(plan, *body, lab, name) {
                needed.insert(at);
            } else if own && declared.contains(name) && !out.iter().any(|d| d.span() == at) {
                let headline = format!("no step before this handler can fail with `{name}`");
                let d = Diagnostic::warning(codes::DEAD_BRANCH, at, headline, "never reached");
                out.push(d.help("remove the handler, or name another failure"));
            }
        }
    }
    // A turn of a loop may raise what another does not.
    out.retain(|d| !needed.contains(&d.span()));
    out
}

/// Whether a skill that is called declares a failure: a caller may handle it, whatever the values of this call.
fn is_declared(plan: &Plan, root: StepId, lab: &Elaborator<'_>, failure: &str) -> bool {
    let declares = |verb: &str| {
        lab.tables.names.decls.iter().any(|decl| match &decl.item.kind {
            ItemKind::Skill { sig, clauses, .. } => {
                verb_text(&sig.verb) == verb && clauses.iter().filter_map(fails).flatten().any(|n| n.text == failure)
            }
            _ => false,
        })
    };
    let mut todo = vec![root];
    while let Some(id) = todo.pop() {
        let step = &plan.get(id).step;
        if matches!(step, Step::Skill { verb, .. } if declares(verb)) {
            return true;
        }
        todo.extend(step.children());
    }
    false
}

/// Whether laws may break a limit of this failure while time passes, or events, which change the states of `set`.
fn may_flow(plan: &Plan, lab: &Elaborator<'_>, set: &BTreeSet<u32>, failure: &str) -> bool {
    let moves = |op: &Op| match op {
        Op::Time => true,
        Op::State(s) => lab.rates.contains_key(s) || set.contains(s),
        _ => false,
    };
    let mut limits = plan.limits.iter().map(|l| &l.condition).filter(|c| c.failure() == failure);
    limits.any(|condition| lab.graph.depends(condition.node, moves))
}

/// Whether time may pass in a step.
fn takes_time(plan: &Plan, root: StepId) -> bool {
    let mut todo = vec![root];
    while let Some(id) = todo.pop() {
        let step = &plan.get(id).step;
        match step {
            Step::Wait { .. } | Step::WaitUntil { .. } | Step::Hold { .. } | Step::Await { .. } => return true,
            Step::Operation(operation) if !operation.is_at_once() => return true,
            _ => todo.extend(step.children()),
        }
    }
    false
}

/// All that a step may fail with; without what only devices report, where those do what they are told.
pub(super) fn raised(plan: &Plan, root: StepId, devices: bool) -> BTreeSet<String> {
    let moves = plan.steps.iter().any(|step| matches!(&step.step, Step::Operation(o) if o.motion.is_some()));
    Raising { plan, devices, moves, awaited: BTreeSet::new() }.of(root)
}

/// Goes through what steps fail with.
struct Raising<'p> {
    plan: &'p Plan,
    /// What only devices report counts.
    devices: bool,
    /// Robots move in it.
    moves: bool,
    /// Bodies of jobs that were waited for.
    awaited: BTreeSet<StepId>,
}

impl Raising<'_> {
    fn of(&mut self, id: StepId) -> BTreeSet<String> {
        let (plan, devices) = (self.plan, self.devices);
        let mut out: BTreeSet<String> = BTreeSet::new();
        let mut more: Vec<StepId> = Vec::new();
        let step = &plan.get(id).step;
        let mut add = |name: &str| {
            out.insert(name.to_string());
        };
        match step {
            Step::Guarded { body, handlers, finally } => {
                let mut open = self.of(*body);
                for (caught, handler) in handlers {
                    // When the turns of a handler are used up, the failure goes on.
                    if !retries(plan, *handler) {
                        match caught {
                            Caught::Any => open.clear(),
                            Caught::Named(name) => drop(open.remove(name)),
                        }
                    }
                    out.extend(self.of(*handler));
                }
                out.extend(open);
                finally.iter().for_each(|last| out.extend(self.of(*last)));
                return out;
            }
            Step::Operation(o) => {
                o.fails.iter().filter(|_| devices).for_each(|name| add(name));
                let by_motion: &[&str] = match &o.motion {
                    Some(_) => &Motion::FAILURES,
                    None if self.moves => &Motion::FAILURES_BESIDE,
                    None => &[],
                };
                by_motion.iter().filter(|_| devices).for_each(|name| add(name));
                o.needs.iter().for_each(|need| add(need.failure()));
                o.limits.iter().filter_map(|i| plan.limits.get(*i as usize)).for_each(|l| add(l.condition.failure()));
                add("claimed");
            }
            Step::Skill { needs, invariants, promises, takes, .. } => {
                needs.iter().for_each(|need| add(need.failure()));
                if !invariants.is_empty() {
                    add("broken");
                }
                if !promises.is_empty() || takes.is_some_and(|t| t.bounds.is_some()) {
                    add("promise");
                }
            }
            Step::Keep { .. } | Step::During { .. } => add("broken"),
            Step::Within { .. } => add("late"),
            Step::WaitUntil { timeout: Some(_), .. } | Step::Hold { timeout: Some(_), .. } => add("timeout"),
            Step::RepeatWhile { .. } => add("max"),
            Step::Start { .. } => add("job"),
            Step::Await { job } => {
                add("job");
                // The failure of the job becomes that of whoever waits for it.
                more.extend(bodies(plan, job).filter(|body| self.awaited.insert(*body)));
            }
            Step::Fail { name, .. } => add(name),
            _ => {}
        }
        more.extend(step.children());
        more.into_iter().for_each(|below| out.extend(self.of(below)));
        out
    }
}

/// Whether a handler begins its body again.
fn retries(plan: &Plan, handler: StepId) -> bool {
    match &plan.get(handler).step {
        Step::Retry { .. } => true,
        // What stands in the handlers of a handler is theirs.
        Step::Guarded { body, .. } => retries(plan, *body),
        step => step.children().into_iter().any(|below| retries(plan, below)),
    }
}

/// What a job does, wherever it is started.
fn bodies<'a>(plan: &'a Plan, awaited: &'a str) -> impl Iterator<Item = StepId> + 'a {
    plan.steps.iter().filter_map(move |step| match &step.step {
        Step::Start { job, body } if job == awaited => Some(*body),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use crate::check::tests::found;

    const LAB: &str = "lab bench { ambient: 25 degC }\n";

    #[test]
    fn what_follows_a_failure_in_its_block_is_never_done() {
        let after = |steps: &str| {
            found(&format!("{LAB}workflow w in bench {{ {steps} }}"), |bench| {
                let plan = bench.subject().plan;
                super::beyond(plan, plan.span())
            })
        };
        assert_eq!(after("wait 1 s; fail broken \"it broke\""), [""; 0]);
        assert_eq!(after("fail broken \"it broke\"; wait 1 s"), ["dead-branch: steps after `fail` are never reached"]);
    }
}
