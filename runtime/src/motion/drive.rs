//! Robots that drive: where to stand so that the arm reaches, and the way there.

use std::f64::consts::{PI, TAU};

use matterix_ir::math;
use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::inverse::{Request, Solver};
use matterix_motion::pose::pose;
use matterix_motion::spheres::Checker;

use super::bring::Way;
use super::effort::EFFORT;
use super::performed::{Part, Performed};
use super::refused::Refused;
use super::stage::{Actor, Stage};
use super::surroundings::Surroundings;
use super::tilt::LEVEL;

/// Distances from the target at which the foot of the arm is tried, m.
const DISTANCES: [f64; 5] = [0.65, 0.55, 0.75, 0.45, 0.85];
/// Directions around the target, and headings, that are tried at each distance.
const AROUND: u32 = 16;
/// Places that are driven to before a target counts as out of reach.
const PLACES: usize = 6;
/// How far the tip must get on from a place, back and forth along its own axis, m: approaches and retreats are driven
/// by the arm alone.
const ROOM: f64 = 0.12;

/// A place to stand.
pub(super) struct Place {
    /// What drives the robot about, rad or m.
    pub(super) drive: Vec<f64>,
    /// How far it is from where it stands.
    far: f64,
}

impl Stage<'_> {
    /// Brings the tip to one of some poses; a robot that drives goes where its arm reaches them.
    pub(super) fn reach(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        way: Way,
        goal: Option<InstanceId>,
    ) -> Result<Vec<Part>, Refused> {
        let straight = way == Way::Straight;
        let refused = match self.stretch(robot, to, way, goal) {
            Ok(parts) if straight || self.has_room(robot, to) => return Ok(parts),
            Ok(parts) => {
                // It reaches, but not beyond: another place is better where there is one.
                let there = self.clone();
                match self.visit(robot, to, way, goal) {
                    Some(parts) => return Ok(parts),
                    None => *self = there,
                }
                return Ok(parts);
            }
            Err(refused) => refused,
        };
        match straight {
            true => Err(refused),
            false => self.visit(robot, to, way, goal).ok_or(refused),
        }
    }

    /// Drives a robot to a frame, its arm folded if its hand is empty; with something in hand the arm stays as it is.
    pub(super) fn drive(&mut self, robot: InstanceId, goal: InstanceId, frame: &str) -> Result<Performed, Refused> {
        let to = self.frame(goal, frame).ok_or(Refused::NoFrame)?;
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (drive, arm) = (actor.drive.clone(), actor.arm.clone());
        let [x, y, turn] = drive[..] else { return Err(Refused::Fixed) };
        let there = self.pose(robot).inverse().then(to);
        let ahead = there.point([1.0, 0.0, 0.0]);
        let heading = math::atan2(ahead[1] - there.position[1], ahead[0] - there.position[0]);
        let now = actor.positions(&drive);
        let nearest = now[2] + wrapped(heading - now[2]);
        let mut joints = actor.joints.clone();
        (joints[x], joints[y], joints[turn]) = (0.0, 0.0, nearest);
        // What the last joint of the base carries comes there.
        let variables = actor.tree.variables();
        let last = variables.get(turn).and_then(|v| actor.assembly.robot.joints.get(v.joint as usize));
        let links = actor.tree.poses(&joints);
        let base = last.and_then(|j| links.get(j.child as usize)).map(matterix_motion::placement).unwrap_or_default();
        let q = vec![there.position[0] - base.position[0], there.position[1] - base.position[1], nearest];
        for (variable, value) in drive.iter().zip(&q) {
            let Some(v) = variables.get(*variable) else { continue };
            if *value < v.limits.lower || *value > v.limits.upper {
                let name = actor.assembly.robot.joints.get(v.joint as usize).map(|j| j.name.clone());
                return Err(Refused::Beyond(name.unwrap_or_default()));
            }
        }
        let home: Vec<f64> = arm.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect();
        let mut parts = self.depart(robot, None)?;
        if self.held(robot).is_none() {
            parts.extend(self.way(robot, &arm, &home, None).ok());
        }
        parts.push(self.way(robot, &drive, &q, None)?);
        Ok(Performed::new(robot, parts))
    }

    /// Whether a robot stands for good, or so that its tip gets on from one of these poses.
    fn has_room(&self, robot: InstanceId, to: &[Pose]) -> bool {
        let Some(actor) = self.actors.get(&robot).filter(|a| !a.drive.is_empty()) else { return true };
        let mut solver = actor.solver();
        let tip = self.tip(robot);
        let near = |at: &&Pose| (0..3).all(|k| (at.position[k] - tip.position[k]).abs() < 1e-3);
        to.iter().filter(near).any(|at| gets_on(&mut solver, &self.foot(robot), at, &actor.configuration()))
    }

    /// Drives to where the arm reaches one of some poses, and reaches it.
    fn visit(&mut self, robot: InstanceId, to: &[Pose], way: Way, goal: Option<InstanceId>) -> Option<Vec<Part>> {
        let (drive, arm, home) = {
            let actor = self.actors.get(&robot).filter(|actor| !actor.drive.is_empty())?;
            let home: Vec<f64> = actor.arm.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect();
            (actor.drive.clone(), actor.arm.clone(), home)
        };
        let within = match way {
            Way::Upright(within) => Some(within),
            // What stands upright in the hand stays so on the way.
            Way::Free | Way::Straight => self.is_held_upright(robot).then(|| self.steady(robot).min(LEVEL)),
        };
        for place in self.places(robot, to, &drive).into_iter().take(PLACES) {
            self.refresh(EFFORT / 2);
            let before = self.clone();
            let mut parts = Vec::new();
            // On the way the arm is where it is at home, if it gets there.
            parts.extend(self.way(robot, &arm, &home, within).ok());
            let driven = self.way(robot, &drive, &place.drive, None).and_then(|part| {
                parts.push(part);
                self.stretch(robot, to, way, goal)
            });
            if let Ok(reached) = driven {
                parts.extend(reached);
                return Some(parts);
            }
            self.back_to(&before);
        }
        None
    }

    /// Places where the robot is free to stand and from which its arm gets to one of some poses and on; the nearest first.
    pub(super) fn places(&self, robot: InstanceId, to: &[Pose], drive: &[usize]) -> Vec<Place> {
        let (Some(actor), [x, y, turn]) = (self.actors.get(&robot), drive) else { return Vec::new() };
        let around = Surroundings::of_driving(self, robot);
        let Ok(figure) = self.figure(robot, actor, drive) else { return Vec::new() };
        let mut checker = Checker::new(&figure, &around.world, 1.0);
        let mut solver = actor.solver();
        let home: Vec<f64> = actor.arm.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect();
        let now = actor.positions(drive);
        let own = self.pose(robot).inverse();
        let angle = |n: u32| TAU * f64::from(n) / f64::from(AROUND);
        let shoulder = shoulder(actor);
        // Where the arm reaches from when the base is in the middle tells where the base is for an arm elsewhere.
        let turned = |heading: u32| {
            let nearest = now[2] + wrapped(angle(heading) - now[2]);
            let mut joints = actor.joints.clone();
            (joints[*x], joints[*y], joints[*turn]) = (0.0, 0.0, nearest);
            let links = actor.tree.poses(&joints);
            let foot = links.get(actor.assembly.base as usize).map(matterix_motion::placement)?;
            Some((nearest, foot.then(shoulder).position))
        };
        let turned: Vec<(f64, [f64; 3])> = (0..AROUND).filter_map(turned).collect();
        let mut found = Vec::new();
        for target in to {
            let at = own.point(target.position);
            let all = DISTANCES.iter().flat_map(|d| (0..AROUND).map(move |side| (*d, angle(side))));
            for ((distance, side), (nearest, reach)) in all.flat_map(|way| turned.iter().map(move |turn| (way, *turn)))
            {
                let wanted = [at[0] + distance * math::cos(side), at[1] + distance * math::sin(side)];
                let place = vec![wanted[0] - reach[0], wanted[1] - reach[1], nearest];
                let far = place.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
                found.push((far, place, *target));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut out: Vec<Place> = Vec::new();
        for (far, place, target) in found {
            if out.len() == PLACES {
                break;
            }
            let point: Vec<f32> = place.iter().map(|v| *v as f32).collect();
            if !checker.is_clear(&point, &[0.0; 3], 0.0) {
                continue;
            }
            let mut joints = actor.joints.clone();
            drive.iter().zip(&place).for_each(|(variable, q)| joints[*variable] = *q);
            let links = actor.tree.poses(&joints);
            let Some(foot) = links.get(actor.assembly.base as usize).map(matterix_motion::placement) else { continue };
            let foot = self.pose(robot).then(foot);
            if gets_on(&mut solver, &foot, &target, &home) {
                out.push(Place { drive: place, far });
            }
        }
        out.sort_by(|a, b| a.far.total_cmp(&b.far));
        out
    }
}

/// Where the first joint of an arm is, in the frame of the arm's base.
fn shoulder(actor: &Actor) -> Pose {
    let first = actor.chain.variables().first().and_then(|v| actor.assembly.robot.joints.get(v.joint as usize));
    let fixed = matterix_motion::Chain::new(&actor.assembly.robot, actor.assembly.base, first.map_or(0, |j| j.parent));
    fixed.map_or(Pose::IDENTITY, |chain| matterix_motion::placement(&chain.tip(&vec![0.0; chain.variables().len()])))
}

/// Whether an arm with its base there brings its tip to a pose, and some way back and forth from it.
fn gets_on(solver: &mut Solver, foot: &Pose, at: &Pose, start: &[f64]) -> bool {
    let back = foot.inverse();
    let mut start = start.to_vec();
    [0.0, ROOM, -ROOM].iter().all(|along| {
        let target = pose(&back.then(at.then(Pose::up(*along))));
        let request = Request { attempts: 12, ..Request::new(target, &start) };
        match solver.solve(&request) {
            Ok(solution) => {
                start = solution.q;
                true
            }
            Err(_) => false,
        }
    })
}

/// An angle by whole turns within half a turn of 0, rad.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * ((angle + PI) / TAU).floor()
}
