//! Where a robot is at any time.

use super::curve::Curve;
use super::profile::Profile;

/// What all joints do at one time; rad or m, per second, second squared and second cubed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Positions.
    pub position: Vec<f64>,
    /// Speeds.
    pub velocity: Vec<f64>,
    /// Accelerations.
    pub acceleration: Vec<f64>,
    /// Jerks.
    pub jerk: Vec<f64>,
}

/// A timed motion that begins and ends at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    start: Vec<f64>,
    end: Vec<f64>,
    /// Each with the time at which it begins.
    pieces: Vec<(f64, Curve, Profile)>,
    duration: f64,
}

impl Trajectory {
    pub(super) fn new(start: Vec<f64>) -> Self {
        Self { end: start.clone(), start, pieces: Vec::new(), duration: 0.0 }
    }

    pub(super) fn push(&mut self, curve: Curve, profile: Profile) {
        let begin = self.duration;
        self.duration += profile.duration;
        self.pieces.push((begin, curve, profile));
    }

    pub(super) fn finish(&mut self, end: Vec<f64>) {
        self.end = end;
    }

    /// How long it takes; s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The same way, so many times as long in time.
    pub fn slowed(&self, times: f64) -> Self {
        let slowed =
            |(begin, curve, profile): &(f64, Curve, Profile)| (begin * times, curve.clone(), profile.slowed(times));
        Trajectory {
            start: self.start.clone(),
            end: self.end.clone(),
            pieces: self.pieces.iter().map(slowed).collect(),
            duration: self.duration * times,
        }
    }

    /// What joints do at a time; at rest before the beginning and after the end.
    pub fn at(&self, time: f64) -> State {
        let rest = |position: &[f64]| {
            let still = vec![0.0; position.len()];
            State { position: position.to_vec(), velocity: still.clone(), acceleration: still.clone(), jerk: still }
        };
        if time <= 0.0 {
            return rest(&self.start);
        }
        if time >= self.duration {
            return rest(&self.end);
        }
        let index = self.pieces.partition_point(|(begin, ..)| *begin <= time).saturating_sub(1);
        let Some((begin, curve, profile)) = self.pieces.get(index) else { return rest(&self.end) };
        let [s, v, a, j] = profile.at(time - begin);
        let mut state = State::default();
        for joint in 0..self.start.len() {
            let [q, d, dd, ddd] = curve.at(s, joint);
            state.position.push(q);
            state.velocity.push(d * v);
            state.acceleration.push(d * a + dd * v * v);
            state.jerk.push(d * j + 3.0 * dd * v * a + ddd * v * v * v);
        }
        state
    }
}
