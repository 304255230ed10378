//! How large things are where it matters: across a gripper, where they stand, where things stand on them.
//!
//! All of it follows from shapes and frames; where nothing is known of a shape, nothing is said.

use crate::outline::radius_at;
use crate::pose::Pose;
use crate::scene::{Frame, Shape, Solid, frame};

/// How level or steep a direction must be to count as that.
const STRAIGHT: f64 = 1e-6;

/// What a body is made of.
#[derive(Clone, Copy, Debug)]
pub struct Body<'s> {
    /// Its named points.
    pub frames: &'s [Frame],
    /// Its main shape.
    pub shape: Option<&'s Shape>,
    /// More of it.
    pub solids: &'s [Solid],
}

impl Body<'_> {
    /// How wide it is between the fingers that grip it at its frame `grasp` and close along that frame's y axis, m.
    /// Where pieces overlap there, the widest of them; nothing where the frame lies in none.
    pub fn across_grasp(&self) -> Option<f64> {
        self.across(frame::GRASP)
    }

    /// The same at another of its frames, m.
    pub fn across(&self, frame: &str) -> Option<f64> {
        let grasp = self.frames.iter().find(|f| f.name == frame && !f.stand)?.pose;
        let main = self.shape.map(|shape| across(shape, grasp));
        let more = self.solids.iter().map(|solid| across(&solid.shape, solid.pose.inverse().then(grasp)));
        main.into_iter().chain(more).flatten().max_by(f64::total_cmp)
    }

    /// From its base to its highest point, m.
    pub fn height(&self) -> Option<f64> {
        let main = self.shape.map(|shape| shape.size()[2]);
        let more = self.solids.iter().map(|solid| top_of(&solid.shape, solid.pose));
        main.into_iter().chain(more).max_by(f64::total_cmp)
    }

    /// The narrowest width of the foot it stands on, m.
    pub fn foot(&self) -> Option<f64> {
        self.shape.and_then(|shape| match shape {
            Shape::Turned { outside, .. } => {
                let lowest = outside.first().map_or(0.0, |p| p[1]);
                Some(2.0 * outside.iter().filter(|p| p[1] <= lowest).map(|p| p[0]).fold(0.0, f64::max))
            }
            Shape::Sphere(_) => Some(0.0),
            Shape::Box([x, y, _]) => Some(x.min(*y)),
            Shape::Cylinder([d, _]) => Some(*d),
            Shape::Mesh(_) => None,
        })
    }

    /// How wide the opening at its rim is, m; nothing where the inside of its shape is not known.
    pub fn mouth(&self) -> Option<f64> {
        match self.shape? {
            Shape::Turned { inside, .. } => inside.last().map(|rim| 2.0 * rim[0]),
            _ => None,
        }
    }

    /// The narrowest width of what things stand on, m.
    pub fn top(&self) -> Option<f64> {
        let known = self.shape.filter(|shape| !matches!(shape, Shape::Mesh(_)));
        known.map(|shape| shape.size()).map(|[x, y, _]| x.min(y))
    }
}

/// The highest point of a piece above the base of its body, m.
fn top_of(shape: &Shape, at: Pose) -> f64 {
    let [x, y, z] = shape.size();
    let corners = [-0.5, 0.5].into_iter().flat_map(|i| [-0.5, 0.5].into_iter().map(move |j| [i * x, j * y]));
    let points = corners.flat_map(|[px, py]| [[px, py, 0.0], [px, py, z]]);
    points.map(|p| at.point(p)[2]).fold(f64::NEG_INFINITY, f64::max)
}

/// How wide a shape is along the y axis of a frame in it, m; nothing if the frame lies outside of it.
fn across(shape: &Shape, at: Pose) -> Option<f64> {
    let [x, y, z] = at.position;
    let [dx, dy, dz] = {
        let ([ox, oy, oz], [px, py, pz]) = (at.position, at.point([0.0, 1.0, 0.0]));
        [(px - ox).abs(), (py - oy).abs(), (pz - oz).abs()]
    };
    let [width, depth, height] = shape.size();
    let near = 1e-9;
    if z < -near || z > height + near {
        return None;
    }
    let radius = match shape {
        Shape::Box(_) => {
            let inside = x.abs() <= width / 2.0 + near && y.abs() <= depth / 2.0 + near;
            return inside.then_some(dx * width + dy * depth + dz * height);
        }
        Shape::Cylinder([d, _]) => d / 2.0,
        Shape::Sphere(d) => (d * d / 4.0 - (z - d / 2.0).powi(2)).max(0.0).sqrt(),
        Shape::Turned { outside, .. } => radius_at(outside, z).unwrap_or(0.0),
        Shape::Mesh(_) => return None,
    };
    if x.hypot(y) > radius + near {
        return None;
    }
    Some(match dz <= STRAIGHT {
        true => 2.0 * radius,
        // Along a slant the whole of it counts.
        false => dx.hypot(dy) * width + dz * height,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn body(shape: &Shape, grasp: Pose) -> Option<f64> {
        let frames = [Frame { name: frame::GRASP.into(), pose: grasp, stand: false, link: None }];
        Body { frames: &frames, shape: Some(shape), solids: &[] }.across_grasp()
    }

    #[test]
    fn a_box_is_as_wide_as_it_is_turned_to_the_fingers() {
        let plate = Shape::Box([0.128, 0.086, 0.014]);
        let wide = |yaw| body(&plate, Pose::turned([0.0, 0.0, 0.007], [0.0, 0.0, yaw])).expect("inside");
        assert!((wide(0.0) - 0.086).abs() < 1e-12);
        assert!((wide(FRAC_PI_2) - 0.128).abs() < 1e-9);
        assert_eq!(body(&plate, Pose::up(0.02)), None);
    }

    #[test]
    fn a_flask_is_narrow_at_its_neck() {
        let flask =
            Shape::Turned { outside: vec![[0.0, 0.0], [0.04, 0.0], [0.015, 0.1], [0.015, 0.13]], inside: vec![] };
        assert!((body(&flask, Pose::up(0.12)).expect("inside") - 0.03).abs() < 1e-12);
        assert!((body(&flask, Pose::up(0.05)).expect("inside") - 0.055).abs() < 1e-12);
    }

    #[test]
    fn a_ball_is_gripped_at_its_height() {
        let ball = Shape::Sphere(0.02);
        assert!((body(&ball, Pose::up(0.01)).expect("inside") - 0.02).abs() < 1e-12);
        assert!((body(&ball, Pose::up(0.016)).expect("inside") - 0.016).abs() < 1e-12);
    }

    #[test]
    fn a_handle_counts_where_it_is_gripped() {
        let frames = [Frame { name: frame::GRASP.into(), pose: Pose::up(0.11), stand: false, link: None }];
        let handle = Solid { shape: Shape::Box([0.1, 0.02, 0.03]), pose: Pose::up(0.1) };
        let crate_ = Shape::Box([0.4, 0.3, 0.1]);
        let body = Body { frames: &frames, shape: Some(&crate_), solids: &[handle] };
        assert_eq!(body.across_grasp(), Some(0.02));
        assert_eq!(body.height(), Some(0.13));
        assert_eq!(body.foot(), Some(0.3));
    }
}
