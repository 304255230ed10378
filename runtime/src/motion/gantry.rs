//! Gantries: robots whose joints all slide. They go up, across and down.

use std::sync::Arc;

use matterix_ir::pose::Pose;
use matterix_ir::robot::JointKind;
use matterix_ir::scene::InstanceId;
use matterix_motion::pose::{distance, pose};
use matterix_motion::spheres::{Checker, Contact, Held};
use matterix_motion::{Chain, Variable};

use super::approach::is_clear;
use super::exact::Exact;
use super::perform::TOLERANCE;
use super::performed::Performed;
use super::refused::Refused;
use super::stage::{Actor, Stage};
use super::surroundings::{SLACK, Surroundings};
use super::way::timed;

/// Heights at which a crossing is tried are so far apart, m.
const STEP: f64 = 0.01;
/// Radius of what hangs below the tool, distance of the balls that stand for it, and fineness of the way across, m.
const HANGING: f64 = 0.004;
/// Places of a way at most at which it is asked what is in the way.
const MOST: f64 = 1000.0;

impl Actor {
    /// Whether all that moves its tip slides, so that the tip never turns.
    pub fn is_gantry(&self) -> bool {
        let slides = |v: &Variable| v.kind == JointKind::Prismatic;
        self.drive.is_empty() && !self.arm.is_empty() && self.chain.variables().iter().all(slides)
    }
}

