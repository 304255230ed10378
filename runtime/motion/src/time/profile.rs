//! Motion along one coordinate with bounded speed, acceleration and jerk, at rest in acceleration at both ends.

/// What a coordinate's motion may not exceed, per second, second squared and second cubed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub speed: f64,
    pub acceleration: f64,
    pub jerk: f64,
}

/// Position, speed, acceleration and jerk along the coordinate.
pub(crate) type Along = [f64; 4];

/// Time with constant jerk, and the state it begins with.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Phase {
    duration: f64,
    begin: Along,
}

/// A motion from one speed to another one over a distance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Profile {
    phases: Vec<Phase>,
    /// s
    pub duration: f64,
}

impl Bounds {
    /// How long changing the speed takes, acceleration being zero before and after.
    fn change(&self, from: f64, to: f64) -> f64 {
        let change = (to - from).abs();
        if change * self.jerk <= self.acceleration * self.acceleration {
            2.0 * (change / self.jerk).sqrt()
        } else {
            change / self.acceleration + self.acceleration / self.jerk
        }
    }

    /// The way that takes: speed is symmetric about the middle of the change.
    fn way(&self, from: f64, to: f64) -> f64 {
        0.5 * (from + to) * self.change(from, to)
    }

    /// The greatest speed, up to `most`, that a distance allows to reach from another one.
    pub fn reachable(&self, from: f64, most: f64, distance: f64) -> f64 {
        if from >= most || self.way(from, most) <= distance {
            return most;
        }
        largest(from, most, |speed| self.way(from, speed) <= distance)
    }
}

/// The largest number between two for which something holds that holds below and not above it; holds for the first.
fn largest(mut holds: f64, mut fails: f64, test: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (holds + fails);
        if test(middle) {
            holds = middle;
        } else {
            fails = middle;
        }
    }
    holds
}

impl Profile {
    /// The quickest motion over a distance between two speeds that it allows, never backwards.
    pub fn new(distance: f64, from: f64, to: f64, bounds: &Bounds) -> Self {
        let fits = |peak: f64| bounds.way(from, peak) + bounds.way(peak, to) <= distance;
        let floor = from.max(to);
        let peak = if fits(bounds.speed) { bounds.speed } else { largest(floor, bounds.speed, fits) };
        let mut profile = Self { phases: Vec::with_capacity(7), duration: 0.0 };
        let mut state = [0.0, from, 0.0, 0.0];
        let left = distance - bounds.way(from, peak) - bounds.way(peak, to);
        profile.turn(&mut state, peak, bounds);
        if peak > 0.0 {
            profile.add(&mut state, left.max(0.0) / peak, 0.0);
        }
        profile.turn(&mut state, to, bounds);
        profile
    }

    /// The same way, so many times as long in time.
    pub fn slowed(&self, times: f64) -> Self {
        let slowed = |phase: &Phase| {
            let [s, v, a, j] = phase.begin;
            Phase {
                duration: phase.duration * times,
                begin: [s, v / times, a / (times * times), j / (times * times * times)],
            }
        };
        Profile { phases: self.phases.iter().map(slowed).collect(), duration: self.duration * times }
    }

    /// A constant speed over a distance.
    pub fn steady(distance: f64, speed: f64) -> Self {
        let mut profile = Self { phases: Vec::with_capacity(1), duration: 0.0 };
        profile.add(&mut [0.0, speed, 0.0, 0.0], distance / speed, 0.0);
        profile
    }

    /// Adds a change of speed.
    fn turn(&mut self, state: &mut Along, to: f64, bounds: &Bounds) {
        let change = to - state[1];
        let jerk = bounds.jerk.copysign(change);
        let size = change.abs();
        if size * bounds.jerk <= bounds.acceleration * bounds.acceleration {
            let ramp = (size / bounds.jerk).sqrt();
            self.add(state, ramp, jerk);
            self.add(state, ramp, -jerk);
        } else {
            let ramp = bounds.acceleration / bounds.jerk;
            self.add(state, ramp, jerk);
            self.add(state, size / bounds.acceleration - ramp, 0.0);
            self.add(state, ramp, -jerk);
        }
        // Rounding leaves traces that must not add up over phases.
        state[1] = to;
        state[2] = 0.0;
    }

    fn add(&mut self, state: &mut Along, duration: f64, jerk: f64) {
        if duration > 0.0 {
            let begin = [state[0], state[1], state[2], jerk];
            self.phases.push(Phase { duration, begin });
            self.duration += duration;
            *state = after(&begin, duration);
        }
    }

    /// The state at a time from the beginning; s.
    pub fn at(&self, time: f64) -> Along {
        let mut left = time;
        for phase in &self.phases {
            if left <= phase.duration {
                return after(&phase.begin, left.max(0.0));
            }
            left -= phase.duration;
        }
        let Some(last) = self.phases.last() else { return [0.0; 4] };
        let mut end = after(&last.begin, last.duration);
        end[3] = 0.0;
        end
    }
}

fn after(&[s, v, a, j]: &Along, t: f64) -> Along {
    [s + t * (v + t * (0.5 * a + t * j / 6.0)), v + t * (a + 0.5 * t * j), a + t * j, j]
}
