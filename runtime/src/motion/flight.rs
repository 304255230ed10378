//! Robots that move at once: who is under way, and how another one keeps clear of them.
//!
//! Robots plan in the order in which their motions begin. A motion is planned with the others where they will come to
//! rest, so that it always fits once they have; then the least wait is looked for with which it keeps clear of their
//! balls at every moment until then. Where it would have to wait, a way around all that they sweep is tried too, and the
//! one that arrives first is taken.

use std::sync::Arc;

use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::meet::{self, Mover};
use matterix_motion::spheres::Figure;
use matterix_motion::time::Trajectory;

use super::perform::{Performed, Refused};
use super::stage::Stage;
use super::surroundings::Surroundings;

/// How near robots that move at once may come to each other, m.
pub const APART: f64 = 0.01;
/// Distance of the waits that are tried, s.
const STEP: f64 = 0.1;
/// Distance of the places at which what a robot sweeps is looked at, m.
const SWEEP: f64 = 0.04;

/// A robot that is under way.
#[derive(Clone, Debug)]
pub struct Flight {
    /// When it began, s since the run began.
    begin: f64,
    performed: Performed,
    /// The joints that move its tip.
    arm: Vec<usize>,
    /// The robot and what it holds.
    figure: Arc<Figure>,
    load: Option<InstanceId>,
    /// The greatest of any of its balls, m/s.
    speed: f64,
}

impl Flight {
    /// When it ends, s since the run began.
    fn end(&self) -> f64 {
        self.begin + self.performed.duration()
    }

    fn at(&self, time: f64) -> Vec<f64> {
        self.performed.at(&self.arm, time - self.begin).unwrap_or_default()
    }
}

/// A motion that has been planned and not begun.
pub(super) struct Candidate<'a> {
    pub robot: InstanceId,
    pub figure: &'a Figure,
    pub part: &'a Trajectory,
    /// When it could begin, s since the run began.
    pub since: f64,
    /// Things it may touch.
    pub without: &'a [InstanceId],
}

impl Stage<'_> {
    /// Lets time pass: what has arrived is no longer under way.
    pub fn come_to(&mut self, now: f64) {
        self.now = now;
        self.flights.retain(|_, flight| flight.end() > now);
    }

    /// How often something has begun to move or changed hands so far.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Whether it is another robot that is in the way of a motion: it may go away.
    pub fn is_by_a_robot(&self, refused: &Refused) -> bool {
        matches!(refused, Refused::Collides(m) if m.with.is_some_and(|w| self.robot_with(w).is_some()))
    }

    /// The robot that an instance is, is part of or is held by.
    fn robot_with(&self, id: InstanceId) -> Option<InstanceId> {
        self.actor_of(id).or_else(|| self.held_by(id))
    }

    /// A motion that was carried out begins now; until it ends, others keep clear of it.
    pub fn depart(&mut self, performed: &Performed) {
        let robot = performed.robot;
        self.changes += 1;
        let Some(actor) = self.actors.get(&robot) else { return };
        let Ok(figure) = self.figure(robot, actor) else { return };
        let arm = actor.arm.clone();
        if performed.at(&arm, 0.0).is_none() {
            return;
        }
        let at = |t: f64| performed.at(&arm, t).unwrap_or_default();
        let speed = meet::speed(&Mover { figure: &figure, at: &at }, 0.0, performed.duration());
        let (begin, load, performed) = (self.now, self.held(robot), performed.clone());
        self.flights.insert(robot, Flight { begin, performed, arm, figure: Arc::new(figure), load, speed });
    }

    /// The others that are under way after a time.
    fn under_way(&self, robot: InstanceId, since: f64) -> impl Iterator<Item = (InstanceId, &Flight)> {
        self.flights.iter().filter(move |(id, f)| **id != robot && f.end() > since).map(|(id, f)| (*id, f))
    }

    /// The least time, s, that a motion has to wait to keep clear of robots that are under way.
    pub(super) fn wait(&self, candidate: &Candidate<'_>) -> f64 {
        let &Candidate { robot, figure, part, since, .. } = candidate;
        let last = self.under_way(robot, since).map(|(_, f)| f.end() - since).fold(0.0, f64::max);
        if last == 0.0 {
            return 0.0;
        }
        let own = |t: f64| part.at(t).position;
        let speed = meet::speed(&Mover { figure, at: &own }, 0.0, part.duration());
        let steps = (last / STEP).ceil() as u32;
        let waits = (0..steps).map(|k| f64::from(k) * STEP);
        waits.into_iter().find(|wait| self.keeps_clear(candidate, *wait, speed)).unwrap_or(last)
    }

    fn keeps_clear(&self, candidate: &Candidate<'_>, wait: f64, speed: f64) -> bool {
        let Candidate { robot, figure, part, since, without } = candidate;
        let begin = since + wait;
        let own = |t: f64| part.at(t - begin).position;
        let a = Mover { figure, at: &own };
        self.under_way(*robot, begin).all(|(_, flight)| {
            let other = |t: f64| flight.at(t);
            let b = Mover { figure: &flight.figure, at: &other };
            let links = flight.figure.links() as u32;
            let touched = flight.load.is_some_and(|load| self.is_in_any(load, without));
            let counts = |_: u32, theirs: u32| !(touched && theirs >= links);
            meet::meeting([&a, &b], [begin, flight.end()], APART, speed + flight.speed, &counts).is_none()
        })
    }

    /// What another robot has in the way, where there would be a way without any of them.
    pub(super) fn robot_between(&self, figure: &Figure, around: &Surroundings, way: &Trajectory) -> Option<Refused> {
        let steps = (way.duration() / STEP * 10.0).ceil().max(1.0) as u32;
        let at = |step: u32| way.at(way.duration() * f64::from(step) / f64::from(steps)).position;
        let met = (0..=steps).map(|step| figure.contacts(&around.world, &at(step))).find(|found| !found.is_empty())?;
        Some(self.meeting(figure, around, &met, false))
    }

    /// What stands around, but for other robots and what they hold.
    pub(super) fn without_robots(&self, around: &Surroundings) -> Surroundings {
        let mut out = Surroundings::default();
        for (body, owner) in around.world.bodies.iter().zip(&around.owners) {
            if self.robot_with(*owner).is_none() {
                out.world.bodies.push(body.clone());
                out.owners.push(*owner);
            }
        }
        out
    }

    /// What stands around, with all that the others sweep from a time on; none where nobody is under way.
    pub(super) fn swept(&self, around: &Surroundings, robot: InstanceId, since: f64) -> Option<Surroundings> {
        let mut out = around.clone();
        for (id, flight) in self.under_way(robot, since) {
            let steps = (flight.speed * (flight.end() - since) / SWEEP).ceil().clamp(1.0, 1e4) as u32;
            let pace = (flight.end() - since) / f64::from(steps);
            for step in 0..=steps {
                for link in flight.figure.placed(&flight.at(since + pace * f64::from(step))) {
                    let name = flight.figure.name(link.link);
                    for (at, radius) in link.balls {
                        out.push_ball(id, name, Pose::at(at.into()), radius + SWEEP / 2.0 + APART);
                    }
                }
            }
        }
        (out.owners.len() > around.owners.len()).then_some(out)
    }
}
