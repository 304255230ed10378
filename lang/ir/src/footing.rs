//! Whether a thing stands: its centre of mass must be above what it touches of what bears it.

use crate::extent::Body;
use crate::inertia::of_shapes;
use crate::math::{cos, sin};
use crate::pose::Pose;
use crate::scene::{Shape, frame};

/// How far apart a foot and the top of what bears it may be, m: shapes are nominal.
pub const LEVEL: f64 = 2e-3;

/// How upright a piece must be.
const UPRIGHT: f64 = 1e-6;

/// Corners of the polygon that stands for a circle: it is 0.2 % narrower at most.
const CORNERS: u32 = 48;

type Point = [f64; 2];

/// How far the centre of mass of a thing there is inside what bears it, seen from above, m: below 0 it tips over. Some
/// pieces, with their places, may bear it. Nothing where no foot or no top at its level is known.
pub fn footing<'s>(thing: &Body<'_>, at: &Pose, pieces: impl Iterator<Item = (&'s Shape, Pose)>) -> Option<f64> {
    let foot = feet(thing, at)?;
    let tops = tops(at.position[2], pieces)?;
    let centre = at.point(centre(thing)?);
    let centre = [centre[0], centre[1]];
    let shared: Vec<Point> = foot.iter().flat_map(|foot| tops.iter().flat_map(move |top| common(foot, top))).collect();
    if shared.is_empty() {
        let inside = tops.iter().map(|top| inside(centre, top));
        return inside.max_by(f64::total_cmp).map(|most| most.min(0.0));
    }
    Some(inside(centre, &hull(shared)))
}

/// The least and the greatest corner of what is at a level among some pieces, m; nothing where nothing is known there.
pub fn reach<'s>(level: f64, pieces: impl Iterator<Item = (&'s Shape, Pose)>) -> Option<[Point; 2]> {
    let points: Vec<Point> = tops(level, pieces)?.concat();
    let over = |k: usize, f: fn(f64, f64) -> f64| points.iter().map(|p| p[k]).reduce(f);
    Some([[over(0, f64::min)?, over(1, f64::min)?], [over(0, f64::max)?, over(1, f64::max)?]])
}

/// Where the centre of mass of a thing is, in its own frame, m.
pub fn centre(thing: &Body<'_>) -> Option<[f64; 3]> {
    let named = thing.frames.iter().find(|f| f.name == frame::CENTRE && !f.stand && f.link.is_none());
    let main = thing.shape.iter().map(|shape| (*shape, Pose::IDENTITY));
    let shapes = main.chain(thing.solids.iter().map(|solid| (&solid.shape, solid.pose)));
    named.map(|f| f.pose.position).or_else(|| Some(of_shapes(1.0, shapes)?.placement.position))
}

/// What a thing touches the ground with.
fn feet(thing: &Body<'_>, at: &Pose) -> Option<Vec<Vec<Point>>> {
    let main = thing.shape.iter().map(|shape| (*shape, *at));
    let more = thing.solids.iter().map(|solid| (&solid.shape, at.then(solid.pose)));
    let mut out = Vec::new();
    for (shape, place) in main.chain(more) {
        if (place.position[2] - at.position[2]).abs() > LEVEL {
            continue;
        }
        let round = match shape {
            Shape::Box(_) => None,
            Shape::Cylinder([d, _]) => Some(d / 2.0),
            Shape::Turned { outside, .. } => {
                let lowest = outside.first().map_or(0.0, |p| p[1]);
                Some(outside.iter().filter(|p| p[1] <= lowest + LEVEL).map(|p| p[0]).fold(0.0, f64::max))
            }
            Shape::Sphere(_) | Shape::Mesh(_) => return None,
        };
        out.push(flat(shape, &place, round)?);
    }
    Some(out).filter(|feet| !feet.is_empty())
}

/// What is at a level and flat of some pieces; nothing where one of them cannot be told.
fn tops<'s>(level: f64, pieces: impl Iterator<Item = (&'s Shape, Pose)>) -> Option<Vec<Vec<Point>>> {
    let mut out = Vec::new();
    for (shape, place) in pieces {
        let high = shape.size()[2];
        if (place.point([0.0, 0.0, high])[2] - level).abs() > LEVEL {
            continue;
        }
        let round = match shape {
            Shape::Box(_) => None,
            Shape::Cylinder([d, _]) => Some(d / 2.0),
            Shape::Turned { .. } => Some(shape.rim()),
            Shape::Sphere(_) | Shape::Mesh(_) => return None,
        };
        out.push(flat(shape, &place, round)?);
    }
    Some(out).filter(|tops| !tops.is_empty())
}

