//! Outlines of round shapes: points of radius and height, m, from the bottom up.

/// Rounding of a length, m.
const ROUNDING: f64 = 1e-9;
/// How near to a corner an outline is looked at from either side, as a share of the stretch between two corners.
const BESIDE: f64 = 1e-6;

/// The greatest radius of an outline at a height, m; nothing above and below it.
pub fn radius_at(outline: &[[f64; 2]], z: f64) -> Option<f64> {
    let between = |pair: &[[f64; 2]]| {
        let ([r, low], [s, high]) = (pair[0], pair[1]);
        match high - low {
            _ if z < low || z > high => None,
            0.0 => Some(r.max(s)),
            step => Some(r + (s - r) * (z - low) / step),
        }
    };
    outline.windows(2).filter_map(between).reduce(f64::max)
}

/// Where an inside comes out of the outside around it: wider than that, above or below it. Radius of the inside and height, m.
pub fn sticks_out(outside: &[[f64; 2]], inside: &[[f64; 2]]) -> Option<[f64; 2]> {
    let (&[_, foot], &[_, top]) = (outside.first()?, outside.last()?);
    if let Some(point) = inside.iter().find(|p| p[1] < foot - ROUNDING || p[1] > top + ROUNDING) {
        return Some(*point);
    }
    let (&[_, low], &[_, high]) = (inside.first()?, inside.last()?);
    let mut heights: Vec<f64> =
        outside.iter().chain(inside).map(|p| p[1]).filter(|z| (low..=high).contains(z)).collect();
    heights.sort_by(f64::total_cmp);
    // Both are straight between two heights, and may jump at one.
    let beside =
        heights.windows(2).flat_map(|pair| [BESIDE, 1.0 - BESIDE].map(|share| pair[0] + (pair[1] - pair[0]) * share));
    let widths = beside.filter_map(|z| Some((z, radius_at(outside, z)?, radius_at(inside, z)?)));
    widths.filter(|(_, around, own)| *own > around + ROUNDING).map(|(z, _, own)| [own, z]).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    const JAR: [[f64; 2]; 5] = [[0.0, 0.0], [0.04, 0.0], [0.04, 0.06], [0.02, 0.06], [0.02, 0.1]];

    #[test]
    fn an_outline_is_as_wide_as_its_widest_point_at_a_height() {
        assert_eq!(radius_at(&JAR, 0.06), Some(0.04));
        assert_eq!(radius_at(&JAR, 0.08), Some(0.02));
        assert_eq!(radius_at(&JAR, 0.11), None);
    }

    #[test]
    fn an_inside_stays_within_its_outside() {
        let fits = [[0.0, 0.002], [0.038, 0.002], [0.038, 0.055], [0.018, 0.055], [0.018, 0.1]];
        assert_eq!(sticks_out(&JAR, &fits), None);
        assert_eq!(sticks_out(&JAR, &[]), None);
        assert_eq!(sticks_out(&[], &fits), None);
        // A ring has no bottom.
        assert_eq!(sticks_out(&[[0.022, 0.0], [0.022, 0.008]], &[[0.014, 0.0], [0.014, 0.008]]), None);
        let tall = [[0.0, 0.002], [0.018, 0.002], [0.018, 0.12]];
        assert_eq!(sticks_out(&JAR, &tall), Some([0.018, 0.12]));
        // Both ends fit: the shoulder between does not.
        let straight = [[0.0, 0.002], [0.03, 0.002], [0.03, 0.07], [0.018, 0.07], [0.018, 0.1]];
        let [r, z] = sticks_out(&JAR, &straight).expect("a place");
        assert!(r == 0.03 && z > 0.06 && z < 0.07);
        let slanted = [[0.0, 0.002], [0.038, 0.002], [0.018, 0.1]];
        assert!(sticks_out(&JAR, &slanted).is_some_and(|[r, z]| r > 0.02 && z > 0.06 && z < 0.0601));
    }
}
