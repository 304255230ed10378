//! The quickest motion from any state to rest elsewhere, each joint on its own way: by Ruckig, as rsruckig has it.
//!
//! Joints arrive together but not along a straight line, so such motions are for where nothing stands in the way.

use rsruckig::prelude::*;

use super::{Limits, State, Untimed};

/// A motion of all joints from one state to another one.
#[derive(Debug)]
pub struct Direct {
    joints: usize,
    trajectory: rsruckig::prelude::Trajectory<0>,
}

/// The quickest motion within the limits to rest at a configuration.
pub fn direct(from: &State, to: &[f64], limits: &Limits) -> Result<Direct, Untimed> {
    let joints = to.len();
    limits.check(joints)?;
    if [&from.position, &from.velocity, &from.acceleration].iter().any(|l| l.len() != joints) {
        return Err(Untimed::Size);
    }
    if joints == 0 {
        return Err(Untimed::Empty);
    }
    let list = |values: &[f64]| DataArrayOrVec::Heap(values.to_vec());
    let mut input = InputParameter::<0>::new(Some(joints));
    input.current_position = list(&from.position);
    input.current_velocity = list(&from.velocity);
    input.current_acceleration = list(&from.acceleration);
    input.target_position = list(to);
    input.max_velocity = list(&limits.velocity);
    input.max_acceleration = list(&limits.acceleration);
    input.max_jerk = list(&limits.jerk);
    let mut trajectory = rsruckig::prelude::Trajectory::new(Some(joints));
    let mut ruckig = Ruckig::<0, ThrowErrorHandler>::new(Some(joints), 0.001);
    match ruckig.calculate(&input, &mut trajectory) {
        Ok(RuckigResult::Working | RuckigResult::Finished) => Ok(Direct { joints, trajectory }),
        _ => Err(Untimed::Unsolved),
    }
}

impl Direct {
    /// How long it takes; s.
    pub fn duration(&self) -> f64 {
        self.trajectory.get_duration()
    }

    /// What joints do at a time.
    pub fn at(&self, time: f64) -> State {
        let zeros = || DataArrayOrVec::<f64, 0>::new(Some(self.joints), 0.0);
        let (mut q, mut v, mut a, mut j) = (zeros(), zeros(), zeros(), zeros());
        let time = time.clamp(0.0, self.duration());
        let (q_, v_, a_, j_) = (&mut Some(&mut q), &mut Some(&mut v), &mut Some(&mut a), &mut Some(&mut j));
        self.trajectory.at_time(time, q_, v_, a_, j_, &mut None);
        let list = |values: DataArrayOrVec<f64, 0>| values.iter().copied().collect();
        State { position: list(q), velocity: list(v), acceleration: list(a), jerk: list(j) }
    }
}
