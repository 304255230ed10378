//! Turning: joints to positions, and a gripper on the spot.

use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::Variable;
use matterix_motion::inverse::Request;
use matterix_motion::pose::pose;

use super::perform::{Part, Performed, Refused};
use super::postures::postures;
use super::stage::Stage;

/// How far what is held tilts while a gripper only turns, rad.
const TURNING: f64 = 0.1;
/// Postures that are tried for a line beyond reach.
const POSTURES: usize = 4;

impl Stage<'_> {
    /// Brings the joints that move the tip to positions.
    pub(super) fn turn(&mut self, mover: InstanceId, to: Vec<f64>) -> Result<Performed, Refused> {
        let robot = self.actor_of(mover).ok_or(Refused::NoRobot)?;
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let variables = actor.chain.variables();
        if to.len() != variables.len() {
            return Err(Refused::Joints(to.len(), variables.len()));
        }
        let beyond = |(v, q): &(&Variable, &f64)| {
            !q.is_finite() || v.is_bounded() && !(v.limits.lower..=v.limits.upper).contains(*q)
        };
        if let Some((variable, _)) = variables.iter().zip(&to).find(beyond) {
            let joint = actor.assembly.robot.joints.get(variable.joint as usize);
            return Err(Refused::Beyond(joint.map(|j| j.name.clone()).unwrap_or_default()));
        }
        let mut parts = self.depart(robot, None)?;
        let arm = self.arm(robot);
        parts.push(self.way(robot, &arm, &to, None)?);
        Ok(Performed::new(robot, parts))
    }

    /// Turns the tip where it is as a pose is turned, then brings it there on a straight line.
    pub(super) fn turned_line(
        &mut self,
        robot: InstanceId,
        to: &Pose,
        near: &[InstanceId],
    ) -> Result<[Part; 2], Refused> {
        let here = Pose { position: self.tip(robot).position, rotation: to.rotation };
        let base = self.foot(robot).inverse();
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let now = actor.configuration();
        let request = Request { attempts: 60, ..Request::new(pose(&base.then(here)), &now) };
        let turned = actor.solver().solve(&request).map_err(|_| Refused::NoWay)?;
        self.way_and_line(robot, &turned.q, to, near)
    }

    /// Takes another posture with the tip where it is, from which it is then brought to a pose on a straight line.
    pub(super) fn line_from_elsewhere(
        &mut self,
        robot: InstanceId,
        to: &Pose,
        near: &[InstanceId],
    ) -> Result<[Part; 2], Refused> {
        let mut others = postures(self, robot, &[self.tip(robot)]).into_iter().take(POSTURES);
        others.find_map(|q| self.way_and_line(robot, &q, to, near).ok()).ok_or(Refused::NoWay)
    }

    /// Takes a posture, then brings the tip to a pose on a straight line; stays as it is where either cannot be done.
    fn way_and_line(
        &mut self,
        robot: InstanceId,
        q: &[f64],
        to: &Pose,
        near: &[InstanceId],
    ) -> Result<[Part; 2], Refused> {
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (before, arm) = (actor.joints.clone(), actor.arm.clone());
        let first = self.way(robot, &arm, q, Some(TURNING));
        let both = first.and_then(|first| Ok([first, self.line(robot, std::slice::from_ref(to), near)?]));
        if let (Err(_), Some(actor)) = (&both, self.actors.get_mut(&robot)) {
            actor.joints = before;
        }
        both
    }
}
