//! A block with upright holes, in convex pieces: what stands in a rack or is dipped into a well has its room.

use std::f64::consts::{PI, TAU};

use matterix_ir::math::{cos, sin_cos};
use matterix_ir::scene::{Shape, Solid};
use parry3d_f64::math::Vector;

/// Sides of the prism that stands for a round hole; its wall stands into a hole of 13 mm by 0.13 mm.
const SIDES: u32 = 16;

/// Sides of the prism that stands around a round hole: its wall is farther from the axis than that of the hole by 0.5 % at most.
const AROUND: u32 = 32;

/// What is thinner than this is left out, m.
const THIN: f64 = 1e-5;

/// Holes whose axis leans by more than this sine are none that can be cut.
const UPRIGHT: f64 = 1e-6;

/// A piece of a block.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// Its least and its greatest corner, m.
    Box([f64; 3], [f64; 3]),
    /// The corners of something convex, m.
    Corners(Vec<Vector>),
}

/// An upright hole.
#[derive(Clone, Copy, Debug)]
struct Hole {
    middle: [f64; 2],
    /// Half its extent along x and y.
    half: [f64; 2],
    round: bool,
    /// Of the prism that stands for it, where it is round.
    sides: u32,
    /// Where it begins and ends.
    height: [f64; 2],
}

/// From, to: along x and y.
type Rectangle = [[f64; 2]; 2];

/// A block, its origin in the middle of its base, without the rooms in it, m. Where holes cannot be told apart by straight
/// cuts, the block stays whole there.
pub fn pieces(size: [f64; 3], rooms: &[Solid]) -> Vec<Piece> {
    bored(size, rooms, SIDES)
}

/// The same with prisms around the round holes instead of within: what fits a hole fits them.
pub fn wide_pieces(size: [f64; 3], rooms: &[Solid]) -> Vec<Piece> {
    let widened = |room: &Solid| match room.shape {
        Shape::Cylinder([d, h]) => {
            Solid { shape: Shape::Cylinder([d / cos(PI / f64::from(AROUND)), h]), ..room.clone() }
        }
        _ => room.clone(),
    };
    bored(size, &rooms.iter().map(widened).collect::<Vec<_>>(), AROUND)
}

fn bored(size: [f64; 3], rooms: &[Solid], sides: u32) -> Vec<Piece> {
    let mut holes: Vec<Hole> = rooms.iter().filter_map(|room| hole(room, size)).collect();
    holes.iter_mut().for_each(|hole| hole.sides = sides);
    let [x, y, z] = size.map(|s| s / 2.0);
    let mut out = Vec::new();
    split([[-x, x], [-y, y]], 2.0 * z, holes, &mut out);
    out
}

fn hole(room: &Solid, size: [f64; 3]) -> Option<Hole> {
    let [px, py, pz] = room.pose.position;
    let along = |axis: [f64; 3]| {
        let tip = room.pose.point(axis);
        [tip[0] - px, tip[1] - py, tip[2] - pz]
    };
    let (up, ahead) = (along([0.0, 0.0, 1.0]), along([1.0, 0.0, 0.0]));
    if up[0].hypot(up[1]) > UPRIGHT || up[2] < 0.0 {
        return None;
    }
    let [mut wide, mut deep, high] = room.shape.size();
    let round = room.shape.is_round() && !matches!(room.shape, Shape::Sphere(_));
    if !round {
        match (ahead[0].abs(), ahead[1].abs()) {
            (_, y) if y < UPRIGHT => {}
            (x, _) if x < UPRIGHT => std::mem::swap(&mut wide, &mut deep),
            _ => return None,
        }
    }
    let height = [pz.max(0.0), (pz + high).min(size[2])];
    let half = [wide / 2.0, deep / 2.0];
    let inside = (0..2).all(|k| [px, py][k].abs() + half[k] <= size[k] / 2.0 + THIN);
    let is_box = matches!(room.shape, Shape::Box(_));
    (inside && (round || is_box) && height[1] > height[0] + THIN).then_some(Hole {
        middle: [px, py],
        half,
        round,
        sides: SIDES,
        height,
    })
}

