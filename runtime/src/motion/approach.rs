//! What straight lines lead to: a robot may touch there what it grips, with its fingers, and what it puts down may stand on
//! its place; nothing may reach into anything.

use matterix_ir::scene::InstanceId;
use matterix_motion::placement;
use matterix_motion::spheres::{ASKED, Checker, Figure, Other};

use super::exact::Exact;
use super::performed::Part;
use super::refused::Refused;
use super::stage::{Actor, Stage};
use super::surroundings::Surroundings;
use super::way::timed;

/// How much less far than asked for is far enough, m.
const LOOSE: f64 = 1e-3;

/// Greatest change of any joint between two configurations that are looked at, rad or m: 5 mm of a point at a metre's reach.
const FINE: f64 = 0.005;

impl Actor {
    /// Whether a link is a finger: moved by what opens and closes the gripper.
    pub fn is_finger(&self, link: u32) -> bool {
        let robot = &self.assembly.robot;
        let mut next = link;
        while next >= self.assembly.tools {
            let Some(joint) = robot.joints.iter().position(|j| j.child == next) else { return false };
            let (own, follows) = (joint as u32, robot.joints[joint].mimic.map(|m| m.joint));
            let moves = |variable: &usize| {
                let of = self.tree.variables().get(*variable).map(|v| v.joint);
                of == Some(own) || of.is_some() && of == follows
            };
            if self.fingers.as_ref().is_some_and(|f| f.joints.iter().any(moves)) {
                return true;
            }
            next = robot.joints[joint].parent;
        }
        false
    }
}

impl Stage<'_> {
    /// What straight motions leave out of what they look at on their way: what they come up to or leave, and what that stands
    /// on.
    pub(super) fn left_out(&self, robot: InstanceId, near: &[InstanceId]) -> Vec<InstanceId> {
        let mut out = Vec::new();
        for id in near {
            out.push(*id);
            // No hand that holds it.
            out.extend(self.stand_of(*id).map(|below| self.whole(below)));
        }
        out.extend(self.held(robot).and_then(|held| self.stood_on(held)).map(|on| self.whole(on)));
        out
    }

    /// Leads a robot back along the straight line on which it came, until its tip is so far from where it is, m; none where it
    /// did not come on one, or something is in the way of its open gripper.
    pub(super) fn reversed(
        &mut self,
        robot: InstanceId,
        came: &[Vec<f64>],
        far: f64,
        near: InstanceId,
    ) -> Option<Part> {
        let actor = self.actors.get(&robot)?;
        if came.last() != Some(&actor.configuration()) {
            return None;
        }
        let tip = |q: &[f64]| placement(&actor.chain.tip(q)).position;
        let from = tip(came.last()?);
        let gone = |q: &Vec<f64>| {
            let at = tip(q);
            (0..3).map(|k| (at[k] - from[k]) * (at[k] - from[k])).sum::<f64>().sqrt()
        };
        let back = came.iter().rev();
        let count = back.clone().position(|q| gone(q) >= far - LOOSE).map_or(came.len(), |k| k + 1);
        let points: Vec<Vec<f64>> = back.take(count).cloned().collect();
        let around = self.beside_line(robot, &[near]);
        let figure = self.figure(robot, actor, &actor.arm).ok()?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        let free = |checker: &mut Checker<'_>| points.windows(2).all(|way| is_clear(checker, &way[0], &way[1]));
        let passes = points.len() > 1 && (free(&mut checker) || checker.ask(true) && free(&mut checker));
        if !passes || self.bump(robot, &figure, &[near], &points).is_some() {
            return None;
        }
        let arm = actor.arm.clone();
        let part = timed(actor, &arm, &points, Some(&mut checker)).ok()?;
        let end = points.last()?.clone();
        self.settle(robot, &arm, &end);
        Some(part)
    }

    /// What a robot runs into, along configurations on a straight line, of what that leaves out; none where it only comes as
    /// near to it as it must.
    pub(super) fn bump(
        &self,
        robot: InstanceId,
        figure: &Figure,
        near: &[InstanceId],
        points: &[Vec<f64>],
    ) -> Option<Refused> {
        let actor = self.actors.get(&robot)?;
        let left_out = self.left_out(robot, near);
        if left_out.is_empty() {
            return None;
        }
        let around = Surroundings::of_only(self, robot, &left_out);
        let exact = Exact::of(self, robot, figure, &around);
        let empty = self.held(robot).is_none();
        let spared = |link: u32, other: &Other| match other {
            Other::Body(index) => {
                let owner = around.owners.get(*index);
                empty && actor.is_finger(link) && owner.is_some_and(|owner| self.is_in_any(*owner, near))
            }
            // How the robot stands to itself has been looked at.
            Other::Link(_) => true,
        };
        let mut last: Option<&Vec<f64>> = None;
        for point in points {
            let from = last.unwrap_or(point);
            let far = from.iter().zip(point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let steps = (far / FINE).ceil().max(1.0) as u32;
            for step in 1..=steps {
                let share = f64::from(step) / f64::from(steps);
                let q: Vec<f64> = from.iter().zip(point).map(|(a, b)| a + share * (b - a)).collect();
                self.spend(ASKED);
                let met = exact.touches(&q, &spared);
                if !met.is_empty() {
                    return Some(self.meeting(figure, &around, &met, false));
                }
            }
            last = Some(point);
        }
        None
    }
}

/// Whether a robot is free all along the line between two configurations.
pub(super) fn is_clear(checker: &mut Checker<'_>, from: &[f64], to: &[f64]) -> bool {
    let from: Vec<f32> = from.iter().map(|v| *v as f32).collect();
    let vector: Vec<f32> = from.iter().zip(to).map(|(a, b)| *b as f32 - a).collect();
    let length = vector.iter().map(|v| v * v).sum::<f32>().sqrt();
    checker.is_clear(&from, &vector, length)
}