impl Stage<'_> {
    /// What moves next is the tool that is mounted on the robot by this instance.
    pub(super) fn take(&mut self, robot: InstanceId, mover: InstanceId) -> Result<(), Refused> {
        let on = std::iter::successors(Some(mover), |id| self.scene.get(*id).owner);
        let link = on.take_while(|id| *id != robot).find_map(|id| self.scene.get(id).link);
        link.map_or(Ok(()), |link| self.take_link(robot, link))
    }

    /// What moves next is what is on this link of the robot.
    pub(super) fn take_link(&mut self, robot: InstanceId, link: u32) -> Result<(), Refused> {
        let Some(actor) = self.actors.get_mut(&robot) else { return Ok(()) };
        if actor.assembly.tip == link {
            return Ok(());
        }
        let chain = Chain::new(&actor.assembly.robot, actor.assembly.base, link).map_err(|_| Refused::NoRobot)?;
        let place = |v: &Variable| actor.tree.variables().iter().position(|other| other.joint == v.joint);
        actor.arm = chain.variables().iter().filter_map(place).collect();
        Arc::make_mut(&mut actor.assembly).tip = link;
        actor.chain = Arc::new(chain);
        Ok(())
    }

    /// Brings the tip to one of some poses: up by its last joint to the least height at which the way is free, across, and
    /// down to `goal`. `hanging` is how far something hangs below the tip, m. What else slides goes to where it is at home first.
    pub(super) fn cross(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        goal: InstanceId,
        hanging: f64,
    ) -> Result<Performed, Refused> {
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let now = actor.configuration();
        let there = self.settled(robot, actor, &now, to)?;
        let last = now.len().saturating_sub(1);
        let level = now[..last].iter().zip(&there[..last]).all(|(a, b)| (a - b).abs() < 1e-6);
        let others: Vec<usize> = (0..actor.joints.len()).filter(|i| !actor.arm.contains(i)).collect();
        let home: Vec<f64> = others.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect();
        // It crosses and lowers with the rest at home already.
        let mut raised = actor.clone();
        raised.set_some(&others, &home);
        let mut stops = vec![now.clone()];
        if !level {
            let height = self.height(robot, &raised, &now, &there, hanging)?;
            for from in [&now, &there] {
                let mut above = from.clone();
                above[last] = height;
                stops.push(above);
            }
        }
        stops.push(there.clone());
        self.lowers_freely(robot, &raised, goal, &stops)?;
        let mut parts = Vec::new();
        let away = actor.positions(&others);
        if away.iter().zip(&home).any(|(a, b)| (a - b).abs() > 1e-6) {
            parts.push(timed(actor, &others, &[away, home.clone()], None)?);
        }
        for way in stops.windows(2).filter(|way| way[0] != way[1]) {
            parts.push(timed(actor, &actor.arm, way, None)?);
        }
        let arm = actor.arm.clone();
        self.settle(robot, &others, &home);
        self.settle(robot, &arm, &there);
        Ok(Performed::new(robot, parts))
    }

    /// Where the joints stand that bring the tip to one of some poses.
    fn settled(&self, robot: InstanceId, actor: &Actor, now: &[f64], to: &[Pose]) -> Result<Vec<f64>, Refused> {
        let foot = self.foot(robot).inverse();
        let tip = actor.chain.tip(now);
        let turned = |t: &Pose| distance(&tip, &pose(&foot.then(*t))).1;
        let nearest = to.iter().map(|t| (turned(t), t)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((turned, target)) = nearest.filter(|n| n.0 <= TOLERANCE.1) else {
            return Err(Refused::OutOfReach(0.0, nearest.map_or(0.0, |n| n.0)));
        };
        let target = foot.then(*target).position;
        let away: [f64; 3] = std::array::from_fn(|k| target[k] - tip.translation.vector[k]);
        // Each joint moves the tip along a line, so that three of them are three equations.
        let lines: Vec<[f64; 3]> = (0..now.len())
            .map(|i| {
                let mut moved = now.to_vec();
                moved[i] += 1.0;
                let there = actor.chain.tip(&moved).translation.vector;
                std::array::from_fn(|k| there[k] - tip.translation.vector[k])
            })
            .collect();
        let moved = thirds(&lines, away).ok_or(Refused::OutOfReach(norm(away), turned))?;
        let q: Vec<f64> = now.iter().zip(moved).map(|(a, b)| a + b).collect();
        let beyond = |(v, q): (&Variable, &f64)| (v.limits.lower - q).max(q - v.limits.upper).max(0.0);
        let far = actor.chain.variables().iter().zip(&q).map(beyond).fold(0.0, f64::max);
        if far > 1e-6 { Err(Refused::OutOfReach(far, 0.0)) } else { Ok(q) }
    }

    /// The position of the last joint, as near to where it is as may be, at which the way across is free.
    fn height(
        &self,
        robot: InstanceId,
        actor: &Actor,
        now: &[f64],
        there: &[f64],
        hanging: f64,
    ) -> Result<f64, Refused> {
        let around = Surroundings::of(self, robot);
        let along = (0..=(hanging / HANGING) as u32).map(|k| [0.0, 0.0, f64::from(k) * HANGING]);
        let tool = Held {
            name: "its tool".to_string(),
            link: actor.assembly.tip,
            balls: along.map(|at| (at, HANGING - SLACK)).collect(),
            touching: (0..actor.assembly.robot.links.len() as u32).collect(),
        };
        let base = pose(&self.pose(robot));
        let figure = self.figures.of((robot, actor), base, &actor.arm, vec![tool])?;
        let mut checker = Checker::new(&figure, &around.world, 1.0 / HANGING);
        let last = now.len().saturating_sub(1);
        let (up, top) = self.upwards(actor, now);
        let lift = |q: f64| if up > 0.0 { q.min(top) } else { q.max(top) };
        let mut height = if up > 0.0 { now[last].max(there[last]) } else { now[last].min(there[last]) };
        loop {
            let [a, b] = [now, there].map(|q| {
                let mut q: Vec<f32> = q.iter().map(|v| *v as f32).collect();
                q[last] = height as f32;
                q
            });
            let vector: Vec<f32> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
            let length = vector.iter().map(|v| v * v).sum::<f32>().sqrt();
            let still = vec![0.0; a.len()];
            // A way is taken to begin at a free place.
            if checker.is_clear(&a, &still, 0.0) && checker.is_clear(&a, &vector, length) {
                return Ok(height);
            }
            if height == top {
                let [from, to] = [now, there].map(|q| {
                    let mut q = q.to_vec();
                    q[last] = top;
                    q
                });
                let contacts = first(&from, &to, |q| figure.contacts(&around.world, q));
                return Err(self.meeting(&figure, &around, &contacts, false));
            }
            height = lift(height + up * STEP);
        }
    }

    /// Whether nothing is in the way where a gantry comes down on a thing, but for that thing and what it stands in.
    fn lowers_freely(
        &self,
        robot: InstanceId,
        actor: &Actor,
        goal: InstanceId,
        stops: &[Vec<f64>],
    ) -> Result<(), Refused> {
        let [.., from, to] = stops else { return Ok(()) };
        let left_out = [self.whole(goal)];
        let around = Surroundings::of_but(self, robot, &left_out, &[]);
        let figure = self.figure(robot, actor, &actor.arm)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        if is_clear(&mut checker, from, to) || checker.ask(true) && is_clear(&mut checker, from, to) {
            return Ok(());
        }
        let contacts = first(to, from, |q| checker.contacts(q));
        Err(self.meeting(&figure, &around, &contacts, false))
    }

    /// The direction in which the last joint of a gantry raises its tip, and how far that goes.
    fn upwards(&self, actor: &Actor, now: &[f64]) -> (f64, f64) {
        let last = now.len().saturating_sub(1);
        let mut moved = now.to_vec();
        if let Some(q) = moved.get_mut(last) {
            *q += STEP;
        }
        let rises = actor.chain.tip(&moved).translation.z > actor.chain.tip(now).translation.z;
        let limits = actor.chain.variables().get(last).map(|v| [v.limits.lower, v.limits.upper]).unwrap_or_default();
        if rises { (1.0, limits[1]) } else { (-1.0, limits[0]) }
    }
}

/// What is met first on a straight way; nothing where none of the places looked at has a contact.
fn first(from: &[f64], to: &[f64], contacts: impl Fn(&[f64]) -> Vec<Contact>) -> Vec<Contact> {
    let far = from.iter().zip(to).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let steps = (far / HANGING).ceil().clamp(1.0, MOST) as u32;
    let at = |step: u32| {
        let share = f64::from(step) / f64::from(steps);
        from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect::<Vec<f64>>()
    };
    (0..=steps).map(|step| contacts(&at(step))).find(|met| !met.is_empty()).unwrap_or_default()
}

/// How far to go along each of three lines to get there; none where they lie in a plane or are not three.
fn thirds(lines: &[[f64; 3]], to: [f64; 3]) -> Option<[f64; 3]> {
    let [a, b, c] = <[[f64; 3]; 3]>::try_from(lines.to_vec()).ok()?;
    let volume = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    let whole = volume(a, b, c);
    (whole.abs() > 1e-9).then(|| [volume(to, b, c), volume(a, to, c), volume(a, b, to)].map(|part| part / whole))
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
