//! Brings the tip of a robot to where it is to go: away from what it let go, to a spot that is free, in a posture that is.

use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, frame};
use matterix_motion::inverse::{Request, Unreached};
use matterix_motion::pose::pose;

use super::goal::{carried_to, spots, targets_at};
use super::performed::{Part, Performed};
use super::postures::postures;
use super::refused::Refused;
use super::stage::Stage;

/// How far a gripper draws back from what it has let go before it goes elsewhere, m.
const RETREAT: f64 = 0.10;

/// After how many postures to which no way was found no other is tried.
const LOST: usize = 4;

/// How a tip is brought to a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Free,
    Straight,
    /// What is held tilts by no more than this, rad.
    Upright(f64),
}

impl Stage<'_> {
    /// What comes before a motion: a gripper draws back from what it has let go, and opens for what it goes to. Nothing is
    /// drawn back where `near` is what it let go.
    pub(super) fn depart(&mut self, robot: InstanceId, near: Option<InstanceId>) -> Result<Vec<Part>, Refused> {
        if let Some((item, other)) = self.bound(robot) {
            return Err(Refused::Bound(item, other));
        }
        let mut parts = Vec::new();
        if let Some(item) = self.just_freed(robot).filter(|item| Some(*item) != near) {
            parts.push(self.retreat(robot, item)?);
        }
        self.leave(robot);
        Ok(parts)
    }

    /// Draws a gripper back from what it has let go; where that leads beyond reach, the way it came, or less far.
    fn retreat(&mut self, robot: InstanceId, item: InstanceId) -> Result<Part, Refused> {
        let tip = self.tip(robot);
        let came = self.came.get(&robot).cloned().unwrap_or_default();
        let mut back = |far: f64| {
            let to = Pose { position: tip.point([0.0, 0.0, -far]), ..tip };
            self.line(robot, &[to], &[item])
        };
        let why = match back(RETREAT) {
            Err(why) if matches!(why, Refused::OutOfReach(..) | Refused::NoWay) => why,
            whole => return whole,
        };
        if let Some(part) = self.reversed(robot, &came, RETREAT, item) {
            return Ok(part);
        }
        let mut back = |far: f64| {
            let to = Pose { position: tip.point([0.0, 0.0, -far]), ..tip };
            self.line(robot, &[to], &[item]).ok()
        };
        [0.5, 0.25].iter().find_map(|share| back(share * RETREAT)).ok_or(why)
    }

    /// Brings a robot to a frame, or so far from it, m; what it holds to the nearest spot about it that is free and within
    /// reach.
    pub(super) fn bring(
        &mut self,
        robot: InstanceId,
        (goal, frame): (InstanceId, &str),
        shift: [f64; 3],
        way: Way,
    ) -> Result<Performed, Refused> {
        let mut spots = match carried_to(self, robot, goal, frame) {
            Some(held) => spots(self, held, goal),
            None => vec![Pose::IDENTITY],
        };
        if way == Way::Straight && spots.len() > 1 {
            // Straight down, not over to another spot.
            let tip = self.tip(robot).position;
            let far = |spot: &Pose| {
                let to = targets_at(self, robot, goal, frame, *spot).first().map_or(tip, |p| p.position);
                (0..3).map(|k| (to[k] - tip[k]) * (to[k] - tip[k])).sum::<f64>()
            };
            let mut near: Vec<(f64, Pose)> = spots.into_iter().map(|spot| (far(&spot), spot)).collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            spots = near.into_iter().map(|n| n.1).take(1).collect();
        }
        if spots.len() > 1 {
            let near: Vec<Pose> = spots.iter().copied().filter(|s| self.may_reach(robot, goal, frame, *s)).collect();
            spots = if near.is_empty() { spots.into_iter().take(1).collect() } else { near };
        }
        let before = (spots.len() > 1).then(|| self.clone());
        let mut refused = Refused::NoFrame;
        for (k, spot) in spots.into_iter().enumerate() {
            let to = shifted(targets_at(self, robot, goal, frame, spot), shift);
            if to.is_empty() {
                return Err(Refused::NoFrame);
            }
            match self.go(robot, &to, way, Some(goal)) {
                Ok(done) => return Ok(done),
                // The first spot says best what is wrong.
                Err(why) if k == 0 => refused = why,
                Err(_) => {}
            }
            if let Some(before) = &before {
                self.back_to(before);
            }
            if self.is_weary() {
                break;
            }
        }
        Err(refused)
    }

    /// Whether a short search finds a posture for one spot beside a frame, and for letting go there.
    fn may_reach(&self, robot: InstanceId, goal: InstanceId, frame: &str, spot: Pose) -> bool {
        let Some(actor) = self.actors.get(&robot) else { return false };
        if !actor.drive.is_empty() {
            return true;
        }
        let (base, now) = (self.foot(robot).inverse(), actor.configuration());
        let mut solver = actor.solver();
        let mut reaches = |frame: &str| {
            let to = targets_at(self, robot, goal, frame, spot).into_iter().next()?;
            let request = Request { attempts: 6, ..Request::new(pose(&base.then(to)), &now) };
            Some(solver.solve(&request).is_ok())
        };
        reaches(frame) == Some(true) && reaches(frame::PLACE) != Some(false)
    }

    pub(super) fn go(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        way: Way,
        goal: Option<InstanceId>,
    ) -> Result<Performed, Refused> {
        let mut parts = self.depart(robot, goal.filter(|_| way == Way::Straight))?;
        if let Some(item) = goal.filter(|_| self.held(robot).is_none()) {
            parts.extend(self.make_room(robot, item).filter(|part| part.trajectory.duration() > 0.0));
        }
        parts.extend(self.reach(robot, to, way, goal)?);
        Ok(Performed::new(robot, parts))
    }

    /// Brings the tip to one of some poses from where the robot stands.
    pub(super) fn stretch(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        way: Way,
        goal: Option<InstanceId>,
    ) -> Result<Vec<Part>, Refused> {
        let base = self.foot(robot).inverse();
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (now, arm) = (actor.configuration(), actor.arm.clone());
        let mut solver = actor.solver();
        let mut found: Vec<(f64, &Pose, Vec<f64>)> = Vec::new();
        let mut missed: Option<Unreached> = None;
        for target in to {
            let request = Request { choices: 4, attempts: 60, ..Request::new(pose(&base.then(*target)), &now) };
            match solver.solve(&request) {
                Ok(solution) => {
                    let far = solution.q.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum();
                    found.push((far, target, solution.q));
                }
                Err(near) if missed.as_ref().is_none_or(|m| near.linear + near.angular < m.linear + m.angular) => {
                    missed = Some(near);
                }
                Err(_) => {}
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut refused = missed.map(|m| Refused::OutOfReach(m.linear, m.angular)).unwrap_or(Refused::NoWay);
        if !found.is_empty() {
            refused = Refused::NoWay;
        }
        let mut keep = |why: Refused| {
            // What meets says more than that no way was found, and the nearest says most.
            if !matches!(refused, Refused::Collides(_)) {
                refused = why;
            }
        };
        for (_, target, q) in &found {
            let tried = match way {
                Way::Straight => self.line(robot, std::slice::from_ref(*target), goal.as_slice()),
                Way::Free => self.way(robot, &arm, q, None),
                Way::Upright(within) => self.way(robot, &arm, q, Some(within)),
            };
            match tried {
                Ok(part) => return Ok(vec![part]),
                Err(why) => keep(why),
            }
        }
        // What is in the way of a line may not be if the gripper turns before it sets out, or the arm takes another posture;
        // a line that ends beyond what one posture reaches may be within what another one does.
        if way == Way::Straight {
            let nearest: Vec<(Pose, Vec<f64>)> = found.iter().map(|(_, target, q)| (**target, q.clone())).collect();
            if let Some(parts) = self.line_from_elsewhere(robot, to, &nearest, goal.as_slice()) {
                return Ok(parts.into());
            }
        }
        // Another posture may be free where the nearest is not; a search that finds no way to one takes long.
        let within = match way {
            Way::Upright(within) => Some(within),
            Way::Free | Way::Straight => None,
        };
        let others = match refused {
            Refused::Collides(_) if way != Way::Straight => postures(self, robot, to),
            _ => Vec::new(),
        };
        let mut lost = 0;
        for q in others {
            match self.way(robot, &arm, &q, within) {
                Ok(part) => return Ok(vec![part]),
                Err(Refused::NoWay) if lost + 1 >= LOST || self.is_weary() => break,
                Err(Refused::NoWay) => lost += 1,
                Err(_) => {}
            }
        }
        Err(refused)
    }
}

/// Poses so far from where they were, m.
pub(super) fn shifted(mut all: Vec<Pose>, by: [f64; 3]) -> Vec<Pose> {
    all.iter_mut().for_each(|at| (0..3).for_each(|k| at.position[k] += by[k]));
    all
}
