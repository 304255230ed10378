//! Whether two robots meet while both move, and when.
//!
//! The balls of both are looked at again and again, each time after as long as they need at least to come together from
//! where they are (conservative advancement), so that no meeting is stepped over however short it is.

use nalgebra::Point3;

use crate::spheres::{Figure, Placed};

/// Distance of the moments at which speeds are measured, s.
const PACE: f64 = 0.01;
/// What a ball may be faster than measured between two such moments, m/s: acceleration of a quick arm times half of it.
const FASTER: f64 = 0.1;

/// Distances below this do not matter, m.
const LEAST: f64 = 1e-4;

/// Distances above this are not told apart, m.
const FAR: f64 = 0.5;

/// A robot of which it is known where it is at any time.
pub struct Mover<'a> {
    /// It and what it holds.
    pub figure: &'a Figure,
    /// Its variables at a time, s.
    pub at: &'a dyn Fn(f64) -> Vec<f64>,
}

/// The nearest balls of two robots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Between their surfaces, m; negative where they reach into each other.
    pub distance: f64,
    /// Index of the link, or of a held thing after the links, of either.
    pub links: [u32; 2],
    /// On the surface of the second one's ball, in the world.
    pub point: Point3<f64>,
}

/// The nearest that robots come, among the links that `counts` names, if it is nearer than `below`, m.
pub fn gap(a: &[Placed], b: &[Placed], below: f64, counts: &dyn Fn(u32, u32) -> bool) -> Option<Gap> {
    let mut nearest: Option<Gap> = None;
    let mut least = below;
    for one in a {
        for other in b {
            let reach = least + one.cover.1 + other.cover.1;
            if reach <= 0.0 || square(&one.cover.0, &other.cover.0) >= reach * reach {
                continue;
            }
            if !counts(one.link, other.link) {
                continue;
            }
            for (p, r) in &one.balls {
                for (q, s) in &other.balls {
                    let reach = least + r + s;
                    let apart = square(p, q);
                    if reach <= 0.0 || apart >= reach * reach {
                        continue;
                    }
                    let apart = apart.sqrt();
                    let point = if apart > 0.0 { q + (p - q) * (s / apart) } else { *q };
                    least = apart - r - s;
                    nearest = Some(Gap { distance: least, links: [one.link, other.link], point });
                }
            }
        }
    }
    nearest
}

/// The square of a distance, m^2.
fn square(a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let (x, y, z) = (a.x - b.x, a.y - b.y, a.z - b.z);
    x * x + y * y + z * z
}

/// The greatest speed of any ball between two times, m/s.
pub fn speed(mover: &Mover<'_>, from: f64, until: f64) -> f64 {
    let steps = ((until - from) / PACE).ceil().clamp(1.0, 1e6) as u32;
    let pace = (until - from) / f64::from(steps);
    let mut before = mover.figure.placed(&(mover.at)(from));
    let mut most: f64 = 0.0;
    for step in 1..=steps {
        let now = mover.figure.placed(&(mover.at)(from + pace * f64::from(step)));
        for (was, is) in before.iter().zip(&now) {
            for ((p, _), (q, _)) in was.balls.iter().zip(&is.balls) {
                most = most.max((q - p).norm() / pace);
            }
        }
        before = now;
    }
    if most > 0.0 { most + FASTER } else { 0.0 }
}

/// The first time from which on two robots are nearer to each other than `least`, m, and how; none where they keep
/// that distance from one time to another. `speed` is the greatest at which their balls come together, m/s.
pub fn meeting(
    [a, b]: [&Mover<'_>; 2],
    [from, until]: [f64; 2],
    least: f64,
    speed: f64,
    counts: &dyn Fn(u32, u32) -> bool,
) -> Option<(f64, Gap)> {
    let mut time = from;
    loop {
        let nearest = gap(&a.figure.placed(&(a.at)(time)), &b.figure.placed(&(b.at)(time)), FAR, counts);
        let distance = nearest.map_or(FAR, |gap| gap.distance);
        if let Some(nearest) = nearest.filter(|gap| gap.distance < least) {
            return Some((time, nearest));
        }
        if time >= until || speed <= 0.0 {
            return None;
        }
        time = (time + distance.max(LEAST) / speed).min(until);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use matterix_ir::robot::{Ball, Joint, JointKind, JointLimits, Link, Placement, Robot};

    /// A ball of 0.1 m radius on a slide along x.
    fn slide() -> Figure {
        let link = |name: &str| Link { name: name.into(), inertial: None, visual: Vec::new(), collision: Vec::new() };
        let limits =
            JointLimits { lower: -9.0, upper: 9.0, velocity: 9.0, effort: 1.0, acceleration: None, jerk: None };
        let joint = Joint {
            name: "x".into(),
            kind: JointKind::Prismatic,
            parent: 0,
            child: 1,
            origin: Placement::default(),
            axis: [1.0, 0.0, 0.0],
            limits: Some(limits),
            mimic: None,
        };
        let ball = Ball { link: 1, center: [0.0; 3], radius: 0.1 };
        let robot = Robot {
            name: "slide".into(),
            links: vec![link("foot"), link("hand")],
            joints: vec![joint],
            balls: vec![ball],
            ..Robot::default()
        };
        Figure::new(&robot, &Pose::identity(), &[0], &[0.0], &[]).expect("a robot")
    }

    #[test]
    fn a_short_meeting_is_not_stepped_over() {
        let figure = slide();
        // They rush through each other at 20 m/s: for 20 ms of 1 s they overlap.
        let (there, back) = (|t: f64| vec![-5.0 + 10.0 * t], |t: f64| vec![5.0 - 10.0 * t]);
        let (a, b) = (Mover { figure: &figure, at: &there }, Mover { figure: &figure, at: &back });
        let fast = speed(&a, 0.0, 1.0) + speed(&b, 0.0, 1.0);
        assert!((20.0..20.3).contains(&fast), "{fast}");
        let all = |_: u32, _: u32| true;
        let (time, gap) = meeting([&a, &b], [0.0, 1.0], 0.01, fast, &all).expect("they meet");
        assert!((0.4895..0.4906).contains(&time) && gap.distance < 0.01, "{time} {gap:?}");
        assert!(gap.point.x.abs() < 0.01, "{gap:?}");
        assert!(meeting([&a, &b], [0.0, 0.48], 0.01, fast, &all).is_none());
        assert!(meeting([&a, &b], [0.0, 1.0], 0.01, fast, &|_, _| false).is_none());
    }
}
