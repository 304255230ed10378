//! How high a liquid stands in an upright round vessel. Its surface is taken as flat.

use std::f64::consts::PI;

/// By how much straight lines between the points of a table may be off, as a share of the height of the inside.
const OFF: f64 = 1e-3;
/// A stretch of a table is halved so often at most.
const HALVED: u32 = 12;

/// Points (volume, height above the lowest point), m3 and m, both rising from nothing to the rim. `inside` are radius and height along
/// the inner wall from the axis at the bottom to the rim, m. Empty where nothing fits in.
pub fn table(inside: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (Some([_, low]), Some([_, high])) = (inside.first(), inside.last()) else { return Vec::new() };
    let mut out = vec![[0.0, 0.0]];
    for pair in inside.windows(2).filter(|pair| pair[0][1] < pair[1][1]) {
        let (from, to) = (pair[0], pair[1]);
        // A stretch on the axis holds nothing: the table would rise there without end.
        if from[0].max(to[0]) > 0.0 {
            stretch(from, to, OFF * (high - low), HALVED, *low, &mut out);
        }
    }
    if out.len() < 2 { Vec::new() } else { out }
}

/// Adds the points of a straight stretch of the wall after its first one.
fn stretch(from: [f64; 2], to: [f64; 2], off: f64, halved: u32, low: f64, out: &mut Vec<[f64; 2]>) {
    let middle = [0, 1].map(|k| (from[k] + to[k]) / 2.0);
    let (whole, half) = (frustum(from, to), frustum(from, middle));
    let straight = from[1] + (to[1] - from[1]) * (half / whole);
    if halved > 0 && (straight - middle[1]).abs() > off {
        stretch(from, middle, off, halved - 1, low, out);
        stretch(middle, to, off, halved - 1, low, out);
    } else {
        let below = out.last().map_or(0.0, |last| last[0]);
        out.push([below + whole, to[1] - low]);
    }
}

fn frustum([r0, z0]: [f64; 2], [r1, z1]: [f64; 2]) -> f64 {
    PI / 3.0 * (z1 - z0) * (r0 * r0 + r0 * r1 + r1 * r1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn height(points: &[[f64; 2]], volume: f64) -> f64 {
        let at = points.windows(2).find(|pair| volume <= pair[1][0]).expect("within the table");
        let ([v0, h0], [v1, h1]) = (at[0], at[1]);
        h0 + (h1 - h0) * (volume - v0) / (v1 - v0)
    }

    #[test]
    fn a_cylinder_fills_evenly() {
        let points = table(&[[0.0, 0.002], [0.01, 0.002], [0.01, 0.052]]);
        assert_eq!(points.len(), 2);
        assert!((height(&points, PI * 1e-4 * 0.02) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_cone_fills_as_the_third_root() {
        let (radius, tall) = (0.003, 0.012);
        let points = table(&[[0.0, 0.0], [radius, tall]]);
        for share in [0.001_f64, 0.01, 0.05, 0.3, 0.7, 1.0] {
            let volume = PI / 3.0 * radius * radius * tall * share;
            let exact = tall * share.powf(1.0 / 3.0);
            assert!((height(&points, volume) - exact).abs() < 2e-3 * tall, "{share}");
        }
        assert!(points.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]));
    }

    #[test]
    fn without_room_there_is_no_table() {
        assert!(table(&[]).is_empty());
        assert!(table(&[[0.0, 0.0], [0.0, 0.1]]).is_empty());
        assert!(table(&[[0.0, 0.0], [0.1, 0.0]]).is_empty());
    }
}
