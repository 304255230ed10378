//! Straight lines that begin in another posture, or turned: the line first, so that a way is looked for only to where a free
//! one begins.

use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::inverse::Request;
use matterix_motion::plan;
use matterix_motion::pose::pose;

use super::exact::Exact;
use super::performed::Part;
use super::postures::postures;
use super::stage::Stage;
use super::way::{STRIDE, timed};

/// How far what is held tilts while a gripper takes another posture, rad.
const TURNING: f64 = 0.1;
/// To how many free lines a way is looked for, and what share of what may still be looked at goes into each.
const TRIED: usize = 12;
const SHARE: u64 = 4;

/// One way to follow a line: from a configuration at one end of it to a pose at the other.
pub(super) struct Lead {
    pub(super) from: Vec<f64>,
    pub(super) to: Pose,
    /// Whether the configuration is at the end of the line.
    pub(super) back: bool,
}

impl Stage<'_> {
    /// Takes another posture with the tip where it is, from which a straight line leads to one of some poses; stays as it is
    /// where there is none. `nearest` are configurations at some of them.
    pub(super) fn line_from_elsewhere(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        nearest: &[(Pose, Vec<f64>)],
        near: &[InstanceId],
    ) -> Option<[Part; 2]> {
        let arm = self.arm(robot);
        let before = self.actors.get(&robot)?.joints.clone();
        let now = self.actors.get(&robot)?.configuration();
        let mut lines = Vec::new();
        for lead in self.leads(robot, to, nearest) {
            if lines.len() == TRIED || self.is_weary() {
                break;
            }
            lines.extend(self.led(robot, &lead, near));
        }
        let far = |points: &[Vec<f64>]| {
            let start = points.first().map(Vec::as_slice).unwrap_or_default();
            start.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum::<f64>()
        };
        lines.sort_by(|a, b| far(&a.1).total_cmp(&far(&b.1)));
        for (line, points) in lines {
            let (start, end) = (points.first()?, points.last()?.clone());
            if let Ok(first) = self.within_share(SHARE, |stage| stage.way(robot, &arm, start, Some(TURNING))) {
                self.settle(robot, &arm, &end);
                self.came.insert(robot, points);
                return Some([first, line]);
            }
            self.actors.get_mut(&robot)?.joints.clone_from(&before);
        }
        None
    }

    /// Ways to follow lines from where the tip is to some poses: turned on the spot, led back from all postures at their ends,
    /// and from all postures with the tip as it is; of each the nearest to where the robot is first.
    fn leads(&self, robot: InstanceId, to: &[Pose], nearest: &[(Pose, Vec<f64>)]) -> Vec<Lead> {
        let Some(actor) = self.actors.get(&robot) else { return Vec::new() };
        let (tip, now, base) = (self.tip(robot), actor.configuration(), self.foot(robot).inverse());
        let far = |lead: &Lead| lead.from.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let here = |target: &Pose| Pose { position: tip.position, ..*target };
        let (mut solver, mut turned, mut back) = (actor.solver(), Vec::new(), Vec::new());
        for (target, q) in nearest {
            let request = Request { attempts: 60, ..Request::new(pose(&base.then(here(target))), &now) };
            let solved = solver.solve(&request).ok();
            turned.extend(solved.map(|s| Lead { from: s.q, to: *target, back: false }));
            back.push(Lead { from: q.clone(), to: here(target), back: true });
        }
        for target in to {
            let ends = postures(self, robot, &[*target]).into_iter();
            back.extend(ends.map(|from| Lead { from, to: here(target), back: true }));
        }
        let starts = postures(self, robot, &[tip]);
        let pairs = starts.iter().flat_map(|from| nearest.iter().map(move |(to, _)| (from, to)));
        let mut forth: Vec<Lead> = pairs.map(|(from, to)| Lead { from: from.clone(), to: *to, back: false }).collect();
        back.sort_by(|a, b| far(a).total_cmp(&far(b)));
        forth.sort_by(|a, b| far(a).total_cmp(&far(b)));
        turned.into_iter().chain(back).chain(forth).collect()
    }

    /// The straight line of a lead, if nothing is in the way on it, with its configurations.
    pub(super) fn led(&self, robot: InstanceId, lead: &Lead, near: &[InstanceId]) -> Option<(Part, Vec<Vec<f64>>)> {
        let around = self.beside_line(robot, near);
        let actor = self.actors.get(&robot)?;
        let figure = self.figure(robot, actor, &actor.arm).ok()?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        let from: Vec<f32> = lead.from.iter().map(|v| *v as f32).collect();
        let free = checker.is_free(&from) || checker.ask(true) && checker.is_free(&from);
        let touches = |points: &[Vec<f64>]| self.bump(robot, &figure, near, points).is_some();
        let mut follow = || {
            if !free || touches(std::slice::from_ref(&lead.from)) {
                return None;
            }
            checker.ask(false);
            let to = pose(&self.foot(robot).inverse().then(lead.to));
            let mut points = plan::straight(&mut actor.solver(), &mut checker, &lead.from, &to, &STRIDE).ok()?;
            if lead.back {
                points.reverse();
            }
            let part = (!touches(&points)).then(|| timed(actor, &actor.arm, &points, Some(&mut checker)).ok());
            Some((part.flatten()?, points))
        };
        let followed = follow();
        self.spent_on(&checker, 0);
        followed
    }
}