/// A shape seen from above, counter-clockwise; nothing where it leans.
fn flat(shape: &Shape, at: &Pose, radius: Option<f64>) -> Option<Vec<Point>> {
    if at.point([0.0, 0.0, 1.0])[2] - at.position[2] < 1.0 - UPRIGHT {
        return None;
    }
    let seen = |x: f64, y: f64| {
        let [x, y, _] = at.point([x, y, 0.0]);
        [x, y]
    };
    Some(match radius {
        Some(r) => {
            let turn = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(CORNERS);
            (0..CORNERS).map(|k| seen(r * cos(turn(k)), r * sin(turn(k)))).collect()
        }
        None => {
            let [x, y, _] = shape.size().map(|s| s / 2.0);
            [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| seen(x, y)).to_vec()
        }
    })
}

/// Twice the area of a triangle, above 0 where it turns left.
fn left(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The sides of a polygon.
fn sides(polygon: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    polygon.iter().copied().zip(polygon.iter().copied().cycle().skip(1))
}

/// The corners of what two convex polygons share (Sutherland and Hodgman 1974).
fn common(one: &[Point], other: &[Point]) -> Vec<Point> {
    let mut kept = one.to_vec();
    for (a, b) in sides(other) {
        let whole = std::mem::take(&mut kept);
        for (p, q) in sides(&whole) {
            let (from, to) = (left(a, b, p), left(a, b, q));
            if from >= 0.0 {
                kept.push(p);
            }
            if (from >= 0.0) != (to >= 0.0) {
                let share = from / (from - to);
                kept.push([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])]);
            }
        }
    }
    kept
}

/// The convex polygon around some points, counter-clockwise (Andrew 1979).
fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut out: Vec<Point> = Vec::new();
        for p in points {
            while let [.., a, b] = out[..]
                && left(a, b, p) <= 0.0
            {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    if lower.is_empty() { points } else { lower }
}

/// How far a point is inside a convex polygon, m; below 0 outside of it.
fn inside(point: Point, polygon: &[Point]) -> f64 {
    let near = |(a, b): (Point, Point)| {
        let (along, out) = ([b[0] - a[0], b[1] - a[1]], [point[0] - a[0], point[1] - a[1]]);
        let length = along[0] * along[0] + along[1] * along[1];
        let share = if length > 0.0 { (along[0] * out[0] + along[1] * out[1]) / length } else { 0.0 };
        let share = share.clamp(0.0, 1.0);
        (out[0] - share * along[0]).hypot(out[1] - share * along[1])
    };
    let far = sides(polygon).map(near).fold(f64::INFINITY, f64::min);
    let within = polygon.len() > 2 && sides(polygon).all(|(a, b)| left(a, b, point) >= 0.0);
    if within { far } else { -far }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn margin(thing: &Shape, at: [f64; 3], below: &[(Shape, [f64; 3])]) -> Option<f64> {
        let body = Body { frames: &[], shape: Some(thing), solids: &[] };
        footing(&body, &Pose::at(at), below.iter().map(|(shape, at)| (shape, Pose::at(*at))))
    }

    #[test]
    fn a_thing_stands_while_its_middle_is_above_what_bears_it() {
        let (cup, post) = (Shape::Cylinder([0.07, 0.095]), (Shape::Cylinder([0.06, 0.2]), [0.0; 3]));
        let on = |x: f64| margin(&cup, [x, 0.0, 0.2], std::slice::from_ref(&post)).expect("known");
        assert!((on(0.0) - 0.03).abs() < 1e-4, "{}", on(0.0));
        assert!(on(0.02) > 0.0 && on(0.045) < -0.014, "{} {}", on(0.02), on(0.045));
        // Off it altogether: how far its middle is from it.
        assert!((on(0.5) + 0.47).abs() < 1e-3, "{}", on(0.5));
    }

    #[test]
    fn two_rails_bear_what_lies_across_them() {
        let rail = |y: f64| (Shape::Box([0.4, 0.02, 0.1]), [0.0, y, 0.0]);
        let plate = Shape::Box([0.1, 0.3, 0.01]);
        let across = margin(&plate, [0.0, 0.0, 0.1], &[rail(-0.1), rail(0.1)]).expect("known");
        assert!((across - 0.05).abs() < 1e-9, "{across}");
        assert!(margin(&plate, [0.0, 0.0, 0.1], &[rail(-0.1)]).expect("known") < 0.0);
    }

    #[test]
    fn nothing_is_said_where_nothing_is_at_its_level() {
        let cup = Shape::Cylinder([0.07, 0.095]);
        let table = (Shape::Box([1.0, 1.0, 0.05]), [0.0; 3]);
        assert_eq!(margin(&cup, [0.0, 0.0, 0.2], std::slice::from_ref(&table)), None);
        assert_eq!(margin(&Shape::Sphere(0.02), [0.0, 0.0, 0.05], &[table]), None);
    }
}
