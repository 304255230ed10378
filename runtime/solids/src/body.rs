//! A body in convex pieces, and where it touches another one.

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use matterix_ir::mesh::Mesh;
use matterix_ir::pose::Pose;
use matterix_ir::robot::{Link, Robot, Solid};
use matterix_ir::scene::{Shape, Solid as Placed};
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::math::{Pose as Isometry, Vector};
use parry3d_f64::query::{self, Ray};
use parry3d_f64::shape::SharedShape;

use crate::bored::{self, Piece};
use crate::mesh::{self, hull};
use crate::place::isometry;
use crate::turned;

/// A contact nearer to nothing than this may be that of pieces that are placed alike, m.
const ALIGNED: f64 = 1e-9;

/// By how much such a piece is moved, along none of the axes, m.
const NUDGE: [f64; 3] = [1.1e-6, 2.3e-6, 1.7e-6];

/// Something rigid, of one or more convex pieces.
#[derive(Clone)]
pub struct Body {
    pieces: Vec<Convex>,
    around: Aabb,
}

#[derive(Clone)]
struct Convex {
    at: Isometry,
    shape: SharedShape,
    /// In the frame of the body.
    around: Aabb,
}

/// Where two bodies are nearest, or reach deepest into each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Their distance; below 0 a bound of how far they reach into each other, seldom more than that is; m.
    pub distance: f64,
    /// On the other body, in the frame that both were placed in; m.
    pub point: [f64; 3],
}

impl fmt::Debug for Body {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Body of {} pieces", self.pieces.len())
    }
}

