//! Keeping what is held upright, and tilting it about a point of it, as for pouring.

use std::f64::consts::{FRAC_PI_4, PI};

use matterix_ir::math::{acos, cos};
use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::inverse::Request;
use matterix_motion::plan::Upright;
use matterix_motion::pose::{distance, pose};

use super::carried::Carried;
use super::performed::{Part, Performed};
use super::refused::Refused;
use super::stage::Stage;

/// What tilts by less than this counts as upright, rad.
pub(super) const LEVEL: f64 = 0.1;
/// Greatest tilt between two poses on the way, rad.
const STEP: f64 = 0.15;
/// What is nearer than this to where it would be over the frame is there, m and rad.
const THERE: f64 = 2e-3;
/// How many ways of tilting are tried, the nearest first.
const TRIED: usize = 8;
/// Greatest cosine between the way a vessel is tilted and the line from finger to finger: what flows out passes beside them.
const BESIDE: f64 = 0.5;

/// One way to tilt: poses of the tip by the angle of what it holds.
struct Tilting {
    to: Pose,
    point: Pose,
    inner: Pose,
    /// How high the point is above the base of what is held, m.
    height: f64,
    /// How far from the frame the point is held once it is tilted, m: the way it sinks, aside, up.
    shift: [f64; 3],
}

/// How something is tilted over a frame already: its angle, rad, and how far from the frame its point is, m, as in [`Tilting::shift`].
#[derive(Clone, Copy)]
struct Begun {
    angle: f64,
    off: [f64; 3],
}

impl Tilting {
    /// With the point so far from the frame.
    fn at(&self, angle: f64, off: [f64; 3]) -> Pose {
        self.to.then(Pose::at(off)).then(about_y(angle)).then(self.point).then(self.inner)
    }

    /// With the base no lower than the frame.
    fn above(&self, angle: f64) -> Pose {
        let [x, y, z] = self.shift;
        self.at(angle, [x, y, z.max(self.height * cos(angle).max(0.0))])
    }

    /// From upright to an angle: tilted above the frame, and brought down to it tilted. From one angle to another one with the point
    /// going straight to where it is held then; to upright above the frame.
    fn poses(&self, begun: Option<Begun>, to: f64) -> Vec<Pose> {
        let begin = begun.map_or(0.0, |begun| begun.angle);
        let steps = ((to - begin).abs() / STEP).ceil().max(1.0) as u32;
        let angle = |k: u32| begin + (to - begin) * f64::from(k) / f64::from(steps);
        let part = |from: f64, to: f64, k: u32| from + (to - from) * f64::from(k) / f64::from(steps);
        match begun {
            Some(begun) if to > LEVEL || to > begun.angle => {
                let off = |k: u32| [0, 1, 2].map(|i| part(begun.off[i], self.shift[i], k));
                (1..=steps).map(|k| self.at(angle(k), off(k))).collect()
            }
            Some(_) => (0..=steps).map(|k| self.above(angle(k))).collect(),
            None => {
                let down = (to > 0.0).then(|| self.at(to, self.shift)).filter(|_| to > LEVEL || self.shift[2] > 0.0);
                (1..=steps).map(|k| self.above(angle(k))).chain(down).collect()
            }
        }
    }

    /// How it is tilted already, if the tip is where it is then, whatever its height.
    fn begun(&self, angle: f64, tip: Pose) -> Option<Begun> {
        let here = self.at(angle, [0.0; 3]);
        let away = [0, 1, 2].map(|k| self.to.position[k] + tip.position[k] - here.position[k]);
        let off = self.to.inverse().point(away);
        let aside = off[0] - self.shift[0];
        let (aside, turned) = (aside.hypot(off[1] - self.shift[1]), distance(&pose(&here), &pose(&tip)).1);
        (aside < THERE && turned < THERE).then_some(Begun { angle, off })
    }
}

