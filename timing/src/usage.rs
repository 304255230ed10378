//! Who uses and who claims which instance.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Plan, Step, StepId};
use matterix_ir::scene::InstanceId;

use crate::walk::Timing;

/// A step that uses an instance from its beginning to its end without a pause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Use {
    /// The instance.
    pub instance: InstanceId,
    /// The step.
    pub step: StepId,
}

/// The uses of a plan, outermost steps: a skill whose every step uses the arm is one use of it. Handlers and `finally`
/// are left out: there, what is in use is waited for. So are steps in `never`, which no run does.
pub fn uses(plan: &Plan, timing: &Timing, never: &BTreeSet<StepId>) -> Vec<Use> {
    let mut below: BTreeMap<StepId, BTreeSet<InstanceId>> = BTreeMap::new();
    gather(plan, plan.root, &mut below);
    let mut partly: BTreeSet<StepId> = BTreeSet::new();
    if !never.is_empty() {
        is_partly(plan, plan.root, never, &mut partly);
    }
    let mut out = Vec::new();
    let mut open = vec![(plan.root, BTreeSet::new())];
    while let Some((step, covered)) = open.pop() {
        let aside = timing.visit(step).is_none_or(|v| v.aside) || never.contains(&step);
        let Some(instances) = below.get(&step).filter(|_| !aside) else { continue };
        let node = &plan.get(step).step;
        let block = matches!(node, Step::Sequence(_) | Step::Parallel(_)) || partly.contains(&step);
        let whole = |i: &InstanceId| !block && all_along(plan, step, *i) && surely(plan, timing, step, *i);
        let (own, other): (BTreeSet<InstanceId>, BTreeSet<InstanceId>) =
            instances.difference(&covered).partition(|i| whole(i));
        out.extend(own.iter().map(|&instance| Use { instance, step }));
        if !other.is_empty() {
            // What this step is a use of is not one again below.
            let covered: BTreeSet<InstanceId> = covered.union(&own).copied().collect();
            open.extend(node.children().into_iter().map(|child| (child, covered.clone())));
        }
    }
    out.sort_unstable();
    out
}

fn gather(plan: &Plan, step: StepId, below: &mut BTreeMap<StepId, BTreeSet<InstanceId>>) -> BTreeSet<InstanceId> {
    let node = &plan.get(step).step;
    let mut all: BTreeSet<InstanceId> = match node {
        Step::Operation(operation) => operation.claims.iter().copied().collect(),
        _ => BTreeSet::new(),
    };
    for child in node.children() {
        all.extend(gather(plan, child, below));
    }
    below.insert(step, all.clone());
    all
}

/// Whether no run does some of what is below a step; notes all steps of which that is so.
fn is_partly(plan: &Plan, step: StepId, never: &BTreeSet<StepId>, partly: &mut BTreeSet<StepId>) -> bool {
    let mut some = never.contains(&step);
    for child in plan.get(step).step.children() {
        some |= is_partly(plan, child, never, partly);
    }
    if some {
        partly.insert(step);
    }
    some
}

/// Whether every way through a step uses an instance all the time.
fn all_along(plan: &Plan, step: StepId, instance: InstanceId) -> bool {
    let node = &plan.get(step).step;
    match node {
        Step::Operation(operation) => operation.claims.contains(&instance),
        Step::Wait { .. } | Step::WaitUntil { .. } | Step::Hold { .. } | Step::Await { .. } => false,
        Step::Claim { .. } | Step::Start { .. } | Step::Parallel(_) => false,
        Step::Guarded { body, .. } => all_along(plan, *body, instance),
        _ => node.children().iter().all(|c| all_along(plan, *c, instance)),
    }
}

/// Whether a step uses an instance whenever it is done: not where it does so in a branch or in turns that may not come.
fn surely(plan: &Plan, timing: &Timing, step: StepId, instance: InstanceId) -> bool {
    let below = |child: &StepId| surely(plan, timing, *child, instance);
    match &plan.get(step).step {
        Step::Operation(operation) => operation.claims.contains(&instance),
        Step::If { then, otherwise, .. } => below(then) && otherwise.as_ref().is_some_and(below),
        // Turns that may not come are a scope of their own.
        Step::Repeat { body, .. } | Step::RepeatWhile { body, .. } => {
            let scope = |s: StepId| timing.visit(s).map(|v| v.scope);
            scope(step) == scope(*body) && below(body)
        }
        Step::Guarded { body, .. } => below(body),
        Step::Try(alternatives) => alternatives.first().is_some_and(below),
        step => step.children().iter().any(below),
    }
}