impl Body {
    /// Shapes of a thing, each with its pose; none where there are none.
    pub fn of_shapes<'a>(shapes: impl IntoIterator<Item = (&'a Shape, Pose)>) -> Option<Body> {
        let mut pieces = Vec::new();
        shapes.into_iter().for_each(|(shape, at)| add_shape(shape, &at, &mut pieces));
        Body::of(pieces)
    }

    /// As [`Body::of_shapes`], with rooms taken out of a main shape that is a block: holes of a rack, wells of a plate.
    pub fn with_rooms(main: Option<&Shape>, more: &[Placed], rooms: &[Placed]) -> Option<Body> {
        Body::bored(main, more, rooms, bored::pieces)
    }

    /// As [`Body::with_rooms`], with prisms around round holes instead of within: what fits such a hole fits that.
    pub fn with_wide_rooms(main: Option<&Shape>, more: &[Placed], rooms: &[Placed]) -> Option<Body> {
        Body::bored(main, more, rooms, bored::wide_pieces)
    }

    /// Shapes of a thing as a hand feels them from outside: vessels are full, and round walls are round. None where there are none.
    pub fn outside<'a>(shapes: impl IntoIterator<Item = (&'a Shape, Pose)>) -> Option<Body> {
        let mut pieces = Vec::new();
        for (shape, at) in shapes {
            let Shape::Turned { outside, .. } = shape else {
                add_shape(shape, &at, &mut pieces);
                continue;
            };
            for two in outside.windows(2) {
                let ([low, z], [high, top]) = (two[0], two[1]);
                let height = top - z;
                if height > 0.0 && low == high {
                    add_shape(&Shape::Cylinder([2.0 * low, height]), &at.then(Pose::up(z)), &mut pieces);
                } else if height > 0.0 {
                    let corners = turned::pieces(two, &[]);
                    corners.iter().filter_map(|c| hull(c)).for_each(|hull| push(isometry(&at), hull, &mut pieces));
                }
            }
        }
        Body::of(pieces)
    }

    fn bored(
        main: Option<&Shape>,
        more: &[Placed],
        rooms: &[Placed],
        without: fn([f64; 3], &[Placed]) -> Vec<Piece>,
    ) -> Option<Body> {
        let mut pieces = Vec::new();
        match main {
            Some(Shape::Box(size)) if !rooms.is_empty() => {
                without(*size, rooms).into_iter().for_each(|piece| add_piece(piece, &mut pieces));
            }
            Some(shape) => add_shape(shape, &Pose::IDENTITY, &mut pieces),
            None => {}
        }
        more.iter().for_each(|solid| add_shape(&solid.shape, &solid.pose, &mut pieces));
        Body::of(pieces)
    }

    /// What collides of each link of a robot; none for links without that.
    pub fn of_links(robot: &Robot) -> Vec<Option<Body>> {
        let body = |link: &Link| {
            let mut pieces = Vec::new();
            link.collision.iter().for_each(|piece| add_solid(robot, &piece.solid, &piece.placement, &mut pieces));
            Body::of(pieces)
        };
        robot.links.iter().map(body).collect()
    }

    fn of(pieces: Vec<Convex>) -> Option<Body> {
        let around = pieces.iter().map(|p| p.around).reduce(|a, b| a.merged(&b))?;
        Some(Body { pieces, around })
    }

    /// Its convex pieces, each with its place in the frame of the body.
    pub fn pieces(&self) -> impl Iterator<Item = (Isometry, &SharedShape)> {
        self.pieces.iter().map(|piece| (piece.at, &piece.shape))
    }

    /// How far its farthest point may be from the origin of its frame, m.
    pub fn reach(&self) -> f64 {
        self.around.mins.abs().max(self.around.maxs.abs()).length()
    }

    /// The least and the greatest corner of a box around it as it is placed, m.
    pub fn bounds(&self, at: &Isometry) -> [[f64; 3]; 2] {
        let around = self.pieces.iter().map(|p| p.shape.compute_aabb(&(*at * p.at))).reduce(|a, b| a.merged(&b));
        let around = around.unwrap_or_else(|| self.around.transform_by(at));
        [around.mins.to_array(), around.maxs.to_array()]
    }

    /// How far a body goes on from a point in it, along the y axis of a frame there and against it, m; none where the line meets nothing.
    pub fn ways_across(&self, frame: &Pose) -> Option<[f64; 2]> {
        let frame = isometry(frame);
        let far = 2.0 * (self.reach() + frame.translation.length());
        let from_outside = |side: f64| {
            let along = frame.rotation * Vector::new(0.0, side, 0.0);
            let ray = Ray::new(frame.translation + along * far, -along);
            let met = self.pieces.iter().filter_map(|piece| piece.shape.cast_ray(&piece.at, &ray, 2.0 * far, true));
            met.min_by(f64::total_cmp).map(|way| far - way)
        };
        Some([from_outside(1.0)?, from_outside(-1.0)?])
    }

    /// Whether two bodies reach deeper into each other than this, m; quicker than where and how deep.
    pub fn meets(&self, at: &Isometry, other: &Body, other_at: &Isometry, deeper: f64) -> bool {
        let between = at.inv_mul(other_at);
        if !self.around.intersects(&other.around.transform_by(&between)) {
            return false;
        }
        other.pieces.iter().any(|theirs| {
            let box_of_theirs = theirs.around.transform_by(&between);
            if !box_of_theirs.intersects(&self.around) {
                return false;
            }
            let theirs_at = between * theirs.at;
            let near = self.pieces.iter().filter(|mine| mine.around.intersects(&box_of_theirs));
            near.into_iter().any(|mine| is_deep(mine, theirs, &theirs_at, deeper))
        })
    }

    /// The nearest or deepest touch of two bodies, if they are no farther apart than `within`, m.
    pub fn touch(&self, at: &Isometry, other: &Body, other_at: &Isometry, within: f64) -> Option<Touch> {
        // The other in the frame of this one.
        let between = at.inv_mul(other_at);
        if !self.around.loosened(within).intersects(&other.around.transform_by(&between)) {
            return None;
        }
        let mut least: Option<Touch> = None;
        for theirs in &other.pieces {
            let box_of_theirs = theirs.around.transform_by(&between).loosened(within);
            if !box_of_theirs.intersects(&self.around) {
                continue;
            }
            let theirs_at = between * theirs.at;
            for mine in self.pieces.iter().filter(|mine| mine.around.intersects(&box_of_theirs)) {
                let Some(found) = contact(mine, theirs, &theirs_at, within) else { continue };
                if least.is_none_or(|l| found.dist < l.distance) {
                    least = Some(Touch { distance: found.dist, point: at.transform_point(found.point2).to_array() });
                }
            }
        }
        least
    }
}

