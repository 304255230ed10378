//! Bodies in pieces whose faces have four corners at most.
//!
//! The engine keeps four points where two faces meet, and picks them anew in every step: a round foot that stands on 32 corners rocks from
//! one choice to the next, and tips over at four fifths of its angle. So what is round stands on wedges, each with all of its corners.

use std::cmp::Ordering;
use std::f64::consts::TAU;

use matterix_ir::math::{atan2, sin_cos};
use rapier3d_f64::prelude::{Pose, SharedShape, Vector};

/// Sides of a round foot, as those of turned bodies.
const SIDES: u32 = 32;
/// By how much the barrel of a cylinder is shorter than it at either end, and how thick the feet there are, m.
const BARREL: f64 = 5e-5;
const FOOT: f64 = 2e-3;
/// Corners on one level are no farther apart in height, m.
const LEVEL: f64 = 1e-9;

/// The same piece with feet that stand on all of their corners, each part smaller by so much all round, m: the skin that the engine puts on
/// again.
pub(crate) fn fine(at: Pose, shape: &SharedShape, skin: f64) -> Vec<(Pose, SharedShape)> {
    let parts = parted(at, shape).into_iter();
    parts.map(|(at, shape)| (at, inset(&shape, skin).unwrap_or(shape))).collect()
}

/// A convex part, smaller by so much on each of the six sides of the box around it, m; none where it is something else, or thinner than that.
pub(crate) fn inset(shape: &SharedShape, skin: f64) -> Option<SharedShape> {
    let less = |length: f64| (length > 2.0 * skin).then_some(length - skin);
    if let Some(cuboid) = shape.as_cuboid() {
        let half = cuboid.half_extents;
        return Some(SharedShape::cuboid(less(half.x)?, less(half.y)?, less(half.z)?));
    }
    if let Some(cylinder) = shape.as_cylinder() {
        return Some(SharedShape::cylinder(less(cylinder.half_height)?, less(cylinder.radius)?));
    }
    if let Some(ball) = shape.as_ball() {
        return Some(SharedShape::ball(less(ball.radius)?));
    }
    let polyhedron = shape.as_convex_polyhedron()?;
    let around = shape.compute_local_aabb();
    let (middle, half) = (around.center(), around.half_extents());
    let by = Vector::new(less(half.x)? / half.x, less(half.y)? / half.y, less(half.z)? / half.z);
    let points: Vec<Vector> = polyhedron.points().iter().map(|p| middle + (*p - middle) * by).collect();
    SharedShape::convex_hull(&points)
}

fn parted(at: Pose, shape: &SharedShape) -> Vec<(Pose, SharedShape)> {
    if let Some(cylinder) = shape.as_cylinder() {
        let (half, radius) = (cylinder.half_height, cylinder.radius);
        let thick = FOOT.min(half);
        let mut out = match half > 2.0 * BARREL {
            true => vec![(at, SharedShape::cylinder(half - BARREL, radius))],
            false => Vec::new(),
        };
        let ring = |y: f64| -> Vec<Vector> {
            let corner = |k: u32| {
                let (s, c) = sin_cos(f64::from(k) * TAU / f64::from(SIDES));
                Vector::new(radius * c, y, radius * s)
            };
            (0..SIDES).map(corner).collect()
        };
        for end in [half, -half] {
            let inner = end - thick * end.signum();
            out.extend(wedges(&ring(end), &ring(inner)).map(|wedge| (at, wedge)));
        }
        return out;
    }
    let Some(polyhedron) = shape.as_convex_polyhedron() else { return vec![(at, shape.clone())] };
    match slice(polyhedron.points()) {
        Some([low, high]) => wedges(&low, &high).map(|wedge| (at, wedge)).collect(),
        None => vec![(at, shape.clone())],
    }
}

/// The corners of a round slice below and above, in order of their angle; none where it is something else.
fn slice(points: &[Vector]) -> Option<[Vec<Vector>; 2]> {
    let least = points.iter().map(|p| p.z).min_by(f64::total_cmp)?;
    let (mut low, mut high): (Vec<Vector>, Vec<Vector>) = points.iter().partition(|p| p.z <= least + LEVEL);
    let top = high.first()?.z;
    if low.len() != high.len() || low.len() <= 4 || high.iter().any(|p| (p.z - top).abs() > LEVEL) {
        return None;
    }
    for side in [&mut low, &mut high] {
        let middle = middle(side);
        let angle = |p: &Vector| atan2(p.y - middle.y, p.x - middle.x);
        side.sort_by(|a, b| angle(a).partial_cmp(&angle(b)).unwrap_or(Ordering::Equal));
    }
    Some([low, high])
}

fn middle(points: &[Vector]) -> Vector {
    points.iter().copied().sum::<Vector>() / points.len() as f64
}

/// The wedges between two faces with as many corners each.
fn wedges<'a>(low: &'a [Vector], high: &'a [Vector]) -> impl Iterator<Item = SharedShape> + 'a {
    let middles = [middle(low), middle(high)];
    let all = low.len().min(high.len());
    (0..all).filter_map(move |k| {
        let next = (k + 1) % all;
        SharedShape::convex_hull(&[middles[0], middles[1], low[k], low[next], high[k], high[next]])
    })
}
