//! Ways of a robot's joints: free ones, and straight lines of its tip; and how fast they are gone.

use std::sync::Arc;

use matterix_ir::pose::Pose;
use matterix_ir::robot::JointLimits;
use matterix_ir::scene::InstanceId;
use matterix_motion::plan::{self, Blocked, Judge, Level, Stride};
use matterix_motion::pose::pose;
use matterix_motion::spheres::{Checker, Figure};
use matterix_motion::time::{Limits, follow};

use super::exact::Exact;
use super::performed::Part;
use super::refused::Refused;
use super::stage::{Actor, Stage};
use super::surroundings::{Surroundings, held};

/// Distance of checked configurations along a way, rad or m.
const FINENESS: f64 = 0.02;
/// Steps along a straight line.
pub(super) const STRIDE: Stride = Stride { linear: 0.01, angular: 0.05, jump: 0.35 };
/// From this share of a line on it ends there.
const LAST: f64 = 0.999;
/// Where a description gives no acceleration or jerk: times to full speed and to full acceleration, s (assumed).
const RAMP: (f64, f64) = (0.3, 0.1);

impl Stage<'_> {
    /// What a robot must not touch on a straight line: all but what it comes up to or leaves, and what that stands on.
    pub(super) fn beside_line(&self, robot: InstanceId, near: &[InstanceId]) -> Surroundings {
        let without = self.left_out(robot, near);
        let bodiless: Vec<InstanceId> = without.iter().flat_map(|id| self.owners(*id)).collect();
        Surroundings::of_but(self, robot, &without, &bodiless)
    }

    /// A free way of some joints to where they are to stand; the others do not move. What is held tilts by no more than so
    /// much on it, rad.
    pub(super) fn way(
        &mut self,
        robot: InstanceId,
        variables: &[usize],
        q: &[f64],
        within: Option<f64>,
    ) -> Result<Part, Refused> {
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let around = match variables == actor.drive {
            true => Surroundings::of_driving(self, robot),
            false => Surroundings::of(self, robot),
        };
        let figure = self.figure(robot, actor, variables)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        if self.is_weary() {
            return Err(Refused::NoWay);
        }
        let settings = self.search();
        let start = actor.positions(variables);
        let refused = |failure| match failure {
            plan::Failure::Collision(end, contacts) => {
                self.meeting(&figure, &around, &contacts, end == plan::End::Start).ending(end == plan::End::Goal)
            }
            plan::Failure::Tilt(_, by) => Refused::Tilted(by),
            _ => Refused::NoWay,
        };
        let part = match within.and_then(|tilt| self.upright(robot, tilt)) {
            Some(upright) => {
                let mut solver = actor.solver();
                let mut level = Level { checker: &mut checker, solver: &mut solver, upright };
                let route = plan::plan_upright(&mut level, &start, q, &settings);
                self.spent_on(level.checker, 0);
                let route = route.map_err(refused)?;
                timed(actor, variables, &route.points, Some(&mut level))?
            }
            None => {
                let route = plan::plan(&mut checker, &start, q, &settings);
                self.spent_on(&checker, 0);
                let route = route.map_err(refused)?;
                timed(actor, variables, &route.points, Some(&mut checker))?
            }
        };
        self.settle(robot, variables, q);
        Ok(part)
    }

    /// Straight lines of the tip from pose to pose; fingers may touch what it comes up to or leaves.
    pub(super) fn line(&mut self, robot: InstanceId, to: &[Pose], near: &[InstanceId]) -> Result<Part, Refused> {
        self.lines(robot, to, near, true)
    }

    /// As [`Stage::line`]; where it does not look at what it comes up to, that goes along with it.
    pub(super) fn lines(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        near: &[InstanceId],
        looks: bool,
    ) -> Result<Part, Refused> {
        let around = self.beside_line(robot, near);
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (base, arm) = (self.foot(robot).inverse(), actor.arm.clone());
        let figure = self.figure(robot, actor, &arm)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        let mut solver = actor.solver();
        let mut points = vec![actor.configuration()];
        for to in to {
            let from = points.last().cloned().unwrap_or_default();
            let to = pose(&base.then(*to));
            let before = checker.effort();
            let followed = plan::straight(&mut solver, &mut checker, &from, &to, &STRIDE);
            self.spent_on(&checker, before);
            let followed = followed.map_err(|blocked| match blocked {
                Blocked::Reach(_, far, turned) => Refused::OutOfReach(far, turned),
                Blocked::Collision(share, contacts) => {
                    self.meeting(&figure, &around, &contacts, false).ending(share > LAST)
                }
                Blocked::Endless | Blocked::Jump(..) => Refused::NoWay,
            })?;
            points.extend(followed.into_iter().skip(1));
        }
        if let Some(refused) = looks.then(|| self.bump(robot, &figure, near, &points)).flatten() {
            return Err(refused);
        }
        let part = timed(actor, &arm, &points, Some(&mut checker))?;
        let end = points.last().cloned().unwrap_or_default();
        self.settle(robot, &arm, &end);
        self.came.insert(robot, points);
        Ok(part)
    }

    /// Says what collides. What others sweep are balls, and a way around them is not worth asking true shapes.
    pub(super) fn checker<'a>(
        &self,
        figure: &'a Figure,
        around: &'a Surroundings,
        exact: &'a Exact<'_>,
    ) -> Checker<'a> {
        let checker = Checker::new(figure, &around.world, 1.0 / FINENESS);
        if self.around_sweeps { checker } else { checker.overruled_by(exact) }
    }

    pub(super) fn figure(&self, robot: InstanceId, actor: &Actor, moved: &[usize]) -> Result<Arc<Figure>, Refused> {
        let base = pose(&self.pose(robot));
        let held = held(self, robot, actor);
        self.figures.of((robot, actor), base, moved, held)
    }

    /// Joints of a robot stand like this from now on.
    pub(super) fn settle(&mut self, robot: InstanceId, variables: &[usize], q: &[f64]) {
        self.came.remove(&robot);
        if let Some(actor) = self.actors.get_mut(&robot) {
            actor.set_some(variables, q);
        }
    }

    /// Which joints of a robot move its tip.
    pub(super) fn arm(&self, robot: InstanceId) -> Vec<usize> {
        self.actors.get(&robot).map(|actor| actor.arm.clone()).unwrap_or_default()
    }
}

/// The motion of some joints of a robot from point to point, as fast as they may.
pub(super) fn timed(
    actor: &Actor,
    variables: &[usize],
    points: &[Vec<f64>],
    judge: Option<&mut dyn Judge>,
) -> Result<Part, Refused> {
    let limits = |f: fn(&JointLimits) -> f64| -> Vec<f64> {
        variables.iter().filter_map(|i| actor.tree.variables().get(*i)).map(|v| f(&v.limits)).collect()
    };
    let limits = Limits { velocity: limits(|l| l.velocity), acceleration: limits(acceleration), jerk: limits(jerk) };
    let trajectory = follow(points, &limits, judge).map_err(|_| Refused::NoWay)?;
    Ok(Part { wait: 0.0, joints: variables.to_vec(), trajectory })
}

/// The greatest acceleration of a joint, rad/s2 or m/s2.
pub(super) fn acceleration(limits: &JointLimits) -> f64 {
    limits.acceleration.unwrap_or(limits.velocity / RAMP.0)
}

/// The greatest jerk of a joint, rad/s3 or m/s3.
pub(super) fn jerk(limits: &JointLimits) -> f64 {
    limits.jerk.unwrap_or(acceleration(limits) / RAMP.1)
}