/// Nearest or deepest contact of two convex pieces, in the frame of the first.
///
/// How far two pieces reach into each other is found by expanding a polytope, which may stop early on a direction that is not
/// the shortest way out; either order gives an upper bound, and the lesser of both is taken. Of a thousand random pairs about one
/// is still said deeper than it is, by 2 mm in 20.
fn contact(mine: &Convex, theirs: &Convex, theirs_at: &Isometry, within: f64) -> Option<query::Contact> {
    // Only pairs of convex pieces are asked about, which all are supported.
    let one = one_way((&mine.at, mine), (theirs_at, theirs), within);
    if one.is_some_and(|c| c.dist >= 0.0) {
        return one;
    }
    let other = one_way((theirs_at, theirs), (&mine.at, mine), within).map(query::Contact::flipped);
    match (one, other) {
        (Some(a), Some(b)) => Some(if a.dist < b.dist { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The contact of two pieces, the first one's own side first.
///
/// Pieces that are placed alike, so that faces and corners of both lie in one plane, leave the expansion without a direction: it may stop at a
/// distance of nothing however deep they are in each other. Such an answer counts only if the same pieces a little apart give it too.
fn one_way(one: (&Isometry, &Convex), other: (&Isometry, &Convex), within: f64) -> Option<query::Contact> {
    let ask = |other_at: &Isometry, within: f64| {
        query::contact(one.0, one.1.shape.as_ref(), other_at, other.1.shape.as_ref(), within).ok().flatten()
    };
    let found = ask(other.0, within.max(ALIGNED))?;
    if found.dist.abs() > ALIGNED {
        return Some(found);
    }
    let nudged = Isometry::from_translation(Vector::from(NUDGE)) * *other.0;
    let deep = ask(&nudged, within).filter(|c| c.dist < -2.0 * NUDGE[1]);
    deep.or(Some(found).filter(|c| c.dist <= within))
}

/// Whether [`contact`] is deeper than this, m.
fn is_deep(mine: &Convex, theirs: &Convex, theirs_at: &Isometry, deeper: f64) -> bool {
    let one = one_way((&mine.at, mine), (theirs_at, theirs), 0.0);
    if one.is_some_and(|c| c.dist >= -deeper) {
        return false;
    }
    let other = one_way((theirs_at, theirs), (&mine.at, mine), 0.0);
    other.map_or(one.is_some(), |c| c.dist < -deeper)
}

fn push(at: Isometry, shape: SharedShape, pieces: &mut Vec<Convex>) {
    let around = shape.compute_aabb(&at);
    pieces.push(Convex { at, shape, around });
}

fn add_piece(piece: Piece, pieces: &mut Vec<Convex>) {
    match piece {
        Piece::Box(low, high) => {
            let (low, high) = (Vector::from(low), Vector::from(high));
            let half = (high - low) / 2.0;
            push(Isometry::from_translation(low + half), SharedShape::cuboid(half.x, half.y, half.z), pieces);
        }
        Piece::Corners(corners) => {
            hull(&corners).into_iter().for_each(|hull| push(Isometry::identity(), hull, pieces));
        }
    }
}

/// A shape of a scene has its origin at the middle of its base.
fn add_shape(shape: &Shape, at: &Pose, pieces: &mut Vec<Convex>) {
    let size = shape.size();
    let middle = isometry(&at.then(Pose::up(size[2] / 2.0)));
    match shape {
        Shape::Box([x, y, z]) => push(middle, SharedShape::cuboid(x / 2.0, y / 2.0, z / 2.0), pieces),
        Shape::Cylinder([d, h]) => push(middle * upright(), SharedShape::cylinder(h / 2.0, d / 2.0), pieces),
        Shape::Sphere(d) => push(middle, SharedShape::ball(d / 2.0), pieces),
        Shape::Mesh(mesh) => mesh::pieces(mesh).into_iter().for_each(|piece| push(isometry(at), piece, pieces)),
        Shape::Turned { outside, inside } => {
            for corners in turned::pieces(outside, inside) {
                // A slice without thickness is none.
                hull(&corners).into_iter().for_each(|hull| push(isometry(at), hull, pieces));
            }
        }
    }
}

/// A solid of a robot has its origin at its middle.
fn add_solid(robot: &Robot, solid: &Solid, at: &Pose, pieces: &mut Vec<Convex>) {
    let at = isometry(at);
    match solid {
        Solid::Cuboid([x, y, z]) => push(at, SharedShape::cuboid(x / 2.0, y / 2.0, z / 2.0), pieces),
        Solid::Cylinder([r, length]) => push(at * upright(), SharedShape::cylinder(length / 2.0, *r), pieces),
        Solid::Sphere(r) => push(at, SharedShape::ball(*r), pieces),
        Solid::Mesh(name, scale) => {
            // A mesh that was not found has no form.
            if let Some(mesh) = robot.meshes.get(name) {
                let mesh = Mesh::clone(mesh).scaled(*scale);
                mesh::pieces(&mesh).into_iter().for_each(|piece| push(at, piece, pieces));
            }
        }
    }
}

/// Parry's cylinders stand along y.
fn upright() -> Isometry {
    Isometry::rotation(Vector::new(FRAC_PI_2, 0.0, 0.0))
}
