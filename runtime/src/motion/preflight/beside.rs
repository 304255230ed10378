//! What moves at the same time as something else.

use std::collections::BTreeSet;

use matterix_ir::plan::{Motion, Plan, Step, StepId};
use matterix_ir::scene::InstanceId;

use super::course::Course;
use crate::motion::stage::Stage;

/// The first job that a sequence starts: it runs beside what follows until it is awaited.
pub struct Job<'l> {
    /// What comes first.
    pub before: &'l [StepId],
    /// The start of the job.
    pub start: &'l StepId,
    /// What it does.
    pub body: StepId,
    /// What runs beside it.
    pub meanwhile: &'l [StepId],
    /// From where it is awaited.
    pub later: &'l [StepId],
}

impl<'l> Job<'l> {
    /// The first one of a sequence; none where it starts none.
    pub fn first(plan: &Plan, list: &'l [StepId]) -> Option<Self> {
        let at = list.iter().position(|id| matches!(plan.get(*id).step, Step::Start { .. }))?;
        let (before, rest) = list.split_at(at);
        let (start, rest) = rest.split_first()?;
        let Step::Start { job: name, body } = &plan.get(*start).step else { return None };
        let awaits = |id: &StepId| matches!(&plan.get(*id).step, Step::Await { job } if job == name);
        let (meanwhile, later) = rest.split_at(rest.iter().position(awaits).unwrap_or(rest.len()));
        Some(Job { before, start, body: *body, meanwhile, later })
    }
}

/// What a part of a plan moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moved {
    /// Robots.
    pub robots: BTreeSet<InstanceId>,
    /// Things that are gripped or let go.
    pub items: BTreeSet<InstanceId>,
    /// What they are put down on.
    pub surfaces: BTreeSet<InstanceId>,
}

impl Moved {
    /// What a step and those below it move.
    pub fn by(plan: &Plan, id: StepId, stage: &Stage<'_>) -> Self {
        let mut out = Moved::default();
        let mut open = vec![id];
        while let Some(id) = open.pop() {
            let step = &plan.get(id).step;
            open.extend(step.children());
            let Step::Operation(operation) = step else { continue };
            match &operation.motion {
                Some(Motion::Grip { item, .. }) => {
                    out.items.insert(*item);
                }
                Some(Motion::Free { item, on, .. }) => {
                    out.items.insert(*item);
                    out.surfaces.extend(on);
                }
                Some(Motion::Fingers { .. }) | None => {}
                Some(travel) => out.robots.extend(stage.actor_of(travel.mover())),
            }
        }
        out
    }

    /// Whether it moves nothing.
    pub fn is_empty(&self) -> bool {
        self.robots.is_empty() && self.items.is_empty()
    }

    /// With what another part moves.
    pub fn and(mut self, other: &Moved) -> Self {
        self.robots.extend(&other.robots);
        self.items.extend(&other.items);
        self.surfaces.extend(&other.surfaces);
        self
    }

    /// What both parts move.
    pub fn common(self, other: Moved) -> Self {
        let both = |a: BTreeSet<InstanceId>, b: BTreeSet<InstanceId>| a.intersection(&b).copied().collect();
        Moved {
            robots: both(self.robots, other.robots),
            items: both(self.items, other.items),
            surfaces: both(self.surfaces, other.surfaces),
        }
    }

    /// While this moves, nobody can tell where it is. Gives what could be told before.
    pub fn blur(&self, course: &mut Course<'_>) -> Moved {
        let unknown = &mut course.stage.unknown;
        let robots = self.robots.iter().copied().filter(|r| unknown.postures.insert(*r)).collect();
        let items = self.items.iter().copied().filter(|i| unknown.places.insert(*i)).collect();
        Moved { robots, items, surfaces: BTreeSet::new() }
    }

    /// What could be told before can be told again, but for what both parts move.
    pub fn clear(&self, both: &Moved, course: &mut Course<'_>) {
        let unknown = &mut course.stage.unknown;
        self.robots.difference(&both.robots).for_each(|r| {
            unknown.postures.remove(r);
        });
        self.items.difference(&both.items).for_each(|i| {
            unknown.places.remove(i);
        });
    }
}
