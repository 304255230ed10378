//! When to be where: paths become trajectories within limits of speed, acceleration and jerk.
//!
//! A path's corners are rounded by blends that are passed at a steady speed, so that what joints feel there follows
//! from the shape alone; all changes of speed happen on the straight lines between. Every limit then holds by
//! construction, not by sampling.

mod curve;
mod direct;
mod profile;
mod trajectory;

pub use direct::direct;
pub use trajectory::{State, Trajectory};

use crate::plan::Judge;
use curve::{Curve, PEAK, SLOPE};
use profile::{Bounds, Profile};

/// What each joint may not exceed; rad or m, per second, second squared and second cubed.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Greatest speeds.
    pub velocity: Vec<f64>,
    /// Greatest accelerations.
    pub acceleration: Vec<f64>,
    /// Greatest jerks.
    pub jerk: Vec<f64>,
}

/// Why a path cannot be timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Untimed {
    /// A limit of the joint with this index is not a positive number.
    Limit(usize),
    /// Points, or limits, differ in their number of joints.
    Size,
    /// The path has no points.
    Empty,
    /// No motion within the limits was found.
    Unsolved,
}

impl Limits {
    fn check(&self, joints: usize) -> Result<(), Untimed> {
        let lists = [&self.velocity, &self.acceleration, &self.jerk];
        if lists.iter().any(|l| l.len() != joints) {
            return Err(Untimed::Size);
        }
        let bad = |i: &usize| lists.iter().any(|l| !(l[*i] > 0.0 && l[*i].is_finite()));
        (0..joints).find(bad).map_or(Ok(()), |i| Err(Untimed::Limit(i)))
    }

    /// The bounds along a direction.
    fn along(&self, way: &[f64]) -> Bounds {
        let least = |limits: &[f64]| {
            way.iter()
                .zip(limits)
                .fold(f64::INFINITY, |least, (d, l)| if *d == 0.0 { least } else { least.min(l / d.abs()) })
        };
        Bounds { speed: least(&self.velocity), acceleration: least(&self.acceleration), jerk: least(&self.jerk) }
    }

    /// The greatest speed at which a corner between two directions can be passed in a blend of this length.
    fn through(&self, way: &[f64], next: &[f64], length: f64) -> f64 {
        let mut speed = f64::INFINITY;
        for (i, (a, b)) in way.iter().zip(next).enumerate() {
            let (most, bend) = (a.abs().max(b.abs()), (b - a).abs());
            if most > 0.0 {
                speed = speed.min(self.velocity[i] / most);
            }
            if bend > 0.0 {
                speed = speed.min((self.acceleration[i] * length / (bend * PEAK)).sqrt());
                speed = speed.min((self.jerk[i] * length * length / (bend * SLOPE)).cbrt());
            }
        }
        speed
    }
}

/// The greatest part of a line that one of its blends takes.
const SHARE: f64 = 0.4;

/// How often a blend that collides is made half as large before the corner is stopped at.
const HALVINGS: usize = 6;

struct Line {
    from: Vec<f64>,
    way: Vec<f64>,
    length: f64,
}

fn lines(points: &[Vec<f64>]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for pair in points.windows(2) {
        let step: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| b - a).collect();
        let length = step.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 1e-9 {
            lines.push(Line { from: pair[0].clone(), way: step.iter().map(|x| x / length).collect(), length });
        }
    }
    lines
}

/// A motion along a path from rest to rest. Corners are rounded where the judge allows the way around them, and
/// stopped at where it does not or where there is none.
pub fn follow(points: &[Vec<f64>], limits: &Limits, judge: Option<&mut dyn Judge>) -> Result<Trajectory, Untimed> {
    let first = points.first().ok_or(Untimed::Empty)?;
    if points.iter().any(|p| p.len() != first.len()) {
        return Err(Untimed::Size);
    }
    limits.check(first.len())?;
    let lines = lines(points);
    let corners = corners(&lines, judge);
    let bounds: Vec<Bounds> = lines.iter().map(|l| limits.along(&l.way)).collect();
    let lengths: Vec<f64> =
        (0..lines.len()).map(|i| (lines[i].length - corners[i] - corners[i + 1]).max(0.0)).collect();
    // The speed at which each line begins; the last one is where the path ends.
    let mut speeds = vec![0.0; lines.len() + 1];
    for i in 1..lines.len() {
        if corners[i] > 0.0 {
            let most = limits.through(&lines[i - 1].way, &lines[i].way, 2.0 * corners[i]);
            speeds[i] = bounds[i - 1].reachable(speeds[i - 1], most.min(bounds[i].speed), lengths[i - 1]);
        }
    }
    for i in (0..lines.len()).rev() {
        speeds[i] = bounds[i].reachable(speeds[i + 1], speeds[i], lengths[i]).min(speeds[i]);
    }
    let mut trajectory = Trajectory::new(first.clone());
    for (i, line) in lines.iter().enumerate() {
        if i > 0 && corners[i] > 0.0 {
            let before = &lines[i - 1];
            let from = offset(&before.from, &before.way, before.length - corners[i]);
            let blend = Curve::Blend(from, [before.way.clone(), line.way.clone()], 2.0 * corners[i]);
            trajectory.push(blend, Profile::steady(2.0 * corners[i], speeds[i]));
        }
        let from = offset(&line.from, &line.way, corners[i]);
        let profile = Profile::new(lengths[i], speeds[i], speeds[i + 1], &bounds[i]);
        trajectory.push(Curve::Line(from, line.way.clone()), profile);
    }
    if let Some(last) = points.last() {
        trajectory.finish(last.clone());
    }
    Ok(trajectory)
}

fn offset(from: &[f64], way: &[f64], by: f64) -> Vec<f64> {
    from.iter().zip(way).map(|(f, w)| f + w * by).collect()
}

/// How much of the lines before and after each corner its blend takes; nothing at both ends of the path.
fn corners(lines: &[Line], judge: Option<&mut dyn Judge>) -> Vec<f64> {
    let mut sizes = vec![0.0; lines.len() + 1];
    let Some(judge) = judge else { return sizes };
    for i in 1..lines.len() {
        let (before, after) = (&lines[i - 1], &lines[i]);
        let mut size = SHARE * before.length.min(after.length);
        for _ in 0..HALVINGS {
            let from = offset(&before.from, &before.way, before.length - size);
            let blend = Curve::Blend(from, [before.way.clone(), after.way.clone()], 2.0 * size);
            if is_allowed(&blend, 2.0 * size, before.way.len(), judge) {
                sizes[i] = size;
                break;
            }
            size *= 0.5;
        }
    }
    sizes
}

fn is_allowed(curve: &Curve, length: f64, joints: usize, judge: &mut dyn Judge) -> bool {
    let count = (length * judge.resolution()).ceil().max(1.0) as usize;
    let points = (1..=count).flat_map(|k| {
        let s = length * k as f64 / (count + 1) as f64;
        (0..joints).map(move |j| curve.at(s, j)[0] as f32)
    });
    judge.allows(&points.collect::<Vec<f32>>())
}
