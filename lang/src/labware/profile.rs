//! The inside of a well, from the sections that a definition gives: of one that is not round, a round one as wide at every height.

use std::f64::consts::PI;

use matterix_ir::filling;
use matterix_ir::math::{acos, cos, sin};

/// Points along a section with a curved wall: its volume is off by less than 0.1 %.
const ROUND: u32 = 24;

/// By how much the inside may be smaller than the volume it holds, as a share: dimensions are rounded.
const ROUNDED: f64 = 0.01;

/// Radius and height along the inner wall of a well, from its bottom up, mm.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Profile(Vec<[f64; 2]>);

/// A section of a well; heights above the bottom, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Section {
    /// A cone cut off at both ends: its radii and heights at the bottom and at the top.
    Cone([[f64; 2]; 2]),
    /// The cap of a sphere that points down: the radius of the sphere, the heights of bottom and top.
    Cap(f64, [f64; 2]),
    /// Pyramids cut off at both ends, side by side: how many, and their two sides and heights at the bottom and at the top.
    Pyramids(f64, [[f64; 3]; 2]),
}

impl Section {
    fn heights(self) -> [f64; 2] {
        match self {
            Section::Cone([[_, low], [_, high]])
            | Section::Cap(_, [low, high])
            | Section::Pyramids(_, [[_, _, low], [_, _, high]]) => [low, high],
        }
    }

    fn points(self) -> Vec<[f64; 2]> {
        match self {
            Section::Cone(ends) => ends.to_vec(),
            Section::Cap(radius, [low, high]) => {
                // By equal angles at the middle of the sphere, which is above the bottom by its radius.
                let whole = acos((1.0 - (high - low) / radius).clamp(-1.0, 1.0));
                let point = |k: u32| {
                    let angle = whole * f64::from(k) / f64::from(ROUND);
                    [radius * sin(angle), low + radius * (1.0 - cos(angle))]
                };
                up_to_end((0..=ROUND).map(point).collect(), high)
            }
            Section::Pyramids(count, [low, high]) => {
                let point = |k: u32| {
                    let share = f64::from(k) / f64::from(ROUND);
                    let [x, y, z] = [0, 1, 2].map(|i| low[i] + (high[i] - low[i]) * share);
                    [(count * x * y / PI).sqrt(), z]
                };
                // Straight walls are straight in a round one, too.
                let steps = if low[..2] == high[..2] { ROUND as usize } else { 1 };
                up_to_end((0..=ROUND).step_by(steps).map(point).collect(), high[2])
            }
        }
    }
}

/// Points that end at a height to the last bit, as the next section begins there.
fn up_to_end(mut points: Vec<[f64; 2]>, height: f64) -> Vec<[f64; 2]> {
    if let Some(last) = points.last_mut() {
        last[1] = height;
    }
    points
}

impl Profile {
    /// The inside that these sections make, in any order, up to the depth of the well; none where they leave a gap or hold less
    /// than `volume`, µL: then they are not those of this well.
    pub(super) fn of(mut sections: Vec<Section>, depth: f64, volume: f64) -> Option<Profile> {
        sections.sort_by(|a, b| a.heights()[0].total_cmp(&b.heights()[0]));
        let mut reached = 0.0;
        let mut points: Vec<[f64; 2]> = vec![[0.0, 0.0]];
        for section in sections {
            let [low, high] = section.heights();
            if low != reached || high <= low {
                return None;
            }
            reached = high;
            points.extend(section.points());
        }
        points.dedup();
        if points.iter().flatten().any(|v| !(v.is_finite() && *v >= 0.0)) {
            return None;
        }
        let cut = up_to(points, depth)?;
        let inside = Profile(cut);
        (inside.volume() * (1.0 + ROUNDED) >= volume).then_some(inside)
    }

    /// Its points.
    pub(super) fn points(&self) -> &[[f64; 2]] {
        &self.0
    }

    /// The volume in it, µL.
    pub(super) fn volume(&self) -> f64 {
        filling::below(&self.0, filling::depth(&self.0))
    }
}

/// An outline that ends at a height: cut off there, or carried on straight up.
fn up_to(points: Vec<[f64; 2]>, height: f64) -> Option<Vec<[f64; 2]>> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    for [r, z] in points {
        match out.last() {
            Some([r0, z0]) if z > height => {
                let share = (height - z0) / (z - z0);
                out.push([r0 + (r - r0) * share, height]);
                return (height > 0.0).then_some(out);
            }
            _ => out.push([r, z]),
        }
    }
    let [r, z] = *out.last()?;
    if z < height {
        out.push([r, height]);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_make_the_inside_of_a_well() {
        let cone = Section::Cone([[1.0, 1.0], [2.0, 4.0]]);
        let half = Section::Cap(1.0, [0.0, 1.0]);
        let exact = PI * (2.0 / 3.0 + 7.0);
        let inside = Profile::of(vec![cone, half], 4.0, 24.2).expect("an inside");
        assert!((inside.volume() / exact - 1.0).abs() < 1e-3, "{}", inside.volume());
        assert_eq!(inside.points().first(), Some(&[0.0, 0.0]));
        assert!(inside.points().windows(2).all(|two| two[0][1] <= two[1][1]), "{inside:?}");
        assert_eq!(inside.points().last(), Some(&[2.0, 4.0]));
        // Too small for what it is to hold, a gap, no bottom.
        assert_eq!(Profile::of(vec![cone, half], 4.0, exact * 1.02), None);
        assert_eq!(Profile::of(vec![Section::Cone([[1.0, 1.5], [2.0, 4.0]]), half], 4.0, 1.0), None);
        assert_eq!(Profile::of(vec![cone], 4.0, 1.0), None);
    }

    #[test]
    fn an_inside_ends_where_the_well_does() {
        let tube = || vec![Section::Cone([[1.0, 0.0], [2.0, 10.0]])];
        let ends = |depth| Profile::of(tube(), depth, 1.0).and_then(|inside| inside.points().last().copied());
        assert_eq!(ends(5.0), Some([1.5, 5.0]));
        assert_eq!(ends(12.0), Some([2.0, 12.0]));
        assert_eq!(ends(0.0), None);
    }
}
