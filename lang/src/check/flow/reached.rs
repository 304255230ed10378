//! Steps that no run does: those that are always refused, those behind one that always fails, and what would begin too late on every way.

use std::collections::BTreeSet;

use matterix_ir::plan::{Step, StepId};

use super::{Interpreter, MOST_STEPS};

impl Interpreter<'_, '_> {
    /// Notes that a step is followed, and an operation that it is done.
    pub(super) fn come_to(&mut self, id: StepId) {
        if let Some(reached) = self.reached.get_mut(id.0 as usize) {
            *reached = true;
        }
    }

    /// Whether a step was followed, or an operation done.
    pub(super) fn is_come_to(&self, id: StepId) -> bool {
        self.reached.get(id.0 as usize).copied().unwrap_or(true)
    }

    /// Takes over what another flow of the same plan comes to.
    pub(super) fn reaches_also(&mut self, other: &Self) {
        self.reached.iter_mut().zip(&other.reached).for_each(|(own, other)| *own |= other);
    }

    /// The steps that no run does. Handlers and alternatives count as reached: they may take what is not followed, such as a use of one
    /// thing by two.
    pub(super) fn never_reached(&self) -> BTreeSet<StepId> {
        let mut out = BTreeSet::new();
        if self.steps > MOST_STEPS {
            return out;
        }
        for (i, node) in self.plan.steps.iter().enumerate() {
            let inner = match &node.step {
                Step::Sequence(steps) => steps.as_slice(),
                Step::Within { body, .. } | Step::Skill { body, .. } => std::slice::from_ref(body),
                _ => continue,
            };
            if self.is_come_to(StepId(i as u32)) {
                let behind = inner.iter().filter(|id| !self.is_come_to(**id));
                out.extend(behind.flat_map(|id| self.below(*id)));
            }
        }
        out
    }
}
