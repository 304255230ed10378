//! How high a volume stands in a vessel, as its inside has it.
//!
//! An inside is round here: radius and height from the axis at the bottom up to the rim, m. One that is not round counts as a round one that is as
//! wide at every height. Left out is the meniscus.

use std::f64::consts::PI;

use crate::scene::Shape;

/// By how much a table of levels may be off, as a share of the depth.
const OFF: f64 = 2e-3;

/// Stretches into which a sloping part of the wall is cut at most.
const MOST: u32 = 16;

/// The inside of a shape that holds something; none where it is not known.
pub fn inside(shape: &Shape) -> Option<Vec<[f64; 2]>> {
    let straight = |area: f64, depth: f64| {
        let radius = (area / PI).sqrt();
        vec![[0.0, 0.0], [radius, 0.0], [radius, depth]]
    };
    let inside = match shape {
        Shape::Box([x, y, z]) => straight(x * y, *z),
        Shape::Cylinder([d, h]) => straight(PI * d * d / 4.0, *h),
        Shape::Turned { inside, .. } => inside.clone(),
        Shape::Sphere(_) | Shape::Mesh(_) => return None,
    };
    Some(inside).filter(|inside| below(inside, depth(inside)) > 0.0)
}

/// From the lowest point of the inside up to the rim, m.
pub fn depth(inside: &[[f64; 2]]) -> f64 {
    inside.last().map_or(0.0, |rim| rim[1] - lowest(inside))
}

fn lowest(inside: &[[f64; 2]]) -> f64 {
    inside.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min)
}

/// What a vessel holds up to a height above the lowest point of its inside, m3.
pub fn below(inside: &[[f64; 2]], height: f64) -> f64 {
    let top = lowest(inside) + height.min(depth(inside));
    inside.windows(2).map(|pair| frustum(pair[0], pair[1], top)).sum::<f64>().max(0.0)
}

/// What a stretch of the wall encloses below a height; less than nothing where it leads down, as over a raised bottom.
fn frustum([r0, z0]: [f64; 2], [r1, z1]: [f64; 2], top: f64) -> f64 {
    if z1 < z0 {
        return -frustum([r1, z1], [r0, z0], top);
    }
    let high = z1.min(top);
    if high <= z0 {
        return 0.0;
    }
    let r = r0 + (r1 - r0) * (high - z0) / (z1 - z0);
    PI / 3.0 * (high - z0) * (r0 * r0 + r0 * r + r * r)
}

/// Points (volume, level), m3 and m, both rising from nothing to the rim.
pub fn levels(inside: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let bottom = lowest(inside);
    let (whole, off) = (depth(inside), OFF * depth(inside));
    let mut heights: Vec<f64> = inside.iter().map(|p| p[1] - bottom).chain([0.0, whole]).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let point = |z: f64| [below(inside, z), z];
    let mut out = vec![point(0.0)];
    for pair in heights.windows(2) {
        let stretch = pair[1] - pair[0];
        let between = |share: f64| point(pair[0] + stretch * share);
        // Where lines between as many points are near enough.
        let is_off = |cuts: u32| {
            (0..cuts).any(|k| {
                let [low, middle, high] = [0.0, 0.5, 1.0].map(|by| between((f64::from(k) + by) / f64::from(cuts)));
                let share = if high[0] > low[0] { (middle[0] - low[0]) / (high[0] - low[0]) } else { 0.5 };
                (low[1] + (high[1] - low[1]) * share - middle[1]).abs() > off
            })
        };
        let cuts = [1, 2, 4, 8].into_iter().find(|cuts| !is_off(*cuts)).unwrap_or(MOST);
        out.extend((1..=cuts).map(|k| between(f64::from(k) / f64::from(cuts))));
    }
    // A volume stands at one height.
    out.dedup_by(|next, before| next[0] <= before[0]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_walls_fill_evenly() {
        let well = inside(&Shape::Cylinder([0.006, 0.01])).unwrap();
        let area = PI * 9e-6;
        assert!((below(&well, 0.004) - area * 0.004).abs() < 1e-15);
        assert_eq!(levels(&well).len(), 2);
        let trough = inside(&Shape::Box([0.1, 0.07, 0.02])).unwrap();
        assert!((below(&trough, 0.01) - 0.1 * 0.07 * 0.01).abs() < 1e-12);
        assert!((depth(&trough) - 0.02).abs() < 1e-15);
    }

    #[test]
    fn a_cone_fills_by_the_cube_of_its_height() {
        let cone = vec![[0.0, 0.0], [0.003, 0.01]];
        for z in [0.001, 0.004, 0.01] {
            let r: f64 = 0.3 * z;
            assert!((below(&cone, z) / (PI / 3.0 * r * r * z) - 1.0).abs() < 1e-12);
        }
        let table = levels(&cone);
        assert!(table.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]));
        for z in [0.0005, 0.002, 0.0073] {
            let v = below(&cone, z);
            let k = table.windows(2).find(|pair| v <= pair[1][0]).unwrap();
            let found = k[0][1] + (k[1][1] - k[0][1]) * (v - k[0][0]) / (k[1][0] - k[0][0]);
            assert!((found - z).abs() < 0.05 * 0.01, "{z}: {found}");
        }
    }

    #[test]
    fn a_raised_bottom_takes_its_room() {
        // A ring around a cone that stands in the middle.
        let punt = vec![[0.0, 0.002], [0.005, 0.0], [0.005, 0.01]];
        let whole = PI * 25e-6 * 0.01 - PI / 3.0 * 25e-6 * 0.002;
        assert!((below(&punt, 0.01) / whole - 1.0).abs() < 1e-12);
    }
}