/// Cuts between holes until each has a rectangle of its own.
fn split(around: Rectangle, top: f64, mut holes: Vec<Hole>, out: &mut Vec<Piece>) {
    if holes.len() <= 1 {
        match holes.first() {
            Some(hole) => cell(around, top, hole, out),
            None => slab(around, [0.0, top], out),
        }
        return;
    }
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in 0..2 {
        holes.sort_by(|a, b| a.middle[axis].total_cmp(&b.middle[axis]));
        let mut reached = f64::NEG_INFINITY;
        for pair in holes.windows(2) {
            reached = reached.max(pair[0].middle[axis] + pair[0].half[axis]);
            let next = pair[1].middle[axis] - pair[1].half[axis];
            if next >= reached - THIN && best.is_none_or(|b| next - reached > b.0) {
                best = Some((next - reached, axis, (reached + next) / 2.0));
            }
        }
    }
    let Some((_, axis, at)) = best else { return slab(around, [0.0, top], out) };
    let (mut low, mut high) = (around, around);
    (low[axis][1], high[axis][0]) = (at, at);
    let (before, after): (Vec<_>, Vec<_>) = holes.into_iter().partition(|hole| hole.middle[axis] < at);
    if before.is_empty() || after.is_empty() {
        return slab(around, [0.0, top], out);
    }
    split(low, top, before, out);
    split(high, top, after, out);
}

/// A rectangle with one hole in it.
fn cell(around: Rectangle, top: f64, hole: &Hole, out: &mut Vec<Piece>) {
    let [low, high] = hole.height;
    slab(around, [0.0, low], out);
    slab(around, [high, top], out);
    let [[x0, x1], [y0, y1]] = around;
    let [[hx0, hx1], [hy0, hy1]] = [0, 1].map(|k| [hole.middle[k] - hole.half[k], hole.middle[k] + hole.half[k]]);
    if !hole.round {
        slab([[x0, hx0], [y0, y1]], hole.height, out);
        slab([[hx1, x1], [y0, y1]], hole.height, out);
        slab([[hx0, hx1], [y0, hy0]], hole.height, out);
        slab([[hx0, hx1], [hy1, y1]], hole.height, out);
        return;
    }
    // Rays to the sides of the prism and to the corners of the rectangle; between two of them the wall is convex.
    let [cx, cy] = hole.middle;
    let corner = |x: f64, y: f64| matterix_ir::math::atan2(y - cy, x - cx);
    let mut rays: Vec<f64> = (0..hole.sides).map(|k| TAU * f64::from(k) / f64::from(hole.sides) - PI).collect();
    rays.extend([corner(x0, y0), corner(x1, y0), corner(x0, y1), corner(x1, y1)]);
    rays.sort_by(f64::total_cmp);
    rays.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let ends = |angle: f64| {
        let (s, c) = sin_cos(angle);
        let to = |c: f64, low: f64, high: f64| if c > 0.0 { high / c } else { low / c };
        let far = to(c, x0 - cx, x1 - cx).min(to(s, y0 - cy, y1 - cy));
        [hole.half[0], far].map(|r| [cx + r * c, cy + r * s])
    };
    for (k, angle) in rays.iter().enumerate() {
        let next = rays.get(k + 1).copied().unwrap_or(rays[0] + TAU);
        let flat: Vec<[f64; 2]> = [ends(*angle), ends(next)].concat();
        let corners = flat.iter().flat_map(|[x, y]| [Vector::new(*x, *y, low), Vector::new(*x, *y, high)]);
        out.push(Piece::Corners(corners.collect()));
    }
}

fn slab([[x0, x1], [y0, y1]]: Rectangle, [low, high]: [f64; 2], out: &mut Vec<Piece>) {
    if x1 - x0 > THIN && y1 - y0 > THIN && high - low > THIN {
        out.push(Piece::Box([x0, y0, low], [x1, y1, high]));
    }
}
