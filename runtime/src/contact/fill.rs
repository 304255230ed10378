//! What contents add to the mass of a vessel: a body that does not move in it, up to its level.

use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_ir::scene::{Instance, Shape};

/// Slices in which the inside of a vessel is filled.
const SLICES: u32 = 256;

/// A vessel with so much in it, kg and m3, upright. What sloshes is not a part of this.
pub(super) fn filled(vessel: &Instance, empty: &Inertial, mass: f64, volume: f64) -> Inertial {
    if mass <= 0.0 {
        return *empty;
    }
    let middle = empty.placement.position;
    let (centre, height, radius) = match &vessel.shape {
        Some(Shape::Turned { inside, .. }) => level(inside, volume).unwrap_or((middle[2], 0.0, 0.0)),
        _ => (middle[2], 0.0, 0.0),
    };
    let all = empty.mass + mass;
    let up = (empty.mass * middle[2] + mass * centre) / all;
    // Both brought to the common centre, which is above or below each of theirs.
    let (own, other) = (middle[2] - up, centre - up);
    let across = empty.mass * own * own + mass * (other * other + (3.0 * radius * radius + height * height) / 12.0);
    let along = mass * radius * radius / 2.0;
    let [xx, xy, xz, yy, yz, zz] = empty.inertia;
    let inertia = [xx + across, xy, xz, yy + across, yz, zz + along];
    let placement = Pose { position: [middle[0], middle[1], up], ..empty.placement };
    Inertial { mass: all, placement, inertia }
}

/// The middle, the height and the mean radius of what fills an inside with such a volume, m and m3.
fn level(inside: &[[f64; 2]], volume: f64) -> Option<(f64, f64, f64)> {
    let (low, high) = (inside.first()?[1], inside.last()?[1]);
    let step = (high - low) / f64::from(SLICES);
    let radius = |z: f64| {
        inside.windows(2).find_map(|two| {
            let ([r0, z0], [r1, z1]) = (two[0], two[1]);
            (z1 > z0 && z >= z0 && z <= z1).then(|| r0 + (r1 - r0) * (z - z0) / (z1 - z0))
        })
    };
    let (mut left, mut moment, mut top) = (volume, 0.0, low);
    for slice in 0..SLICES {
        let z = low + (f64::from(slice) + 0.5) * step;
        let r = radius(z).unwrap_or(0.0);
        let own = (std::f64::consts::PI * r * r * step).min(left);
        moment += own * z;
        left -= own;
        top = z + step / 2.0;
        if left <= 0.0 {
            break;
        }
    }
    let filled = volume - left.max(0.0);
    let height = top - low;
    (filled > 0.0 && height > 0.0).then(|| (moment / filled, height, (filled / (std::f64::consts::PI * height)).sqrt()))
}
