//! What stays in an open vessel that is tilted, at rest: the liquid below the level of its lip.
//!
//! The vessel is round and air gets in freely. Left out are the height to which surface tension lets a liquid stand over the
//! rim, some millimetres at most, and what stays behind as a film.

use std::f64::consts::{PI, TAU};

use crate::math::{acos, cos, sin};

/// By how much straight lines between the points of a table may be off, as a share of what fills the vessel.
const OFF: f64 = 1e-3;
/// The share of that which may be seen where a stretch of a table is looked at: between those places it is off by more.
const SEEN: f64 = 0.6;
/// The tilts at which a table begins to look, evenly over half a turn.
const FIRST: u32 = 12;
/// A stretch of a table is halved so often at most.
const HALVED: u32 = 8;
/// Parts into which each stretch of an outline is cut, and Gauss' points and weights for five points in each, from -1 to 1.
const PARTS: u32 = 8;
const GAUSS: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189],
    [-0.538_469_310_105_683, 0.478_628_670_499_366],
    [0.0, 0.568_888_888_888_889],
    [0.538_469_310_105_683, 0.478_628_670_499_366],
    [0.906_179_845_938_664, 0.236_926_885_056_189],
];

/// The volume that stays, m3, of what fills a vessel: `inside` are radius and height along its inner wall from the axis at the bottom to
/// the rim, m; `tilt` is from upright, rad.
pub fn kept(inside: &[[f64; 2]], tilt: f64) -> f64 {
    let Some(&[rim, top]) = inside.last() else { return 0.0 };
    if tilt >= PI {
        return 0.0;
    }
    // At a height, what is farther towards the lip than this is below its level.
    let steep = if tilt > 0.0 { cos(tilt) / sin(tilt) } else { f64::INFINITY };
    let from = |z: f64| if top - z == 0.0 { rim } else { rim - (top - z) * steep };
    let stretches = inside.windows(2).map(|pair| stretch([pair[0], pair[1]], &from));
    stretches.sum::<f64>().max(0.0)
}

/// What a stretch of the wall encloses at the axis side of it; less than nothing where it leads down, as over a raised bottom.
fn stretch([[r0, z0], [r1, z1]]: [[f64; 2]; 2], from: &dyn Fn(f64) -> f64) -> f64 {
    if z0 == z1 {
        return 0.0;
    }
    let at = |share: f64| (r0 + (r1 - r0) * share, from(z0 + (z1 - z0) * share));
    // The area bends where the level enters and leaves the circle: both change evenly along the stretch.
    let ((ra, ca), (rb, cb)) = (at(0.0), at(1.0));
    let meets = |a: f64, b: f64| if a.is_finite() && b.is_finite() && a != b { a / (a - b) } else { 0.0 };
    let mut ends = [0.0, meets(ra - ca, rb - cb).clamp(0.0, 1.0), meets(ra + ca, rb + cb).clamp(0.0, 1.0), 1.0];
    ends.sort_by(f64::total_cmp);
    let mut sum = 0.0;
    for pair in ends.windows(2).filter(|pair| pair[0] < pair[1]) {
        let width = (pair[1] - pair[0]) / f64::from(PARTS);
        for part in 0..PARTS {
            let middle = pair[0] + width * (f64::from(part) + 0.5);
            for [point, weight] in GAUSS {
                let (r, c) = at(middle + 0.5 * width * point);
                sum += 0.5 * width * weight * beyond(r, c);
            }
        }
    }
    sum * (z1 - z0)
}

/// The part of a circle that is farther than `c` from its middle, in one direction, m2.
fn beyond(r: f64, c: f64) -> f64 {
    match c {
        _ if c >= r => 0.0,
        _ if c <= -r => PI * r * r,
        _ => r * r * acos(c / r) - c * (r * r - c * c).sqrt(),
    }
}

/// Points (tilt, volume that stays), rad and m3: the tilts rise and the volumes fall, from upright to where nothing stays. Straight lines
/// between them are within a thousandth of what fills the vessel.
pub fn table(inside: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let full = kept(inside, 0.0);
    if full <= 0.0 {
        return Vec::new();
    }
    let point = |tilt: f64| [tilt, kept(inside, tilt)];
    let mut out = vec![point(0.0)];
    for step in 1..=FIRST {
        let [begin, end] = [out[out.len() - 1], point(0.5 * TAU * f64::from(step) / f64::from(FIRST))];
        refined(begin, end, SEEN * OFF * full, HALVED, &point, &mut out);
    }
    // From where all is out on, nothing more happens; what does not fall is left out, so that volumes tell tilts.
    let least = full * 1e-9;
    let empty = out.iter().position(|p| p[1] <= least).unwrap_or(out.len() - 1);
    out.truncate(empty + 1);
    if let Some(last) = out.last_mut() {
        last[1] = 0.0;
    }
    let mut falling: Vec<[f64; 2]> = Vec::with_capacity(out.len());
    for p in out {
        while falling.last().is_some_and(|before| before[1] - p[1] <= least && falling.len() > 1) {
            falling.pop();
        }
        falling.push(p);
    }
    falling
}

