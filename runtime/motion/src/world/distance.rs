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
    /// Whether it comes as near to a point as this, m.
    pub fn is_within(&self, reach: f64, from: &Point3<f64>) -> bool {
        // The middle is in the solid, and all of the solid is around it: most bodies are near or far by that alone.
        let off = (from.coords - self.pose.translation.vector).norm();
        off <= reach || off - self.extent() <= reach && self.nearest(from).distance <= reach
    }

    /// How far it reaches from its middle, m.
    fn extent(&self) -> f64 {
        match self.shape {
            Shape::Sphere(radius) => radius,
            Shape::Capsule(radius, half) => radius + half,
            Shape::Cuboid([x, y, z]) => x.hypot(y).hypot(z),
            Shape::Cylinder(radius, half) => radius.hypot(half),
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;

    #[test]
    fn what_is_within_reach_is_what_is_near_enough() {
        let shapes =
            [Shape::Sphere(0.2), Shape::Capsule(0.1, 0.3), Shape::Cuboid([0.1, 0.2, 0.4]), Shape::Cylinder(0.2, 0.1)];
        let mut within = 0;
        for (index, shape) in shapes.into_iter().enumerate() {
            let turn = nalgebra::Rotation3::from_euler_angles(0.3, 0.2 * index as f64, -0.4);
            let pose = Pose::from_parts(nalgebra::Translation3::new(0.1, -0.2, 0.3), turn);
            let body = Body { name: String::new(), pose, shape };
            for place in (-6i32..=6).flat_map(|x| (-6i32..=6).map(move |y| [x, y])) {
                let from = Point3::new(f64::from(place[0]) * 0.15, f64::from(place[1]) * 0.15, 0.1);
                for reach in [0.0, 0.05, 0.3, 0.7, f64::INFINITY] {
                    assert_eq!(body.is_within(reach, &from), body.nearest(&from).distance <= reach, "{from} {reach}");
                    within += usize::from(body.is_within(reach, &from));
                }
            }
        }
        assert!(within > 100);
    }
}
