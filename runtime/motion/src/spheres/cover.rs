//! Small balls around many balls.

use std::ops::Range;

use nalgebra::Vector3;

/// A ball in some frame; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Round {
    pub center: Vector3<f64>,
    pub radius: f64,
}

impl Round {
    /// How far it reaches from a point, m.
    fn reach(&self, from: Vector3<f64>) -> f64 {
        (self.center - from).norm() + self.radius
    }

    /// In 32 bits: middle and radius.
    pub fn single(&self) -> [f32; 4] {
        [self.center.x as f32, self.center.y as f32, self.center.z as f32, self.radius as f32]
    }
}

/// Steps of the walk in which all balls are looked at.
const FIRST: u32 = 24;
/// Steps in which only those are that may be the farthest.
const LAST: u32 = 96;
/// What reaches less far than this share of the farthest after the first steps is never the farthest later on.
const FAR: f64 = 0.8;

/// A ball around all of these, within a hundredth of the least one, as a rule (Badoiu and Clarkson's walk: towards the
/// farthest, by ever shorter steps).
pub(crate) fn cover(balls: &[Round]) -> Round {
    if let [only] = balls {
        return *only;
    }
    let count = balls.len().max(1) as f64;
    let mut walk = Walk::from(balls.iter().map(|b| b.center).sum::<Vector3<f64>>() / count);
    walk.along(balls, 0..FIRST);
    let far = FAR * farthest(balls, walk.center).0;
    let outer: Vec<Round> = balls.iter().filter(|b| b.reach(walk.center) >= far).copied().collect();
    walk.least = f64::INFINITY;
    walk.along(&outer, FIRST..LAST);
    let radius = farthest(balls, walk.best).0;
    // A hair more, so that rounding to 32 bits leaves nothing outside.
    Round { center: walk.best, radius: radius * (1.0 + 1e-6) + 1e-7 }
}

/// How far balls reach from a point, and the point of them that is the farthest.
fn farthest(balls: &[Round], from: Vector3<f64>) -> (f64, Vector3<f64>) {
    let (mut most, mut ball) = (0.0, None);
    for one in balls {
        let reach = one.reach(from);
        if reach > most {
            (most, ball) = (reach, Some(one));
        }
    }
    let end = |b: &Round| b.center + (b.center - from).try_normalize(1e-12).unwrap_or_default() * b.radius;
    (most, ball.map_or(from, end))
}

/// A walk towards the middle of balls.
struct Walk {
    center: Vector3<f64>,
    best: Vector3<f64>,
    /// How far the balls reach from the best middle.
    least: f64,
}

impl Walk {
    fn from(center: Vector3<f64>) -> Self {
        Walk { center, best: center, least: f64::INFINITY }
    }

    fn along(&mut self, balls: &[Round], steps: Range<u32>) {
        for step in steps {
            let (reach, end) = farthest(balls, self.center);
            if reach < self.least {
                (self.least, self.best) = (reach, self.center);
            }
            self.center += (end - self.center) / (f64::from(step) + 2.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball([x, y, z]: [f64; 3], radius: f64) -> Round {
        Round { center: Vector3::new(x, y, z), radius }
    }

    #[test]
    fn nothing_is_outside_and_little_is_too_much() {
        // Balls on the rim of a plate, many near one side, and small ones within: the least ball around them is known.
        let mut balls: Vec<Round> = (0..360)
            .map(|i| f64::from(i).to_radians())
            .map(|a| ball([0.3 + 0.2 * a.cos(), 0.2 * a.sin(), 0.1], 0.01))
            .collect();
        balls.extend((0..500).map(|i| ball([0.31 + 1e-4 * f64::from(i), 0.05, 0.1], 0.005)));
        let around = cover(&balls);
        assert!(balls.iter().all(|b| (b.center - around.center).norm() + b.radius <= around.radius));
        assert!((0.21..0.21 * 1.005).contains(&around.radius), "{around:?}");
    }

    #[test]
    fn two_balls_are_covered_from_end_to_end() {
        let around = cover(&[ball([0.0; 3], 0.1), ball([1.0, 0.0, 0.0], 0.3)]);
        assert!((0.7..0.7 * 1.01).contains(&around.radius), "{around:?}");
        assert_eq!(cover(&[ball([1.0; 3], 0.2)]), ball([1.0; 3], 0.2));
    }
}
