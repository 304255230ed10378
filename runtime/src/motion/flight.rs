//! Robots that move at once: who is under way, and how another one keeps clear of them.
//!
//! Robots plan in the order in which their motions begin. A motion is planned with the others where they will come to
//! rest, so that it always fits once they have; then the least wait is looked for with which it keeps clear of their
//! balls at every moment until then. Where it would have to wait, a way around all that they sweep is tried too, and the
//! one that arrives first is taken.

use std::sync::Arc;

use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::meet::{self, Mover};
use matterix_motion::spheres::{Figure, Other};

use super::performed::Performed;
use super::refused::Refused;
use super::stage::Stage;
use super::surroundings::Surroundings;

/// How near robots that move at once may come to each other, m.
pub const APART: f64 = 0.01;
/// Distance of the waits that are tried, s.
const STEP: f64 = 0.1;
/// Samples drawn for a way around what others sweep, which is only looked for to save waiting.
const DETOUR: usize = 2_000;
/// Distance of the places at which what a robot sweeps is looked at, m.
const SWEEP: f64 = 0.04;

/// A robot that is under way.
#[derive(Clone, Debug)]
pub struct Flight {
    /// When it began, s since the run began.
    pub(super) begin: f64,
    pub(super) performed: Performed,
    /// The joints that move.
    joints: Vec<usize>,
    /// The robot and what it holds.
    figure: Arc<Figure>,
    load: Option<InstanceId>,
    /// The greatest of any of its balls, m/s.
    speed: f64,
}

impl Flight {
    /// When it ends, s since the run began.
    pub(super) fn end(&self) -> f64 {
        self.begin + self.performed.duration()
    }

    fn at(&self, time: f64) -> Vec<f64> {
        self.performed.at(&self.joints, time - self.begin).unwrap_or_default()
    }
}

/// A part of a motion that has been planned and not begun.
struct Candidate<'a> {
    robot: InstanceId,
    figure: &'a Figure,
    /// Where its joints are so long after it began, s.
    at: &'a dyn Fn(f64) -> Vec<f64>,
    /// s.
    lasts: f64,
    /// When it could begin, s since the run began.
    since: f64,
    /// What it may touch.
    near: Option<InstanceId>,
}

