//! What a robot did: motions of its joints, one after the other.

use matterix_ir::scene::InstanceId;
use matterix_motion::time::{State, Trajectory};

use super::fixture::Led;
use super::moment::Moment;
use super::stage::Actor;

/// What a robot did.
#[derive(Clone, Debug, PartialEq)]
pub struct Performed {
    /// The robot.
    pub robot: InstanceId,
    /// One after the other.
    pub parts: Vec<Part>,
    /// What its hand took along.
    pub led: Option<Led>,
}

/// A motion of some of a robot's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// How long it waits first when those before it have ended, s.
    pub wait: f64,
    /// Which of all that move, by index.
    pub joints: Vec<usize>,
    /// Their way.
    pub trajectory: Trajectory,
}

impl Performed {
    /// Some parts after each other, with nothing taken along.
    pub fn new(robot: InstanceId, parts: Vec<Part>) -> Self {
        Performed { robot, parts, led: None }
    }

    /// The same, all of it so many times as long in time, after a wait, s.
    pub(super) fn paced(mut self, (times, wait): (f64, f64)) -> Self {
        if times > 1.0 {
            for part in &mut self.parts {
                part.wait *= times;
                part.trajectory = part.trajectory.slowed(times);
            }
            self.led.iter_mut().for_each(|led| led.since *= times);
        }
        if let Some(first) = self.parts.first_mut() {
            first.wait += wait;
        }
        self
    }

    /// The same with its last part so much slower that all of it takes at least so long, s.
    pub fn lasting(mut self, least: f64) -> Self {
        let missing = least - self.duration();
        if let Some(last) = self.parts.last_mut().filter(|_| missing > 0.0) {
            match last.trajectory.duration() {
                own if own > 0.0 => last.trajectory = last.trajectory.slowed((own + missing) / own),
                // It is there already, and stays.
                _ => last.wait += missing,
            }
        }
        self
    }

    /// How long it takes, s.
    pub fn duration(&self) -> f64 {
        self.parts.iter().map(|part| part.wait + part.trajectory.duration()).sum()
    }

    /// Its parts, each with the time at which it begins, s since the motion did.
    pub fn begins(&self) -> impl Iterator<Item = (f64, &Part)> {
        self.parts.iter().scan(0.0, |time, part| {
            let begin = *time + part.wait;
            *time = begin + part.trajectory.duration();
            Some((begin, part))
        })
    }

    /// Some joints at a time since the beginning, s; while they wait, where they are. Nothing where one of them does not
    /// move.
    pub fn at(&self, joints: &[usize], time: f64) -> Option<Vec<f64>> {
        Some(self.state(joints, time)?.position)
    }

    /// What some joints do at a time since the beginning, s; at rest while they wait. Nothing where one of them does not
    /// move.
    fn state(&self, joints: &[usize], time: f64) -> Option<State> {
        let mut out = State::default();
        for joint in joints {
            let mut own = self.begins().filter_map(|(t, p)| Some((t, p, p.joints.iter().position(|j| j == joint)?)));
            let mut now = own.next()?;
            own.take_while(|(begin, ..)| *begin <= time).for_each(|next| now = next);
            let (begin, part, index) = now;
            let all = part.trajectory.at(time - begin);
            if part.joints == joints {
                return Some(all);
            }
            out.position.push(*all.position.get(index)?);
            out.velocity.push(*all.velocity.get(index)?);
            out.acceleration.push(*all.acceleration.get(index)?);
            out.jerk.push(*all.jerk.get(index)?);
        }
        Some(out)
    }

    /// Which joints it moves of those that move the tip and that drive the robot about.
    pub fn moved(&self, actor: &Actor) -> Vec<usize> {
        let moves = |joints: &&Vec<usize>| self.parts.iter().any(|part| part.joints == **joints);
        [&actor.arm, &actor.drive].into_iter().filter(moves).flatten().copied().collect()
    }

    /// Brings the robot to where it is at a time since the beginning, s. What has not moved yet is where it begins.
    pub fn bring(&self, actor: &mut Actor, time: f64) {
        for part in &self.parts {
            if let Some(at) = self.at(&part.joints, time) {
                actor.set_some(&part.joints, &at);
            }
        }
    }

    /// Gives a moment the speeds and accelerations that joints have at a time since the beginning, s.
    pub(crate) fn rush(&self, moment: &mut Moment, time: f64) {
        for part in &self.parts {
            let Some(state) = self.state(&part.joints, time) else { continue };
            let put = |values: &[f64], all: &mut [f64]| {
                for (joint, value) in part.joints.iter().zip(values) {
                    all.get_mut(*joint).into_iter().for_each(|v| *v = *value);
                }
            };
            put(&state.velocity, &mut moment.speeds);
            put(&state.acceleration, &mut moment.accelerations);
        }
    }
}