/// The points from behind `begin` to `end`, so dense that lines between them are within `off`.
fn refined(
    begin: [f64; 2],
    end: [f64; 2],
    off: f64,
    left: u32,
    point: &dyn Fn(f64) -> [f64; 2],
    out: &mut Vec<[f64; 2]>,
) {
    let between = |share: f64| [0, 1].map(|k| begin[k] + (end[k] - begin[k]) * share);
    let is_off = |share: f64| {
        let on_line = between(share);
        (point(on_line[0])[1] - on_line[1]).abs() > off
    };
    if left > 0 && [0.25, 0.5, 0.75].into_iter().any(is_off) {
        let middle = point(between(0.5)[0]);
        refined(begin, middle, off, left - 1, point, out);
        refined(middle, end, off, left - 1, point, out);
    } else {
        out.push(end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radius and depth, m.
    fn beaker(r: f64, h: f64) -> Vec<[f64; 2]> {
        vec![[0.0, 0.0], [r, 0.0], [r, h]]
    }

    #[test]
    fn a_cylinder_keeps_what_closed_forms_say() {
        let (r, h) = (0.0332, 0.093);
        let inside = beaker(r, h);
        let full = PI * r * r * h;
        assert!((kept(&inside, 0.0) - full).abs() < 1e-9 * full);
        // As long as the level meets the wall all round, a wedge is missing.
        for deg in [1.0_f64, 20.0, 45.0, 54.0] {
            let tilt = deg.to_radians();
            let wedge = PI * r * r * (h - r * tilt.tan());
            assert!((kept(&inside, tilt) - wedge).abs() < 1e-6 * full, "{deg}");
        }
        // Through the middle of the bottom it leaves a hoof of two thirds of r2 h (Archimedes).
        let through = (h / r).atan();
        assert!((kept(&inside, through) - 2.0 / 3.0 * r * r * h).abs() < 1e-6 * full);
        // A smaller hoof, by the formula for an ungula whose base is the segment beyond `a` from the middle.
        let tilt = 75_f64.to_radians();
        let high = r - h / tilt.tan();
        assert!(high > 0.0);
        let (half, phi) = ((r * r - high * high).sqrt(), (high / r).acos());
        let ungula = (r - high).recip() * h * (half * (3.0 * r * r - half * half) / 3.0 - r * r * high * phi);
        assert!((kept(&inside, tilt) - ungula).abs() < 1e-6 * full, "{} {ungula}", kept(&inside, tilt));
        assert!(kept(&inside, PI / 2.0) < 1e-9 * full && kept(&inside, 2.0) == 0.0);
    }

    #[test]
    fn a_cone_and_a_raised_bottom_are_counted_as_they_are() {
        let cone = [[0.0, 0.0], [0.03, 0.09]];
        assert!((kept(&cone, 0.0) - PI * 0.03 * 0.03 * 0.09 / 3.0).abs() < 1e-12);
        // A cone stands out of the bottom of a cylinder.
        let punt = [[0.0, 0.02], [0.03, 0.0], [0.03, 0.1]];
        let full = PI * 0.03 * 0.03 * (0.1 - 0.02 / 3.0);
        assert!((kept(&punt, 0.0) - full).abs() < 1e-12);
    }

    #[test]
    fn a_flask_with_shoulders_keeps_something_when_it_lies() {
        let flask = [[0.0, 0.002], [0.0395, 0.002], [0.0395, 0.015], [0.016, 0.103], [0.016, 0.132]];
        let lying = kept(&flask, PI / 2.0);
        assert!(lying > 0.1 * kept(&flask, 0.0));
        // The numbers of a slow sum over small cubes.
        let mut cubes = 0.0;
        let step = 5e-4;
        let radius = |z: f64| if z < 0.015 { 0.0395 } else { (0.0395 - (z - 0.015) * 0.0235 / 0.088).max(0.016) };
        for (i, j) in (0..160).flat_map(|i| (0..160).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) * step - 0.04);
            for k in 0..260 {
                let z = 0.002 + (f64::from(k) + 0.5) * step;
                cubes += if x.hypot(y) < radius(z) && x >= 0.016 { step.powi(3) } else { 0.0 };
            }
        }
        assert!((lying - cubes).abs() < 0.01 * cubes, "{lying} {cubes}");
    }

    #[test]
    fn tables_fall_and_are_within_a_thousandth() {
        let vessels = [
            beaker(0.0332, 0.093),
            beaker(0.005, 0.1),
            vec![[0.0, 0.002], [0.0395, 0.002], [0.0395, 0.015], [0.016, 0.103], [0.016, 0.132]],
            vec![[0.0, 0.02], [0.03, 0.0], [0.03, 0.1]],
            vec![[0.0, 0.0], [0.03, 0.09]],
        ];
        for inside in vessels {
            let table = table(&inside);
            let full = kept(&inside, 0.0);
            assert!(table.len() > 3 && table.len() < 100, "{}", table.len());
            assert!(table.windows(2).all(|p| p[0][0] < p[1][0] && p[0][1] > p[1][1]), "{table:?}");
            assert_eq!(table.last().map(|p| p[1]), Some(0.0));
            for pair in table.windows(2) {
                for share in [0.2, 0.35, 0.5, 0.65, 0.8] {
                    let [tilt, volume] = [0, 1].map(|k| pair[0][k] + (pair[1][k] - pair[0][k]) * share);
                    assert!((kept(&inside, tilt) - volume).abs() < OFF * full, "{inside:?} at {tilt}");
                }
            }
        }
    }

    /// What stays, by sums over heights and directions: the part of a circle beyond the level is added up sector by sector.
    fn added_up(inside: &[[f64; 2]], tilt: f64) -> f64 {
        let [rim, top] = *inside.last().expect("a rim");
        let (heights, sectors) = (240_u32, 240_u32);
        let turn = TAU / f64::from(sectors);
        let mut sum = 0.0;
        for pair in inside.windows(2) {
            let ([r0, z0], [r1, z1]) = (pair[0], pair[1]);
            for step in 0..heights {
                let share = (f64::from(step) + 0.5) / f64::from(heights);
                let (r, z) = (r0 + (r1 - r0) * share, z0 + (z1 - z0) * share);
                // Below the level of the lip is what is so far towards it.
                let c = if tilt > 0.0 { rim - (top - z) / tilt.tan() } else { f64::NEG_INFINITY };
                let area: f64 = (0..sectors)
                    .map(|k| {
                        let cosine = ((f64::from(k) + 0.5) * turn).cos();
                        let [from, to] = match cosine > 0.0 {
                            true => [(c / cosine).clamp(0.0, r), r],
                            false => [0.0, (c / cosine).clamp(0.0, r)],
                        };
                        0.5 * (to * to - from * from) * turn
                    })
                    .sum();
                sum += area * (z1 - z0) / f64::from(heights);
            }
        }
        sum
    }

    /// Numbers from 0 to 1 that are spread evenly.
    fn spread(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn what_stays_in_cylinders_cones_and_flasks_is_what_slow_sums_say() {
        let mut seed = 22;
        for round in 0..40 {
            let mut between = |low: f64, high: f64| low + (high - low) * spread(&mut seed);
            let (r, h) = (between(0.005, 0.08), between(0.02, 0.2));
            let (neck, waist) = (r * between(0.1, 0.9), h * between(0.1, 0.9));
            let inside = match round % 5 {
                0 => beaker(r, h),
                1 => vec![[0.0, 0.0], [r, h]],
                2 => vec![[0.0, 0.0], [r, 0.0], [neck, h]],
                3 => vec![[0.0, 0.0], [r, 0.0], [r, 0.3 * waist], [neck, waist], [neck, h]],
                _ => vec![[0.0, 0.0], [neck, 0.0], [r, h]],
            };
            // Beside any tilt those at which a wall is level, on either side, and those at which the level goes through a corner.
            let slopes = inside.windows(2).map(|p| [p[1][1] - p[0][1], p[1][0] - p[0][0]]);
            let walls = slopes.flat_map(|[dz, dr]| [dz.atan2(dr), dz.atan2(-dr)]);
            let rim = inside[inside.len() - 1][0];
            let corners = inside.iter().flat_map(|p| [(h - p[1]).atan2(rim + p[0]), (h - p[1]).atan2(rim - p[0])]);
            let mut tilts: Vec<f64> = walls.chain(corners).flat_map(|t| [t, t - 1e-9, t + 1e-9]).collect();
            tilts.extend((0..6).map(|_| between(0.0, PI)));
            let (full, table) = (kept(&inside, 0.0), table(&inside));
            for tilt in tilts.into_iter().filter(|t| (0.0..PI).contains(t)) {
                let (here, slow) = (kept(&inside, tilt), added_up(&inside, tilt));
                assert!((here - slow).abs() < 3e-4 * full, "{inside:?} at {tilt}: {here} {slow} of {full}");
                let after = table.partition_point(|p| p[0] <= tilt).clamp(1, table.len() - 1);
                let ([a, v], [b, w]) = (table[after - 1], table[after]);
                let read = v + (w - v) * ((tilt - a) / (b - a)).min(1.0);
                assert!((read - here).abs() < OFF * full, "{inside:?} at {tilt}: table {read} {here} of {full}");
            }
        }
    }
}
