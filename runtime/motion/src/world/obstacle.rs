//! Solids laid out for testing eight balls at once in 32-bit floats.

use nalgebra::Vector3;

use super::{Body, Shape};
use crate::lanes::Lanes;
use crate::vector::Vector;

/// A solid in the world's frame.
#[derive(Clone, Debug)]
pub(crate) enum Obstacle {
    /// A box turned about the vertical: middle, first axis in the plane, half edges.
    Upright([f32; 3], [f32; 2], [f32; 3]),
    /// A box: middle, axes, half edges.
    Box([f32; 3], [[f32; 3]; 3], [f32; 3]),
    /// A vertical capsule: lower end, length, radius.
    Post([f32; 3], f32, f32),
    /// A capsule: one end, vector to the other one, the inverse of its squared length, radius.
    Capsule([f32; 3], [f32; 3], f32, f32),
    /// A cylinder: middle, axis, half length, radius.
    Cylinder([f32; 3], [f32; 3], f32, f32),
}

fn single(v: Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

impl Obstacle {
    /// The same solid in 32 bits.
    pub fn new(body: &Body) -> Self {
        let at = body.pose.translation.vector;
        let m = body.pose.rotation.matrix();
        let axis: Vector3<f64> = m.column(2).into();
        let upright = 1.0 - axis.z.abs() < 1e-12;
        let capsule = |radius: f64, half: f64| {
            if upright {
                Self::Post(single(at - Vector3::z() * half), (2.0 * half) as f32, radius as f32)
            } else {
                let inverse = 0.25 / (half * half);
                Self::Capsule(single(at - axis * half), single(axis * (2.0 * half)), inverse as f32, radius as f32)
            }
        };
        match body.shape {
            Shape::Sphere(radius) => Self::Post(single(at), 0.0, radius as f32),
            Shape::Capsule(radius, half) => capsule(radius, half),
            Shape::Cylinder(radius, half) => Self::Cylinder(single(at), single(axis), half as f32, radius as f32),
            Shape::Cuboid(half) if upright => {
                Self::Upright(single(at), [m[(0, 0)] as f32, m[(1, 0)] as f32], half.map(|h| h as f32))
            }
            Shape::Cuboid(half) => {
                let axes = [0, 1, 2].map(|i| single(m.column(i).into()));
                Self::Box(single(at), axes, half.map(|h| h as f32))
            }
        }
    }

    /// The same number for the same kind.
    pub fn kind(&self) -> u8 {
        match self {
            Self::Upright(..) => 0,
            Self::Box(..) => 1,
            Self::Post(..) => 2,
            Self::Capsule(..) => 3,
            Self::Cylinder(..) => 4,
        }
    }

    /// Whether in any lane a ball at these coordinates reaches into the solid.
    #[inline(always)]
    pub fn meets<L: Lanes>(&self, ball: Vector<L>, radius: f32) -> bool {
        let none = L::splat(0.0);
        let (square, reach) = match self {
            Self::Upright(at, axis, half) => {
                let d = ball - Vector::splat(*at);
                let (ax, ay) = (L::splat(axis[0]), L::splat(axis[1]));
                let u = (d.x.mul_add(ax, d.y * ay).abs() - L::splat(half[0])).max(none);
                let v = ((d.y * ax - d.x * ay).abs() - L::splat(half[1])).max(none);
                let w = (d.z.abs() - L::splat(half[2])).max(none);
                (u.mul_add(u, v.mul_add(v, w * w)), radius)
            }
            Self::Box(at, [a, b, c], half) => {
                let d = ball - Vector::splat(*at);
                let u = (d.dot(*a).abs() - L::splat(half[0])).max(none);
                let v = (d.dot(*b).abs() - L::splat(half[1])).max(none);
                let w = (d.dot(*c).abs() - L::splat(half[2])).max(none);
                (u.mul_add(u, v.mul_add(v, w * w)), radius)
            }
            Self::Post(from, length, thick) => {
                let d = ball - Vector::splat(*from);
                let w = d.z - d.z.min(L::splat(*length)).max(none);
                (Vector { z: w, ..d }.square(), radius + thick)
            }
            Self::Capsule(from, along, inverse, thick) => {
                let d = ball - Vector::splat(*from);
                let t = (d.dot(*along) * L::splat(*inverse)).min(L::splat(1.0)).max(none);
                ((d - Vector::splat(*along).scaled(t)).square(), radius + thick)
            }
            Self::Cylinder(at, axis, half, thick) => {
                let d = ball - Vector::splat(*at);
                let along = d.dot(*axis);
                let radial = (d.square() - along * along).max(none).sqrt();
                let (u, w) = ((radial - L::splat(*thick)).max(none), (along.abs() - L::splat(*half)).max(none));
                (u.mul_add(u, w * w), radius)
            }
        };
        square.below(L::splat(reach * reach)) != 0
    }
}