impl Stage<'_> {
    /// Lets time pass: what has arrived is no longer under way.
    pub fn come_to(&mut self, now: f64) {
        self.now = now;
        self.flights.retain(|_, flight| flight.end() > now);
    }

    /// Carries out a motion that begins now, clear of the robots that are under way; until it ends, others keep clear of
    /// it. What cannot be carried out leaves everything as it is.
    pub fn set_out(&mut self, motion: &Motion, values: &[f64]) -> Result<Option<Performed>, Refused> {
        let before = self.clone();
        let mut performed = match self.perform(motion, values) {
            Ok(Some(performed)) => performed,
            Ok(None) => return Ok(None),
            Err(refused) => {
                self.clone_from(&before);
                return Err(self.blamed(refused, motion, values));
            }
        };
        let near = motion.goal().map(|(goal, _)| goal);
        if self.hold_back(&mut performed, near) > 0.0 {
            let mut around = before;
            around.around_sweeps = true;
            let other = around.perform(motion, values);
            around.around_sweeps = false;
            if let Ok(Some(mut other)) = other {
                around.hold_back(&mut other, near);
                if other.duration() < performed.duration() {
                    (*self, performed) = (around, other);
                }
            }
        }
        self.is_off(&performed);
        Ok(Some(performed))
    }

    /// How often something has begun to move or changed hands so far.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// How many samples are drawn for a way, where so many are as a rule.
    pub(super) fn samples(&self, many: usize) -> usize {
        if self.around_sweeps || self.hasty { DETOUR } else { many }
    }

    /// Whether it is another robot that is in the way of a motion: it may go away.
    pub fn is_by_a_robot(&self, refused: &Refused) -> bool {
        let is_a_robot = |id: InstanceId| self.actors.contains_key(&id) || self.held_by(id).is_some();
        match refused {
            Refused::Collides(m) => m.part.is_some() || m.with.is_some_and(|w| self.held_by(w).is_some()),
            Refused::Swings(_, m) => m.with.is_some_and(is_a_robot),
            _ => false,
        }
    }

    /// The robot that an instance is, is part of or is held by.
    fn robot_with(&self, id: InstanceId) -> Option<InstanceId> {
        self.actor_of(id).or_else(|| self.held_by(id))
    }

    /// A motion that was carried out begins now.
    fn is_off(&mut self, performed: &Performed) {
        let robot = performed.robot;
        self.changes += 1;
        let Some(actor) = self.actors.get(&robot) else { return };
        let joints = performed.moved(actor);
        let Ok(figure) = self.figure(robot, actor, &joints) else { return };
        if joints.is_empty() {
            return;
        }
        let at = |t: f64| performed.at(&joints, t).unwrap_or_default();
        let speed = meet::speed(&Mover { figure: &figure, at: &at }, 0.0, performed.duration());
        let (begin, load, performed) = (self.now, self.held(robot), performed.clone());
        self.flights.insert(robot, Flight { begin, performed, joints, figure, load, speed });
    }

    /// The others that are under way after a time.
    fn under_way(&self, robot: InstanceId, since: f64) -> impl Iterator<Item = (InstanceId, &Flight)> {
        self.flights.iter().filter(move |(id, f)| **id != robot && f.end() > since).map(|(id, f)| (*id, f))
    }

    /// Lets the parts of a motion wait as long as they must to keep clear of robots that are under way; in all, s.
    fn hold_back(&self, performed: &mut Performed, near: Option<InstanceId>) -> f64 {
        let robot = performed.robot;
        let Some(actor) = self.actors.get(&robot) else { return 0.0 };
        let joints = performed.moved(actor);
        let Ok(figure) = self.figure(robot, actor, &joints) else { return 0.0 };
        let (mut begun, mut waited) = (0.0, 0.0);
        for index in 0..performed.parts.len() {
            let part = &performed.parts[index];
            let (lasts, goes) = (part.trajectory.duration(), part.joints.iter().any(|j| joints.contains(j)));
            if goes {
                let at = |t: f64| performed.at(&joints, begun + t).unwrap_or_default();
                let since = self.now + begun;
                let wait = self.wait(&Candidate { robot, figure: &figure, at: &at, lasts, since, near });
                performed.parts[index].wait = wait;
                waited += wait;
            }
            begun += performed.parts[index].wait + lasts;
        }
        waited
    }

    /// The least time, s, that a motion has to wait to keep clear of robots that are under way.
    fn wait(&self, candidate: &Candidate<'_>) -> f64 {
        let &Candidate { robot, figure, at, lasts, since, .. } = candidate;
        let last = self.under_way(robot, since).map(|(_, f)| f.end() - since).fold(0.0, f64::max);
        if last == 0.0 {
            return 0.0;
        }
        let speed = meet::speed(&Mover { figure, at }, 0.0, lasts);
        let steps = (last / STEP).ceil() as u32;
        let waits = (0..steps).map(|k| f64::from(k) * STEP);
        waits.into_iter().find(|wait| self.keeps_clear(candidate, *wait, speed)).unwrap_or(last)
    }

    fn keeps_clear(&self, candidate: &Candidate<'_>, wait: f64, speed: f64) -> bool {
        let Candidate { robot, figure, at, since, near, .. } = candidate;
        let begin = since + wait;
        let own = |t: f64| at((t - begin).max(0.0));
        let a = Mover { figure, at: &own };
        self.under_way(*robot, begin).all(|(_, flight)| {
            let other = |t: f64| flight.at(t);
            let b = Mover { figure: &flight.figure, at: &other };
            let links = flight.figure.links() as u32;
            let touched = flight.load.is_some() && flight.load == *near;
            let counts = |_: u32, theirs: u32| !(touched && theirs >= links);
            meet::meeting([&a, &b], [begin, flight.end()], APART, speed + flight.speed, &counts).is_none()
        })
    }

    /// A refusal for want of a way blames another robot, if there would be a way without.
    fn blamed(&self, refused: Refused, motion: &Motion, values: &[f64]) -> Refused {
        let (Refused::NoWay, Some(robot)) = (&refused, self.actor_of(motion.mover())) else { return refused };
        let mut alone = self.clone();
        alone.unknown.postures.extend(self.actors.keys().filter(|other| **other != robot));
        let Ok(Some(performed)) = alone.perform(motion, values) else { return refused };
        self.robot_between(&performed).unwrap_or(refused)
    }

    /// What another robot has in the way of a motion.
    fn robot_between(&self, performed: &Performed) -> Option<Refused> {
        let robot = performed.robot;
        let actor = self.actors.get(&robot)?;
        let joints = performed.moved(actor);
        let figure = self.figure(robot, actor, &joints).ok()?;
        let around = Surroundings::of(self, robot);
        let others: Vec<bool> = around.owners.iter().map(|owner| self.robot_with(*owner).is_some()).collect();
        let steps = (performed.duration() / STEP * 10.0).ceil().max(1.0) as u32;
        (0..=steps).find_map(|step| {
            let at = performed.at(&joints, performed.duration() * f64::from(step) / f64::from(steps))?;
            let mut met = figure.contacts(&around.world, &at);
            met.retain(|c| matches!(c.other, Other::Body(index) if others.get(index) == Some(&true)));
            (!met.is_empty()).then(|| self.meeting(&figure, &around, &met, step == 0))
        })
    }

    /// The balls of all that others sweep from now on.
    pub(super) fn sweeps(&self, robot: InstanceId) -> Vec<(InstanceId, String, Pose, f64)> {
        let mut out = Vec::new();
        for (id, flight) in self.under_way(robot, self.now) {
            let left = flight.end() - self.now;
            let steps = (flight.speed * left / SWEEP).ceil().clamp(1.0, 1e4) as u32;
            for step in 0..=steps {
                for link in flight.figure.placed(&flight.at(self.now + left * f64::from(step) / f64::from(steps))) {
                    let name = flight.figure.name(link.link);
                    let ball = |(at, radius): ([f64; 3], f64)| (id, name.to_string(), Pose::at(at), radius);
                    out.extend(link.balls.into_iter().map(|(at, r)| ball((at.into(), r + SWEEP / 2.0 + APART))));
                }
            }
        }
        out
    }
}
