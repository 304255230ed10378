//! Whether a failure at a step must end the workflow.

use std::collections::BTreeSet;

use matterix_ir::plan::{Caught, Plan, Step, StepId};
use matterix_timing::Timing;

use crate::check::failures::raised;

/// Whether a run may go on although a step fails with `failure`: a handler around takes that, or takes another failure that may come
/// before the step, so that some run never gets there.
pub(super) fn handled(plan: &Plan, timing: &Timing, step: StepId, failure: &str) -> bool {
    handled_but(plan, timing, step, failure, &mut BTreeSet::new())
}

fn handled_but<'p>(plan: &'p Plan, timing: &Timing, step: StepId, failure: &str, jobs: &mut BTreeSet<&'p str>) -> bool {
    let mut inner = step;
    for around in timing.around(step) {
        let taken = match &plan.get(around).step {
            Step::Guarded { body, handlers, .. } if *body == inner => {
                let mut lasting = handlers.iter().filter(|(_, handler)| !leaves(plan, *handler)).peekable();
                lasting.peek().is_some() && {
                    let raised = raised(plan, *body, false);
                    lasting.any(|(caught, _)| match caught {
                        Caught::Any => true,
                        Caught::Named(name) => name == failure || raised.contains(name),
                    })
                }
            }
            Step::Try(alternatives) => alternatives.last() != Some(&inner),
            // What a job fails with is raised where it is waited for.
            Step::Start { job, .. } if jobs.insert(job) => {
                let awaits = |id: &StepId| matches!(&plan.get(*id).step, Step::Await { job: name } if name == job);
                let steps = (0..plan.steps.len() as u32).map(StepId);
                let visited = |id: &StepId| timing.visit(*id).is_some();
                steps.filter(awaits).filter(visited).any(|id| handled_but(plan, timing, id, failure, jobs))
            }
            _ => false,
        };
        if taken {
            return true;
        }
        inner = around;
    }
    false
}

/// Whether a handler never goes on by itself: it fails in turn, or has its body begin again until that fails once more.
fn leaves(plan: &Plan, handler: StepId) -> bool {
    match &plan.get(handler).step {
        Step::Fail { .. } | Step::Retry { .. } => true,
        Step::Sequence(steps) => steps.iter().any(|step| leaves(plan, *step)),
        _ => false,
    }
}
