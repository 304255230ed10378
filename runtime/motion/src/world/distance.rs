//! How far a point is from a solid, and where on it: exact, in 64-bit floats.

use nalgebra::{Point3, Vector3};

use super::{Body, Shape};

/// The nearest point on a solid's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// From the surface, negative inside; metres.
    pub distance: f64,
    /// On the surface.
    pub point: Point3<f64>,
}

impl Body {
    /// The point of the surface nearest to `from`.
    pub fn nearest(&self, from: &Point3<f64>) -> Nearest {
        let p = self.pose.inverse_transform_point(from).coords;
        let on = match self.shape {
            Shape::Sphere(radius) => outward(p, Vector3::z()) * radius,
            Shape::Capsule(radius, half) => {
                let core = Vector3::new(0.0, 0.0, p.z.clamp(-half, half));
                core + outward(p - core, Vector3::x()) * radius
            }
            Shape::Cuboid(half) => on_cuboid(p, half.into()),
            Shape::Cylinder(radius, half) => on_cylinder(p, radius, half),
        };
        let distance = (p - on).norm();
        let inside = match self.shape {
            Shape::Sphere(radius) => p.norm() < radius,
            Shape::Capsule(radius, half) => (p - Vector3::new(0.0, 0.0, p.z.clamp(-half, half))).norm() < radius,
            Shape::Cuboid(half) => (0..3).all(|i| p[i].abs() < half[i]),
            Shape::Cylinder(radius, half) => p.xy().norm() < radius && p.z.abs() < half,
        };
        Nearest { distance: if inside { -distance } else { distance }, point: self.pose * Point3::from(on) }
    }
}

fn outward(v: Vector3<f64>, else_: Vector3<f64>) -> Vector3<f64> {
    v.try_normalize(1e-12).unwrap_or(else_)
}

fn on_cuboid(p: Vector3<f64>, half: Vector3<f64>) -> Vector3<f64> {
    let clamped = p.zip_map(&half, |x, h: f64| x.clamp(-h, h));
    if clamped != p {
        return clamped;
    }
    let axis = (0..3).min_by(|&i, &j| (half[i] - p[i].abs()).total_cmp(&(half[j] - p[j].abs()))).unwrap_or(0);
    let mut on = p;
    on[axis] = half[axis].copysign(p[axis]);
    on
}

fn on_cylinder(p: Vector3<f64>, radius: f64, half: f64) -> Vector3<f64> {
    let radial = p.xy().norm();
    let out = if radial > 1e-12 { p.xy() / radial } else { nalgebra::Vector2::x() };
    let (mut r, mut z) = (radial.min(radius), p.z.clamp(-half, half));
    if r == radial && z == p.z {
        if radius - radial < half - p.z.abs() {
            r = radius;
        } else {
            z = half.copysign(p.z);
        }
    }
    Vector3::new(out.x * r, out.y * r, z)
}
