//! The closed form of six turning joints of which the second, third and fourth are parallel and the last two meet in a
//! point, as in the arms of Universal Robots: up to eight solutions. Recognised by that, never by name.
//!
//! Directions and points are those of the configuration zero, in the base's frame (product of exponentials); the way of
//! solving is that of Elias and Wen, "IK-Geo" (2022), for three parallel axes.

use nalgebra::{Matrix3, Vector3};

use super::subproblems::{angle_between, angles_with_component, rotation};
use super::unwind;
use crate::chain::Chain;
use crate::pose::{Pose, distance};

/// How far lines may be from parallel (rad) or from meeting (m).
const EXACT: f64 = 1e-9;

/// What the solution may be off, in metres and radians; beyond, it is none.
const RESIDUE: f64 = 1e-6;

/// The geometry of such a chain.
#[derive(Clone, Debug)]
pub struct ParallelWrist {
    /// Directions of the axes.
    axes: [Vector3<f64>; 6],
    /// From the base to a point on the first axis.
    base: Vector3<f64>,
    /// From a point on each axis to one on the next; the last two axes share theirs.
    arms: [Vector3<f64>; 4],
    /// From the point where the last two axes meet to the tip.
    tip: Vector3<f64>,
    /// How the tip is turned.
    turned: Matrix3<f64>,
}

impl ParallelWrist {
    /// The geometry of a chain, if it is of this kind.
    pub fn of(chain: &Chain) -> Option<Self> {
        let moves = chain.stages.iter().enumerate();
        let plain = |(i, stage): (usize, &crate::chain::Stage)| {
            let motion = &stage.motion;
            !motion.slides && motion.variable == i && motion.multiplier.abs() == 1.0
        };
        if chain.stages.len() != 6 || chain.variables().len() != 6 || !moves.into_iter().all(plain) {
            return None;
        }
        let zero = [0.0; 6];
        let mut axes = [Vector3::zeros(); 6];
        let mut points = [Vector3::zeros(); 6];
        let mut at = chain.lead;
        for (i, stage) in chain.stages.iter().enumerate() {
            axes[i] = at.rotation.matrix().column(2) * stage.motion.multiplier;
            points[i] = at.translation.vector;
            at = stage.motion.apply(&at, &zero) * stage.after;
        }
        let parallel = |a: usize, b: usize| axes[a].cross(&axes[b]).norm() < EXACT;
        if !parallel(1, 2) || !parallel(2, 3) || parallel(0, 1) || parallel(3, 4) || parallel(4, 5) {
            return None;
        }
        let meeting = meeting(&points[4], &axes[4], &points[5], &axes[5])?;
        points[4] = meeting;
        Some(Self {
            axes,
            base: points[0],
            arms: [points[1] - points[0], points[2] - points[1], points[3] - points[2], points[4] - points[3]],
            tip: at.translation.vector - meeting,
            turned: *at.rotation.matrix(),
        })
    }

    /// All configurations within the limits that bring the chain's tip to the target; each variable by whole turns as near
    /// to the wish as its limits allow. Where the wrist is straight, its last joint stays at the wish.
    pub fn solve(&self, chain: &Chain, target: &Pose, wish: &[f64]) -> Vec<Vec<f64>> {
        let [h1, h2, h3, h4, h5, h6] = self.axes;
        let [p12, p23, p34, p45] = self.arms;
        // All six turns together, and the point of the wrist.
        let turn = target.rotation.matrix() * self.turned.transpose();
        let wrist = target.translation.vector - self.base - turn * self.tip;
        let mut found = Vec::with_capacity(8);

        // Along the parallel axes the wrist is as far as the arms reach, whatever they do.
        let depth = h2.dot(&(p12 + p23 + p34 + p45));
        for q1 in distinct(angles_with_component(&-h1, &wrist, &h2, depth)) {
            let first = rotation(&h1, -q1);
            let (rest, wrist) = (first * turn, first * wrist);
            for q5 in distinct(angles_with_component(&h5, &h6, &h2, h2.dot(&(rest * h6)))) {
                let fifth = rotation(&h5, q5);
                let seen = fifth.transpose() * h2;
                let straight = seen.cross(&h6).norm() < 1e-7;
                let q6 = if straight { wish[5] } else { angle_between(&-h6, &seen, &(rest.transpose() * h2)) };
                let sum = rest * rotation(&h6, -q6) * fifth.transpose();
                let side = if h1.cross(&h2).norm() > EXACT { h2.cross(&h1) } else { h2.cross(&p23) };
                let total = angle_between(&h2, &side, &(sum * side));
                let reach = wrist - p12 - sum * p45;
                let inner = 0.5 * (reach.norm_squared() - p23.norm_squared() - p34.norm_squared());
                for q3 in distinct(angles_with_component(&h3, &p34, &p23, inner)) {
                    let q2 = angle_between(&h2, &(p23 + rotation(&h3, q3) * p34), &reach);
                    // Parallel axes may point against each other.
                    let q4 = h4.dot(&h2).signum() * (total - q2 - h3.dot(&h2).signum() * q3);
                    let mut q = vec![q1, q2, q3, q4, q5, q6];
                    unwind(chain.variables(), wish, &mut q);
                    let within =
                        q.iter().zip(chain.variables()).all(|(q, v)| v.limits.lower <= *q && *q <= v.limits.upper);
                    let (linear, angular) = distance(&chain.tip(&q), target);
                    if within && linear < RESIDUE && angular < RESIDUE {
                        found.push(q);
                    }
                }
            }
        }
        found
    }
}

/// The two angles, or the one if they are the same.
fn distinct(angles: Option<[f64; 2]>) -> impl Iterator<Item = f64> {
    let [first, second] = match angles {
        None => [None, None],
        Some([a, b]) if (a - b).abs() < 1e-12 => [Some(a), None],
        Some([a, b]) => [Some(a), Some(b)],
    };
    first.into_iter().chain(second)
}

/// Where two lines that are not parallel meet, if they do.
fn meeting(p: &Vector3<f64>, u: &Vector3<f64>, q: &Vector3<f64>, v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let normal = u.cross(v);
    let between = q - p;
    if (between.dot(&normal) / normal.norm()).abs() > EXACT {
        return None;
    }
    Some(p + u * (between.cross(v).dot(&normal) / normal.norm_squared()))
}
