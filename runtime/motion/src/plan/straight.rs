//! Motion of the tip along a straight line, turning evenly: inverse kinematics step by step.

use nalgebra::UnitQuaternion;

use crate::inverse::{Request, Solver};
use crate::pose::{Pose, distance};
use crate::spheres::{Checker, Contact};

/// How finely a line is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stride {
    /// Greatest way of the tip between two configurations; metres.
    pub linear: f64,
    /// Greatest turn of the tip between two configurations; rad.
    pub angular: f64,
    /// Greatest change of any variable between two configurations; more is a jump to another posture. rad or m.
    pub jump: f64,
}

impl Default for Stride {
    fn default() -> Self {
        Self { linear: 0.005, angular: 0.02, jump: 0.2 }
    }
}

/// Why a line cannot be followed to its end. Shares are of the line, 0 where it begins and 1 where it ends.
#[derive(Clone, Debug, PartialEq)]
pub enum Blocked {
    /// The strides, or the target, are not such that a finite number of steps leads there.
    Endless,
    /// The tip cannot get there: the share, and how far it stays away (m, rad).
    Reach(f64, f64, f64),
    /// The arm would have to change its posture at this share, by so much in one variable (index; rad or m).
    Jump(f64, usize, f64),
    /// At this share something collides; deepest contact first.
    Collision(f64, Vec<Contact>),
}

/// More steps than any line takes.
const MOST: f64 = 1e6;

/// The pose at a share of the way between two others: the position on a line, the rotation about one axis.
pub fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    let [a, b] = [from, to].map(|p| UnitQuaternion::from_rotation_matrix(&p.rotation));
    let rotation = a.try_slerp(&b, share, 1e-9).unwrap_or(if share < 0.5 { a } else { b });
    let at = from.translation.vector.lerp(&to.translation.vector, share);
    Pose::from_parts(at.into(), rotation.to_rotation_matrix())
}

/// Configurations from `start` that lead the solver's tip straight to a pose, free of collisions as far as `checker`
/// can tell: among true shapes, if balls collide and it has a referee, which is then asked from there on. Poses are relative
/// to the solver's chain's base, whose variables must be those the checker plans for.
pub fn straight(
    solver: &mut Solver,
    checker: &mut Checker,
    start: &[f64],
    to: &Pose,
    stride: &Stride,
) -> Result<Vec<Vec<f64>>, Blocked> {
    match lead(solver, checker, start, to, stride) {
        Err(Blocked::Collision(..)) if checker.ask(true) => lead(solver, checker, start, to, stride),
        found => found,
    }
}

fn lead(
    solver: &mut Solver,
    checker: &mut Checker,
    start: &[f64],
    to: &Pose,
    stride: &Stride,
) -> Result<Vec<Vec<f64>>, Blocked> {
    let from = solver.chain().tip(start);
    let (linear, angular) = distance(&from, to);
    let steps = (linear / stride.linear).max(angular / stride.angular).ceil().max(1.0);
    if !(steps < MOST && stride.linear > 0.0 && stride.angular > 0.0) {
        return Err(Blocked::Endless);
    }
    let mut points = vec![start.to_vec()];
    let mut here = start.to_vec();
    let mut step = 0.0;
    while step < steps {
        step += 1.0;
        let share = step / steps;
        let target = between(&from, to, share);
        // Only from where the arm is: another posture would be a jump anyway.
        let request = Request { attempts: 1, ..Request::new(target, &here) };
        let next = match solver.search(&request) {
            Ok(solution) => solution.q,
            Err(off) => return Err(Blocked::Reach(share, off.linear, off.angular)),
        };
        let changes = here.iter().zip(&next).map(|(a, b)| (b - a).abs());
        if let Some((variable, change)) = changes.enumerate().find(|(_, change)| *change > stride.jump) {
            return Err(Blocked::Jump(share, variable, change));
        }
        let [a, b] = [&here, &next].map(|q| q.iter().map(|&x| x as f32).collect::<Vec<f32>>());
        let mut vector = vec![0.0; a.len()];
        let length = super::path::gap(&a, &b, &mut vector);
        if !checker.is_clear(&a, &vector, length) {
            return Err(Blocked::Collision(share, checker.contacts(&next)));
        }
        points.push(next.clone());
        here = next;
    }
    Ok(points)
}
