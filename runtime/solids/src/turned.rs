//! What is turned on a lathe, in convex pieces: a vessel keeps its room.

use matterix_ir::math::sin_cos;
use parry3d_f64::math::Vector;

/// Sides of the prism that stands for a circle; it stands out of a wall of 35 mm radius by 0.17 mm.
pub const SIDES: u32 = 32;

/// Convex pieces between an outside and an inside outline, each a list of its corners; heights from the bottom up, m.
///
/// An outline is radius and height from the axis at the bottom to the rim. Where there is no inside, or below it, the
/// body is full.
pub fn pieces(outside: &[[f64; 2]], inside: &[[f64; 2]]) -> Vec<Vec<Vector>> {
    let mut levels: Vec<f64> = outside.iter().chain(inside).map(|p| p[1]).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let mut out = Vec::new();
    for band in levels.windows(2) {
        let (low, high) = (band[0], band[1]);
        let Some(outer) = section(outside, low, high) else { continue };
        match section(inside, low, high) {
            Some(inner) if inner.iter().any(|r| *r > 0.0) => out.extend(ring(outer, inner, low, high)),
            _ => out.push(disc(outer, low, high)),
        }
    }
    out
}

/// Radii of an outline just above one height and just below another, between which it has no corner.
fn section(outline: &[[f64; 2]], low: f64, high: f64) -> Option<[f64; 2]> {
    outline.windows(2).find_map(|step| {
        let ([r0, z0], [r1, z1]) = (step[0], step[1]);
        let at = |z: f64| r0 + (r1 - r0) * (z - z0) / (z1 - z0);
        (z0 <= low && z1 >= high && z1 > z0).then(|| [at(low), at(high)])
    })
}

/// A full slice.
fn disc([bottom, top]: [f64; 2], low: f64, high: f64) -> Vec<Vector> {
    (0..SIDES).flat_map(|k| [corner(bottom, k, low), corner(top, k, high)]).collect()
}

/// The sectors of a slice of wall.
fn ring(outer: [f64; 2], inner: [f64; 2], low: f64, high: f64) -> impl Iterator<Item = Vec<Vector>> {
    (0..SIDES).map(move |k| {
        let side = |k: u32| {
            let along = [(outer[0], low), (outer[1], high), (inner[0], low), (inner[1], high)];
            along.map(|(r, z)| corner(r, k, z))
        };
        [side(k), side(k + 1)].concat()
    })
}

fn corner(radius: f64, side: u32, height: f64) -> Vector {
    let (s, c) = sin_cos(f64::from(side % SIDES) * std::f64::consts::TAU / f64::from(SIDES));
    Vector::new(radius * c, radius * s, height)
}
