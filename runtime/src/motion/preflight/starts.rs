//! Robots that are in something else as they stand, where lines that run beside each other begin.

use matterix_ir::plan::Motion;
use matterix_ir::scene::InstanceId;

use super::beside::Moved;
use crate::motion::exact::Exact;
use crate::motion::refused::{Meeting, Refused};
use crate::motion::stage::Stage;
use crate::motion::surroundings::Surroundings;

/// What is in what where lines that run beside each other begin, each pair told of once.
#[derive(Debug, Default)]
pub struct Starts {
    /// Robots of the line that is followed, with what of what others move they stand in.
    open: Vec<(InstanceId, Meeting)>,
    /// Robots with those that have been told of beside them.
    told: Vec<[InstanceId; 2]>,
}

impl Starts {
    /// Looks at the robots of a line while it is known how the others stand.
    pub fn look(&mut self, stage: &Stage<'_>, own: &Moved, others: &Moved) {
        for robot in &own.robots {
            let Some(Refused::Collides(meeting)) = stage.stands_in(*robot) else { continue };
            let Some(with) = meeting.with else { continue };
            let other = stage.actor_of(with).or_else(|| stage.held_by(with)).unwrap_or(with);
            let moves = others.robots.contains(&other) || others.items.contains(&with);
            if moves && !self.told.contains(&[other, *robot]) {
                self.told.push([*robot, other]);
                self.open.push((*robot, meeting));
            }
        }
    }

    /// Robots that have been told of with what they stand in.
    pub fn told(self) -> Vec<[InstanceId; 2]> {
        self.told
    }

    /// What a robot stands in before the first of its motions.
    pub fn take(&mut self, motion: &Motion, robot: InstanceId) -> Option<Refused> {
        let stays = matches!(motion, Motion::Grip { .. } | Motion::Free { .. } | Motion::Fingers { .. });
        let at = self.open.iter().position(|(own, _)| *own == robot && !stays)?;
        Some(Refused::Collides(self.open.remove(at).1))
    }
}

impl Stage<'_> {
    /// What a robot, with what it holds, is in as it stands; nothing where that is not known.
    fn stands_in(&self, robot: InstanceId) -> Option<Refused> {
        let actor = self.actors.get(&robot).filter(|_| !self.is_unknown(robot))?;
        if self.unknown.postures.contains(&robot) {
            return None;
        }
        let around = Surroundings::of(self, robot);
        let figure = self.figure(robot, actor, &actor.arm).ok()?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        let now = actor.configuration();
        if checker.contacts(&now).is_empty() || !checker.ask(true) {
            return None;
        }
        let contacts = checker.contacts(&now);
        (!contacts.is_empty()).then(|| self.meeting(&figure, &around, &contacts, true))
    }
}