impl Stage<'_> {
    /// What must not tilt while a robot moves, if it holds anything.
    pub(super) fn upright(&self, robot: InstanceId, tilt: f64) -> Option<Upright> {
        let (_, inner) = self.inner(robot)?;
        Some(Upright::of(&pose(&inner), &pose(&self.foot(robot).inverse()), tilt))
    }

    /// Whether a robot holds something that stands upright.
    pub(super) fn is_held_upright(&self, robot: InstanceId) -> bool {
        self.held(robot).is_some_and(|held| tilt_of(self.pose(held)) < LEVEL)
    }

    /// What a robot holds and where, relative to its tip.
    fn inner(&self, robot: InstanceId) -> Option<(InstanceId, Pose)> {
        let held = self.held(robot)?;
        match self.carried.get(held.0 as usize)? {
            Carried::Held(_, inner) => Some((held, *inner)),
            Carried::Stands(_) => None,
        }
    }

    /// Tilts what a robot holds about a point of it that is brought to a frame.
    pub(super) fn tilt(
        &mut self,
        robot: InstanceId,
        (item, point): (InstanceId, &str),
        (goal, frame): (InstanceId, &str),
        (angle, shift): (f64, [f64; 3]),
        parts: Vec<Part>,
    ) -> Result<Performed, Refused> {
        let (_, inner) = self.inner(robot).filter(|(held, _)| *held == item).ok_or(Refused::NotHeld)?;
        if !(0.0..=PI).contains(&angle) {
            return Err(Refused::Tilted(angle));
        }
        let to = self.frame(goal, frame).ok_or(Refused::NoFrame)?;
        let point = self.scene.get(item).frames.iter().find(|f| f.name == point && !f.stand);
        let point = point.map(|f| f.pose).ok_or(Refused::NoFrame)?;
        let now = tilt_of(self.pose(item));
        let ways = self.ways(robot, item, (to, shift), point, inner);
        // What is hardly tilted yet may be on its way all the same.
        let tip = self.tip(robot);
        let is_begun = now >= LEVEL || ways.iter().any(|way| way.begun(now, tip).is_some());
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (before, arm) = (actor.joints.clone(), actor.arm.clone());
        let level = self.steady(robot).min(LEVEL);
        let mut refused = Refused::NoWay;
        let mut keep = |why: Refused| {
            if !matches!(refused, Refused::Collides(_)) {
                refused = why;
            }
        };
        for (way, begun, q) in self.nearest_first(robot, ways, is_begun.then_some(now), &mut keep) {
            let mut done = parts.clone();
            let brought = match begun {
                None => self.way(robot, &arm, &q, Some(level)).map(|part| done.push(part)),
                Some(_) => Ok(()),
            };
            let poses = way.poses(begun, angle);
            match brought.and_then(|()| self.line(robot, &poses, &[])) {
                Ok(part) => {
                    done.push(part);
                    return Ok(Performed::new(robot, done));
                }
                Err(why) => keep(why),
            }
            if let Some(actor) = self.actors.get_mut(&robot) {
                actor.joints.clone_from(&before);
            }
        }
        Err(refused)
    }

    /// All ways to tilt: from any side; what is round over any point of its rim that is not under a finger.
    fn ways(
        &self,
        robot: InstanceId,
        item: InstanceId,
        (to, shift): (Pose, [f64; 3]),
        point: Pose,
        inner: Pose,
    ) -> Vec<Tilting> {
        let round = self.scene.get(item).shape.as_ref().is_some_and(|s| s.is_round());
        let spins = if round { 8 } else { 1 };
        let has_fingers = self.actors.get(&robot).is_some_and(|a| a.fingers.is_some());
        let mut out = Vec::new();
        for spin in 0..spins {
            let point = about_z(f64::from(spin) * FRAC_PI_4).then(point);
            let over = inner.then(point);
            let (begin, end) = (over.position, over.point([1.0, 0.0, 0.0]));
            if has_fingers && round && (end[1] - begin[1]).abs() > BESIDE {
                continue;
            }
            for side in 0..8 {
                let to = to.then(about_z(f64::from(side) * FRAC_PI_4));
                let height = point.position[2];
                out.push(Tilting { to, point: point.inverse(), inner: inner.inverse(), height, shift });
            }
        }
        out
    }

    /// The ways nearest to how a robot stands now, with the configurations in which they begin.
    fn nearest_first(
        &self,
        robot: InstanceId,
        ways: Vec<Tilting>,
        tilted: Option<f64>,
        missed: &mut dyn FnMut(Refused),
    ) -> Vec<(Tilting, Option<Begun>, Vec<f64>)> {
        let Some(actor) = self.actors.get(&robot) else { return Vec::new() };
        let (base, here) = (self.foot(robot).inverse(), actor.configuration());
        let mut solver = actor.solver();
        let tip = self.tip(robot);
        let mut found: Vec<(f64, Tilting, Option<Begun>, Vec<f64>)> = Vec::new();
        for way in ways {
            if let Some(angle) = tilted {
                let begun = way.begun(angle, tip);
                let (far, turned) = distance(&pose(&way.at(angle, way.shift)), &pose(&tip));
                // What is tilted, but elsewhere, is brought there as it is.
                let far = if begun.is_some() { 0.0 } else { far + turned };
                let begun = begun.unwrap_or(Begun { angle, off: way.shift });
                found.push((far, way, Some(begun), here.clone()));
                continue;
            }
            match solver.solve(&Request::new(pose(&base.then(way.above(0.0))), &here)) {
                Ok(solution) => {
                    let far = solution.q.iter().zip(&here).map(|(a, b)| (a - b) * (a - b)).sum();
                    found.push((far, way, None, solution.q));
                }
                Err(off) => missed(Refused::OutOfReach(off.linear, off.angular)),
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(TRIED);
        found.into_iter().map(|(_, way, begun, q)| (way, begun, q)).collect()
    }
}

/// The angle between a thing's z axis and up, rad.
pub(super) fn tilt_of(at: Pose) -> f64 {
    let up = pose(&at).rotation.matrix()[(2, 2)];
    acos(up.clamp(-1.0, 1.0))
}

fn about_y(angle: f64) -> Pose {
    Pose::turned([0.0; 3], [0.0, angle, 0.0])
}

fn about_z(angle: f64) -> Pose {
    Pose::turned([0.0; 3], [0.0, 0.0, angle])
}
