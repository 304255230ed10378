//! Whether a plan is a tree: every node has one parent and none is its own ancestor.

use matterix_ir::plan::{Plan, StepId};

/// A node and all below it, parents first.
pub(super) fn subtree(plan: &Plan, root: StepId) -> Vec<StepId> {
    let mut found = vec![root];
    let mut next = 0;
    while let Some(&step) = found.get(next) {
        found.extend(plan.get(step).step.children());
        next += 1;
    }
    found
}

/// Says what is wrong with the plan's shape.
pub(super) fn check(plan: &Plan) -> Result<(), String> {
    let mut seen = vec![false; plan.steps.len()];
    let mut open = vec![plan.root];
    while let Some(step) = open.pop() {
        match seen.get_mut(step.0 as usize) {
            None => return Err(format!("the plan has no step {}", step.0)),
            Some(true) => return Err(format!("step {} of the plan is in two places", step.0)),
            Some(slot) => *slot = true,
        }
        open.extend(plan.get(step).step.children());
    }
    Ok(())
}
